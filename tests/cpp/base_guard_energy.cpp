// SPDX-License-Identifier: Apache-2.0
// A guard around a needle that bends has one account of energy for all axes of the base, also around engines
// that make energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "guarded_bases.hpp"
#include "hands.hpp"
#include "needleforce/solid/bent_in_solid.hpp"
#include "solid.hpp"

namespace {

namespace base_guard_energy {

using namespace guarded_bases;

/// A gyrator: a force across for each depth, along for each place across. Gains whatever goes round one way.
struct Pump {
  double stiffness;
  BentSample step(const Base& base, double) noexcept {
    return {.wrench = {-stiffness * base.depth, 0.0, 0.0, 0.0, 0.0, 0.0},
            .force = -stiffness * base.lateral[0]};
  }
};

/// What a hand puts in that moves from one base to another against a force that is held.
double work(const BaseForce& force, const Base& from, const Base& to) {
  double sum = force.depth * (to.depth - from.depth) + force.roll * (to.roll - from.roll);
  for (std::size_t d = 0; d < 2; ++d)
    sum += force.lateral[d] * (to.lateral[d] - from.lateral[d]) + force.tilt[d] * (to.tilt[d] - from.tilt[d]);
  return sum;
}

/// A device that moves a base cycle by cycle, with and without a guard.
template <class Engine>
class Device {
 public:
  Device(const Engine& engine, const GuardSettings& settings, const Base& at)
      : guard_(engine, settings), bare_(engine), at_(at), before_(at) {
    held();
  }
  /// In even cycles to a place.
  void go(const Base& to, int cycles) {
    const Base from = at_;
    for (int i = 1; i <= cycles; ++i) {
      const double share = static_cast<double>(i) / cycles;
      move(between(from, to, share, from.depth + share * (to.depth - from.depth)));
    }
  }
  void move(const Base& to) {
    guarded_ += work(output_.force, at_, to);
    alone_ += work(force_, at_, to);
    least_ = std::min(least_, guarded_);
    at_ = to;
    held();
  }
  double guarded() const { return guarded_; }
  double alone() const { return alone_; }
  double least() const { return least_; }
  const BaseOutput& output() const { return output_; }
  const Base& at() const { return at_; }

