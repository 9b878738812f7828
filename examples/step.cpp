// SPDX-License-Identifier: Apache-2.0
// The force of the paper's model in a control loop, during insertion and withdrawal. Twin of step.py.
//   g++ -std=c++20 -O2 -Iinclude examples/step.cpp -o step && ./step
#include <cstdio>

#include "needleforce/insertion.hpp"

int main() {
  using namespace needleforce;
  const Model model{laws::Cone{117546.06, 15.0 * tips::degree}, laws::PunctureDepth{3.237e-3},
                    laws::Coulomb{18.6, 20e-6, 0.0}, laws::ConstantCutting{0.0776, 20e-6}};
  if (!valid(model)) return 1;

  Insertion insertion(model);
  const double dt = 1e-3, speed = 3e-3;
  double deepest = 0.0, pull = 0.0;
  for (int cycle = 0; cycle < 8000; ++cycle) {
    const double depth = cycle < 4000 ? speed * dt * cycle : speed * dt * (8000 - cycle);
    const Sample sample = insertion.step(depth, no_velocity, dt);
    if (sample.status != Status::ok) return 1;
    if (sample.punctured) std::printf("puncture at %.3f mm\n", 1e3 * depth);
    deepest = sample.force > deepest ? sample.force : deepest;
    pull = sample.force < pull ? sample.force : pull;
  }
  std::printf("largest push %.4f N, largest pull %.4f N\n", deepest, -pull);
}
