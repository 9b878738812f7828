// SPDX-License-Identifier: Apache-2.0
// The guard: nothing bad in, nothing bad out. Expected forces are sums on paper over a spring of 1 kN/m.
#include "needleforce/guard.hpp"

#include <gtest/gtest.h>

#include <string>

#include "hands.hpp"

using namespace hands;

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double ms = 1e-3, mm = 1e-3;

static_assert(std::is_trivially_copyable_v<Guard<Insertion>>);
static_assert(std::is_trivially_copyable_v<Guard<Wall>>);
static_assert(std::is_trivially_copyable_v<Output>);
static_assert(noexcept(std::declval<Guard<Insertion>&>().step(0.0, 0.0, 0.0)));
static_assert(noexcept(std::declval<Guard<Insertion>&>().miss(0.0)));
static_assert(noexcept(std::declval<Guard<Insertion>&>().reset()));
static_assert(std::is_same_v<decltype(Guard(std::declval<Insertion>())), Guard<Insertion>>);

/// Tissue that holds the needle back on its way out.
struct Pull {
  Sample step(double, double, double) noexcept { return {.force = -5.0}; }
};

Guard<Wall> at_wall(const GuardSettings& settings) { return Guard(Wall{1000.0}, settings); }

TEST(Guard, DefaultSettingsPassTheEngineForceThrough) {
  Insertion bare{std::span<const Layer>(paper())};
  Guard guard(bare);
  WilfulHand hand(-3e-3, 12e-3, 0.3, 20.0, 1);
  for (int i = 0; i < 20000; ++i) {
    const Output output = guard.step(hand.depth(), no_velocity, cycle);
    ASSERT_EQ(output.force, bare.step(hand.depth(), no_velocity, cycle).force);
    ASSERT_FALSE(output.did.clamped || output.did.slewed || output.did.rejected || output.did.stale ||
                 output.did.limited_by_energy || output.did.outside_bounds);
    hand.move();
  }
}

TEST(Guard, ScalesMotionAndForceToTheDevice) {
  Guard guard = at_wall({.force_scale = 3.0, .motion_scale = 0.5});
  const Output output = guard.step(2 * mm, 0.1, ms);
  EXPECT_DOUBLE_EQ(output.sample.depth, 1 * mm);
  EXPECT_DOUBLE_EQ(output.sample.force, 1.0);
  EXPECT_DOUBLE_EQ(output.force, 3.0);
}

TEST(Guard, ClampsBothWays) {
  Guard guard = at_wall({.max_force = 2.0});
  EXPECT_DOUBLE_EQ(guard.step(1 * mm, no_velocity, ms).force, 1.0);
  const Output output = guard.step(5 * mm, no_velocity, ms);
  EXPECT_DOUBLE_EQ(output.force, 2.0);
  EXPECT_DOUBLE_EQ(output.sample.force, 5.0);
  EXPECT_TRUE(output.did.clamped);
  Guard pulled(Pull{}, {.max_force = 2.0});
  const Output pull = pulled.step(5 * mm, no_velocity, ms);
  EXPECT_DOUBLE_EQ(pull.force, -2.0);
  EXPECT_DOUBLE_EQ(pull.sample.force, -5.0);
  EXPECT_TRUE(pull.did.clamped);
}

TEST(Guard, SlewRateHoldsBothWaysAndIgnoresPauses) {
  Guard guard = at_wall({.max_slew = 100.0, .longest_cycle = 2 * ms});
  EXPECT_DOUBLE_EQ(guard.step(5 * mm, no_velocity, ms).force, 0.1);
  EXPECT_TRUE(guard.step(5 * mm, no_velocity, ms).did.slewed);
  EXPECT_DOUBLE_EQ(guard.step(5 * mm, no_velocity, 1.0).force,
                   0.4);  // a second passed: two cycles of it count
  EXPECT_DOUBLE_EQ(guard.step(-5 * mm, no_velocity, ms).force, 0.3);
}

TEST(Guard, ForceIsHeldThenFallsToZeroWithoutMeasurement) {
  Guard guard = at_wall({.max_slew = 1.0, .stale_after = 2 * ms, .fall_time = 4 * ms});
  for (int i = 0; i < 1000; ++i) guard.step(1 * mm, no_velocity, ms);
  const double expected[] = {1.0, 1.0, 0.75, 0.5, 0.25, 0.0, 0.0};  // however slow the slew
  for (int i = 0; i < 7; ++i) {
    const Output output = guard.miss(ms);
    EXPECT_NEAR(output.force, expected[i], 1e-12) << i;
    EXPECT_EQ(output.did.stale, i >= 2) << i;
    EXPECT_FALSE(output.did.rejected);
  }
  const Output back = guard.step(1 * mm, no_velocity, ms);
  EXPECT_NEAR(back.force, 1e-3, 1e-12);  // the way back is slewed
  EXPECT_TRUE(back.did.slewed);
}

