// SPDX-License-Identifier: Apache-2.0
// What every cutting law must keep.
#include "every_law.hpp"

namespace {

template <class L>
struct EveryCutting : ::testing::Test {};
using CuttingLaws = AsTypes<Cutting>::type;
TYPED_TEST_SUITE(EveryCutting, CuttingLaws);

constexpr double unloaded = 0.1;  // [m]: no law may still push so far behind its cut

TYPED_TEST(EveryCutting, IsFullAtTheCutAndFallsToNothing) {
  for (const TypeParam& given : across<TypeParam>()) {
    const auto law = given.prepare();
    EXPECT_DOUBLE_EQ(law.force(0.0), law.steady());
    EXPECT_GE(law.steady(), 0.0);
    EXPECT_EQ(law.force(unloaded), 0.0);
    double last = law.steady();
    for (double retreat = 1e-9; retreat < unloaded; retreat *= 1.1) {
      ASSERT_LE(law.force(retreat), last);
      ASSERT_GE(law.force(retreat), 0.0);
      last = law.force(retreat);
    }
  }
}

TYPED_TEST(EveryCutting, IsContinuous) {
  const auto law = middle<TypeParam>().prepare();
  ASSERT_GT(law.steady(), 0.0);
  // in every interval the half with the larger drop, again and again: a jump keeps its size
  for (double start = 0.0; start < unloaded; start = std::max(1e-9, 1.1 * start)) {
    double low = start, high = std::max(1e-9, 1.1 * start);
    for (int i = 0; i < 60; ++i) {
      const double half = 0.5 * (low + high);
      (law.force(low) - law.force(half) >= law.force(half) - law.force(high) ? high : low) = half;
    }
    ASSERT_LT(law.force(low) - law.force(high), 1e-9 * law.steady()) << low;
  }
}

TYPED_TEST(EveryCutting, DerivativeByDepthIsTheFiniteDifference) {
  const auto law = middle<TypeParam>().prepare();
  // deeper is less retreat; at the deepest cut it moves along
  const auto rise = [&](double retreat, double dz) {
    return (law.force(std::max(0.0, retreat - dz)) - law.force(retreat)) / dz;
  };
  EXPECT_TRUE(is_one_of(law.by_depth(0.0), rise(0.0, 1e-12)));
  for (double retreat = 1e-7; retreat < unloaded; retreat *= 1.3) {
    const double dz = 1e-7 * retreat;
    ASSERT_TRUE(is_one_of(law.by_depth(retreat), rise(retreat, dz), rise(retreat, -dz))) << retreat;
  }
}

TYPED_TEST(EveryCutting, ReturnsNoEnergyOverAClosedPath) {
  const auto law = middle<TypeParam>().prepare();
  const double scale = half_way([&](double retreat) { return -law.force(retreat); });
  // the state is the deepest cut; the path starts at one
  const auto advance = [](double deepest, double z, double dz) { return std::max(deepest, z + dz); };
  const auto force = [&](double deepest, double z) { return law.force(deepest - z); };
  EXPECT_GE(least_closed_work(scale, advance, force), -1e-4);
}

TYPED_TEST(EveryCutting, Scales) {
  const auto law = middle<TypeParam>().prepare(), large = scaled(middle<TypeParam>(), s, m).prepare();
  for (double retreat = 1e-9; retreat < unloaded; retreat *= 1.3)
    EXPECT_NEAR(large.force(s * retreat), m * s * s * law.force(retreat), 1e-9 * large.steady());
}

TEST(ConstantCutting, UnloadsOverTheStatedTravel) {
  const auto law = laws::ConstantCutting{0.08, 20e-6}.prepare();
  EXPECT_NEAR(law.force(5e-6), 0.06, 1e-15);
  EXPECT_GT(law.force(19.99e-6), 0.0);
  EXPECT_NEAR(law.force(20e-6), 0.0, 1e-15);
  EXPECT_NEAR(law.by_depth(10e-6), 0.08 / 20e-6, 1e-9);
}

}  // namespace
