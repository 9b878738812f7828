// SPDX-License-Identifier: Apache-2.0
// What every puncture law must keep.
#include "every_law.hpp"

namespace {

template <class L>
struct EveryPuncture : ::testing::Test {};
using PunctureLaws = AsTypes<Puncture>::type;
TYPED_TEST_SUITE(EveryPuncture, PunctureLaws);

TYPED_TEST(EveryPuncture, DepthIsReachedByTheContact) {
  for (const TypeParam& puncture : across<TypeParam>())
    with_each<Stiffness>([&](const auto& contact) {
      const auto prepared = contact.prepare();
      const double depth = puncture.puncture_depth(prepared);
      EXPECT_TRUE(std::isfinite(depth));
      EXPECT_GE(depth, 0.0);
      EXPECT_TRUE(std::isfinite(prepared.force(depth)));
      EXPECT_NEAR(prepared.indentation(prepared.force(depth)), depth, 1e-12 * depth);
    });
}

TYPED_TEST(EveryPuncture, IsNoDeeperInStifferTissueAndScales) {
  const TypeParam puncture = middle<TypeParam>();
  with_each<Stiffness>([&](const auto& contact) {
    const double depth = puncture.puncture_depth(contact.prepare());
    EXPECT_LE(puncture.puncture_depth(scaled(contact, 1.0, m).prepare()), depth);
    const double large = scaled(puncture, s, m).puncture_depth(scaled(contact, s, m).prepare());
    EXPECT_NEAR(large, s * depth, 1e-12 * large);
  });
}

TYPED_TEST(EveryPuncture, ElasticContactBreaksAtThePunctureDepth) {
  const TypeParam puncture = middle<TypeParam>();
  with_each<Stiffness>([&](const auto& contact) {
    const auto elastic = contact.prepare();
    const double depth = puncture.puncture_depth(elastic);
    const auto breaks = [&](double h) { return puncture.breaks(elastic.force(h), elastic.energy(h)); };
    EXPECT_TRUE(breaks(1.001 * depth));
    // a depth is asked for by the loop itself
    EXPECT_EQ(breaks(0.999 * depth), (std::is_same_v<TypeParam, laws::PunctureDepth>));
  });
}

TYPED_TEST(EveryPuncture, ZeroThresholdGivesAnInterfaceWithoutResistance) {
  TypeParam puncture{};
  for (const auto& parameter : TypeParam::table) puncture.*parameter.member = 0.0;
  EXPECT_EQ(first_invalid(puncture), nullptr);
  with_each<Stiffness>(
      [&](const auto& contact) { EXPECT_EQ(puncture.puncture_depth(contact.prepare()), 0.0); });
  EXPECT_TRUE(puncture.breaks(0.0, 0.0));
}

TEST(Puncture, CriteriaAreDepthForceAndEnergy) {
  with_each<Stiffness>([](const auto& contact) {
    const auto prepared = contact.prepare();
    EXPECT_EQ(laws::PunctureDepth{3e-3}.puncture_depth(prepared), 3e-3);
    EXPECT_NEAR(prepared.force(laws::PunctureForce{0.2}.puncture_depth(prepared)), 0.2, 1e-12);
    EXPECT_NEAR(prepared.energy(laws::PunctureEnergy{2e-4}.puncture_depth(prepared)), 2e-4, 1e-15);
  });
}

TEST(Puncture, ConeEnergyAtThePaperDepthIsAThirdOfForceTimesDepth) {
  const auto cone = laws::Cone{116e3, 15.0 * tips::degree}.prepare();
  const laws::PunctureEnergy third{cone.force(3.237e-3) * 3.237e-3 / 3.0};
  EXPECT_NEAR(third.puncture_depth(cone), 3.237e-3, 1e-14);
}

}  // namespace
