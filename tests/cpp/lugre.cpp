// SPDX-License-Identifier: Apache-2.0
// LuGre friction: its invariant, its steady force, its energy, against the closed forms.
#include "walks.hpp"

namespace {

const laws::LuGre bristles{1e6, 300.0, 100.0, 18.0, 25.0, 1e-3, 2.0};

TEST(LuGre, BristleForceStaysWithinStaticFriction) {
  std::mt19937_64 generator{5};
  for (const double exponent : {1.0, 1.5, 2.0}) {
    laws::LuGre law = bristles;
    law.stribeck_exponent = exponent;
    Shafted<laws::LuGre> walk(law);
    double most = 0.0;
    for (const double travel : random_travels(5000, 1e-3)) {
      walk.step(travel, random_dt(generator));
      most = std::max(most, std::abs(walk.memory.elastic));
    }
    EXPECT_LE(most, 25.0);
    EXPECT_GT(most, 24.9);  // and reaches it
  }
}

TEST(LuGre, SteadyForceIsTheStribeckCurve) {
  for (const double v : {1e-5, 1e-3, 1e-2}) {
    Shafted<laws::LuGre> walk(bristles);
    walk.step(5e-3, 5e-3 / v);
    const double g = 18.0 + 7.0 * std::exp(-std::pow(v / 1e-3, 2.0));
    EXPECT_NEAR(walk.force() / 8e-3, g + 100.0 * v, 1e-9);
    walk.step(-1e-3, 1e-3 / v);
    EXPECT_NEAR(walk.force() / 7e-3, -g - 100.0 * v, 1e-9);
  }
}

TEST(LuGre, ForceApproachesSlidingExponentiallyOverTheTravel) {
  // from rest at constant velocity: sigma_0 zeta = g (1 - exp(-sigma_0 x / g))
  Shafted<laws::LuGre> walk(bristles);
  const double v = 1e-3, g = 18.0 + 7.0 * std::exp(-1.0), x = 7e-6;
  walk.step(x, x / v);
  EXPECT_NEAR(walk.memory.elastic, g * (1.0 - std::exp(-1e6 * x / g)), 1e-12);
}

TEST(LuGre, EqualsDahlWithoutStribeckFallAndDamping) {
  const laws::LuGre dahl{1e6, 0.0, 0.0, 18.0, 18.0, 1e-3, 2.0};
  for (const double v : {1e-6, 1e-3, 1.0}) {  // no rate enters
    Shafted<laws::LuGre> walk(dahl);
    walk.step(12e-6, 12e-6 / v);
    walk.step(-5e-6, 5e-6 / v);
    const double there = 18.0 * (1.0 - std::exp(-12.0 / 18.0));
    EXPECT_NEAR(walk.memory.elastic, -18.0 + (there + 18.0) * std::exp(-5.0 / 18.0), 1e-10);
  }
}

TEST(LuGre, WorkBalancesDissipationAndBristleEnergy) {
  // sigma_0 zeta dz = d(sigma_0 zeta^2 / 2) + (sigma_0 zeta)^2 / g |dz|, with rates of no account
  const laws::LuGre law{1e6, 0.0, 0.0, 18.0, 25.0, 1e-3, 2.0};
  Shafted<laws::LuGre> walk(law);
  double work = 0.0, lost = 0.0;
  for (int i = 0; i < 300000; ++i) {
    const double dz = (i / 20000) % 2 == 0 ? 1e-9 : -0.7e-9, before = walk.memory.elastic;
    walk.step(dz, 1e-6);
    const double middle = 0.5 * (before + walk.memory.elastic);
    work += middle * dz;
    lost += middle * middle / walk.memory.limit * std::abs(dz);
  }
  const double zeta = walk.memory.elastic / 1e6;
  EXPECT_NEAR(work, lost + 0.5 * 1e6 * zeta * zeta, 1e-6 * work);
}

TEST(LuGre, IsPassiveFromVelocityToForceWithTheRequiredViscosity) {
  laws::LuGre law = bristles;
  law.bristle_damping = 3e3;
  law.viscous = law.min_passive_viscous();
  EXPECT_NEAR(law.viscous, 3e3 * 7.0 / 18.0, 1e-9);
  for (const double v : {1e-4, 1e-3, 5e-3})
    for (const double reach : {500e-6, 50e-6}) {
      Shafted<laws::LuGre> start(law);
      start.step(5e-3, 5.0);
      start.memory.elastic = 0.0;
      ASSERT_GE(min_closed_work(start, reach, v), -1e-3) << v;
    }
}

}  // namespace
