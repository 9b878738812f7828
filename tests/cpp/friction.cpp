// SPDX-License-Identifier: Apache-2.0
// Coulomb's and Karnopp's friction, and the surface that recovers, against their closed forms.
#include "walks.hpp"

namespace {

TEST(Coulomb, SlidesAfterTheStatedTravel) {
  Shafted<laws::Coulomb> walk(laws::Coulomb{18.6, 20e-6, 0.25}, 4e-3);
  walk.step(5e-6, 1.0);
  EXPECT_NEAR(walk.memory.traction, 0.25 * 18.6, 1e-12);
  EXPECT_NEAR(walk.shaft.surface, 1e-3, 1e-15);
  walk.step(8e-3, 1.0);
  EXPECT_NEAR(walk.force(), 18.6 * 11.005e-3, 1e-15);
  walk.step(-20e-6, 1.0);
  EXPECT_NEAR(walk.force(), 0.0, 1e-12);
  walk.step(-20e-6, 1.0);
  EXPECT_NEAR(walk.force(), -18.6 * 10.965e-3, 1e-12);
}

TEST(Coulomb, ForceChangesSignWithTheDirection) {
  Shafted<laws::Coulomb> walk(laws::Coulomb{18.6, 20e-6, 0.0}), mirrored = walk;
  for (const double travel : random_travels(2000, 1e-4)) {
    walk.step(travel, 1.0);
    mirrored.step(-travel, 1.0);
    ASSERT_NEAR(mirrored.memory.traction, -walk.memory.traction, 1e-11);
  }
}

// bovine liver as a secondary source gives it, in SI; unconfirmed
const laws::Karnopp liver{10.57, -11.96, 212.13, 293.08, 18.45, -18.23, 1e-3, 20e-6};

TEST(Karnopp, SlidingForceIsThatOfTheSourceOutsideTheStaticBand) {
  for (const double v : {0.5e-3, 2e-3, 10e-3}) {
    Shafted<laws::Karnopp> walk(liver);
    walk.step(5e-3, v, 1.0);
    EXPECT_NEAR(walk.memory.traction, 10.57 + 212.13 * v, 1e-12);
    walk.step(-1e-3, -v, 1.0);
    EXPECT_NEAR(walk.memory.traction, -11.96 - 293.08 * v, 1e-12);
  }
}

TEST(Karnopp, BreaksLooseAtTheStaticLimitAtAnySpeed) {
  for (const int n : {1, 10, 1000}) {
    Shafted<laws::Karnopp> walk(liver);
    // an element of 18.45 N/m over 20 um: after 16 um it still sticks, though 10.57 + 212.13 v is passed
    for (int i = 0; i < n; ++i) walk.step(16e-6 / n, 5e-3, 3.2e-3 / n);
    EXPECT_NEAR(walk.memory.traction, 0.8 * 18.45, 1e-9);
    for (int i = 0; i < n; ++i) walk.step(8e-6 / n, 5e-3, 1.6e-3 / n);
    EXPECT_NEAR(walk.memory.traction, 10.57 + 212.13 * 5e-3, 1e-12);
  }
}

TEST(Karnopp, StaticFrictionExceedsSlidingFriction) {
  Shafted<laws::Karnopp> walk(liver);
  walk.step(5e-3, 2e-3, 1.0);
  EXPECT_NEAR(walk.memory.traction, 10.57 + 212.13 * 2e-3, 1e-12);
  walk.step(0.0, 0.0, 1.0);  // at rest it keeps what it has
  EXPECT_NEAR(walk.memory.traction, 10.57 + 212.13 * 2e-3, 1e-12);
  walk.step(40e-6, 0.4e-3, 0.1);
  EXPECT_NEAR(walk.memory.traction, 18.45, 1e-12);
  walk.step(-80e-6, -0.4e-3, 0.2);
  EXPECT_NEAR(walk.memory.traction, -18.23, 1e-12);
  EXPECT_EQ(walk.by_velocity(), 0.0);
}

TEST(Karnopp, FallsToTheStaticLimitAtAReversalForAnyStep) {
  const laws::Karnopp fast{10.0, -10.0, 1e4, 1e4, 12.0, -12.0, 1e-4, 20e-6};
  for (const int n : {1, 10, 1000}) {
    Shafted<laws::Karnopp> walk(fast);
    walk.step(5e-3, 2e-3, 1.0);  // 30 N/m
    EXPECT_NEAR(walk.memory.traction, 30.0, 1e-12);
    // from 12 N/m back over 10 um of an element of 12 N/m over 20 um
    for (int i = 0; i < n; ++i) walk.step(-10e-6 / n, -1e-3, 1e-2 / n);
    EXPECT_NEAR(walk.memory.traction, 6.0, 1e-9) << n;
  }
}

TEST(RelaxingSurface, RecoversToTheStaticBalanceOfAFlatPunch) {
  // 2 E_r R = 81.2 N/m, f_c alone: 0.96 mm; implicit in the embedded length
  const double k = 2.0 * 116e3 * 0.35e-3, f = 18.6, tip = 0.0776, depth = 10e-3;
  const auto tip_alone = laws::RelaxingSurface({0.0, 20e-6, 1.0, k, tip}).prepare();
  EXPECT_NEAR(tip_alone.resting(LayerExtent{0, 3.237e-3, 1, true}, depth, 0.0).depth, 0.96e-3, 5e-6);
  Shafted<laws::RelaxingSurface> walk(laws::RelaxingSurface{f, 20e-6, 2.0, k, tip}, 3.237e-3);
  walk.step(depth - 3.237e-3, 1e-9);
  EXPECT_NEAR(walk.shaft.surface, 3.237e-3, 1e-9);
  // at rest the tissue that the surface adds to the shaft is not strained: the force stays as it slid
  const double slid = walk.force();
  EXPECT_NEAR(slid, f * (depth - 3.237e-3), 1e-9);
  for (int i = 0; i < 4000; ++i) walk.step(0.0, 0.01);
  EXPECT_NEAR(walk.force(), slid, 1e-12);
  const double share = walk.memory.traction / f;  // of the tip's push that is left
  EXPECT_LT(share, 0.95);
  EXPECT_NEAR(walk.shaft.surface, std::min(3.237e-3, (tip * share + slid) / k), 1e-9);
}

TEST(RelaxingSurface, SurfaceRisesOnWithdrawalAndForceVanishesAtTheUndeformedSurface) {
  const double k = 200.0, f = 18.6;
  Shafted<laws::RelaxingSurface> walk(laws::RelaxingSurface{f, 20e-6, 1e-3, k, 0.0776}, 3.237e-3);
  const auto pull = [&] {
    for (int i = 0; i < 5000; ++i) walk.step(-1e-6, -1e-3, 2e-3);  // two recovery times a step
  };
  walk.step(6.763e-3, 1e-3, 10.0);
  pull();
  const double rest = -f * 5e-3 / (k - f);  // k z_res = -f' (z - z_res)
  EXPECT_NEAR(walk.shaft.surface, rest, 1e-12);
  EXPECT_NEAR(walk.force(), -f * (5e-3 - rest), 1e-12);
  pull();
  EXPECT_NEAR(walk.shaft.embedded, 0.0, 1e-12);
}

TEST(RelaxingSurface, ConvergesToFirstOrderWhereTheTissueIsDraggedFar) {
  const auto end = [](int n) {
    Shafted<laws::RelaxingSurface> walk(laws::RelaxingSurface{18.6, 5e-3, 2.0, 200.0, 0.0776}, 3.237e-3);
    go(walk, 4e-3, 1e-3, 4e-3 / n);
    go(walk, -2e-3, 1e-3, 2e-3 / n);
    return walk.force();
  };
  const double first = end(400) - end(800), second = end(800) - end(1600), third = end(1600) - end(3200);
  EXPECT_NEAR(first / second, 2.0, 0.1);
  EXPECT_NEAR(second / third, 2.0, 0.05);
}

TEST(RelaxingSurface, RecoversExponentially) {
  Shafted<laws::RelaxingSurface> walk(laws::RelaxingSurface{0.0, 20e-6, 2.0, 1e3, 0.0776}, 3.237e-3);
  walk.step(5e-3, 1e-9);
  const double rest = 0.0776 / 1e3;
  for (int i = 0; i < 4; ++i) walk.step(0.0, 0.5);
  EXPECT_NEAR(walk.shaft.surface, rest + (3.237e-3 - rest) * std::exp(-1.0), 1e-11);
}

}  // namespace
