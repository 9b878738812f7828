// SPDX-License-Identifier: Apache-2.0
// Energy that random motion takes out of tissues at 1 kHz with delay: bare, under the classic time-domain
// passivity controller, and under the guard; of needles that bend along all axes of the base, bare and under
// the guard. Prints JSON, one object a trial.
//   g++ -std=c++20 -O2 -Iinclude -Itests/cpp benchmarks/energy.cpp -o energy && ./energy [steps]
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "bending.hpp"
#include "hands.hpp"
#include "needleforce/base_guard.hpp"
#include "needleforce/solid/bent_in_solid.hpp"
#include "solid.hpp"

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

solid::CondensedInsertion in_solid() {
  return solid_tests::insertion(2e-3, solid_tests::laws_of(20.0, 0.1, 0.2), bending_tests::any_speed);
}

/// A base that goes its own way along every axis of a needle, in a plane (1) or in space (2).
class WilfulBase {
 public:
  explicit WilfulBase(std::size_t dimension) : dimension_(dimension) {}
  bending::Base base() const {
    bending::Base base{.depth = along_[0].depth(), .roll = along_[5].depth()};
    for (std::size_t d = 0; d < dimension_; ++d)
      base.lateral[d] = along_[1 + d].depth(), base.tilt[d] = along_[3 + d].depth();
    return base;
  }
  void move() {
    for (WilfulHand& hand : along_) hand.move();
  }

 private:
  std::size_t dimension_;
  std::array<WilfulHand, 6> along_{{{-2e-3, 15e-3, 0.1, 10.0, 1},
                                    {-3e-3, 3e-3, 0.1, 10.0, 2},
                                    {-3e-3, 3e-3, 0.1, 10.0, 3},
                                    {-0.05, 0.05, 1.0, 100.0, 4},
                                    {-0.05, 0.05, 1.0, 100.0, 5},
                                    {-2.0, 2.0, 1.0, 100.0, 6}}};
};

std::array<double, 6> numbers_of(const BaseForce& f) {
  return {f.depth, f.lateral[0], f.lateral[1], f.tilt[0], f.tilt[1], f.roll};
}

/// Forces of all axes: energy, and how far forces [N] and moments [N m] are from the wanted ones.
struct BaseColumn {
  TrueEnergy energy{};
  double force = 0.0, moment = 0.0;
  void add(const BaseForce& held, const BaseForce& wanted, const bending::Base& from,
           const bending::Base& to) {
    const double travel[] = {to.depth - from.depth,           to.lateral[0] - from.lateral[0],
                             to.lateral[1] - from.lateral[1], to.tilt[0] - from.tilt[0],
                             to.tilt[1] - from.tilt[1],       to.roll - from.roll};
    const auto h = numbers_of(held), w = numbers_of(wanted);
    double work = 0.0;
    for (std::size_t i = 0; i < 6; ++i) {
      work += h[i] * travel[i];
      (i < first_turning_axis ? force : moment) += (h[i] - w[i]) * (h[i] - w[i]);
    }
    energy.add(work);
  }
};

