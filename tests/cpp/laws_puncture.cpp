// SPDX-License-Identifier: Apache-2.0
// What every puncture law must keep.
#include "every_law.hpp"

namespace {

template <class L>
struct EveryPuncture : ::testing::Test {};
using PunctureLaws = AsTypes<Puncture>::type;
TYPED_TEST_SUITE(EveryPuncture, PunctureLaws);

TYPED_TEST(EveryPuncture, ComesAtADepthThatTheContactReaches) {
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

TYPED_TEST(EveryPuncture, ComesNoDeeperInAStifferTissueAndScales) {
  const TypeParam puncture = middle<TypeParam>();
  with_each<Stiffness>([&](const auto& contact) {
    const double depth = puncture.puncture_depth(contact.prepare());
    EXPECT_LE(puncture.puncture_depth(scaled(contact, 1.0, m).prepare()), depth);
    const double large = scaled(puncture, s, m).puncture_depth(scaled(contact, s, m).prepare());
    EXPECT_NEAR(large, s * depth, 1e-12 * large);
  });
}

TEST(Puncture, ADepthStandsAndAForceIsReached) {
  with_each<Stiffness>([](const auto& contact) {
    const auto prepared = contact.prepare();
    EXPECT_EQ(laws::PunctureDepth{3e-3}.puncture_depth(prepared), 3e-3);
    EXPECT_NEAR(prepared.force(laws::PunctureForce{0.2}.puncture_depth(prepared)), 0.2, 1e-12);
  });
}

}  // namespace