TEST(Guard, DefaultForceWithoutMeasurementIsZero) {
  Guard guard = at_wall({});
  EXPECT_DOUBLE_EQ(guard.step(1 * mm, no_velocity, ms).force, 1.0);
  EXPECT_EQ(guard.miss(1e-9).force, 0.0);
  EXPECT_DOUBLE_EQ(guard.step(1 * mm, no_velocity, ms).force, 1.0);
  EXPECT_EQ(guard.step(nan, no_velocity, ms).force, 0.0);
}

TEST(Guard, NegativeZeroDtIsInvalid) {
  Guard guard = at_wall({.stale_after = -0.0, .fall_time = -0.0});
  EXPECT_EQ(guard.miss(ms).force, 0.0);
  EXPECT_DOUBLE_EQ(guard.step(1 * mm, no_velocity, ms).force, 1.0);
  EXPECT_EQ(guard.miss(ms).force, 0.0);
}

TEST(Guard, InvalidMeasurementIsTreatedAsAMissedCycle) {
  const double infinite = std::numeric_limits<double>::infinity();
  const double bad[][3] = {{nan, 0.0, ms},     {infinite, 0.0, ms},     {-infinite, 0.0, ms},
                           {1 * mm, nan, ms},  {1 * mm, infinite, ms},  {1e300, 0.0, ms},
                           {1 * mm, 0.0, nan}, {1 * mm, 0.0, infinite}, {1 * mm, 0.0, 0.0},
                           {1 * mm, 0.0, -ms}, {1 * mm, 0.0, 1e300},    {nan, nan, nan}};
  for (const auto& [depth, velocity, dt] : bad) {
    Guard guard = at_wall({.stale_after = 2 * ms, .fall_time = 4 * ms});
    guard.step(1 * mm, no_velocity, ms);
    Output output = guard.step(depth, velocity, dt);
    EXPECT_TRUE(output.did.rejected) << depth << " " << velocity << " " << dt;
    EXPECT_DOUBLE_EQ(output.force, 1.0);
    // a clock that stands does not keep the force: a cycle counts as long as the last one did
    for (int i = 0; i < 6; ++i) output = guard.step(depth, velocity, dt);
    EXPECT_EQ(output.force, 0.0) << depth << " " << velocity << " " << dt;
    EXPECT_DOUBLE_EQ(guard.step(1 * mm, no_velocity, ms).force, 1.0);
  }
}

TEST(Guard, JumpIsRejectedUntilEnoughCyclesHavePassed) {
  Guard guard = at_wall({.max_slew = 1e3, .stale_after = 1.0, .max_jump = 1 * mm});
  EXPECT_DOUBLE_EQ(guard.step(0.5 * mm, no_velocity, ms).force, 0.5);
  for (int i = 0; i < 3; ++i) {
    const Output output = guard.step(4.4 * mm, no_velocity, ms);
    EXPECT_TRUE(output.did.rejected);
    EXPECT_DOUBLE_EQ(output.force, 0.5);
  }
  const Output output = guard.step(4.4 * mm, no_velocity, ms);  // 3.9 mm in four cycles
  EXPECT_FALSE(output.did.rejected);
  EXPECT_DOUBLE_EQ(output.force, 1.5);  // slewed on the way back
}

TEST(Guard, EngineReceivesTheElapsedTimeAfterAGap) {
  Guard guard(Insertion(std::span<const Layer>(paper()), Limits{.max_speed = 0.1}), {.stale_after = 0.1});
  guard.step(1 * mm, no_velocity, ms);
  for (int i = 0; i < 9; ++i) guard.miss(ms);
  // 0.9 mm in 10 ms are 0.09 m/s, the velocity at the end is another
  const Output output = guard.step(1.9 * mm, 0.0, ms);
  EXPECT_EQ(output.sample.status, Status::ok);
  EXPECT_NEAR(output.sample.velocity, 0.09, 1e-12);
}

TEST(Guard, MissedCycleReportsNoEvents) {
  Guard guard{Insertion(std::span<const Layer>(paper()))};
  guard.step(3.2 * mm, no_velocity, ms);
  EXPECT_TRUE(guard.step(3.3 * mm, no_velocity, ms).sample.punctured);
  EXPECT_FALSE(guard.miss(ms).sample.punctured);
}

TEST(Guard, EngineRefusesVelocityThatContradictsDepth) {
  Guard guard(Insertion(std::span<const Layer>(paper()), Limits{.hold_time = 5 * ms}));
  for (int i = 0; i <= 300; ++i) guard.step(0.01 * mm * i, no_velocity, ms);
  const double force = guard.step(3.01 * mm, no_velocity, ms).force;
  for (int i = 0; i < 8; ++i) {
    const Output output = guard.step(3.02 * mm, -0.5, ms);
    EXPECT_EQ(output.sample.status, Status::outside_range);
    EXPECT_EQ(output.force, i < 5 ? force : 0.0);
  }
}

