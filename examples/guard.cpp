// SPDX-License-Identifier: Apache-2.0
// A haptic device between a user and a tissue: twice the tissue's force, at most 0.5 N, never more energy
// than the user put in; then the sensor fails. Twin of guard.py.
//   g++ -std=c++20 -O2 -Iinclude examples/guard.cpp -o guard && ./guard
#include "needleforce/guard.hpp"

#include <cstdio>

#include "needleforce/flight_recorder.hpp"
#include "needleforce/insertion.hpp"

int main() {
  using namespace needleforce;
  const Model model{laws::Cone{117546.06040021202, 15.0 * tips::degree}, laws::PunctureDepth{3.237e-3},
                    laws::Coulomb{18.6, 20e-6, 0.0}, laws::ConstantCutting{0.0776, 20e-6}};
  const GuardSettings settings{.force_scale = 2.0,
                               .max_force = 0.5,
                               .stale_after = 5e-3,
                               .fall_time = 10e-3,
                               .longest_cycle = 1.5e-3,
                               .max_speed = 0.3,
                               .max_acceleration = 20.0,
                               .delay = 1.0};
  if (const GuardFault fault = first_fault(settings); fault.reason) {
    std::fprintf(stderr, "%s: %s\n", fault.quantity, fault.reason);
    return 1;
  }
  Guard guard{Insertion(model), settings};
  static FlightRecorder<64> recorder;

  const double dt = 1e-3, speed = 20e-3;
  double largest = 0.0;
  Output output;
  for (int cycle = 0; cycle < 600; ++cycle) {  // to 12 mm, measured a cycle late
    const double depth = speed * dt * (cycle - 1);
    output = guard.step(depth, no_velocity, dt);
    recorder.write(depth, no_velocity, dt, output);
    largest = output.force > largest ? output.force : largest;
  }
  std::printf("largest force %.4f N, energy put in %.3f mJ\n", largest, 1e3 * output.energy);
  int cycles = 0;
  for (; output.force > 0.0; ++cycles) output = guard.miss(dt);
  std::printf("without a measurement no force after %d cycles\n", cycles);

  Cycle room[64];
  for (const Cycle& cycle : recorder.read(room))
    if (cycle.number % 32 == 0)
      std::printf("cycle %d: %.3f N of %.3f N%s\n", static_cast<int>(cycle.number), cycle.force,
                  2.0 * cycle.sample_force, cycle.did.clamped ? ", clamped" : "");
}
