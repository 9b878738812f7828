// SPDX-License-Identifier: Apache-2.0
// A guard around a needle that bends: forces along the coordinates of its base from a wrench, each within its
// limits, and what is refused.
#include "needleforce/base_guard.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "guarded_bases.hpp"

namespace {

namespace base_guard {

using namespace guarded_bases;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

static_assert(std::is_trivially_copyable_v<Guard<PlanarInsertion>>);
static_assert(std::is_trivially_copyable_v<Guard<SpatialInsertion>>);
static_assert(std::is_trivially_copyable_v<BaseOutput>);
static_assert(noexcept(std::declval<Guard<SpatialInsertion>&>().step({}, 0.0)));
static_assert(noexcept(std::declval<Guard<SpatialInsertion>&>().miss(0.0)));

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
