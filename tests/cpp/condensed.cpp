// SPDX-License-Identifier: Apache-2.0
// A condensed solid in the loop: its limits, its balance, its energy, and what it refuses.
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <utility>

#include "solid.hpp"

using namespace solid_tests;

namespace {

constexpr double endless = std::numeric_limits<double>::infinity();
const Limits any_speed{.max_speed = endless, .velocity_slack = endless};

/// Goes to a depth in steps; the last sample.
template <class Engine>
Sample go(Engine& engine, double& at, double to, double step = 5e-6) {
  Sample sample{};
  while (at != to) {
    at = std::abs(to - at) <= step ? to : at + std::copysign(step, to - at);
    sample = engine.step(at, no_velocity, 1e-3);
  }
  return sample;
}

TEST(CondensedInsertion, IsTheAxialLawWhereTissueDoesNotGive) {
  const Model laws = laws_of(20.0, 0.1, 0.2);
  CondensedInsertion solid = insertion(1e-10, laws);
  Insertion axial(laws);
  double one = -1e-3, other = -1e-3;
  for (double to : {1e-3, 10e-3, 30e-3, 29e-3, 31e-3, 5e-3, 8e-3, -1e-3})
    EXPECT_NEAR(go(solid, one, to).force, go(axial, other, to).force, 1e-5) << to;
}

TEST(CondensedInsertion, BreaksIntoTheSurfaceAsItsContactLawSays) {
  // 100 N/m to 0.2 N, whatever the solid is: nothing else is in it yet
  for (double scale : {1e-6, 2e-3, 2e-2, 0.2}) {
    CondensedInsertion solid = insertion(scale, laws_of(20.0, 0.1, 0.2));
    double at = -1e-3;
    EXPECT_NEAR(go(solid, at, 1.5e-3).force, 0.15, 1e-9) << scale;
    EXPECT_EQ(solid.state().pierced, 0u) << scale;
    go(solid, at, 2.01e-3);
    EXPECT_EQ(solid.state().pierced, 1u) << scale;
  }
}

TEST(CondensedInsertion, HasTheSlopeOfItsContactLawAlsoAtRest) {
  CondensedInsertion solid = insertion(2e-3, laws_of(20.0, 0.1, 0.2));
  double at = -1e-3;
  EXPECT_NEAR(go(solid, at, 1e-3).force_by_depth, 100.0, 1e-9);
  EXPECT_NEAR(solid.step(at, no_velocity, 1e-3).force_by_depth, 100.0, 1e-9);
  const double moving = go(solid, at, 20e-3).force_by_depth;
  EXPECT_GT(moving, 1.0);
  EXPECT_EQ(solid.step(at, no_velocity, 1e-3).force_by_depth, moving);
}

TEST(CondensedInsertion, FirstStepAboveThePuncturePressesAndBelowItIsInTheTissue) {
  CondensedInsertion pressing = insertion(2e-3, laws_of(20.0, 0.1, 0.2)), deep = pressing;
  const Sample sample = pressing.step(1e-3, no_velocity, 1e-3);
  EXPECT_EQ(sample.phase, Phase::deformation);
  EXPECT_NEAR(sample.force, 0.1, 1e-9);
  deep.step(2.1e-3, no_velocity, 1e-3);
  EXPECT_EQ(deep.pierced_layers(), 1u);
}

TEST(CondensedInsertion, BalancesForceAndDisplacementAtEveryNode) {
  CondensedInsertion solid = insertion(2e-3, laws_of(20.0, 0.1, 0.2));
  double at = -1e-3;
  for (double to : {10e-3, 30e-3, 29.8e-3, 29e-3, 33e-3, 20e-3}) {
    const Sample sample = go(solid, at, to);
    double sum = 0.0;
    for (std::size_t i = 0; i < solid.tissue().nodes; ++i) {
      EXPECT_LE(std::abs(solid.shaft_force(i)), 20.0 * 1e-3 * (1.0 + 1e-9));
      sum += solid.shaft_force(i);
    }
    EXPECT_NEAR(sum + solid.state().tip_force, sample.force, 1e-12);
    // what is kept is what the forces give
    for (std::size_t i = 0; i < solid.state().shaft.known; ++i)
      EXPECT_NEAR(solid.state().shaft.displacement[i], solid.displacement(i), 1e-12);
  }
}

TEST(CondensedInsertion, ReturnsNoEnergyOverAnyMotion) {
  std::mt19937_64 generator(2);
  std::uniform_real_distribution<double> depth(-2e-3, 50e-3), scale(1e-4, 8e-3);
  for (int trial = 0; trial < 40; ++trial) {
    CondensedInsertion solid =
        insertion(scale(generator), laws_of(30.0, trial % 2 * 0.1, trial % 3 * 0.1), any_speed);
    double at = -1e-3, force = 0.0, work = 0.0, lowest = 0.0;
    for (int turn = 0; turn < 12; ++turn) {
      const double to = turn == 11 ? -10e-3 : depth(generator), from = at;
      for (int k = 1; k <= 400; ++k) {
        const double next = from + (to - from) * k / 400.0;
        const double now = solid.step(next, no_velocity, 1e-3).force;
        work += 0.5 * (force + now) * (next - at);
        force = now;
        at = next;
        lowest = std::min(lowest, work);
      }
    }
    EXPECT_GT(lowest, -1e-6) << trial;
    EXPECT_GT(work, 0.0) << trial;
    EXPECT_EQ(force, 0.0) << trial;
  }
}

TEST(CondensedInsertion, LeavesForAndComesFromAnywhereInOneStep) {
  CondensedInsertion solid = insertion(2e-3, laws_of(20.0, 0.1, 0.2), any_speed);
  EXPECT_EQ(solid.step(-1.0, no_velocity, 1.0).phase, Phase::free);
  const Sample in = solid.step(50e-3, no_velocity, 1.0);
  EXPECT_EQ(in.status, Status::ok);
  EXPECT_NEAR(in.friction, 20.0 * solid.state().tip, 0.05 * in.friction);
  const Sample out = solid.step(-1.0, no_velocity, 1.0);
  EXPECT_EQ(out.force, 0.0);
  EXPECT_EQ(out.phase, Phase::free);
}

TEST(CondensedInsertion, TakesNoLongerWhereTissueIsPulledUpForever) {
  // a path of 61 um in tissue that follows by kilometres: two million half spacings to -1 m
  CondensedTissue thin = tissue(1e6);
  thin.spacing = 1e-6;
  const Layer layer{0.0, laws_of(1e3, 0.0, 0.0)};
  CondensedInsertion solid(thin, std::span(&layer, 1), any_speed);
  solid.step(-1e-6, no_velocity, 1.0);
  solid.step(50e-6, no_velocity, 1.0);
  for (int k = 0; k < 100; ++k)
    EXPECT_TRUE(std::isfinite(solid.step(k % 2 ? 50e-6 : -1.0, no_velocity, 1.0).force));
}

TEST(CondensedInsertion, CopiesSavesAndRestoresItsState) {
  CondensedInsertion solid = insertion(2e-3, laws_of(20.0, 0.1, 0.2)),
                     other = insertion(1e-3, laws_of(20.0, 0.1, 0.2));
  double at = -1e-3;
  go(solid, at, 20e-3);
  const CondensedInsertion copy = solid.snapshot();
  const CondensedInsertion::Saved saved = solid.save();
  CondensedInsertion again = copy;
  double one = at, two = at, three = at;
  const double force = go(solid, one, 15e-3).force;
  EXPECT_EQ(go(again, two, 15e-3).force, force);
  EXPECT_TRUE(solid.restore(saved));
  EXPECT_EQ(go(solid, three, 15e-3).force, force);
  EXPECT_FALSE(other.restore(saved));
  CondensedInsertion::Saved altered = saved;
  altered.words[3] ^= 1;
  EXPECT_FALSE(solid.restore(altered));
  solid.reset();
  EXPECT_EQ(solid.state().tip, 0.0);
}

TEST(CondensedInsertion, RefusesInputBeyondItsPathAndTables) {
  CondensedInsertion solid = insertion(2e-3, laws_of(20.0, 0.1, 0.2), any_speed);
  EXPECT_EQ(solid.step(61e-3, no_velocity, 1.0).status, Status::outside_range);
  EXPECT_EQ(solid.step(std::nan(""), no_velocity, 1.0).status, Status::not_finite);
  EXPECT_EQ(solid.step(10e-3, no_velocity, 0.0).status, Status::outside_range);
  const Layer layer{0.0, laws_of(20.0, 0.1, 0.2)};
  CondensedTissue wrong = tissue(1e-3);
  wrong.compliance[1] *= 2.0;
  EXPECT_STREQ(CondensedInsertion::fault(wrong, std::span(&layer, 1)), "the compliance is not symmetric");
  EXPECT_EQ(CondensedInsertion(wrong, std::span(&layer, 1)).step(1e-3, no_velocity, 1e-3).status,
            Status::invalid_parameter);
  EXPECT_STREQ(fault(tissue(-1e-3)), "the compliance is not positive definite");
  EXPECT_STREQ(fault(tissue(1e-3, 1)), "the number of nodes is not 2 to 64");
  CondensedTissue unspaced = tissue(1e-3);
  unspaced.spacing = std::nan("");
  EXPECT_STREQ(fault(unspaced), "the spacing is not 1e-6 to 0.1 m");
}

TEST(CondensedInsertion, CutsWithItsForceWhateverTheStep) {
  for (double step : {2e-6, 20e-6, 200e-6, 1e-3}) {
    CondensedInsertion solid = insertion(1e-3, laws_of(20.0, 0.1, 0.2), any_speed);
    double at = -1e-3;
    go(solid, at, 10e-3, step);
    for (double to : {20e-3, 30e-3, 40e-3, 50e-3}) {
      const Sample sample = go(solid, at, to, step);
      EXPECT_NEAR(sample.cutting, 0.1, 2e-3) << step;
      EXPECT_NEAR(sample.friction, 20.0 * solid.state().tip, 0.01) << step;
    }
  }
}

TEST(CondensedInsertion, ForcesAlongTheShaftAddUpAndEndAtTheTip) {
  CondensedInsertion solid = insertion(2e-3, laws_of(20.0, 0.1, 0.2));
  double at = -1e-3;
  for (double to : {10.3e-3, 30e-3, 29.8e-3, 20e-3, 1e-3}) {
    const Sample sample = go(solid, at, to);
    double sum = 0.0, last = 0.0, densest = 0.0;
    solid.along_shaft(sample.velocity, [&](double from, double end, double force) {
      EXPECT_DOUBLE_EQ(from, last);
      EXPECT_GT(end, from);
      sum += force;
      last = end;
      if (end - from > 0.9e-3) densest = std::max(densest, std::abs(force) / (end - from));
    });
    EXPECT_NEAR(sum, sample.friction, 1e-12);
    EXPECT_DOUBLE_EQ(last, std::min(solid.state().tip, to));
    EXPECT_LE(densest, 20.0 * 1.6);  // friction per length, and in the last piece what is left of a node
  }
}

TEST(CondensedInsertion, CutBeginsWithNoMoreForceAndEnergyThanItsContactHeld) {
  // 100 N/m to 0.05 N hold 12.5 uJ; the solid around the tip, with less, is softer or stiffer, and cuts at
  // 0.3 N
  for (double scale : {1e-3, 3e-3, 1e-2, 3e-2, 0.1}) {
    CondensedInsertion solid = insertion(scale, laws_of(20.0, 0.3, 0.05));
    double at = -1e-3;
    Sample sample = go(solid, at, 0.4999e-3);
    while (!sample.punctured) sample = solid.step(at += 1e-7, no_velocity, 1e-3);
    EXPECT_LE(sample.cutting, 0.05 * (1.0 + 1e-9)) << scale;
    const double own = BetweenNodes::at(solid.state().tip, solid.tissue()).compliance(solid.tissue());
    EXPECT_LE(0.5 * own * sample.cutting * sample.cutting, 12.5e-6 * (1.0 + 1e-3)) << scale;
    EXPECT_NEAR(go(solid, at, 40e-3).cutting, scale < 3e-2 ? 0.3 : 0.1, scale < 3e-2 ? 1e-2 : 1.0) << scale;
  }
}

/// Smallest and largest force of a minute's hold at 12 mm and 1 kHz, with normal noise of 5 um of the depth.
std::pair<double, double> held(double scale, double known) {
  CondensedInsertion solid = insertion(scale, laws_of(18.6, 0.08, 0.2, 20e-6), {.depth_noise = known});
  std::mt19937_64 generator(11);
  std::normal_distribution<double> normal;
  const auto shown = [&](double at) { return at + 5e-6 * std::clamp(normal(generator), -6.0, 6.0); };
  for (double at = -1e-3; at < 12e-3; at += 5e-6) solid.step(shown(at), no_velocity, 1e-3);
  double least = endless, most = -endless;
  for (int i = 0; i < 60000; ++i) {
    const double force = solid.step(shown(12e-3), no_velocity, 1e-3).force;
    least = std::min(least, force), most = std::max(most, force);
  }
  EXPECT_TRUE(known == 0.0 || solid.state().phase == Phase::hold);
  return {least, most};
}

TEST(CondensedInsertion, HoldKeepsItsForceUnderNoise) {
  constexpr double noise = 30e-6;  // six standard deviations
  for (double scale : {3e-4, 3e-3, 3e-2}) {
    CondensedInsertion still = insertion(scale, laws_of(18.6, 0.08, 0.2, 20e-6));
    double at = -1e-3;
    const double force = go(still, at, 12e-3).force;
    const auto [least, most] = held(scale, noise);
    EXPECT_NEAR(least, force, 18.6 * 2.0 * noise) << scale;
    EXPECT_NEAR(most, force, 18.6 * 2.0 * noise) << scale;
  }
  EXPECT_LT(held(3e-4, 0.0).first, 0.25);
}

TEST(CondensedInsertion, ReversalIsFeltLaterByTheRangeOfTheNoise) {
  for (double w : {0.0, 20e-6}) {
    CondensedInsertion solid = insertion(3e-4, laws_of(18.6, 0.0, 0.2), {.depth_noise = w});
    double at = -1e-3, felt = 0.0;
    const double force = go(solid, at, 12e-3).force;
    while (felt == 0.0) {
      const Sample sample = solid.step(at -= 1e-6, no_velocity, 1e-3);
      if (sample.force < force - 1e-4) felt = 12e-3 - at;
    }
    EXPECT_NEAR(felt, 2.0 * w, 3e-6) << w;
    const double friction = go(solid, at, 5e-3).friction;
    EXPECT_NEAR(friction, -18.6 * solid.state().tip, 0.01);
    EXPECT_EQ(go(solid, at, -5e-3).phase, Phase::free);
    EXPECT_EQ(solid.state().depth, -5e-3);  // the air knows no other depth
  }
}

}  // namespace
