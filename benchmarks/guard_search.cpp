// SPDX-License-Identifier: Apache-2.0
// A search for sequences of clocks, measurements and motions that get more out of a guard than it promises,
// along the depth or along all axes of a base. Prints JSON, one object for each kind of sequence.
//   g++ -std=c++20 -O2 -Iinclude -Itests/cpp benchmarks/guard_search.cpp -o guard_search &&
//   ./guard_search [cycles] [seed] [cycles along all axes]
#include "guard_search.hpp"

#include <cstdio>
#include <cstdlib>

namespace {

template <std::size_t axes>
void print(long cycles, std::uint64_t seed, const char* along, const char*& separator) {
  using namespace guard_search;
  for (const Kind& kind : kinds) {
    const Found<axes> found = search<axes>(kind, cycles / static_cast<long>(std::size(kinds)), seed);
    std::printf("%s{\"kind\": \"%s%s\", \"cycles\": %ld, \"broken\": %ld, \"worst_mJ\": %.3g}", separator,
                kind.name, along, found.cycles, found.broken, found.broken ? 1e3 * found.worst_energy : 0.0);
    std::fflush(stdout);
    separator = ",\n";
  }
}

}  // namespace

int main(int argc, char** argv) {
  const long cycles = argc > 1 ? std::atol(argv[1]) : 1000000;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const long of_a_base = argc > 3 ? std::atol(argv[3]) : cycles;
  const char* separator = "[";
  print<1>(cycles, seed, "", separator);
  print<6>(of_a_base, seed, ", all axes", separator);
  std::printf("]\n");
}
