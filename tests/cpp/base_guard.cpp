// SPDX-License-Identifier: Apache-2.0
// A guard around a needle that bends: forces and moments within their limits, and one account of energy for
// all axes of the base, also around engines that make energy.
#include "needleforce/base_guard.hpp"

#include <gtest/gtest.h>

#include <string>

#include "bending.hpp"
#include "hands.hpp"
#include "needleforce/solid/bent_in_solid.hpp"
#include "solid.hpp"

namespace {

namespace base_guard {

using namespace bending_tests;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double ms = 1e-3, mm = 1e-3, reserve = 1e-5;

static_assert(std::is_trivially_copyable_v<Guard<PlanarInsertion>>);
static_assert(std::is_trivially_copyable_v<Guard<SpatialInsertion>>);
static_assert(std::is_trivially_copyable_v<BaseOutput>);
static_assert(noexcept(std::declval<Guard<SpatialInsertion>&>().step({}, 0.0)));
static_assert(noexcept(std::declval<Guard<SpatialInsertion>&>().miss(0.0)));

/// Asks for the same at every place.
struct Constant {
  double force = 0.0;
  std::array<double, 6> wrench{};
  BentSample step(const Base&, double) noexcept { return {.wrench = wrench, .force = force}; }
};
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

GuardSettings bounds(double speed, double angular_speed) {
  return {.longest_cycle = ms,
          .max_speed = speed,
          .initial_reserve = reserve,
          .max_angular_speed = angular_speed};
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

TEST(BaseGuard, ForcesOfAStraightBaseAreThoseOfItsWrench) {
  const Constant engine{.force = 1.0, .wrench = {0.2, -0.3, -1.0, 0.04, 0.05, 0.06}};
  Guard guard(engine);
  const BaseOutput output = guard.step({.depth = 1 * mm}, ms);
  EXPECT_EQ(output.force.depth, 1.0);
  EXPECT_EQ(output.force.lateral, (std::array{-0.2, 0.3}));
  EXPECT_EQ(output.force.tilt, (std::array{-0.05, 0.04}));  // a slope towards x turns about y
  EXPECT_EQ(output.force.roll, -0.06);
  EXPECT_EQ(output.sample.wrench, engine.wrench);
}

/// The axes in which a wrench is given, as rows.
std::array<Vector, 3> axes_of(const std::array<double, 2>& slope) {
  const auto unit = [](Vector v) {
    const double length = std::hypot(v[0], v[1], v[2]);
    for (double& each : v) each /= length;
    return v;
  };
  const Vector t = unit({slope[0], slope[1], 1.0}), x = unit({1.0 - t[0] * t[0], -t[0] * t[1], -t[0] * t[2]});
  return {x, {t[1] * x[2] - t[2] * x[1], t[2] * x[0] - t[0] * x[2], t[0] * x[1] - t[1] * x[0]}, t};
}
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

TEST(BaseGuard, ForcesOfATiltedBaseDoTheWorkOfItsWrench) {
  const std::array<double, 2> slope{0.3, -0.2};
  const std::array<double, 6> wrench{0.2, -0.3, -1.0, 0.04, 0.05, 0.06};
  const auto axes = axes_of(slope);
  Vector force{};
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < 3; ++i) force[i] += wrench[k] * axes[k][i];
  const BaseForce found = opposing({.wrench = wrench, .force = 1.0}, slope);
  for (std::size_t d = 0; d < 2; ++d) {
    EXPECT_NEAR(found.lateral[d], -force[d], 1e-15);
    // by the turn of the axes from a little less to a little more of this slope
    auto less = slope, more = slope;
    less[d] -= 1e-6, more[d] += 1e-6;
    const auto from = axes_of(less), to = axes_of(more);
    double by_slope = 0.0;
    for (std::size_t k = 0; k < 3;
         ++k) {  // the turn about axis k is how much the next goes to the one after it
      Vector turned{};
      for (std::size_t i = 0; i < 3; ++i) turned[i] = to[(k + 1) % 3][i] - from[(k + 1) % 3][i];
      by_slope += wrench[3 + k] * dot(turned, axes[(k + 2) % 3]) / 2e-6;
    }
    EXPECT_NEAR(found.tilt[d], -by_slope, 1e-9);
  }
  EXPECT_EQ(found.roll, -0.06);
}

TEST(BaseGuard, ScalesHaveOneRatioOfWork) {
  Guard guard(Constant{.force = 1.0, .wrench = {-1.0, 0.0, 0.0, 0.0, -1.0, -1.0}},
              {.force_scale = 3.0, .motion_scale = 0.5});
  const BaseForce force = guard.step({.depth = 1 * mm}, ms).force;
  EXPECT_EQ(force.depth, 3.0);
  EXPECT_EQ(force.lateral[0], 3.0);
  EXPECT_EQ(force.tilt[0], 6.0);
  EXPECT_EQ(force.roll, 6.0);
}

TEST(BaseGuard, EachLimitHoldsTheMagnitudeOfItsForces) {
  Guard guard(Constant{.force = 5.0, .wrench = {-3.0, -4.0, 0.0, 2.0, -1.0, -2.0}},
              {.max_force = 2.0, .max_lateral_force = 1.0, .max_moment = 0.3});
  const BaseOutput output = guard.step({.depth = 1 * mm}, ms);
  EXPECT_TRUE(output.did.clamped);
  EXPECT_EQ(output.force.depth, 2.0);
  EXPECT_NEAR(output.force.lateral[0], 0.6, 1e-15);  // the direction stays
  EXPECT_NEAR(output.force.lateral[1], 0.8, 1e-15);
  EXPECT_NEAR(output.force.tilt[0], 0.1, 1e-15);
  EXPECT_NEAR(output.force.tilt[1], 0.2, 1e-15);
  EXPECT_NEAR(output.force.roll, 0.2, 1e-15);
}

TEST(BaseGuard, EachSlewRateHoldsTheMagnitudeOfTheChange) {
  Guard guard(
      Constant{.force = 1.0, .wrench = {-3.0, -4.0, 0.0, 0.0, -1.0, 0.0}},
      {.max_slew = 100.0, .longest_cycle = 2 * ms, .max_lateral_slew = 1000.0, .max_moment_slew = 10.0});
  BaseOutput output = guard.step({.depth = 1 * mm}, ms);
  EXPECT_TRUE(output.did.slewed);
  EXPECT_NEAR(output.force.depth, 0.1, 1e-15);
  EXPECT_NEAR(output.force.lateral[0], 0.6, 1e-15);
  EXPECT_NEAR(output.force.lateral[1], 0.8, 1e-15);
  EXPECT_NEAR(output.force.tilt[0], 0.01, 1e-15);
  output = guard.step({.depth = 1 * mm}, 1.0);  // a second passed: two cycles of it count
  EXPECT_NEAR(output.force.depth, 0.3, 1e-15);
  EXPECT_NEAR(output.force.lateral[1], 2.4, 1e-15);
}

TEST(BaseGuard, AllForcesFallToZeroWithoutMeasurement) {
  Guard guard(Constant{.force = 1.0, .wrench = {-2.0, 1.0, 0.0, 0.0, -3.0, -4.0}},
              {.stale_after = 2 * ms, .fall_time = 4 * ms});
  guard.step({.depth = 1 * mm}, ms);
  const double expected[] = {1.0, 1.0, 0.75, 0.5, 0.25, 0.0, 0.0};
  for (const double share : expected) {
    const BaseForce force = guard.miss(ms).force;
    EXPECT_NEAR(force.depth, share, 1e-12);
    EXPECT_NEAR(force.lateral[0], 2.0 * share, 1e-12);
    EXPECT_NEAR(force.lateral[1], -share, 1e-12);
    EXPECT_NEAR(force.tilt[0], 3.0 * share, 1e-12);
    EXPECT_NEAR(force.roll, 4.0 * share, 1e-12);
  }
}

TEST(BaseGuard, ACoordinateThatIsNoMeasurementRejectsTheWhole) {
  const double infinite = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinite, -infinite, 1e300})
    for (int which = 0; which < 6; ++which) {
      Guard guard(Constant{.force = 1.0}, {.stale_after = 1.0});
      guard.step({.depth = 1 * mm}, ms);
      Base base{.depth = 2 * mm};
      double* const all[] = {&base.depth,   &base.lateral[0], &base.lateral[1],
                             &base.tilt[0], &base.tilt[1],    &base.roll};
      *all[which] = bad;
      const BaseOutput output = guard.step(base, ms);
      EXPECT_TRUE(output.did.rejected) << which;
      EXPECT_EQ(output.force.depth, 1.0) << which;
    }
  Guard guard(Constant{.force = 1.0}, {.stale_after = 1.0, .max_jump = 1 * mm, .max_angular_jump = 0.01});
  guard.step({}, ms);
  EXPECT_TRUE(guard.step({.lateral = {0.0, 2 * mm}}, ms).did.rejected);
  EXPECT_TRUE(guard.step({.roll = 0.1}, ms).did.rejected);
  EXPECT_FALSE(guard.step({.lateral = {0.0, 2 * mm}, .roll = 0.02}, ms).did.rejected);  // in three cycles
}

