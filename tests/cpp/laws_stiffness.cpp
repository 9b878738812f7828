// SPDX-License-Identifier: Apache-2.0
// What every stiffness law must keep.
#include "every_law.hpp"

namespace {

template <class L>
struct EveryStiffness : ::testing::Test {};
using StiffnessLaws = AsTypes<Stiffness>::type;
TYPED_TEST_SUITE(EveryStiffness, StiffnessLaws);

TYPED_TEST(EveryStiffness, StartsAtZeroAndRisesConvexly) {
  for (const TypeParam& given : cases<TypeParam>()) {
    const auto law = given.prepare();
    EXPECT_EQ(law.force(0.0), 0.0);
    EXPECT_GT(law.reach(), 0.0);
    // across the end of its formula too; a straight line's slope may round, a table's is an interpolant's
    const double straight = accuracy_of<TypeParam>() > 1e-12 ? 1e-6 : 1e-14;
    for (double h = 1e-7; h < 1.0; h *= 1.5) {
      ASSERT_TRUE(std::isfinite(law.force(h)) && std::isfinite(law.energy(h))) << h;
      ASSERT_GT(law.force(1.5 * h), law.force(h)) << h;
      ASSERT_GE(law.slope(1.5 * h), law.slope(h) * (1.0 - straight)) << h;
    }
  }
}

TYPED_TEST(EveryStiffness, SlopeEnergyAndInverseMatchTheForce) {
  for (const TypeParam& each : middles<TypeParam>()) {
    const auto law = each.prepare();
    EXPECT_EQ(law.energy(0.0), 0.0);
    for (double h = 1e-5; h < 0.1; h *= 1.7) {
      const double step = 1e-6 * h;
      EXPECT_NEAR((law.force(h + step) - law.force(h - step)) / (2 * step), law.slope(h),
                  1e-6 * law.slope(h));
      EXPECT_NEAR((law.energy(h + step) - law.energy(h - step)) / (2 * step), law.force(h),
                  1e-6 * law.force(h));
      EXPECT_NEAR(law.indentation(law.force(h)), h, 1e-12 * h);
    }
  }
}

TYPED_TEST(EveryStiffness, ContinuesLinearlyBeyondItsReach) {
  for (const TypeParam& given : cases<TypeParam>()) {
    const auto law = given.prepare();
    const double end = law.reach();
    if (!(end < 1.0)) continue;
    // relative to the end, so that the difference is that of the line and not of rounding
    const double slope = law.slope(end);
    for (const double beyond : {0.01 * end, end, 10.0 * end}) {
      EXPECT_NEAR(law.force(end + beyond), law.force(end) + slope * beyond, 1e-12 * law.force(end + beyond));
      const double energy = law.energy(end) + beyond * (law.force(end) + 0.5 * slope * beyond);
      EXPECT_NEAR(law.energy(end + beyond), energy, 1e-12 * energy);
      EXPECT_NEAR(law.indentation(law.force(end + beyond)), end + beyond, 1e-12 * (end + beyond));
    }
  }
}

TYPED_TEST(EveryStiffness, FollowsTheUnitsOfItsTable) {
  for (const TypeParam& each : middles<TypeParam>()) {
    const auto law = each.prepare(), stiff = scaled(each, 1.0, m).prepare();
    const auto large = scaled(each, s, m).prepare();
    const double keeps = accuracy_of<TypeParam>();
    for (double h = 1e-5; h < 0.1; h *= 1.7) {
      EXPECT_NEAR(stiff.force(h), m * law.force(h), keeps * stiff.force(h));
      EXPECT_NEAR(large.force(s * h), m * s * s * law.force(h), keeps * large.force(s * h));
      EXPECT_NEAR(large.energy(s * h), m * s * s * s * law.energy(h), keeps * large.energy(s * h));
    }
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

TEST(TipContact, HasTheStatedAccuracyForEveryTip) {
  for (const laws::TipContact& law : middles<laws::TipContact>()) {
    const auto table = law.prepare();
    std::visit(
        [&](const auto& tip) {
          const double limit = saturation_radius(tip, law.radius);
          for (double x = 1e-3; x < 1.5; x *= 1.02) {
            const double h = x * std::pow(table.table.last_root(), 2);
            const Reach exact = reach_at_depth(tip, h, limit);
            EXPECT_NEAR(table.force(h), law.reduced_modulus * exact.force,
                        laws::TipContact::accuracy * law.reduced_modulus * table.table.last_force());
            // dF/dh = 2 E_r a, whatever the tip
            EXPECT_NEAR(table.slope(h), 2.0 * law.reduced_modulus * exact.contact_radius,
                        1e-6 * law.reduced_modulus * table.table.last_slope());
          }
        },
        law.tip);
  }
}

TEST(TipContact, HasLowerAccuracyForAProfileWithManyKnots) {
  tips::Profile profile;
  profile.count = 32;
  for (int i = 0; i < 32; ++i) {
    profile.radius[i] = 0.35e-3 * i / 31;
    profile.rise[i] = 1.3e-3 * std::pow(i / 31.0, 1.5);
  }
  const laws::TipContact law{1e5, 0.35e-3, profile};
  const auto table = law.prepare();
  for (double h = 1e-5; h < 5e-3; h *= 1.05) {
    const double exact = 1e5 * reach_at_depth(profile, h, 0.35e-3).force;
    EXPECT_NEAR(table.force(h), exact, 2e-6 * 1e5 * table.table.last_force()) << h;
  }
}

TEST(TipContact, WithAConeEqualsConeCylinder) {
  const auto table = laws::TipContact{1e5, 0.35e-3, tips::Cone{15.0 * tips::degree}}.prepare();
  const auto closed = laws::ConeCylinder{1e5, 15.0 * tips::degree, 0.35e-3}.prepare();
  for (double h = 1e-4; h < 8e-3; h *= 1.1) {
    EXPECT_NEAR(table.force(h), closed.force(h), 1e-10 * closed.force(h));
    EXPECT_NEAR(table.energy(h), closed.energy(h), 1e-10 * closed.energy(h));
  }
}

TEST(TipContact, RefusesAnImpossibleTip) {
  Model model{laws::TipContact{1e5, 0.35e-3, tips::TangentOgive{1e-3, 0.5e-3}}, laws::PunctureDepth{3e-3},
              laws::Coulomb{18.6, 20e-6, 0.0}, laws::ConstantCutting{0.08, 20e-6}};
  EXPECT_FALSE(valid(model));
  std::get<laws::TipContact>(model.stiffness).tip = tips::TangentOgive{1e-3, 2e-3};
  EXPECT_TRUE(valid(model));
}

TEST(PowerLaw, WithExponentTwoEqualsTheConeAndScalesWithLength) {
  const auto cone = laws::Cone{116e3, 15.0 * tips::degree}.prepare();
  const auto square = laws::PowerLaw{cone.force(1e-3), 2.0, 1e-3}.prepare();
  const auto paraboloid = laws::PowerLaw{0.1, 1.5, 1e-3}.prepare();
  for (double h = 1e-5; h < 8e-3; h *= 1.3) {
    EXPECT_NEAR(square.force(h), cone.force(h), 1e-13 * cone.force(h));
    EXPECT_NEAR(square.energy(h), cone.energy(h), 1e-13 * cone.energy(h));
    EXPECT_NEAR(paraboloid.force(4.0 * h), 8.0 * paraboloid.force(h), 1e-12 * paraboloid.force(4.0 * h));
  }
}

TEST(Polynomial, IsLinearPlusACone) {
  const auto line = laws::Polynomial{50.0, 0.0}.prepare();
  EXPECT_DOUBLE_EQ(line.force(2e-3), 0.1);
  EXPECT_DOUBLE_EQ(line.energy(2e-3), 1e-4);
  EXPECT_DOUBLE_EQ(line.indentation(0.1), 2e-3);
  const auto cone = laws::Cone{116e3, 15.0 * tips::degree}.prepare();
  const auto both = laws::Polynomial{50.0, cone.coefficient}.prepare();
  EXPECT_DOUBLE_EQ(both.force(3e-3), 0.15 + cone.force(3e-3));
}

TEST(Exponential, TendsToInitialStiffnessABAndDoublesOverTheFoldLength) {
  const auto straight = laws::Exponential{1e-3, 1e5}.prepare();  // a b = 100 N/m
  for (const double h : {1e-5, 1e-3, 1e-2}) {
    EXPECT_NEAR(straight.force(h), 100.0 * h, 1e-5 * 100.0 * h);
    EXPECT_NEAR(straight.energy(h), 50.0 * h * h, 1e-5 * 50.0 * h * h);
  }
  const auto steep = laws::Exponential{300.0, 0.02}.prepare();
  EXPECT_NEAR(steep.force(std::log(2.0) / 300.0), 0.02, 1e-15);
  EXPECT_NEAR(steep.slope(std::log(2.0) / 300.0), 12.0, 1e-12);
  EXPECT_DOUBLE_EQ(steep.reach(), 50.0 / 300.0);
}

}  // namespace
