// SPDX-License-Identifier: Apache-2.0
// Fracture work with spreading: the numbers of the source paper read as toughness.
#include "walks.hpp"

namespace {

constexpr double crack_radius = 0.35e-3, modulus = 154666.55782265437;  // E' of 116 kPa at nu = 0.5
const double spreading = 0.25 * std::numbers::pi * modulus * crack_radius * crack_radius;

laws::Fracture fracture(double recovered) {
  return {0.0776 / 0.7e-3, 0.7e-3, modulus, crack_radius, recovered, 1e-6};
}

TEST(Fracture, CrackAndSpreadingForcesAreTheClosedForms) {
  EXPECT_NEAR(fracture(0.0).spreading(), 0.0149, 5e-5);
  EXPECT_NEAR(fracture(0.0).prepare().steady(1e-3), 0.0776 + spreading, 1e-15);
}

TEST(Fracture, CrackWorkIsSpentOnceAndSpreadingWorkOnEachInsertion) {
  for (const double recovered : {0.0, 0.4, 1.0}) {
    Edged<laws::Fracture> walk(fracture(recovered));
    const double way = 5e-3, back = recovered * spreading * way;
    EXPECT_NEAR(go(walk, way, 1e-3, 1e-7), (0.0776 + spreading) * way, 1e-6 * 0.1);
    EXPECT_NEAR(go(walk, -way, 1e-3, 1e-7), -back, 1e-6 * 0.1);  // what closes behind the tip
    EXPECT_NEAR(go(walk, way, 1e-3, 1e-7), spreading * way, 1e-6 * 0.1);
    EXPECT_NEAR(go(walk, -way, 1e-3, 1e-7), -back, 1e-6 * 0.1);
  }
}

TEST(Fracture, WithdrawalForceIsTheRecoveredShareOfSpreading) {
  for (const double recovered : {0.0, 0.4, 1.0}) {
    Edged<laws::Fracture> walk(fracture(recovered));
    walk.step(5e-3, 1.0);
    walk.step(-1e-3, 1.0);
    EXPECT_NEAR(walk.force(), recovered * spreading, 1e-15);
    walk.step(-5e-3, 1.0);
    EXPECT_EQ(walk.force(), 0.0);
  }
}

TEST(Fracture, ClosedPathWithSpreadingReturnsNoEnergy) {
  for (const double recovered : {0.0, 0.4, 1.0})
    for (const double reach : {20e-6, 2e-6}) {
      Edged<laws::Fracture> start(fracture(recovered));
      ASSERT_GE(min_closed_work(start, reach, 1e-3), -1e-3) << recovered;
      go(start, 1e-3, 1e-3, 1e-6);
      ASSERT_GE(min_closed_work(start, reach, 1e-3), -1e-3) << recovered;
    }
}

}  // namespace
