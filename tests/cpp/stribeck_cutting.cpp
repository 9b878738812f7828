// SPDX-License-Identifier: Apache-2.0
// The smooth variant of stick-slip cutting with the numbers that reproduce the paper's range at 1 mm/s.
#include "walks.hpp"

namespace {

const laws::StribeckCutting smooth{0.10, 0.0033, 0.5714e-3, 20.73, 200.0, 2e-3};

struct Range {
  double least = 1.0, most = 0.0;
};

/// Least and greatest force of the last half of a way of 8 mm in steps of `dt` [s].
Range range(const laws::StribeckCutting& law, double v, double dt = 1e-3) {
  Edged<laws::StribeckCutting> walk(law);
  Range range;
  const int n = static_cast<int>(8e-3 / (v * dt));
  for (int i = 0; i < n; ++i) {
    walk.step(v * dt, dt);
    if (i < n / 2) continue;
    range.least = std::min(range.least, walk.force());
    range.most = std::max(range.most, walk.force());
  }
  return range;
}

TEST(StribeckCutting, CriticalSpeedIsTheMinimumOfTheForce) {
  const double critical = smooth.critical_speed();
  EXPECT_NEAR(critical, 1.20e-3, 5e-6);
  EXPECT_LT(smooth.steady_force(critical), smooth.steady_force(0.99 * critical));
  EXPECT_LT(smooth.steady_force(critical), smooth.steady_force(1.01 * critical));
  laws::StribeckCutting damped = smooth;
  damped.damping = 1e3;
  EXPECT_EQ(damped.critical_speed(), 0.0);
}

TEST(StribeckCutting, OscillatesAtOneMillimetreASecondAndIsSteadyAtThree) {
  const Range slow = range(smooth, 1e-3), fast = range(smooth, 3e-3);
  EXPECT_NEAR(slow.least, 0.040, 1e-3);
  EXPECT_NEAR(slow.most, smooth.static_force, 1e-4);  // it sticks: no creep that starts it at 0.095 N
  EXPECT_NEAR(fast.least, 0.0660, 5e-5);
  EXPECT_NEAR(fast.most, 0.0660, 5e-5);
}

TEST(StribeckCutting, OscillatesOnlyBelowTheCriticalSpeed) {
  const double critical = smooth.critical_speed();
  const Range below = range(smooth, 0.9 * critical), above = range(smooth, 1.5 * critical);
  EXPECT_GT(below.most - below.least, 0.02);
  EXPECT_LT(above.most - above.least, 1e-4);
  EXPECT_NEAR(above.most, smooth.steady_force(1.5 * critical), 1e-4);
}

TEST(StribeckCutting, ConvergesToFirstOrderInItsSubSteps) {
  // one sub-step a step of at most 10 us, from a crack that runs: where it starts is no matter of order
  const auto end = [](int n) {
    Edged<laws::StribeckCutting> walk(smooth);
    walk.cut.front = -0.09 / smooth.stiffness;
    walk.memory.speed = 3e-3;
    for (int i = 0; i < n; ++i) walk.step(3e-3 * 0.02 / n, 0.02 / n);
    return walk.force();
  };
  const double first = end(2000) - end(4000), second = end(4000) - end(8000);
  EXPECT_NEAR(first / second, 2.0, 0.1);
}

TEST(StribeckCutting, CrackNeverClosesAndItsWorkBalancesTipWork) {
  Edged<laws::StribeckCutting> walk(smooth);
  double tip = 0.0, spent = 0.0, front = walk.cut.front;
  for (int i = 0; i < 400000; ++i) {
    const double force = walk.force(), speed = walk.memory.speed;
    walk.step(2e-8, 2e-5);
    ASSERT_GE(walk.cut.front, front);
    tip += 0.5 * (force + walk.force()) * 2e-8;
    spent += 0.5 * (smooth.steady_force(speed) * (speed > 0.0) + smooth.steady_force(walk.memory.speed)) *
             (walk.cut.front - front);
    front = walk.cut.front;
  }
  const double held = walk.force() * walk.force() / 400.0 + 1e-3 * walk.memory.speed * walk.memory.speed;
  EXPECT_NEAR(tip, spent + held, 0.01 * tip);
}

}  // namespace
