// SPDX-License-Identifier: Apache-2.0
// Tissue dragged by a spring with a Coulomb limit: rupture, sliding, release, and the energy it takes over.
#include "walks.hpp"

namespace {

using laws::DraggedTissueAsFitted;
using laws::DraggedTissuePassive;

// medians of the layered law's first layer
template <class L>
constexpr L fitted{140.0, 220.0, 0.4e-3, 1e-3};

template <class L>
struct Dragged : ::testing::Test {};
using Both = ::testing::Types<DraggedTissuePassive, DraggedTissueAsFitted>;
TYPED_TEST_SUITE(Dragged, Both);

TYPED_TEST(Dragged, ForceFallsToFrictionOverTheRuptureLength) {
  Shafted<TypeParam> walk(fitted<TypeParam>, 8e-3, 0.2);
  for (int i = 1; i <= 8000; ++i) {
    walk.step(1e-6, 1e-3);
    const double grip = 140.0 * std::max(0.0, walk.tip.depth - walk.shaft.surface);
    const double most = grip + std::max(0.0, 0.2 - grip) * std::exp(-(walk.tip.depth - 8e-3) / 0.4e-3);
    ASSERT_LE(walk.force(), most + 1e-3);
  }
  // in steady sliding F = f' (z - z_r - F / k_t): the closed form of the moving surface
  EXPECT_NEAR(walk.force(), 140.0 * (16e-3 - 1e-3) / (1.0 + 140.0 / 220.0), 1e-3);
}

TYPED_TEST(Dragged, ReversalUnloadsTheSpringAndThenSlides) {
  Shafted<TypeParam> walk(fitted<TypeParam>, 8e-3, 0.2);
  go(walk, 8e-3, 1e-3, 1e-6);
  const double before = walk.force();
  walk.step(-1e-3, 1.0);
  EXPECT_NEAR(walk.force(), before - 220.0 * 1e-3, 1e-12);
  EXPECT_NEAR(walk.by_depth(), 220.0, 1e-9);
  go(walk, -12.9e-3, 1e-3, 1e-6);
  // F = -f' l, l = z - z_r - F / k_t: l (1 - f' / k_t) = z - z_r
  const double length = (walk.tip.depth - 1e-3) / (1.0 - 140.0 / 220.0);
  EXPECT_NEAR(walk.force(), -140.0 * length, 2e-3);
}

TYPED_TEST(Dragged, FrictionOutwardsIsTheRatioTimesThatInwards) {
  Shafted<TypeParam> walk(TypeParam{60.0, 220.0, 0.4e-3, 1e-3, 2.5}, 8e-3, 0.2);
  go(walk, 8e-3, 1e-3, 1e-6);
  EXPECT_NEAR(walk.force(), 60.0 * (16e-3 - 1e-3) / (1.0 + 60.0 / 220.0), 2e-3);
  go(walk, -12.9e-3, 1e-3, 1e-6);
  // F = -rho f' l, l (1 - rho f' / k_t) = z - z_r
  const double length = (walk.tip.depth - 1e-3) / (1.0 - 150.0 / 220.0);
  EXPECT_NEAR(walk.force(), -150.0 * length, 2e-3);
  EXPECT_NEAR(walk.by_depth(), -150.0, 1e-9);
  EXPECT_NE((TypeParam{100.0, 220.0, 0.4e-3, 1e-3, 2.5}.contradiction()), nullptr);
}

TYPED_TEST(Dragged, ReleasesAtOnceWhenNothingIsEmbedded) {
  Shafted<TypeParam> walk(fitted<TypeParam>, 8e-3, 0.2);
  go(walk, 2e-3, 1e-3, 1e-6);
  go(walk, -11e-3, 1e-3, 1e-6);
  EXPECT_EQ(walk.force(), 0.0);
  EXPECT_EQ(walk.by_depth(), 0.0);
  EXPECT_EQ(walk.shaft.embedded, 0.0);
  EXPECT_EQ(walk.memory.element.elastic, 0.0);
}

TYPED_TEST(Dragged, UnloadsBeforeItIsReleasedWhereNothingIsEmbedded) {
  // withdrawn in mid rupture: the surface is still below the tip, and the spring pushes
  Shafted<TypeParam> walk(TypeParam{140.0, 220.0, 0.4e-3, 3e-3}, 8e-3, 2.4);
  go(walk, 0.2e-3, 1e-3, 1e-6);
  const double pushed = walk.force(), deepest = walk.tip.depth;
  ASSERT_GT(pushed, 1.0);
  while (walk.tip.depth > 1e-3) {
    walk.step(-1e-6, 1e-3);
    ASSERT_EQ(walk.shaft.embedded, 0.0);
    ASSERT_NEAR(walk.force(), std::max(0.0, pushed - 220.0 * (deepest - walk.tip.depth)), 1e-9);
  }
}

TEST(DraggedTissue, PassiveFormReceivesNoMoreThanTheContactEnergy) {
  // a contact of energy U and force F on a spring k_t: F^2 / 2 k_t <= U
  for (const double energy : {1e-5, 1e-4, 1e-3})
    for (const double force : {0.05, 0.2, 1.0}) {
      laws::DraggedTissueMemory passive, as_fitted;
      const ContactAtPuncture contact{Element{force}, force, energy, 100.0};
      fitted<DraggedTissuePassive>.prepare().pierce(passive, contact);
      fitted<DraggedTissueAsFitted>.prepare().pierce(as_fitted, contact);
      const double most = std::sqrt(2.0 * 220.0 * energy);
      EXPECT_NEAR(passive.element.elastic, std::min(force, most), 1e-12);
      EXPECT_EQ(as_fitted.element.elastic, force);
      EXPECT_EQ(passive.peak, force);
    }
}

}  // namespace
