// SPDX-License-Identifier: Apache-2.0
// What every cutting law must keep.
#include "walks.hpp"

namespace {

template <class L>
struct EveryCutting : ::testing::Test {};
using CuttingLaws = AsTypes<Cutting>::type;
TYPED_TEST_SUITE(EveryCutting, CuttingLaws);

constexpr double cutting_speed = 1e-3;

/// The largest force [N] on a way in.
template <class L>
double largest_cutting(const L& law) {
  Edged<L> walk(law);
  double largest = walk.force();
  for (int i = 0; i < 20000; ++i) {
    walk.step(1e-6, 1e-6 / cutting_speed);
    largest = std::max(largest, walk.force());
  }
  return largest;
}

/// The retreat [m] over which the force falls to half.
template <class L>
double cutting_travel(const L& law) {
  Edged<L> start(law);
  go(start, 3e-3, cutting_speed, 1e-6);
  const auto after = [&](double retreat) {
    Edged<L> walk = start;
    go(walk, -retreat, cutting_speed, retreat);
    return walk.force();
  };
  double low = 0.0, high = 5e-3;
  for (int i = 0; i < 40; ++i)
    (after(0.5 * (low + high)) > 0.5 * start.force() ? low : high) = 0.5 * (low + high);
  return high;
}

TYPED_TEST(EveryCutting, IsFiniteAndNeverPullsForAnyMotionAndStep) {
  std::mt19937_64 generator{2};
  for (const TypeParam& given : everywhere<TypeParam>()) {
    Edged<TypeParam> walk(given);
    for (const double travel : random_travels(2000)) {
      const double dt = random_dt(generator);
      walk.step(generator() % 5 == 0 ? 0.0 : within(travel, dt), dt);
      ASSERT_TRUE(std::isfinite(walk.force())) << travel;
      ASSERT_TRUE(std::isfinite(walk.by_depth())) << travel;
      ASSERT_GE(walk.force(), 0.0);
    }
    for (const double v : {-1e9, -1e-3, 0.0, 1e-300, 1e-6, 1e-3, 1.0, 1e9}) {
      ASSERT_TRUE(std::isfinite(given.prepare().steady(v))) << v;
      ASSERT_GE(given.prepare().steady(v), 0.0) << v;
    }
  }
}

TYPED_TEST(EveryCutting, IsZeroBehindTheCut) {
  for (const TypeParam& given : across<TypeParam>()) {
    Edged<TypeParam> walk(given);
    go(walk, 5e-3, cutting_speed, 1e-5);
    walk.step(-1e6, 1e9);  // the softest tissue springs back from afar
    EXPECT_EQ(walk.force(), 0.0);
    EXPECT_EQ(walk.by_depth(), 0.0);
  }
}

TYPED_TEST(EveryCutting, DoesNotCutAnExistingHoleAgain) {
  const TypeParam given = middle<TypeParam>();
  Edged<TypeParam> walk(given);
  go(walk, 10e-3, cutting_speed, 1e-6);
  go(walk, -2e-3, cutting_speed, 1e-6);  // a crack that runs comes to rest on the way back
  const double front = walk.cut.front;
  go(walk, -6e-3, cutting_speed, 1e-6);
  go(walk, 6e-3, cutting_speed, 1e-6);
  EXPECT_EQ(walk.cut.front, front);
}

TYPED_TEST(EveryCutting, MeanForceOverLongTravelIsTheSteadyForce) {
  const TypeParam given = middle<TypeParam>();
  // where the steady state is a swing of first order, its test is its own
  if constexpr (steps_exactly<TypeParam>)
    for (const double v : {1e-6, 1e-5, 1e-4, 1e-3, 1e-2}) {
      Edged<TypeParam> walk(given);
      const double way = 0.05, work = (go(walk, way, v, way), go(walk, way, v, way / 200000.0));
      EXPECT_NEAR(work / way, given.prepare().steady(v), 2e-2 * given.prepare().steady(v)) << v;
    }
}

TYPED_TEST(EveryCutting, IsIndependentOfTheStepUnlessDeclaredFirstOrder) {
  if constexpr (steps_exactly<TypeParam>) {
    const TypeParam given = middle<TypeParam>();
    const double unit = largest_cutting(given);
    Edged<TypeParam> walk(given);
    for (const double travel : random_travels(500)) {
      const double dt = std::max(1e-6, std::abs(travel) / cutting_speed);
      Edged<TypeParam> fine = walk;
      walk.step(travel, dt);
      for (int i = 0; i < 64; ++i) fine.step(travel / 64, dt / 64);
      ASSERT_NEAR(fine.force(), walk.force(), 1e-8 * unit) << travel;
    }
  }
}

TYPED_TEST(EveryCutting, IsContinuousInDepth) {
  const auto changes = [](int n) {
    Edged<TypeParam> walk(middle<TypeParam>());
    double largest = largest_change(walk, 4e-3, cutting_speed, n);
    largest = std::max(largest, largest_change(walk, -2e-3, cutting_speed, n));
    return std::max(largest, largest_change(walk, 4e-3, cutting_speed, n));
  };
  EXPECT_LE(changes(80000), 0.3 * changes(20000));
}

TYPED_TEST(EveryCutting, DerivativeByDepthIsThatOfTheNextStep) {
  const TypeParam given = middle<TypeParam>();
  const double unit = largest_cutting(given);
  Edged<TypeParam> walk(given);
  for (const double travel : random_travels(500)) {
    walk.step(travel, std::max(1e-9, std::abs(travel) / cutting_speed));
    const auto rise = [&](double dz) {
      Edged<TypeParam> on = walk, further = walk;
      on.step(dz, 1e-15);
      further.step(2.0 * dz, 1e-15);
      return (further.force() - on.force()) / dz;
    };
    ASSERT_TRUE(is_one_of(walk.by_depth(), unit, {rise(1e-11), rise(-1e-11)}))
        << travel << ": " << walk.by_depth() << ", not " << rise(1e-11) << " or " << rise(-1e-11);
  }
}

TYPED_TEST(EveryCutting, ClosedPathReturnsNoEnergy) {
  const double travel = cutting_travel(middle<TypeParam>());
  for (const double reach : {20.0 * travel, 2.0 * travel}) {
    Edged<TypeParam> start(middle<TypeParam>());
    ASSERT_GE(min_closed_work(start, reach, cutting_speed), -1e-3) << reach;
    go(start, 3e-3, cutting_speed, 1e-6);  // and from within the cut
    ASSERT_GE(min_closed_work(start, reach, cutting_speed), -1e-3) << reach;
  }
}

TYPED_TEST(EveryCutting, FollowsTheUnitsOfItsTable) {
  const TypeParam given = middle<TypeParam>();
  Edged<TypeParam> walk(given), large(scaled(given, s, m));
  const double unit = m * s * s * largest_cutting(given);
  for (const double travel : random_travels(500)) {
    const double dt = std::max(1e-6, std::abs(travel) / cutting_speed);
    walk.step(travel, dt);
    large.step(s * travel, dt);
    ASSERT_NEAR(large.force(), m * s * s * walk.force(), 1e-8 * unit);
    ASSERT_NEAR(large.by_depth(), m * s * walk.by_depth(), 1e-8 * std::abs(large.by_depth()));
  }
  EXPECT_NEAR(large.law.steady(s * cutting_speed), m * s * s * walk.law.steady(cutting_speed), 1e-12 * unit);
}

TEST(ConstantCutting, UnloadsOverTheStatedTravel) {
  Edged<laws::ConstantCutting> walk(laws::ConstantCutting{0.08, 20e-6});
  walk.step(1e-3, 1.0);
  EXPECT_DOUBLE_EQ(walk.force(), 0.08);
  walk.step(-5e-6, 1.0);
  EXPECT_NEAR(walk.force(), 0.06, 1e-12);
  EXPECT_NEAR(walk.by_depth(), 0.08 / 20e-6, 1e-9);
  walk.step(-14.99e-6, 1.0);
  EXPECT_GT(walk.force(), 0.0);
  walk.step(-0.02e-6, 1.0);
  EXPECT_EQ(walk.force(), 0.0);
}

}  // namespace
