// SPDX-License-Identifier: Apache-2.0
// What every stiffness law must keep.
#include "every_law.hpp"

namespace {

template <class L>
struct EveryStiffness : ::testing::Test {};
using StiffnessLaws = AsTypes<Stiffness>::type;
TYPED_TEST_SUITE(EveryStiffness, StiffnessLaws);

TYPED_TEST(EveryStiffness, StartsAtZeroAndRisesConvexly) {
  const auto law = middle<TypeParam>().prepare();
  EXPECT_EQ(law.force(0.0), 0.0);
  for (double h = 1e-5; h < 0.1; h *= 1.5) {
    EXPECT_GT(law.force(1.5 * h), law.force(h));
    EXPECT_GE(law.slope(1.5 * h), law.slope(h));
  }
}

TYPED_TEST(EveryStiffness, SlopeEnergyAndInverseBelongToTheForce) {
  const auto law = middle<TypeParam>().prepare();
  EXPECT_EQ(law.energy(0.0), 0.0);
  for (double h = 1e-5; h < 0.1; h *= 1.7) {
    const double step = 1e-6 * h;
    EXPECT_NEAR((law.force(h + step) - law.force(h - step)) / (2 * step), law.slope(h), 1e-6 * law.slope(h));
    EXPECT_NEAR((law.energy(h + step) - law.energy(h - step)) / (2 * step), law.force(h),
                1e-6 * law.force(h));
    EXPECT_NEAR(law.indentation(law.force(h)), h, 1e-12 * h);
  }
}

TYPED_TEST(EveryStiffness, IsProportionalToItsModulusAndToLengthsSquared) {
  const auto law = middle<TypeParam>().prepare(), stiff = scaled(middle<TypeParam>(), 1.0, m).prepare();
  const auto large = scaled(middle<TypeParam>(), s, m).prepare();
  for (double h = 1e-5; h < 0.1; h *= 1.7) {
    EXPECT_NEAR(stiff.force(h), m * law.force(h), 1e-12 * stiff.force(h));
    EXPECT_NEAR(large.force(s * h), m * s * s * law.force(h), 1e-12 * large.force(s * h));
    EXPECT_NEAR(large.energy(s * h), m * s * s * s * law.energy(h), 1e-12 * large.energy(s * h));
  }
}

TEST(ConeCylinder, NeverExceedsTheConeAndEqualsItBeforeSaturation) {
  const double angle = 15.0 * tips::degree;
  const auto cone = laws::Cone{1e5, angle}.prepare();
  const auto shank = laws::ConeCylinder{1e5, angle, 0.35e-3}.prepare();
  for (double h = 0.0; h < 8e-3; h += 1e-5) {
    if (h <= shank.saturation)
      EXPECT_DOUBLE_EQ(shank.force(h), cone.force(h));
    else
      EXPECT_LT(shank.force(h), cone.force(h));
  }
  const auto wide = laws::ConeCylinder{1e5, angle, 0.1}.prepare();
  EXPECT_DOUBLE_EQ(wide.force(8e-3), cone.force(8e-3));
}

}  // namespace
