// SPDX-License-Identifier: Apache-2.0
// A robot pushes a needle under force control and stops where the second layer is punctured. Twin of
// admittance.py, which explains and draws it.
//   g++ -std=c++20 -O2 -Iinclude examples/admittance.cpp -o admittance && ./admittance
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "needleforce/insertion.hpp"

using namespace needleforce;

constexpr double dt = 1e-3, lag = 20e-3, filter = 10e-3;             // [s]
constexpr double mass = 0.5, damping = 12.0;                         // [kg], [N s/m] of the virtual body
constexpr double rise = 0.2, speed = 20e-3, creep = 1e-3;            // [N/s], [m/s], [m/s]
constexpr double ahead_by = 0.5e-3, drop = 0.02, noise = 0.005;      // [m], [N], [N]
constexpr double true_top = 6e-3, model_top = 5.8e-3, gives = 2e-3;  // [m]

/// The paper's layer, and from `top` [m] on one with a stiffer surface.
Insertion tissue(double top) {
  const std::array layers{
      Layer{0.0,
            {laws::Cone{117546.06040021202, 15.0 * tips::degree}, laws::PunctureDepth{3.237e-3},
             laws::Coulomb{18.6, 20e-6, 0.0}, laws::ConstantCutting{0.0776, 20e-6}}},
      Layer{top,
            {laws::Cone{3e5, 0.2618}, laws::PunctureDepth{gives}, laws::Coulomb{30.0, 20e-6, 0.0},
             laws::ConstantCutting{0.06, 20e-6}}}};
  return Insertion(layers);
}

void insert(const char* name, bool by_drop, bool by_model) {
  Insertion truth = tissue(true_top), model = tissue(model_top), ahead = tissue(model_top);
  double depth = 0.0, command = 0.0, velocity = 0.0, reference = 0.0, measured = 0.0, extreme = 0.0;
  std::size_t drops = 0;
  std::uint32_t seed = 1;
  bool falling = false, stopped = false;
  std::vector<double> forces;
  for (int cycle = 0; cycle < 3000; ++cycle) {
    forces.push_back(truth.step(depth, no_velocity, dt).force);
    seed = 1664525 * seed + 1013904223;
    measured += dt / filter * (forces.back() + noise * (seed / 2147483648.0 - 1.0) - measured);
    extreme = falling ? std::min(extreme, measured) : std::max(extreme, measured);
    if (std::abs(measured - extreme) > drop) {
      falling = !falling;
      extreme = measured;
      drops += falling;
    }
    model.step(depth, no_velocity, dt);
    ahead.step(depth + ahead_by, no_velocity, dt);
    stopped = stopped || (by_drop ? drops : model.pierced_layers()) == 2;
    const double most = by_model && ahead.pierced_layers() == 2 ? creep : speed;
    reference += rise * dt;
    velocity += dt / mass * (reference - measured - damping * velocity);
    velocity = stopped ? 0.0 : std::clamp(velocity, -most, most);
    command += velocity * dt;
    depth += (command - depth) * dt / lag;
  }
  const auto peak = std::max_element(forces.begin(), forces.end());
  std::printf("%-5s: peak %.4f N, at rest %+.3f mm and %+.4f N beyond the puncture\n", name, *peak,
              1e3 * (depth - true_top - gives), forces.back() - *std::min_element(peak, forces.end()));
}

int main() {
  insert("drop", true, false);
  insert("model", false, true);
  insert("both", true, true);
}