TEST(BaseGuard, EngineThatReturnsNoNumberGivesNoForceAlongThatAxis) {
  for (const double bad : {nan, std::numeric_limits<double>::infinity()}) {
    Guard guard(Constant{.force = bad, .wrench = {-2.0, 0.0, 0.0, 0.0, -3.0, -bad}});
    const BaseOutput output = guard.step({.depth = 1 * mm}, ms);
    EXPECT_EQ(output.force.depth, 0.0);
    EXPECT_EQ(output.force.lateral[0], 2.0);
    EXPECT_EQ(output.force.roll, 0.0);
  }
  Guard guard(Constant{.force = 1.0, .wrench = {nan, nan, nan, nan, nan, nan}}, bounds(0.1, 1.0));
  for (int i = 0; i < 100; ++i) {
    const BaseOutput output = guard.step({.depth = 0.05 * mm * i, .tilt = {0.1, 0.0}}, ms);
    ASSERT_TRUE(std::isfinite(output.energy) && std::isfinite(output.reserve) &&
                std::isfinite(output.force.depth));
    ASSERT_EQ(output.force.lateral[0], 0.0);
  }
}

TEST(BaseGuard, WhatWasPutInAlongOneAxisMayComeBackAlongAnother) {
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

TEST(BaseGuard, ForcesKeepTheirDirectionWhereEnergyLimitsThem) {
  Guard guard(Constant{.wrench = {-3.0, 4.0, 0.0, 0.0, -0.5, 0.0}}, bounds(0.1, 1.0));
  const BaseOutput output = guard.step({}, ms);
  EXPECT_TRUE(output.did.limited_by_energy);
  EXPECT_GT(output.force.lateral[0], 0.0);
  EXPECT_NEAR(output.force.lateral[1], -4.0 / 3.0 * output.force.lateral[0], 1e-12);
  EXPECT_NEAR(output.force.tilt[0], 0.5 / 3.0 * output.force.lateral[0], 1e-12);
}

TEST(BaseGuard, EngineThatMakesEnergyAddsNoneToTheHand) {
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

TEST(BaseGuard, RectangleOfDepthAndAsideReturnsNoMoreThanWasPutIn) {
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

TEST(BaseGuard, RandomMotionsOfAllAxesExtractNoMoreEnergyThanTheyPutIn) {
  const Insertion axial(paper::model(), any_speed);
  expect_passive(PlanarInsertion(axial, in_gel(24 * mm)), 1, 20000, "in a plane");
  expect_passive(SpatialInsertion(axial, in_gel(24 * mm)), 2, 10000, "in space, guided");
  expect_passive(SpatialInsertion(axial, in_gel(Support::no_guide)), 2, 10000, "in space, at its hub");
  const auto in_solid = solid_tests::insertion(2e-3, solid_tests::laws_of(20.0, 0.1, 0.2), any_speed);
  expect_passive(solid::BentInSolid<2>(in_solid, in_gel(24 * mm)), 2, 5000, "in a solid");
}

TEST(BaseGuard, CondensedSolidIsGuardedAlongTheDepth) {
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

TEST(BaseGuard, BeyondTheBoundsOfAnyAxisIsReported) {
  Base base;
  double* const all[] = {&base.depth,   &base.lateral[0], &base.lateral[1],
                         &base.tilt[0], &base.tilt[1],    &base.roll};
  for (int which = 0; which < 6; ++which) {
    Guard guard(Constant{}, bounds(0.1, 1.0));
    base = {};
    guard.step(base, ms);
    *all[which] = which < 3 ? 0.09 * mm : 0.9e-3;
    EXPECT_FALSE(guard.step(base, ms).did.outside_bounds) << which;
    *all[which] += which < 3 ? 0.11 * mm : 1.1e-3;
    EXPECT_TRUE(guard.step(base, ms).did.outside_bounds) << which;
  }
}

TEST(BaseGuard, SettingsThatDoNotGoTogetherAreRefusedWithTheReason) {
  const auto said = [](const GuardSettings& settings, std::size_t axes) {
    const GuardFault fault = first_fault(settings, axes);
    return std::string(fault.reason ? fault.reason : "");
  };
  const auto has = [](const std::string& text, const char* word) { return text.find(word) < text.size(); };
  GuardSettings speed = bounds(0.1, unlimited);
  EXPECT_EQ(said(speed, axes_of_a_depth), "");
  EXPECT_TRUE(has(said(speed, axes_of_a_base), "max_angular_speed"));
  EXPECT_EQ(said(bounds(0.1, 1.0), axes_of_a_base), "");
  EXPECT_TRUE(has(said(bounds(0.1, 1.0), axes_of_a_depth), "needle that bends"));
  EXPECT_TRUE(has(said({.max_angular_speed = 1.0}, axes_of_a_base), "needs max_speed"));
  EXPECT_TRUE(has(said({.max_angular_acceleration = 1.0}, axes_of_a_base), "needs max_angular_speed"));
  EXPECT_TRUE(has(said(bounds(0.1, 1e300), axes_of_a_base), "further"));
  Guard guard(Constant{.force = 1.0}, speed);
  EXPECT_EQ(guard.step({}, ms).force.depth, 0.0);
  EXPECT_EQ(guard.miss(ms).sample.status, Status::invalid_parameter);
}

TEST(BaseGuard, RecorderKeepsWhatWasGivenAndWhatCameOut) {
  FlightRecorder<4, BaseCycle> recorder;
  Guard guard(Constant{.force = 1.0, .wrench = {-2.0, -3.0, 0.0, 5.0, -4.0, -6.0}}, {.max_force = 0.5});
  for (int i = 0; i < 6; ++i) {
    const Base base{.depth = i * mm, .lateral = {nan, 2.0}, .tilt = {3.0, 4.0}, .roll = 5.0};
    recorder.write(base, ms, guard.step({.depth = i * mm}, ms));
  }
  BaseCycle room[8];
  const auto cycles = recorder.read(room);
  ASSERT_EQ(cycles.size(), 4u);
  const BaseCycle& last = cycles.back();
  EXPECT_EQ(last.number, 5u);
  EXPECT_EQ(last.base.depth, 5 * mm);
  EXPECT_TRUE(std::isnan(last.base.lateral[0]));
  EXPECT_EQ(last.base.roll, 5.0);
  EXPECT_EQ(last.sample_force, 1.0);
  EXPECT_EQ(last.force.depth, 0.5);
  EXPECT_EQ(last.force.lateral, (std::array{2.0, 3.0}));
  EXPECT_EQ(last.force.tilt, (std::array{4.0, 5.0}));
  EXPECT_EQ(last.force.roll, 6.0);
  EXPECT_TRUE(last.did.clamped);
}

}  // namespace base_guard

}  // namespace
