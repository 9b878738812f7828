// SPDX-License-Identifier: Apache-2.0
// Stick-slip cutting with the numbers that reproduce the paper's two speeds.
#include "walks.hpp"

namespace {

// v_a in (1, 3) mm/s; c takes the force from 0.04 N at v_a to 0.0776 N at 3 mm/s
const laws::StickSlip paper{0.10, 0.04, 1.5e-3, (0.0776 - 0.04) / 1.5e-3, 200.0};

TEST(StickSlip, OscillatesAtOneMillimetreASecondWithTheClosedFormPeriod) {
  const double period = 0.3 + 25.0666666666666667 / 200.0 * std::log(0.0725333333333333 / 0.0125333333333333);
  EXPECT_NEAR(period, 0.520, 5e-4);
  Edged<laws::StickSlip> walk(paper);
  walk.step(20e-3, 20.0);
  std::vector<double> breaks;
  double least = 1.0, most = 0.0, last = walk.force();
  bool rising = false;
  for (int i = 0; i < 40000; ++i) {
    walk.step(1e-7, 1e-4);
    const double force = walk.force();
    if (rising && force < last) breaks.push_back(walk.tip.depth);
    rising = force > last;
    least = std::min(least, force);
    most = std::max(most, force);
    last = force;
  }
  EXPECT_NEAR(least, 0.04, 1e-4);
  EXPECT_NEAR(most, 0.10, 1e-4);
  ASSERT_GE(breaks.size(), 7u);
  for (std::size_t i = 1; i < breaks.size(); ++i)
    EXPECT_NEAR(breaks[i] - breaks[i - 1], period * 1e-3, 2.1e-7);
}

TEST(StickSlip, IsSteadyAtThreeMillimetresASecond) {
  Edged<laws::StickSlip> walk(paper);
  walk.step(9e-3, 3.0);
  for (int i = 0; i < 1000; ++i) {
    walk.step(3e-6, 1e-3);
    ASSERT_NEAR(walk.force(), 0.0776, 1e-9);
  }
  EXPECT_NEAR(paper.mean_force(3e-3), 0.0776, 1e-15);
}

TEST(StickSlip, MeanForceAtOneMillimetreASecondIsBelowThatAtThree) {
  EXPECT_NEAR(paper.mean_force(1e-3), 0.0665, 5e-5);
  Edged<laws::StickSlip> walk(paper);
  walk.step(5e-3, 5.0);
  const double way = 0.5200 * 100e-3;  // a hundred cycles, and what is left of one
  EXPECT_NEAR(go(walk, way, 1e-3, 1e-6) / way, paper.mean_force(1e-3), 2e-4);
}

TEST(StickSlip, SkippedCyclesEqualFineStepping) {
  for (const double v : {1e-5, 2e-4, 1e-3, 1.4e-3, 1.6e-3, 3e-3}) {
    Edged<laws::StickSlip> once(paper), fine(paper);
    const double time = 6e-3 / v;
    once.step(6e-3, time);
    for (int i = 0; i < 30000; ++i) fine.step(6e-3 / 30000, time / 30000);
    EXPECT_NEAR(once.force(), fine.force(), 1e-8) << v;
    EXPECT_EQ(once.memory.running, fine.memory.running) << v;
  }
}

TEST(StickSlip, CrackWorkBalancesTipWork) {
  // work of the tip = that of the crack, the integral of F over its way, plus what the spring holds
  Edged<laws::StickSlip> walk(paper);
  double crack = 0.0, tip = 0.0;
  const double held = walk.force() * walk.force() / 400.0;
  for (int i = 0; i < 200000; ++i) {
    const double force = walk.force(), front = walk.cut.front;
    walk.step(5e-8, 5e-5);
    tip += 0.5 * (force + walk.force()) * 5e-8;
    crack += 0.5 * (force + walk.force()) * (walk.cut.front - front);
  }
  EXPECT_NEAR(tip, crack + walk.force() * walk.force() / 400.0 - held, 1e-9 * tip);
  EXPECT_GT(crack, 0.04 * 9e-3);
}

// A crack never closes: the force rises by no more than the tissue ahead of the tip is compressed.
TEST(StickSlip, CrackOfAnotherLawWithoutItsForceSticks) {
  const auto law = paper.prepare();
  Cut cut;
  laws::StickSlip::Prepared::Memory memory{.running = true};
  law.enter(cut, memory, 10e-3, 0.01);
  const double before = law.force(cut, memory, 10e-3);
  EXPECT_NEAR(before, 0.01, 1e-12);
  law.advance(cut, memory, Move{10.01e-3, 1e-5, 1e-5, 5e-3, 2e-3, 10.01e-3, true, false});
  EXPECT_NEAR(law.force(cut, memory, 10.01e-3), before + 200.0 * 1e-5, 1e-12);
}

}  // namespace
