// SPDX-License-Identifier: Apache-2.0
// The energy controller: the true energy of the true motion, which it sees late, never falls below zero.
#include "needleforce/energy_controller.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "hands.hpp"

using namespace hands;

namespace {

constexpr int delays[] = {0, 1, 2, 5, 10};
constexpr double pace = 0.3, push = 20.0;  // what the wilful hand does, in m/s and m/s^2

/// What comes of a hand at a guarded engine.
struct Outcome {
  TrueEnergy guarded, bare;
  double difference = 0.0, wanted = 0.0;  // sums of squares
  long outside = 0;
  double relative() const { return std::sqrt(difference / wanted); }
};

/// Measures of the device: what a sensor makes of a depth, NaN for nothing.
using Sensor = std::function<double(double)>;
using Clock = std::function<double()>;

template <class Engine>
Outcome trial(const Engine& engine, double from, double to, const GuardSettings& settings, int steps,
              const Sensor& sensor = {}, const Clock& clock = {}) {
  WilfulHand hand(from, to, pace, push, 7);
  DelayLine depths(static_cast<int>(settings.delay), hand.depth());
  Engine bare = engine;
  Guard guard(engine, settings);
  Outcome outcome;
  double dt = cycle;
  for (int i = 0; i < steps; ++i) {
    const double depth = depths(hand.depth()), seen = sensor ? sensor(depth) : depth;
    const double wanted = bare.step(depth, no_velocity, dt).force;
    const Output output = seen == seen ? guard.step(seen, no_velocity, dt) : guard.miss(dt);
    dt = clock ? clock() : cycle;
    const Stretch stretch = hand.move(dt);
    outcome.guarded.add(output.force, stretch);
    outcome.bare.add(wanted, stretch);
    outcome.difference += (output.force - wanted) * (output.force - wanted);
    outcome.wanted += wanted * wanted;
    outcome.outside += output.did.outside_bounds;
  }
  return outcome;
}

GuardSettings told(int delay, double acceleration, double lent) {
  GuardSettings settings = bounds(delay);
  settings.max_acceleration = acceleration;
  settings.initial_reserve = lent;
  return settings;
}

void expect_passive(const Outcome& outcome, const GuardSettings& settings, const std::string& what) {
  EXPECT_GE(outcome.guarded.least, -settings.initial_reserve - outcome.guarded.rounding()) << what;
  EXPECT_EQ(outcome.outside, 0) << what;
}

/// Every tissue, with the range in which a hand moves.
template <class Visit>
void with_each_tissue(Visit visit) {
  const Limits limits{.max_speed = 1.0};
  visit("wall", Wall{1000.0}, -2e-3, 4e-3);
  visit("stiff wall", Wall{1e4}, -2e-3, 4e-3);
  visit("paper", Insertion(paper(), limits), -3e-3, 15e-3);
  visit("paper, whole", Insertion(paper(), limits), -3e-3, 3.2e-3);
  visit("layered", Insertion(layered(), limits), -3e-3, 20e-3);
  visit("layered, whole", Insertion(layered(), limits), -3e-3, 7.9e-3);
  visit("layered as fitted", Insertion(layered_as_fitted(), limits), -3e-3, 20e-3);
  visit("lugre", Insertion(lugre(), limits), -3e-3, 15e-3);
}

TEST(EnergyController, MillionRandomStepsExtractNoMoreEnergyThanTheyPutIn) {
  with_each_tissue([](const char* name, const auto& engine, double from, double to) {
    for (const int delay : delays) {
      const GuardSettings settings = bounds(delay);
      const Outcome outcome =
          trial(engine, from, to, settings, 1000000 / static_cast<int>(std::size(delays)));
      expect_passive(outcome, settings, name + std::string(", delay ") + std::to_string(delay));
      EXPECT_GT(outcome.guarded.in, 0.1 * outcome.bare.in) << name << delay;  // a force was felt
    }
  });
}

TEST(EnergyController, SpeedBoundSufficesForTheEnergyGuarantee) {
  with_each_tissue([](const char* name, const auto& engine, double from, double to) {
    for (const int delay : delays) {
      const GuardSettings settings = told(delay, unlimited, 1e-5);
      expect_passive(trial(engine, from, to, settings, 50000), settings, name);
    }
  });
}

TEST(EnergyController, BoundedAccelerationNeedsNoInitialReserve) {
  with_each_tissue([](const char* name, const auto& engine, double from, double to) {
    for (const int delay : {0, 1, 2}) {
      const GuardSettings settings = told(delay, push, 0.0);
      const Outcome outcome = trial(engine, from, to, settings, 50000);
      expect_passive(outcome, settings, name);
      EXPECT_LT(outcome.relative(), 0.3) << name << delay;
    }
  });
}

TEST(EnergyController, SampledSpringWithoutControllerReturnsMoreThanItReceived) {
  for (const int delay : delays) {
    // a held force lags behind the motion by half a cycle and the delay: k tau times the squared speed [W]
    const Outcome outcome = trial(Wall{1000.0}, -2e-3, 4e-3, bounds(delay), 200000);
    EXPECT_LT(outcome.bare.balance(), -1e-3 * (0.5 + delay)) << delay;
  }
}

TEST(EnergyController, ForceIsUnchangedWithEnoughReserve) {
  with_each_tissue([](const std::string& name, const auto& engine, double from, double to) {
    const bool gains = name.find("wall") < name.size() || name.find("whole") < name.size();
    for (const int delay : {0, 1, 2})
      EXPECT_LT(trial(engine, from, to, bounds(delay), 100000).relative(), gains ? 0.1 : 1e-3) << name;
  });
}

TEST(EnergyController, SteadyInsertionIsUnchangedByTheController) {
  for (const int delay : {0, 1, 2})
    for (const double speed : {1e-3, 5e-3, 20e-3, 100e-3}) {
      Insertion bare{std::span<const Layer>(paper())};
      Guard guard(bare, bounds(delay));
      const double step = speed * cycle;
      for (int i = 0; step * i < 12e-3; ++i) {
        const double wanted = bare.step(step * i, no_velocity, cycle).force;
        ASSERT_EQ(guard.step(step * i, no_velocity, cycle).force, wanted) << delay << " " << speed;
      }
    }
}

TEST(EnergyController, EnergyGuaranteeHoldsWithLostMeasurementsAndAnUnevenClock) {
  for (const int delay : delays) {
    std::mt19937 generator(3);
    int lost = 0;
    const auto sensor = [&](double depth) {
      if (generator() % 100 == 0) lost = 1 + static_cast<int>(generator() % 30);
      return lost-- > 0 ? std::numeric_limits<double>::quiet_NaN() : depth;
    };
    const auto clock = [&] { return cycle * (0.2 + 0.8e-3 * (generator() % 1001)); };
    for (const double acceleration : {push, unlimited}) {
      GuardSettings settings = told(delay, acceleration, 1e-5);
      settings.stale_after = 5e-3;
      settings.fall_time = 10e-3;
      expect_passive(trial(Wall{1000.0}, -2e-3, 4e-3, settings, 200000, sensor, clock), settings, "lost");
    }
  }
}

TEST(EnergyController, EnergyGuaranteeHoldsWithACoarseEncoder) {
  const auto counts = [](double depth) { return 1e-5 * std::round(depth / 1e-5); };
  for (const int delay : delays)
    for (const double acceleration : {push, unlimited}) {
      GuardSettings settings = told(delay, acceleration, 1e-5);
      settings.position_error = 0.5e-5;
      expect_passive(trial(Wall{1e4}, -2e-3, 4e-3, settings, 200000, counts), settings, "counts");
    }
}

/// The least energy of a hand that goes against every force as fast as it may, and now and then pushes to
/// have one, at a sensor that errs in favour of it.
TrueEnergy taken(const GuardSettings& settings, int cycles) {
  const int delay = static_cast<int>(settings.delay);
  Guard guard(Wall{1000.0}, settings);
  DelayLine depths(delay, 1e-3);
  TrueEnergy energy, worst;
  double depth = 1e-3, speed = 0.0, force = 0.0, change = 0.0;
  std::mt19937 generator(5);
  int pushing = 0, lost = 0;
  for (int i = 0; i < cycles; ++i) {
    const double error = -std::copysign(settings.position_error, change);
    const double seen = depths(depth) + error;
    if (settings.stale_after > 0.0 && generator() % 60 == 0) lost = static_cast<int>(generator() % 30);
    const double next = (lost-- > 0 ? guard.miss(cycle) : guard.step(seen, no_velocity, cycle)).force;
    change = next - force;
    force = next;
    if (generator() % 50 == 0) pushing = static_cast<int>(generator() % 20);
    const double wish = pushing-- > 0 && depth < 5e-3 ? pace : -std::copysign(pace, force);
    const double most = settings.max_acceleration;
    const double faster = std::clamp((wish - speed) / cycle, -most, most);
    // who may turn at once does so at the beginning of the cycle
    const Stretch stretch = most < unlimited ? Stretch{cycle, speed, faster} : Stretch{cycle, wish, 0.0};
    energy.add(force, stretch);
    depth += stretch.travel();
    speed = stretch.speed + stretch.acceleration * cycle;
    if (energy.least < worst.least) worst = energy;
    if (depth < -1e-3)
      depth = 1e-3, guard.reset(), depths = DelayLine(delay, depth), energy = {},
      speed = force = change = 0.0;
  }
  return worst;
}

TEST(EnergyController, OneWayExtractionIsLimitedToTheInitialReserve) {
  for (const int delay : delays)
    for (const double acceleration : {unlimited, push})
      for (const double error : {0.0, 2e-5, 4e-4})
        for (const double held : {0.0, 1.0}) {
          GuardSettings settings = told(delay, acceleration, 1e-6);
          settings.position_error = error;
          settings.stale_after = held;
          const TrueEnergy energy = taken(settings, 100000);
          const std::string which = std::to_string(delay) + (error > 0.0 ? ", errs" : "") +
                                    (held > 0.0 ? ", lost" : "") + (acceleration < unlimited ? ", a" : "");
          EXPECT_GE(energy.least, -1e-6 - energy.rounding()) << which;
          EXPECT_LT(energy.least, -1e-10) << which;  // it did try
        }
}

TEST(EnergyController, WithdrawalForceFallsWithoutChatter) {
  for (const int delay : delays) {
    Guard guard(Wall{1000.0}, told(delay, unlimited, 1e-5));
    DelayLine depths(delay, 0.0);
    double depth = 0.0, last = unlimited;
    for (int i = 0; i < 400; ++i) guard.step(depths(depth = 1e-5 * i), no_velocity, cycle);
    for (int i = 0; i <= delay; ++i) last = guard.step(depths(depth), no_velocity, cycle).force;
    for (int i = 0; i < 60; ++i) {
      const double force = guard.step(depths(depth -= 1e-4), no_velocity, cycle).force;
      if (i > delay) {
        EXPECT_LE(force, last + 0.02) << "delay " << delay << ", cycle " << i;
      }
      last = force;
    }
  }
}

/// The speed [m/s] that a handle keeps (RMS over the last second) after three at rest in a wall.
template <class Step>
double restless(Step step, int delay, TrueEnergy& energy) {
  FeelingHand hand(0.15, 300.0, 2.0, -5e-3, 10e-3, 1);
  hand.rest(5e-3);
  DelayLine depths(delay, hand.depth());
  double squares = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const double force = step(depths(hand.depth()));
    hand.move(force, [&](double work) { energy.add(work); });
    if (i >= 2000) squares += hand.speed() * hand.speed();
  }
  return std::sqrt(squares / 1000);
}