template <std::size_t dimension, class Axial>
void run_base(const char* name, const Axial& axial, int delay, bool acceleration, int steps,
              const char* end) {
  const auto gel = [] {
    bending::FlexibleSettings settings = bending_tests::settings(0.0006921, 50e3, 0.05, 1e-3, 0.024);
    settings.small_slopes = false;
    return settings;
  };
  GuardSettings settings{
      .longest_cycle = cycle, .max_speed = 0.1, .delay = 1.0 * delay, .max_angular_speed = 1.0};
  if (acceleration) settings.max_acceleration = 10.0, settings.max_angular_acceleration = 100.0;
  bending::FlexibleInsertion<dimension, Axial> alone(axial, gel());
  Guard guard(alone, settings);
  WilfulBase hand(dimension);
  std::vector<bending::Base> seen(static_cast<std::size_t>(delay) + 1, hand.base());
  BaseColumn bare, guarded, whole;
  long limited = 0;
  for (int i = 0; i < steps; ++i) {
    const BaseForce wanted = opposing(alone.step(seen.front(), cycle), seen.front().tilt);
    const BaseOutput output = guard.step(seen.front(), cycle);
    const bending::Base before = hand.base();
    hand.move();
    std::rotate(seen.begin(), seen.begin() + 1, seen.end());
    seen.back() = hand.base();
    bare.add(wanted, wanted, before, hand.base());
    guarded.add(output.force, wanted, before, hand.base());
    whole.add({}, wanted, before, hand.base());
    limited += output.did.limited_by_energy;
  }
  std::printf("{\"tissue\": \"%s\", \"delay\": %d, \"bounds\": \"%s\", \"rms_N\": %.4f, \"rms_Nm\": %.6f, ",
              name, delay, acceleration ? "speed and acceleration" : "speed", std::sqrt(whole.force / steps),
              std::sqrt(whole.moment / steps));
  std::printf("\"bare\": {\"least_mJ\": %.4g, \"balance_mJ\": %.4g}, ", 1e3 * bare.energy.least,
              1e3 * bare.energy.balance());
  std::printf(
      "\"guard\": {\"least_mJ\": %.4g, \"balance_mJ\": %.4g, \"rms_difference\": %.4f, "
      "\"rms_moment_difference\": %.4f}, \"limited\": %.4f}%s\n",
      1e3 * guarded.energy.least, 1e3 * guarded.energy.balance(), std::sqrt(guarded.force / whole.force),
      std::sqrt(guarded.moment / whole.moment), 1.0 * limited / steps, end);
}

void each_needle(int delay, bool acceleration, int steps) {
  const auto axial = [](const std::vector<Layer>& layers) {
    return Insertion(layers, bending_tests::any_speed);
  };
  run_base<1>("needle that bends, in a plane", axial(hands::paper()), delay, acceleration, steps, ",");
  run_base<2>("needle that bends, in space", axial(hands::paper()), delay, acceleration, steps, ",");
  run_base<2>("needle that bends, in a solid", in_solid(), delay, acceleration, steps, ",");
  run_base<2>("needle that bends, without friction", axial({{0.0, bending_tests::forceless()}}), delay,
              acceleration, steps, ",");
}

void each_tissue(const GuardSettings& settings, const char* known, int steps, bool last) {
  const auto at = [&](const char* name, double from, double to) {
    return Trial{name, from, to, settings, known};
  };
  run(Wall{1000.0}, at("wall 1 N/mm", -2e-3, 4e-3), steps, ",");
  run(Insertion(hands::paper()), at("paper", -3e-3, 15e-3), steps, ",");
  run(Insertion(hands::paper()), at("paper, not punctured", -3e-3, 3.2e-3), steps, ",");
  run(Insertion(layered()), at("layered", -3e-3, 20e-3), steps, ",");
  run(Insertion(layered()), at("layered, not punctured", -3e-3, 7.9e-3), steps, ",");
  run(Insertion(layered_as_fitted()), at("layered_as_fitted", -3e-3, 20e-3), steps, ",");
  run(in_solid(), at("condensed solid", -3e-3, 15e-3), steps / 10, ",");
  run(Insertion(lugre()), at("lugre", -3e-3, 15e-3), steps, last ? "" : ",");
}

}  // namespace

int main(int count, char** arguments) {
  const int steps = count > 1 ? std::atoi(arguments[1]) : 1000000;
  std::printf("[\n");
  for (const int delay : {0, 1, 2, 5, 10}) {
    GuardSettings speed_alone = bounds(delay);
    speed_alone.max_acceleration = unlimited;
    for (const bool acceleration : {true, false}) each_needle(delay, acceleration, steps / 10);
    each_tissue(bounds(delay), "speed and acceleration", steps, false);
    each_tissue(speed_alone, "speed", steps, delay == 10);
  }
  std::printf("]\n");
}
