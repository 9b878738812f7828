// SPDX-License-Identifier: Apache-2.0
// A needle goes through two layers and stops after the second puncture, which is found in the noisy force;
// mujoco_two_layers.py is the same with an arm. The axis brakes at 1 m/s^2; force and stop are a cycle late.
//   g++ -std=c++20 -O2 -Iinclude examples/two_layers.cpp -o two_layers && ./two_layers
#include <algorithm>
#include <array>
#include <cstdio>
#include <random>

#include "needleforce/events/event_detector.hpp"
#include "needleforce/insertion.hpp"

int main() {
  using namespace needleforce;
  const auto layer = [](double top, double modulus, double puncture) {
    return Layer{top,
                 {laws::Cone{modulus, 0.2618}, laws::PunctureDepth{puncture}, laws::Coulomb{30.0, 20e-6, 0.0},
                  laws::ConstantCutting{0.2, 20e-6}}};
  };
  const std::array layers{layer(0.0, 1e6, 3e-3), layer(8e-3, 2e6, 2.5e-3)};
  Insertion tissue{layers};
  events::EventDetector watch;
  std::mt19937_64 generator{1};
  std::normal_distribution<double> noise{0.0, 5e-3};
  const double dt = 1e-3, deceleration = 1.0;
  double depth = -5e-3, speed = 5e-3, measured = 0.0, last = 0.0;
  int punctures = 0;
  while (speed > 0.0 && depth < 20e-3) {
    const auto event = watch.step(measured + noise(generator), depth, dt);  // the force of the cycle before
    if (event.kind == events::EventKind::puncture && event.probability > 0.5) {
      last = event.depth;
      std::printf("puncture %d at %.2f mm, found after %.0f ms, resistance %.2f\n", ++punctures, 1e3 * last,
                  1e3 * event.delay, watch.resistance());
    }
    if (punctures == 2) speed = std::max(0.0, speed - deceleration * dt);
    depth += speed * dt;
    measured = tissue.step(depth, no_velocity, dt).force;
  }
  std::printf("at rest %.3f mm past the second\n", 1e3 * (depth - last));
}
