// SPDX-License-Identifier: Apache-2.0
// Reads depths from standard input and prints the parts of the force to the last digit: of preset `physical`,
// or with the argument `layered` of two layers with bristles, stick-slip and relaxation. Compiled and
// compared with the Python module by tests/mechanics/test_conformance.py.
#include <cstdio>
#include <vector>

#include "needleforce/insertion.hpp"

namespace {

using namespace needleforce;

constexpr laws::ConeCylinder contact{154666.55782265437, 0.2617993877991494, 0.00035};

std::vector<Layer> physical() {
  const laws::Coulomb shaft{18.6, 20e-6, 0.25};
  return {{0.0, {contact, laws::PunctureForce{0.2}, shaft, laws::ConstantCutting{0.0776, 20e-6}}}};
}

std::vector<Layer> layered() {
  const laws::Prony fading{0.31, 0.7, 0.26, 5.0};
  const Model first{contact, laws::PunctureForce{0.15}, laws::LuGre{1e6, 100.0, 200.0, 18.0, 25.0, 1e-3, 2.0},
                    laws::StickSlip{0.1, 0.04, 1.5e-3, 25.07, 200.0}, fading};
  const Model second{contact, laws::PunctureDepth{1e-3}, laws::Coulomb{30.0, 20e-6, 0.0},
                     laws::ConstantCutting{0.12, 20e-6}, fading};
  return {{0.0, first}, {5e-3, second}};
}

}  // namespace

int main(int arguments, char**) {
  Insertion insertion(arguments > 1 ? layered() : physical());
  double depth = 0.0;
  while (std::scanf("%lf", &depth) == 1) {
    const Sample sample = insertion.step(depth, no_velocity, 1e-3);
    std::printf("%.17g %.17g %.17g %.17g %.17g\n", sample.force, sample.stiffness, sample.friction,
                sample.cutting, sample.force_by_depth);
  }
}
