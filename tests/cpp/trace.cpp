// SPDX-License-Identifier: Apache-2.0
// Reads depths from standard input and prints the parts of the force of preset `physical`, to the last digit.
// Compiled and compared with the Python module by tests/mechanics/test_conformance.py.
#include <cstdio>

#include "needleforce/insertion.hpp"

int main() {
  using namespace needleforce;
  const Model model{laws::ConeCylinder{154666.55782265437, 0.2617993877991494, 0.00035},
                    laws::PunctureForce{0.2}, laws::Coulomb{18.6, 20e-6, 0.25},
                    laws::ConstantCutting{0.0776, 20e-6}};
  Insertion insertion(model);
  double depth = 0.0;
  while (std::scanf("%lf", &depth) == 1) {
    const Sample sample = insertion.step(depth, no_velocity, 1e-3);
    std::printf("%.17g %.17g %.17g %.17g %.17g\n", sample.force, sample.stiffness, sample.friction,
                sample.cutting, sample.force_by_depth);
  }
}
