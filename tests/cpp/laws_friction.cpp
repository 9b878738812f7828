// SPDX-License-Identifier: Apache-2.0
// What every friction law must keep.
#include "every_model.hpp"
#include "walks.hpp"

namespace {

template <class L>
struct EveryFriction : ::testing::Test {};
using FrictionLaws = AsTypes<Friction>::type;
TYPED_TEST_SUITE(EveryFriction, FrictionLaws);

constexpr double speed = 1e-3;

/// The force [N] at the end of a long way in: what "small" is small against.
template <class L>
double sliding(const L& law) {
  Shafted<L> walk(law);
  go(walk, 0.1, speed, 1e-4);
  return std::abs(walk.force());
}

/// The travel [m] over which the force makes half its way to sliding, after a reversal.
template <class L>
double elastic_travel(const L& law) {
  Shafted<L> start(law);
  go(start, 0.02, speed, 1e-4);
  const auto after = [&](double travel) {
    Shafted<L> walk = start;
    go(walk, -travel, speed, travel / 20.0);
    return walk.force();
  };
  const double half = 0.5 * (start.force() + after(5e-3));
  double low = 0.0, high = 5e-3;
  for (int i = 0; i < 40; ++i) (after(0.5 * (low + high)) > half ? low : high) = 0.5 * (low + high);
  return high;
}

TYPED_TEST(EveryFriction, IsFiniteForAnyMotionAndStep) {
  std::mt19937_64 generator{2};
  for (const TypeParam& given : everywhere<TypeParam>()) {
    Shafted<TypeParam> walk(given);
    for (const double travel : random_travels(2000)) {
      const double velocity = generator() % 4 == 0 ? 0.0 : std::copysign(random_dt(generator) * 1e-3, travel);
      const double dt = random_dt(generator);
      walk.step(generator() % 5 == 0 ? 0.0 : within(travel, dt), velocity, dt);
      ASSERT_TRUE(std::isfinite(walk.force())) << travel;
      ASSERT_TRUE(std::isfinite(walk.by_depth())) << travel;
      ASSERT_TRUE(std::isfinite(walk.by_velocity())) << travel;
    }
  }
}

TYPED_TEST(EveryFriction, IsFiniteAtAnyDepthAboveZero) {
  for (const TypeParam& given : everywhere<TypeParam>())
    for (double depth = std::numeric_limits<double>::denorm_min(); depth < 1e-6; depth *= 1e3) {
      Shafted<TypeParam> walk(given);
      walk.extent.puncture = 0.0;  // the surface stays at 0
      walk.step(-walk.tip.depth, 1.0);
      walk.step(depth, 1e-3);
      ASSERT_EQ(walk.tip.depth, depth);
      ASSERT_TRUE(std::isfinite(walk.force())) << depth;
      ASSERT_TRUE(std::isfinite(walk.by_depth())) << depth;
      ASSERT_TRUE(std::isfinite(walk.by_velocity())) << depth;
    }
}

TYPED_TEST(EveryFriction, IsZeroWithoutEmbeddedLength) {
  for (const TypeParam& given : across<TypeParam>()) {
    Shafted<TypeParam> walk(given);
    for (const double travel : random_travels(200)) {
      walk.step(travel, 1e-2);
      Shafted<TypeParam> outside = walk;
      // far above the layer, with time for the surface to come to rest
      for (int i = 0; i < 5; ++i) outside.step(-(outside.tip.depth + 0.3) / 2.0, 1e6);
      ASSERT_EQ(outside.force(), 0.0);
      ASSERT_EQ(outside.by_depth(), 0.0);
      ASSERT_EQ(outside.by_velocity(), 0.0);
    }
  }
}

TYPED_TEST(EveryFriction, SlidesAgainstTheMotion) {
  const TypeParam given = middle<TypeParam>();
  for (const double length : {0.05, 0.1, 0.2}) {
    Shafted<TypeParam> walk(given);
    go(walk, length, speed, 1e-5);
    EXPECT_GT(walk.force(), 0.0);
    go(walk, -0.3 * length, speed, 1e-5);
    EXPECT_LT(walk.force(), 0.0);
    if constexpr (SlidesSteadily<typename TypeParam::Prepared>) {
      const double embedded = walk.tip.depth - walk.law.surface(0.0, walk.extent.puncture);
      EXPECT_NEAR(walk.force(), walk.law.sliding(embedded, -speed), 1e-9 * sliding(given));
    }
  }
}

TYPED_TEST(EveryFriction, SteadySlidingStartsBetweenSurfaceAndPuncture) {
  if constexpr (SlidesSteadily<typename TypeParam::Prepared>)
    for (const TypeParam& law : across<TypeParam>()) {
      EXPECT_GE(law.prepare().surface(1e-3, 4e-3), 1e-3);
      EXPECT_LE(law.prepare().surface(1e-3, 4e-3), 4e-3);
      EXPECT_EQ(law.prepare().sliding(0.0, speed), 0.0);
    }
}

/// The difference of the forces after one step and after n.
template <class L>
double disagreement(const Shafted<L>& start, double travel, double dt, int n) {
  Shafted<L> coarse = start, fine = start;
  coarse.step(travel, dt);
  for (int i = 0; i < n; ++i) fine.step(travel / n, travel / dt, dt / n);
  return std::abs(coarse.force() - fine.force());
}

TYPED_TEST(EveryFriction, IsIndependentOfTheStepUnlessDeclaredFirstOrder) {
  const TypeParam given = middle<TypeParam>();
  const double unit = sliding(given);
  Shafted<TypeParam> walk(given);
  for (const double travel : random_travels(500)) {
    const double dt = std::max(1e-6, std::abs(travel) / speed);
    if constexpr (steps_exactly<TypeParam>) {
      ASSERT_LT(disagreement(walk, travel, dt, 64), 1e-10 * unit) << travel;
    }
    walk.step(travel, dt);
  }
}

TYPED_TEST(EveryFriction, ConvergesWithTheStep) {
  if constexpr (!steps_exactly<TypeParam>) {
    const auto end = [](int n) {
      Shafted<TypeParam> walk(middle<TypeParam>());
      go(walk, 4e-3, speed, 4e-3 / n);
      go(walk, -1e-3, speed, 1e-3 / n);
      return walk.force();
    };
    const double first = end(200) - end(400), second = end(400) - end(800), third = end(800) - end(1600);
    if (std::abs(first) < 1e-12 * std::abs(end(200))) return;  // where it slides, the step does not matter
    EXPECT_NEAR(first / second, 2.0, 0.1);
    EXPECT_NEAR(second / third, 2.0, 0.05);
  }
}

TYPED_TEST(EveryFriction, IsContinuousInDepthUnlessItBreaksLoose) {
  constexpr bool jumps = requires { TypeParam::breaks_loose; };
  const auto changes = [](int n) {
    Shafted<TypeParam> walk(usual<TypeParam>());
    double largest = largest_change(walk, 4e-3, speed, n);
    largest = std::max(largest, largest_change(walk, -2e-3, speed, n));
    return std::max(largest, largest_change(walk, 4e-3, speed, n));
  };
  if (jumps)
    EXPECT_GT(changes(320000), 0.9 * changes(80000));
  else
    EXPECT_LT(changes(320000), 0.3 * changes(80000));
}

TYPED_TEST(EveryFriction, DerivativesAreThoseOfTheNextStep) {
  const TypeParam given = middle<TypeParam>();
  const double unit = sliding(given);
  Shafted<TypeParam> walk(given);
  for (const double travel : random_travels(500)) {
    walk.step(travel, std::max(1e-9, std::abs(travel) / speed));
    // what follows the step before has caught up
    for (int i = 0; i < 20; ++i) walk.step(std::copysign(1e-8, travel), walk.velocity, 1e-5);
    const auto rise = [&](double dz) {
      Shafted<TypeParam> on = walk, further = walk;
      on.step(dz, walk.velocity, 1e-15);
      further.step(2.0 * dz, walk.velocity, 1e-15);
      return (further.force() - on.force()) / dz;
    };
    // the longer step takes an element to its limit where that has just moved
    ASSERT_TRUE(is_one_of(walk.by_depth(), unit, {rise(1e-12), rise(-1e-12), rise(1e-9), rise(-1e-9)}))
        << travel << ": " << walk.by_depth() << ", not " << rise(1e-12) << " or " << rise(-1e-12);
    const auto faster = [&](double dz) {
      Shafted<TypeParam> more = walk, less = walk;
      more.step(dz, walk.velocity * 1.0001, 1e-15);
      less.step(dz, walk.velocity * 0.9999, 1e-15);
      return (more.force() - less.force()) / (2e-4 * walk.velocity);
    };
    // a limit that follows the velocity shows once the element slips, bristles before they move
    ASSERT_TRUE(is_one_of(walk.by_velocity(), unit, {faster(1e-14), faster(std::copysign(1e-7, travel))}))
        << travel << ": " << walk.by_velocity() << ", not " << faster(std::copysign(1e-7, travel));
  }
}

TYPED_TEST(EveryFriction, ClosedPathReturnsNoEnergyUnlessDeclared) {
  if constexpr (is_passive<TypeParam>) {
    const TypeParam given = middle<TypeParam>();
    const double travel = elastic_travel(given);
    for (const double reach : {20.0 * travel, 2.0 * travel}) {
      Shafted<TypeParam> start(given);
      start.step(0.0, 1e6);  // a dimple that recovers has come to rest
      ASSERT_GE(min_closed_work(start, reach, speed), -1e-3) << reach;
    }
  }
}

TYPED_TEST(EveryFriction, FollowsTheUnitsOfItsTable) {
  const TypeParam given = middle<TypeParam>();
  Shafted<TypeParam> walk(given), large(scaled(given, s, m), s * 3e-3, m * s * s * 0.2);
  const double unit = m * s * s * sliding(given);
  for (const double travel : random_travels(500)) {
    const double dt = std::max(1e-6, std::abs(travel) / speed);
    walk.step(travel, dt);
    large.step(s * travel, dt);
    ASSERT_NEAR(large.force(), m * s * s * walk.force(), 1e-9 * unit);
    ASSERT_NEAR(large.by_depth(), m * s * walk.by_depth(), 1e-7 * std::abs(large.by_depth()) + 1e-9 * unit);
  }
}

}  // namespace
