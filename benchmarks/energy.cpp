// SPDX-License-Identifier: Apache-2.0
// Energy that random motion takes out of tissues at 1 kHz with delay: bare, under the classic time-domain
// passivity controller, and under the guard. Prints JSON, one object a trial.
//   g++ -std=c++20 -O2 -Iinclude -Itests/cpp benchmarks/energy.cpp -o energy && ./energy [steps]
#include <cstdio>
#include <cstdlib>

#include "hands.hpp"

using namespace hands;

namespace {

/// Hannaford & Ryu 2002, impedance causality: where the observed energy is negative, a damper that takes what
/// is missing, after the fact.
struct ClassicController {
  double energy = 0.0, depth = 0.0, force = 0.0;
  bool started = false;
  double limit(double wanted, double measured) {
    const double travel = started ? measured - depth : 0.0, speed = travel / cycle;
    energy += force * travel;
    started = true;
    depth = measured;
    const double damping = energy < 0.0 && speed != 0.0 ? -energy / (cycle * speed * speed) : 0.0;
    return force = wanted + std::clamp(damping * speed, -50.0, 50.0);
  }
};

struct Column {
  TrueEnergy energy{};
  double difference = 0.0;
  void add(double force, double wanted, const Stretch& stretch) {
    energy.add(force, stretch);
    difference += (force - wanted) * (force - wanted);
  }
  void print(const char* name, double scale, const char* end) const {
    std::printf("\"%s\": {\"least_mJ\": %.4g, \"balance_mJ\": %.4g, \"rms_difference\": %.4f}%s", name,
                1e3 * energy.least, 1e3 * energy.balance(), std::sqrt(difference / scale), end);
  }
};

struct Trial {
  const char* tissue;
  double from, to;
  GuardSettings settings;
  const char* known;
};

template <class Engine>
void run(const Engine& engine, const Trial& trial, int steps, const char* end) {
  WilfulHand hand(trial.from, trial.to, 0.3, 20.0, 7);
  DelayLine depths(static_cast<int>(trial.settings.delay), hand.depth());
  Engine alone = engine;
  Guard guard(engine, trial.settings);
  ClassicController classic;
  Column bare, damped, guarded;
  double squares = 0.0;
  long limited = 0;
  for (int i = 0; i < steps; ++i) {
    const double depth = depths(hand.depth()), wanted = alone.step(depth, no_velocity, cycle).force;
    const Output output = guard.step(depth, no_velocity, cycle);
    const double other = classic.limit(wanted, depth);
    const Stretch stretch = hand.move();
    bare.add(wanted, wanted, stretch);
    damped.add(other, wanted, stretch);
    guarded.add(output.force, wanted, stretch);
    squares += wanted * wanted;
    limited += output.did.limited_by_energy;
  }
  std::printf("{\"tissue\": \"%s\", \"delay\": %g, \"bounds\": \"%s\", \"rms_N\": %.4f, ", trial.tissue,
              trial.settings.delay, trial.known, std::sqrt(squares / steps));
  bare.print("bare", squares, ", ");
  damped.print("classic", squares, ", ");
  guarded.print("guard", squares, ", ");
  std::printf("\"limited\": %.4f}%s\n", 1.0 * limited / steps, end);
}

void each_tissue(const GuardSettings& settings, const char* known, int steps, bool last) {
  const auto at = [&](const char* name, double from, double to) {
    return Trial{name, from, to, settings, known};
  };
  run(Wall{1000.0}, at("wall 1 N/mm", -2e-3, 4e-3), steps, ",");
  run(Insertion(paper()), at("paper", -3e-3, 15e-3), steps, ",");
  run(Insertion(paper()), at("paper, not punctured", -3e-3, 3.2e-3), steps, ",");
  run(Insertion(layered()), at("layered", -3e-3, 20e-3), steps, ",");
  run(Insertion(layered()), at("layered, not punctured", -3e-3, 7.9e-3), steps, ",");
  run(Insertion(layered_as_fitted()), at("layered_as_fitted", -3e-3, 20e-3), steps, ",");
  run(Insertion(lugre()), at("lugre", -3e-3, 15e-3), steps, last ? "" : ",");
}

}  // namespace

int main(int count, char** arguments) {
  const int steps = count > 1 ? std::atoi(arguments[1]) : 1000000;
  std::printf("[\n");
  for (const int delay : {0, 1, 2, 5, 10}) {
    GuardSettings speed_alone = bounds(delay);
    speed_alone.max_acceleration = unlimited;
    each_tissue(bounds(delay), "speed and acceleration", steps, false);
    each_tissue(speed_alone, "speed", steps, delay == 10);
  }
  std::printf("]\n");
}
