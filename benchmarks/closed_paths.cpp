// SPDX-License-Identifier: Apache-2.0
// Random models over the whole ranges of the parameter tables, each on a random closed path: how many return
// energy. One path in ten is under noise of the depth. Prints JSON, one object for each friction law of the
// first layer, one for stacks and one for noise.
//   g++ -std=c++20 -O2 -Iinclude -Itests/cpp benchmarks/closed_paths.cpp -lgtest -o closed_paths &&
//   ./closed_paths [paths]
#include "closed_paths.hpp"

#include <cstdio>
#include <cstdlib>
#include <map>

int main(int argc, char** argv) {
  struct Row {
    long paths = 0, returned = 0;
    double least = 1.0;  // work over the work turned over
  };
  const long paths = argc > 1 ? std::atol(argv[1]) : 100000;
  std::map<std::string, Row> rows;
  for (long seed = 0; seed < paths; ++seed) {
    const auto name = static_cast<std::uint64_t>(seed) + (1ull << 32);  // other paths than those of the tests
    closed_paths::Generator generator{name};
    const std::vector<Layer> layers = closed_paths::drawn_stack(generator);
    const bool noise = seed % 10 == 9;
    const closed_paths::Work work =
        noise ? closed_paths::work_in_noise(generator, layers) : closed_paths::work_of(generator, layers);
    Row& row = rows[noise ? "noise" : layers.size() > 1 ? "layers" : name_of(layers[0].laws.friction)];
    row.paths += 1;
    row.returned += work.share() < -1e-6;
    if (work.turned > 0.0) row.least = std::min(row.least, work.share());
  }
  const char* separator = "[";
  for (const auto& [name, row] : rows) {
    std::printf("%s{\"law\": \"%s\", \"paths\": %ld, \"returned\": %ld, \"least\": %.3g}", separator,
                name.c_str(), row.paths, row.returned, row.least);
    separator = ",\n";
  }
  std::printf("]\n");
}