TEST(EnergyController, HandleAtAStiffWallOscillatesOnlyWithoutController) {
  for (const int delay : {0, 2}) {
    // 2 N s/m is less than k T / 2 = 10 N s/m, which a sampled wall needs: Colgate & Schenkel 1997
    Wall wall{2e4};
    TrueEnergy bare, guarded;
    const double driven =
        restless([&](double x) { return wall.step(x, no_velocity, cycle).force; }, delay, bare);
    Guard guard(wall, {.longest_cycle = cycle, .max_speed = 2.0, .delay = 1.0 * delay});
    const double calmed =
        restless([&](double x) { return guard.step(x, no_velocity, cycle).force; }, delay, guarded);
    EXPECT_GT(driven, 0.05) << delay;
    EXPECT_LT(bare.balance(), -0.1) << delay;
    EXPECT_LT(calmed, 0.02) << delay;
    EXPECT_GE(guarded.least, -1e-5) << delay;
  }
}

/// Friction that one day begins to pull.
struct Turncoat {
  bool active = false;
  double last = 0.0;
  Sample step(double depth, double, double) noexcept {
    const double force = active ? -5.0 : depth > last ? 1.0 : depth < last ? -1.0 : 0.0;
    last = depth;
    return {.depth = depth, .force = force};
  }
};