 private:
  void held() {
    output_ = guard_.step(at_, ms);
    force_ = opposing(bare_.step(at_, ms), at_.tilt);
  }
  Guard<Engine> guard_;
  Engine bare_;
  Base at_, before_;
  BaseOutput output_{};
  BaseForce force_{};
  double guarded_ = 0.0, alone_ = 0.0, least_ = 0.0;
};

FlexibleSettings in_gel(double guide_distance) {
  FlexibleSettings result = settings(0.0006921, 50e3, 0.05, 1e-3, guide_distance);
  result.small_slopes = false;
  result.beam.support.needle_length = 0.1;
  return result;
}

TEST(BaseGuardEnergy, WhatWasPutInAlongOneAxisMayComeBackAlongAnother) {
  Constant engine{.force = 2.0};
  Guard<Constant&> guard(engine, bounds(0.1, 1.0));
  BaseOutput output;
  for (int i = 0; i <= 100; ++i) output = guard.step({.depth = 0.05 * mm * i}, ms);
  const double put_in = output.energy;
  EXPECT_GT(put_in, 9e-3);
  EXPECT_NEAR(output.reserve, reserve + put_in - 2.0 * 0.1 * ms,
              1e-12);  // the travel of one cycle is to come
  engine = {.force = 0.0, .wrench = {1.0, 0.0, 0.0, 0.0, 0.0, 0.0}};
  double taken = 0.0, aside = 0.0;
  for (int i = 0; i < 200; ++i) {
    output = guard.step({.depth = 5 * mm, .lateral = {aside, 0.0}}, ms);
    taken -= output.force.lateral[0] * 0.1 * mm;
    aside += 0.1 * mm;
  }
  EXPECT_GT(taken, 0.99 * put_in);
  EXPECT_LE(taken, put_in + reserve);
}

TEST(BaseGuardEnergy, ForcesKeepTheirDirectionWhereEnergyLimitsThem) {
  Guard guard(Constant{.wrench = {-3.0, 4.0, 0.0, 0.0, -0.5, 0.0}}, bounds(0.1, 1.0));
  const BaseOutput output = guard.step({}, ms);
  EXPECT_TRUE(output.did.limited_by_energy);
  EXPECT_GT(output.force.lateral[0], 0.0);
  EXPECT_NEAR(output.force.lateral[1], -4.0 / 3.0 * output.force.lateral[0], 1e-12);
  EXPECT_NEAR(output.force.tilt[0], 0.5 / 3.0 * output.force.lateral[0], 1e-12);
}

TEST(BaseGuardEnergy, EngineThatMakesEnergyAddsNoneToTheHand) {
  for (const double kept : {1e-3, unlimited}) {
    GuardSettings settings = bounds(0.05, 1.0);
    settings.max_reserve = kept;
    Device device(Pump{500.0}, settings, {});
    for (int turn = 0; turn < 50; ++turn) {
      device.go({.lateral = {5 * mm, 0.0}}, 200);
      device.go({.depth = 5 * mm, .lateral = {5 * mm, 0.0}}, 200);
      device.go({.depth = 5 * mm}, 200);
      device.go({}, 200);
    }
    EXPECT_LT(device.alone(), -50 * 2 * 500.0 * 24e-6);
    EXPECT_GE(device.least(), -reserve * (1.0 + 1e-9));
  }
}

TEST(BaseGuardEnergy, RectangleOfDepthAndAsideReturnsNoMoreThanWasPutIn) {
  Device device(PlanarInsertion(Insertion(paper::model(), any_speed), in_gel(24 * mm)), bounds(0.05, 1.0),
                {.depth = -1 * mm});
  device.go({.depth = 30 * mm}, 1000);
  const Base home = device.at();
  Base deeper = home, aside = home, both = home;
  deeper.depth = both.depth += 15e-6;
  aside.lateral[0] = both.lateral[0] = 6 * mm;
  for (const bool across_first : {false, true})
    for (int turn = 0; turn < 60; ++turn)
      for (const Base& to : {across_first ? aside : deeper, both, across_first ? deeper : aside, home})
        device.go(to, 130);
  EXPECT_GE(device.least(), -reserve * (1.0 + 1e-9));
  EXPECT_TRUE(std::isfinite(device.guarded()));
}

/// A random motion of all axes that a needle has: wilful, each with its own bounds.
template <class Engine>
void expect_passive(const Engine& engine, std::size_t dimension, int cycles, const std::string& name) {
  for (const int delay : {0, 2}) {
    GuardSettings settings = bounds(0.1, 1.0);
    settings.max_acceleration = 10.0;
    settings.max_angular_acceleration = 100.0;
    settings.delay = delay;
    hands::WilfulHand hands[] = {{-2 * mm, 15 * mm, 0.1, 10.0, 1}, {-3 * mm, 3 * mm, 0.1, 10.0, 2},
                                 {-3 * mm, 3 * mm, 0.1, 10.0, 3},  {-0.05, 0.05, 1.0, 100.0, 4},
                                 {-0.05, 0.05, 1.0, 100.0, 5},     {-2.0, 2.0, 1.0, 100.0, 6}};
    const auto place = [&] {
      Base base{.depth = hands[0].depth(), .roll = hands[5].depth()};
      for (std::size_t d = 0; d < dimension; ++d)
        base.lateral[d] = hands[1 + d].depth(), base.tilt[d] = hands[3 + d].depth();
      return base;
    };
    std::mt19937 generator(7);
    std::vector<Base> seen(static_cast<std::size_t>(delay) + 1, place());
    Guard guard(engine, settings);
    double energy = 0.0, least = 0.0, turned = 0.0, dt = ms;
    for (int i = 0; i < cycles; ++i) {
      const Base before = place();
      const BaseOutput output = generator() % 50 ? guard.step(seen.front(), dt) : guard.miss(dt);
      ASSERT_FALSE(output.did.outside_bounds) << name << i;
      dt = ms * (0.2 + 0.8e-3 * static_cast<double>(generator() % 1001));
      for (auto& hand : hands) hand.move(dt);
      std::rotate(seen.begin(), seen.begin() + 1, seen.end());
      seen.back() = place();
      const double put = work(output.force, before, place());
      energy += put, turned += std::abs(put), least = std::min(least, energy);
    }
    EXPECT_GE(least, -reserve - 1e-12 * turned) << name << delay;
    EXPECT_GT(turned, 100 * reserve) << name << delay;  // a force was felt
  }
}

TEST(BaseGuardEnergy, RandomMotionsOfAllAxesExtractNoMoreEnergyThanTheyPutIn) {
  const Insertion axial(paper::model(), any_speed);
  expect_passive(PlanarInsertion(axial, in_gel(24 * mm)), 1, 20000, "in a plane");
  expect_passive(SpatialInsertion(axial, in_gel(24 * mm)), 2, 10000, "in space, guided");
  expect_passive(SpatialInsertion(axial, in_gel(Support::no_guide)), 2, 10000, "in space, at its hub");
  const auto in_solid = solid_tests::insertion(2e-3, solid_tests::laws_of(20.0, 0.1, 0.2), any_speed);
  expect_passive(solid::BentInSolid<2>(in_solid, in_gel(24 * mm)), 2, 5000, "in a solid");
}

TEST(BaseGuardEnergy, CondensedSolidIsGuardedAlongTheDepth) {
  const auto in_solid = solid_tests::insertion(2e-3, solid_tests::laws_of(20.0, 0.1, 0.2), any_speed);
  for (const int delay : {0, 1, 5}) {
    hands::WilfulHand hand(-3 * mm, 15 * mm, 0.3, 20.0, 7);
    hands::DelayLine depths(delay, hand.depth());
    Guard guard(in_solid, hands::bounds(delay));
    hands::TrueEnergy energy;
    for (int i = 0; i < 20000; ++i)
      energy.add(guard.step(depths(hand.depth()), no_velocity, ms).force, hand.move());
    EXPECT_GE(energy.least, -1e-5 - energy.rounding()) << delay;
    EXPECT_GT(energy.in, 0.01) << delay;
  }
}

}  // namespace base_guard_energy

}  // namespace
