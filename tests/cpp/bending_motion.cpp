// SPDX-License-Identifier: Apache-2.0
// Motions of a needle that bends: out and in again, with the base aside, and input that no base should give.
#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "bending.hpp"

namespace {

using namespace bending_tests;

const double nan = std::numeric_limits<double>::quiet_NaN();

/// The paper's axial laws under a bevel.
SpatialInsertion with_axial_force(FlexibleSettings settings = guided()) {
  const Bevel bevel{.half_angle = 0.26, .friction_coefficient = 0.1, .face_share = 0.5};
  settings.beam.layers[0].tip_force = 0.0;
  return SpatialInsertion(Insertion(paper::model(), any_speed, bevel), settings);
}

TEST(BendingMotion, AxialForceIsThatOfTheInsertion) {
  SpatialInsertion bent = with_axial_force();
  Insertion straight(paper::model(), any_speed);
  for (int i = 0; i <= 400; ++i) {
    const double depth = 20e-3 * std::sin(std::numbers::pi * i / 400.0) - 1e-3;
    const BentSample sample = bent.step({.depth = depth}, 0.05);
    const Sample axial = straight.step(depth, no_velocity, 0.05);
    ASSERT_EQ(sample.status, Status::ok) << depth;
    EXPECT_NEAR(sample.force, axial.force, 1e-9);
    EXPECT_NEAR(sample.wrench[2], -axial.force, 2e-3 * std::abs(axial.force) + 1e-12);
    EXPECT_EQ(sample.axial.punctured, axial.punctured);
  }
}

TEST(BendingMotion, BevelSteersByTheCuttingForce) {
  SpatialInsertion needle = with_axial_force();
  move(needle, {.depth = -1e-3}, {.depth = 0.05}, 100);
  const BentSample sample = needle.step({.depth = 0.0501}, 1.0);
  const double ratio = 0.5 / std::tan(0.26 + std::atan(0.1));
  EXPECT_NEAR(sample.lateral, ratio * sample.axial.cutting, 1e-6);
  EXPECT_GT(sample.tip[0], 1e-5);
}

TEST(BendingMotion, ComesBackToItsDeepestPointOnItsOwnPath) {
  SpatialInsertion needle = forceless_insertion<2>(guided());
  const BentSample deepest = move(needle, {.depth = 0.0}, {.depth = 0.06}, 60);
  const auto nodes = needle.path().nodes();
  move(needle, {.depth = 0.06}, {.depth = 0.03}, 30);
  EXPECT_EQ(needle.path().nodes(), nodes);
  const BentSample again = move(needle, {.depth = 0.03}, {.depth = 0.06}, 30);
  EXPECT_NEAR(again.tip[0], deepest.tip[0], 1e-9);
  EXPECT_NEAR(again.wrench[4], deepest.wrench[4], 1e-6);
}

TEST(BendingMotion, WithdrawnTipHasNoLateralForce) {
  SpatialInsertion needle = forceless_insertion<2>(guided());
  move(needle, {.depth = 0.0}, {.depth = 0.06}, 60);
  EXPECT_NEAR(needle.step({.depth = 0.06}, 1.0).lateral, 0.2, 1e-9);
  EXPECT_EQ(needle.step({.depth = 0.0598}, 1.0).lateral, 0.0);
}

TEST(BendingMotion, SecondInsertionNearbyFollowsTheHoleAndFarAwayMakesItsOwn) {
  for (const double aside : {0.2e-3, 3e-3}) {
    SpatialInsertion needle = forceless_insertion<2>(guided());
    move(needle, {.depth = 0.0}, {.depth = 0.05}, 50);
    const double front = needle.path().front();
    move(needle, {.depth = 0.05}, {.depth = -5e-3}, 55);
    needle.step({.depth = -5e-3, .lateral = {aside, 0.0}}, 1.0);
    move(needle, {.depth = -5e-3, .lateral = {aside, 0.0}}, {.depth = 0.02, .lateral = {aside, 0.0}}, 25);
    EXPECT_NEAR(needle.path().front(), aside < 1e-3 ? front : 0.02, 1e-12);
    EXPECT_NEAR(needle.path().entry()[0], aside < 1e-3 ? 0.0 : aside, 1e-9);
  }
}

TEST(BendingMotion, NeedleThatStartsInTheTissueIsStraightAndUnloaded) {
  SpatialInsertion needle = forceless_insertion<2>(guided());
  const BentSample sample = needle.step({.depth = 0.05, .lateral = {1e-3, -2e-3}, .tilt = {0.01, 0.0}}, 1.0);
  EXPECT_EQ(sample.status, Status::ok);
  for (const double component : sample.wrench) EXPECT_NEAR(component, 0.0, 1e-9);
  EXPECT_NEAR(sample.tip[0], 1e-3 + 0.01 * 0.08, 1e-9);
  EXPECT_NEAR(sample.tip[1], -2e-3, 1e-9);
}

TEST(BendingMotion, StiffPivotTurnsTheTipAgainstTheBase) {
  FlexibleSettings settings = guided();
  settings.beam.layers[0].tip_force = 0.0;
  for (const bool pivot : {false, true}) {
    settings.beam.support.pivot_stiffness = pivot ? 1e5 : 0.0;
    settings.beam.support.rotational_compliance = pivot ? 1e3 : 0.0;
    settings.beam.layers[0].modulus = pivot ? 100.0 : 20e3;
    SpatialInsertion needle = forceless_insertion<2>(settings);
    move(needle, {.depth = 0.0}, {.depth = 0.02}, 20);
    const double x = needle.step({.depth = 0.02, .lateral = {1e-3, 0.0}}, 1.0).tip[0];
    EXPECT_EQ(x < 0.0, pivot);
  }
}

TEST(BendingMotion, HubComesDownWithTheNeedle) {
  FlexibleSettings settings = guided();
  settings.beam.support.guide_distance = Support::no_guide;
  settings.beam.support.needle_length = 0.1;
  SpatialInsertion needle = forceless_insertion<2>(settings);
  EXPECT_NEAR(needle.step({.depth = 0.0}, 1.0).unsupported, 0.1, 1e-12);
  EXPECT_NEAR(move(needle, {.depth = 0.0}, {.depth = 0.08}, 80).unsupported, 0.02, 1e-12);
  EXPECT_EQ(move(needle, {.depth = 0.08}, {.depth = 0.1}, 20).status, Status::ok);
  EXPECT_EQ(needle.step({.depth = 0.101}, 1.0).status, Status::outside_range);
}

TEST(BendingMotion, NeedleLongerThanItsGuideAllowsIsRefused) {
  FlexibleSettings settings = guided();
  settings.beam.support.needle_length = 0.1;
  SpatialInsertion needle = forceless_insertion<2>(settings);
  EXPECT_EQ(move(needle, {.depth = 0.0}, {.depth = 0.07}, 70).status, Status::ok);
  EXPECT_EQ(needle.step({.depth = 0.071}, 1.0).status, Status::outside_range);  // the hub is at the guide
  EXPECT_EQ(needle.step({.depth = -0.04}, 1.0).status, Status::outside_range);  // the tip is in it
}

TEST(BendingMotion, TiltThatMovesTheShaftFarIsRefused) {
  // the cost of a step is bounded: tissue that yields takes a solution each tenth of a millimetre across
  FlexibleSettings settings = guided();
  settings.beam.support.guide_distance = Support::no_guide;
  SpatialInsertion needle = forceless_insertion<2>(settings);
  needle.step({.depth = 0.02}, 1.0);
  EXPECT_EQ(needle.step({.depth = 0.02, .tilt = {0.5, 0.0}}, 1.0).status, Status::outside_range);
  EXPECT_EQ(needle.step({.depth = 0.02, .tilt = {0.02, 0.0}}, 1.0).status, Status::ok);
}

TEST(BendingMotion, BadInputIsRefusedAndChangesNothing) {
  SpatialInsertion needle = with_axial_force();
  move(needle, {.depth = -1e-3}, {.depth = 0.03}, 31);
  const BentSample before = needle.step({.depth = 0.03}, 1.0);
  const auto refused = [&](const Base& base, double dt, Status status) {
    const BentSample sample = needle.step(base, dt);
    EXPECT_EQ(sample.status, status);
    EXPECT_EQ(sample.force, 0.0);
    for (const double component : sample.wrench) EXPECT_EQ(component, 0.0);
  };
  refused({.depth = nan}, 1.0, Status::not_finite);
  refused({.depth = 0.03, .lateral = {nan, 0.0}}, 1.0, Status::not_finite);
  refused({.depth = 0.03, .tilt = {0.0, nan}}, 1.0, Status::not_finite);
  refused({.depth = 0.03, .roll = nan}, 1.0, Status::not_finite);
  refused({.depth = 0.03, .roll = 1.0 / 0.0}, 1.0, Status::not_finite);
  refused({.depth = 0.03}, nan, Status::not_finite);
  refused({.depth = 0.03}, 0.0, Status::outside_range);
  refused({.depth = 0.03, .roll = 7.0}, 1.0, Status::outside_range);  // more than half a turn
  refused({.depth = 0.03, .lateral = {2.0, 0.0}}, 1.0, Status::outside_range);
  refused({.depth = 0.03, .tilt = {1.5, 0.0}}, 1.0, Status::outside_range);
  refused({.depth = 0.06}, 1.0, Status::outside_range);  // beyond max_travel
  refused({.depth = 2.0}, 1.0, Status::outside_range);
  const BentSample after = needle.step({.depth = 0.03}, 1.0);
  EXPECT_EQ(after.status, Status::ok);
  EXPECT_NEAR(after.tip[0], before.tip[0], 1e-12);
  EXPECT_NEAR(after.force, before.force, 1e-12);
}

TEST(BendingMotion, RefusedStepHoldsForItsTimeAndNoLonger) {
  Limits limits = any_speed;
  limits.hold_time = 5e-3;
  SpatialInsertion needle(Insertion(forceless(), limits), guided());
  const BentSample last = move(needle, {.depth = 0.0}, {.depth = 0.05}, 50, 1e-3);
  EXPECT_EQ(needle.step({.depth = nan}, 1e-3).wrench[4], last.wrench[4]);
  EXPECT_EQ(needle.step({.depth = nan}, 5e-3).wrench[4], 0.0);
}

TEST(BendingMotion, FaultOfTheClockHoldsNothing) {
  for (const double dt : {0.0, -1.0, nan, 1.0 / 0.0})
    for (const double hold_time : {0.0, 0.5}) {
      Limits limits = any_speed;
      limits.hold_time = hold_time;
      SpatialInsertion needle(Insertion(paper::model(), limits), guided());
      insert(needle, 0.05, 50);
      const BentSample sample = needle.step({.depth = 0.05}, dt);
      EXPECT_EQ(sample.force, 0.0) << dt;
      EXPECT_EQ(sample.wrench[4], 0.0) << dt;
    }
}

TEST(BendingMotion, InvalidSettingsGiveNoForce) {
  FlexibleSettings none = guided(), steep = guided(), order = guided(), thin = guided();
  none.beam.layer_count = 0;
  steep.beam.layers[0].modulus = -1.0;
  order.beam.layer_count = 2;
  order.beam.layers[1] = order.beam.layers[0];
  thin.beam.sections.list[0].stiffness = 1e-310;  // its square is 0
  for (const FlexibleSettings& settings : {none, steep, order, thin}) {
    EXPECT_NE(fault(settings), nullptr);
    SpatialInsertion needle = forceless_insertion<2>(settings);
    EXPECT_EQ(needle.step({.depth = 0.01}, 1.0).status, Status::invalid_parameter);
  }
}

TEST(BendingMotion, WiresAndRodsInAirAndStoneStayFinite) {
  for (const double stiffness : {min_stiffness, 1e-7, 1e-4, 1.0, 1e3, max_stiffness})
    for (const double modulus : {0.0, 1.0, 1e4, 1e7}) {
      FlexibleSettings wire = settings(stiffness, modulus, 1e-3, 1e-3, 0.02);
      wire.small_slopes = false;
      SpatialInsertion needle = forceless_insertion<2>(wire);
      const BentSample sample =
          move(needle, {.depth = -1e-3}, {.depth = 0.1, .lateral = {2e-3, 0.0}, .roll = 5.0}, 101);
      double sum = sample.tip[0] + sample.tip[1] + sample.tip[2];
      for (const double component : sample.wrench) sum += component;
      EXPECT_TRUE(std::isfinite(sum)) << stiffness << " " << modulus;
      EXPECT_LE(std::hypot(sample.tip[0], sample.tip[1], sample.tip[2]), 0.13);  // no longer than the needle
      EXPECT_LE(std::hypot(sample.wrench[0], sample.wrench[1]), 2e-3 * 1e7 * 0.1);
    }
}

TEST(BendingMotion, SnapshotContinuesAsTheOriginal) {
  SpatialInsertion needle = with_axial_force();
  move(needle, {.depth = -1e-3}, {.depth = 0.03}, 31);
  SpatialInsertion copy = needle.snapshot();
  const BentSample a = move(needle, {.depth = 0.03}, {.depth = 0.05, .roll = 1.0}, 20);
  const BentSample b = move(copy, {.depth = 0.03}, {.depth = 0.05, .roll = 1.0}, 20);
  EXPECT_EQ(std::memcmp(&a.wrench, &b.wrench, sizeof a.wrench), 0);
  EXPECT_EQ(std::memcmp(&a.tip, &b.tip, sizeof a.tip), 0);
  needle.reset();
  SpatialInsertion fresh = with_axial_force();
  const BentSample c = move(needle, {.depth = -1e-3}, {.depth = 0.02}, 21);
  const BentSample d = move(fresh, {.depth = -1e-3}, {.depth = 0.02}, 21);
  EXPECT_EQ(std::memcmp(&c.tip, &d.tip, sizeof c.tip), 0);
}

/// A needle in tissue that yields and rubs, held for 20 s with normal noise of 5 um of the depth, 2 um and
/// 0.1 mrad across.
BentSample after_noise(double deviation, double known) {
  FlexibleSettings settings = guided();
  settings.beam.layers[0].tip_stiffness = 100.0;
  settings.beam.layers[0].yielding_modulus = 20e3;
  settings.beam.layers[0].yield_force = 1.0;
  settings.lengths.pressure_friction = 0.5;
  settings.lengths.presliding = 20e-6;
  PlanarInsertion needle(Insertion(paper::model(), {.depth_noise = known}), settings);
  std::mt19937_64 generator{11};
  std::normal_distribution<double> normal;
  const auto noise = [&] { return deviation * std::clamp(normal(generator), -6.0, 6.0); };
  const auto shown = [&](double depth) {
    return Base{depth + noise(), {0.1 * std::max(0.0, depth) + 0.4 * noise(), 0.0}, {20.0 * noise(), 0.0}};
  };
  for (double at = -1e-3; at < 12e-3; at += 5e-6) needle.step(shown(at), 1e-3);
  for (int i = 0; i < 20000; ++i) needle.step(shown(12e-3), 1e-3);
  deviation = 0.0;
  return needle.step(shown(12e-3), 1e-3);
}

TEST(BendingMotion, HoldKeepsItsForcesUnderNoise) {
  constexpr double known = 30e-6;  // six standard deviations
  const BentSample still = after_noise(0.0, known), noisy = after_noise(5e-6, known);
  EXPECT_NEAR(noisy.force, still.force, 18.6 * 2.0 * known);
  EXPECT_NEAR(noisy.lateral, still.lateral, 1e-3 * still.lateral);
  EXPECT_NEAR(noisy.tip[0], still.tip[0], 5e-6);
  // tissue that yields settles where it is shaken, by no more than the largest excursion across
  EXPECT_NEAR(noisy.wrench[0], still.wrench[0], 40e3 * 12e-3 * 6.0 * 2e-6);
  const BentSample unknown = after_noise(5e-6, 0.0);
  EXPECT_LT(unknown.force, 0.5 * still.force);
  EXPECT_LT(unknown.lateral, 0.95 * still.lateral);
}

}  // namespace
