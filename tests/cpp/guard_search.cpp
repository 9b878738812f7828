// SPDX-License-Identifier: Apache-2.0
// The guard's promise for any clocks, measurements and settings: a search for a sequence that breaks it, and
// those that once did. benchmarks/guard_search.cpp searches for longer.
#include "guard_search.hpp"

#include <gtest/gtest.h>

#include "hands.hpp"

using namespace guard_search;

namespace {

TEST(GuardSearch, NoSequenceGetsMoreThanIsPromised) {
  for (const Kind& kind : kinds) {
    const auto found = search(kind, 200000, 7);
    EXPECT_GE(found.cycles, 200000) << kind.name;
    EXPECT_EQ(found.broken, 0) << kind.name << ": " << found.worst_energy << " J";
  }
}

TEST(GuardSearch, NoSequenceOfAllAxesGetsMoreThanIsPromised) {
  for (const Kind& kind : kinds) {
    const auto found = search<axes_of_a_base>(kind, 200000, 7);
    EXPECT_GE(found.cycles, 200000) << kind.name;
    EXPECT_EQ(found.broken, 0) << kind.name << ": " << found.worst_energy << " J";
  }
}

TEST(GuardSearch, DelayThatIsNotStatedIsFound) {
  for (const bool acceleration : {false, true}) {
    const Kind planted{"planted", acceleration, false, false, 1};
    EXPECT_GT(search(planted, 200000, 7).broken, 0) << acceleration;
    EXPECT_GT(search<axes_of_a_base>(planted, 200000, 7).broken, 0) << acceleration;
  }
}

/// Cycles of up to a millisecond, and no energy lent.
GuardSettings nothing_lent(double delay) {
  return {.stale_after = 1.0,
          .longest_cycle = hands::cycle,
          .max_speed = 0.3,
          .max_acceleration = 20.0,
          .delay = delay,
          .initial_reserve = 0.0};
}

TEST(GuardSearch, TravelOverAnUntimedCycleIsNoSpeed) {
  // once divided by the length of the cycle before, a microsecond: 10 m/s inwards, which cannot be reversed
  for (const double failed : {0.0, -hands::cycle, not_a_number, unlimited}) {
    Wish wish{20.0};
    Guard<Wish&> guard(wish, nothing_lent(0.0));
    guard.step(0.0, no_velocity, hands::cycle);
    guard.step(0.0, no_velocity, 1e-6);
    EXPECT_EQ(guard.step(1e-5, no_velocity, failed).force, 0.0);
    EXPECT_EQ(guard.step(2e-5, no_velocity, 1e-6).force, 0.0);
  }
}

TEST(GuardSearch, TravelOverACycleReportedTooShortIsNoSpeed) {
  for (const double reported : {1e-300, 1e-12, 1e-6}) {
    Wish wish{20.0};
    Guard<Wish&> guard(wish, nothing_lent(0.0));
    guard.step(0.0, no_velocity, hands::cycle);
    guard.step(0.0, no_velocity, hands::cycle);
    EXPECT_EQ(guard.step(1e-5, no_velocity, reported).force, 0.0) << reported;
  }
}

TEST(GuardSearch, SpeedThatContradictsTheOneBeforeIsNotReliedUpon) {
  Wish wish{20.0};
  Guard<Wish&> guard(wish, nothing_lent(0.0));
  for (int i = 0; i < 3; ++i) guard.step(0.0, no_velocity, hands::cycle);
  const Output contradicted =
      guard.step(2e-4, no_velocity, hands::cycle);  // from rest to 0.2 m/s, 10 times too fast
  EXPECT_TRUE(contradicted.did.outside_bounds);
  EXPECT_EQ(contradicted.force, 0.0);
  EXPECT_EQ(guard.step(4e-4, no_velocity, hands::cycle).force, 20.0);  // confirmed
}

TEST(GuardSearch, AccountOverdrawnBeyondTheBoundsGivesNoForceUntilReset) {
  Wish wish{20.0};
  Guard<Wish&> guard(wish, nothing_lent(0.0));
  double depth = 0.0;
  const auto go = [&](double travel) { return guard.step(depth += travel, no_velocity, hands::cycle); };
  for (int i = 0; i < 4; ++i) go(1e-4);
  EXPECT_EQ(go(1e-4).force, 20.0);
  EXPECT_LT(go(-0.01).reserve, -0.1);  // 0.2 J taken out by a jump
  // inward motion once earned a force again, and the next jump took another 0.2 J
  for (int i = 0; i < 50; ++i) EXPECT_EQ(go(1e-4).force, 0.0);
  guard.reset();
  for (int i = 0; i < 4; ++i) go(1e-4);
  EXPECT_EQ(go(1e-4).force, 20.0);
}

TEST(GuardSearch, TravelOfAPauseIsNotCountedAsThatOfCyclesBefore) {
  // 50 mm back against 2 N within a pause, and a measurement that is late by a cycle but not by the pause
  GuardSettings settings = nothing_lent(1.0);
  settings.initial_reserve = 0.01;
  Wish wish{0.0};
  Guard<Wish&> guard(wish, settings);
  for (int i = 0; i < 5; ++i) guard.step(0.0, no_velocity, hands::cycle);
  wish.force = 2.0;
  EXPECT_EQ(guard.step(0.0, no_velocity, hands::cycle).force, 2.0);
  wish.force = 0.0;
  guard.step(-0.05, no_velocity, 0.2);  // paid as of the cycle before, which had no force
  EXPECT_LT(guard.step(-0.05, no_velocity, hands::cycle).reserve, 0.01 - 0.09);
}

TEST(GuardSearch, NoForceBeforeTheFirstDepthThatCounts) {
  GuardSettings settings = nothing_lent(4.0);
  settings.initial_reserve = 0.01;
  Wish wish{2.0};
  Guard<Wish&> guard(wish, settings);
  guard.miss(hands::cycle);
  EXPECT_EQ(guard.step(0.0, no_velocity, 0.2).force, 0.0);  // after a pause a depth is of any moment in it
}

TEST(GuardSearch, ClockThatStopsAfterAShortCycleDoesNotKeepTheForce) {
  Wish wish{2.0};
  Guard<Wish&> guard(
      wish, {.stale_after = 5 * hands::cycle, .fall_time = 5 * hands::cycle, .longest_cycle = hands::cycle});
  for (int i = 0; i < 3; ++i) guard.step(0.0, no_velocity, hands::cycle);
  EXPECT_EQ(guard.step(0.0, no_velocity, 1e-12).force, 2.0);
  double force = 2.0;
  for (int i = 0; i < 11; ++i) force = guard.miss(not_a_number).force;
  EXPECT_EQ(force, 0.0);  // once held for 5e9 cycles
}

}  // namespace
