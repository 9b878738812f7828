// SPDX-License-Identifier: Apache-2.0
// A search for sequences of clocks, measurements and motions that get more out of a guard than it promises.
// Prints JSON, one object for each kind of sequence.
//   g++ -std=c++20 -O2 -Iinclude -Itests/cpp benchmarks/guard_search.cpp -o guard_search &&
//   ./guard_search [cycles] [seed]
#include "guard_search.hpp"

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  using namespace guard_search;
  const long cycles = argc > 1 ? std::atol(argv[1]) : 1000000;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const char* separator = "[";
  for (const Kind& kind : kinds) {
    const Found found = search(kind, cycles / static_cast<long>(std::size(kinds)), seed);
    std::printf("%s{\"kind\": \"%s\", \"cycles\": %ld, \"broken\": %ld, \"worst_mJ\": %.3g}", separator,
                kind.name, found.cycles, found.broken, found.broken ? 1e3 * found.worst_energy : 0.0);
    separator = ",\n";
  }
  std::printf("]\n");
}