TEST(Guard, ForceStaysInRangeThroughPauseFastReinsertionAndWithdrawal) {
  const GuardSettings settings{.max_force = 0.2, .max_slew = 50.0, .longest_cycle = 2 * ms};
  Guard guard(Insertion(std::span<const Layer>(paper())), settings);
  double last = 0.0;
  const auto go = [&](double depth, double dt) {
    const Output output = guard.step(depth, no_velocity, dt);
    EXPECT_LE(std::abs(output.force), 0.2);
    EXPECT_LE(std::abs(output.force - last), 50.0 * std::min(dt, 2 * ms) + 1e-12);
    last = output.force;
    return output;
  };
  for (int i = 0; i <= 1000; ++i) go(0.02 * mm * i, ms);
  EXPECT_DOUBLE_EQ(last, 0.2);                                 // 18.6 N/m x 20 mm + 0.08 N is more
  EXPECT_EQ(go(2 * mm, 1.0).sample.status, Status::ok);        // 18 mm back during a pause
  for (int i = 0; i < 20; ++i) go(2 * mm - 0.9 * mm * i, ms);  // out past the surface at 0.9 m/s
  EXPECT_EQ(last, 0.0);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(go(-15 * mm + 0.9 * mm * i, ms).sample.status, Status::ok);
}

TEST(Guard, ResetClearsForceEnergyAndTissueMemory) {
  Insertion engine{std::span<const Layer>(paper())};
  Guard guard(engine, bounds(1)), fresh = guard;
  for (int i = 0; i < 1000; ++i) guard.step(0.01 * mm * i, no_velocity, ms);
  EXPECT_GT(guard.engine().pierced_layers(), 0u);
  guard.reset();
  EXPECT_EQ(guard.engine().pierced_layers(), 0u);
  for (int i = 0; i < 1000; ++i) {
    const Output a = guard.step(0.01 * mm * i, no_velocity, ms),
                 b = fresh.step(0.01 * mm * i, no_velocity, ms);
    ASSERT_EQ(a.force, b.force);
    ASSERT_EQ(a.reserve, b.reserve);
  }
}

TEST(Guard, GuardCanReferToAnEngineOfItsOwner) {
  Insertion engine{std::span<const Layer>(paper())};
  Guard<Insertion&> guard(engine);
  for (int i = 0; i < 1000; ++i) guard.step(0.01 * mm * i, no_velocity, ms);
  EXPECT_EQ(engine.pierced_layers(), 1u);
}

TEST(Guard, SettingOutsideItsRangeIsNamedAndGivesZeroForce) {
  for (const auto& row : GuardSettings::table)
    for (const double value : {nan, std::nextafter(row.low, -1e300), -1.0}) {
      GuardSettings settings;
      settings.*row.member = value;
      const GuardFault fault = first_fault(settings);
      ASSERT_NE(fault.reason, nullptr) << row.name;
      EXPECT_STREQ(fault.quantity, row.name);
      Guard guard = at_wall(settings);
      EXPECT_EQ(guard.step(1 * mm, 0.0, ms).force, 0.0);
      EXPECT_EQ(guard.step(1 * mm, 0.0, ms).sample.status, Status::invalid_parameter);
      EXPECT_EQ(guard.miss(ms).sample.status, Status::invalid_parameter);
    }
}

TEST(Guard, ContradictorySettingsAreRefusedWithTheReason) {
  const std::pair<GuardSettings, const char*> cases[] = {
      {{.delay = 0.5}, "whole"},
      {{.max_acceleration = 10.0}, "max_speed"},
      {{.max_speed = 1.0}, "longest_cycle"},
      {{.longest_cycle = 1e300, .max_speed = 1.0}, "further"},
      {{.longest_cycle = ms, .max_speed = 1e300}, "further"},
      {{.longest_cycle = ms, .max_speed = 1.0, .max_reserve = 1e-6}, "initial_reserve"},
      {{.longest_cycle = ms, .max_speed = 1.0, .initial_reserve = 0.0}, "max_acceleration"}};
  for (const auto& [settings, word] : cases) {
    ASSERT_FALSE(valid(settings)) << word;
    EXPECT_NE(std::string(first_fault(settings).reason).find(word), std::string::npos);
  }
  EXPECT_TRUE(valid(GuardSettings{}));
  EXPECT_TRUE(valid(bounds(max_delay)));
}

TEST(Guard, LargestBoundsKeepTheEnergyFiniteWithoutMeasurements) {
  Guard guard = at_wall({.max_force = 1e6, .longest_cycle = 1e3, .max_speed = 1e3});
  for (int k = 0; k < 100000; ++k) {
    const Output output = k % 1000 ? guard.miss(1e9) : guard.step(1 * mm, no_velocity, 1e3);
    ASSERT_TRUE(std::isfinite(output.force) && std::isfinite(output.energy) && std::isfinite(output.reserve));
  }
}

TEST(Guard, DefaultsMatchTheTable) {
  const GuardSettings defaults;
  for (const auto& row : GuardSettings::table) EXPECT_EQ(defaults.*row.member, row.initial) << row.name;
}

}  // namespace
