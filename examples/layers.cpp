// SPDX-License-Identifier: Apache-2.0
// A needle through two layers; the lower one is stiffer and must be punctured as well. Twin of layers.py.
//   g++ -std=c++20 -O2 -Iinclude examples/layers.cpp -o layers && ./layers
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "needleforce/insertion.hpp"

int main() {
  using namespace needleforce;
  const std::array layers{Layer{0.0,
                                {laws::Cone{117546.06040021202, 15.0 * tips::degree},
                                 laws::PunctureDepth{3.237e-3}, laws::Coulomb{18.6, 20e-6, 0.0},
                                 laws::ConstantCutting{0.0776, 20e-6}, laws::Prony{0.3, 0.7, 0.0, 5.0}}},
                          Layer{6e-3,
                                {laws::Cone{3e5, 0.2618}, laws::PunctureDepth{1e-3},
                                 laws::Coulomb{30.0, 20e-6, 0.0}, laws::ConstantCutting{0.12, 20e-6}}}};
  Insertion insertion{layers};
  const double dt = 1e-3, speed = 3e-3, deepest = 10e-3;
  const int stroke = static_cast<int>(std::lround(deepest / speed / dt)), hold = 5000;
  Sample sample;
  for (int cycle = 0; cycle <= 2 * stroke + hold; ++cycle) {
    const int travelled = std::min(cycle, stroke) - std::max(0, cycle - stroke - hold);
    sample = insertion.step(speed * dt * travelled, no_velocity, dt);
    if (sample.punctured)
      std::printf("layer %zu ruptures at %.3f mm\n", insertion.pierced_layers(), 1e3 * sample.depth);
    if (cycle == stroke || cycle == stroke + hold)
      std::printf("%s the hold %.4f N\n", cycle == stroke ? "before" : "after", sample.force);
  }
  std::printf("after withdrawal %.4f N\n", sample.force);
}