TEST(EnergyController, ActiveBurstExtractsNoMoreThanMaxReserve) {
  for (const double kept : {1e-3, unlimited}) {
    GuardSettings settings = told(0, push, 1e-5);
    settings.max_reserve = kept;
    Turncoat engine;
    Guard<Turncoat&> guard(engine, settings);
    WilfulHand hand(0.0, 20e-3, pace, push, 3);
    TrueEnergy energy;
    for (int i = 0; i < 20000; ++i)
      energy.add(guard.step(hand.depth(), no_velocity, cycle).force, hand.move());
    EXPECT_GT(energy.balance(), 0.1);
    const double before = energy.balance();
    engine.active = true;
    double depth = hand.depth(), least = before;
    for (int i = 0; i < 500; ++i) {  // drawn in by a pull
      const double force = guard.step(depth, no_velocity, cycle).force;
      energy.add(force * 1e-4);
      depth += 1e-4;
      least = std::min(least, energy.balance());
    }
    if (kept < 1.0)
      EXPECT_GE(least,
                before - kept - 5.0 * pace * cycle);  // what came in in the last cycle is not known yet
    else
      EXPECT_LT(least, before - 0.05);
  }
}

TEST(EnergyController, MotionBeyondTheBoundsIsReported) {
  EnergyController controller(bounds(0));
  controller.limit(0.0, 0.0, cycle);
  controller.limit(0.0, 0.01 * cycle, cycle);
  EXPECT_FALSE(controller.outside_bounds());
  controller.limit(0.0, 0.02 * cycle, 1.5 * cycle);
  EXPECT_TRUE(controller.outside_bounds());  // a long cycle
  controller.limit(0.0, 0.03 * cycle, cycle);
  EXPECT_FALSE(controller.outside_bounds());
  controller.limit(0.0, 0.34 * cycle, cycle);
  EXPECT_TRUE(controller.outside_bounds());  // 0.31 m/s
  GuardSettings settings = bounds(0);
  settings.max_speed = 10.0;
  EnergyController faster(settings);
  for (const double depth : {0.0, 0.1, 0.2}) faster.limit(0.0, depth * cycle, cycle);
  EXPECT_FALSE(faster.outside_bounds());
  faster.limit(0.0, 0.33 * cycle, cycle);
  EXPECT_TRUE(faster.outside_bounds());  // 0.03 m/s in a millisecond
}

TEST(EnergyController, EnergyIsTheSumOverHeldForces) {
  EnergyController controller{GuardSettings{.delay = 1.0}};
  // held 2, 3, 5 N over travels of 1, -2, 4 mm, seen one cycle late
  const double forces[] = {2.0, 3.0, 5.0, 0.0, 0.0}, depths[] = {0.0, 0.0, 1e-3, -1e-3, 3e-3};
  for (int i = 0; i < 5; ++i) controller.limit(forces[i], depths[i], cycle);
  EXPECT_NEAR(controller.energy(), 2e-3 - 6e-3 + 20e-3, 1e-15);
}

}  // namespace
