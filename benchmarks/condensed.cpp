// SPDX-License-Identifier: Apache-2.0
// Time of a step in a condensed solid: 60 mm in at 5 mm/s and 1 kHz with reversals, and out. The argument is
// a file of doubles: number of nodes, spacing [m], compliance [m/N] row by row. Prints JSON.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <vector>

#include "needleforce/solid/condensed_insertion.hpp"

using namespace needleforce;
using namespace needleforce::solid;

namespace {

CondensedTissue read(const char* path) {
  CondensedTissue tissue;
  std::FILE* file = std::fopen(path, "rb");
  double head[2] = {0.0, 0.0};
  if (!file || std::fread(head, sizeof(double), 2, file) != 2) return tissue;
  tissue.nodes = static_cast<std::size_t>(head[0]);
  tissue.spacing = head[1];
  for (std::size_t i = 0; i < std::min(tissue.nodes, max_path_nodes); ++i)
    if (std::fread(tissue.compliance.data() + i * max_path_nodes, sizeof(double), tissue.nodes, file) !=
        tissue.nodes)
      tissue.nodes = 0;
  std::fclose(file);
  return tissue;
}

/// Depths [m] of a hand: in, a millimetre back and forth every 10 mm, and out.
std::vector<double> depths(double deepest) {
  std::vector<double> result;
  double at = -1e-3;
  const auto go = [&](double to) {
    while (std::abs(to - at) > 1e-9) result.push_back(at += std::clamp(to - at, -5e-6, 5e-6));
  };
  for (double to = 10e-3; to < deepest; to += 10e-3) go(to), go(to - 1e-3), go(to + 1e-3);
  go(deepest), go(deepest - 3e-3), go(deepest), go(-5e-3);
  return result;
}

}  // namespace

int main(int count, char** arguments) {
  const CondensedTissue tissue = read(count > 1 ? arguments[1] : "");
  const Layer layer{0.0,
                    {laws::Polynomial{500.0, 0.0}, laws::PunctureForce{0.2}, laws::Coulomb{20.0, 20e-6, 0.0},
                     laws::ConstantCutting{0.1, 20e-6}}};
  const CondensedInsertion fresh(tissue, std::span(&layer, 1));
  if (!fresh.accepted()) return std::printf("the table is refused\n"), 1;
  const std::vector<double> path = depths(tissue.length() - 1e-3);
  // the least of several passes through that very step: the work without interrupts
  std::vector<double> alone(path.size(), std::numeric_limits<double>::infinity()), seen;
  double sum = 0.0;
  for (int pass = 0; pass < 9; ++pass) {
    CondensedInsertion insertion = fresh;
    for (std::size_t i = 0; i < path.size(); ++i) {
      const auto start = std::chrono::steady_clock::now();
      sum += insertion.step(path[i], no_velocity, 1e-3).force;
      const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - start;
      alone[i] = std::min(alone[i], took.count());
      seen.push_back(took.count());
    }
  }
  asm volatile("" : "+x"(sum));
  std::sort(alone.begin(), alone.end());
  std::sort(seen.begin(), seen.end());
  const auto at = [](const std::vector<double>& times, double share) {
    return times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))];
  };
  std::printf(
      "{\"median_us\": %.3f, \"p99_us\": %.3f, \"p999_us\": %.3f, \"largest_us\": %.3f, \"seen_p999_us\": "
      "%.3f}\n",
      at(alone, 0.5), at(alone, 0.99), at(alone, 0.999), alone.back(), at(seen, 0.999));
}
