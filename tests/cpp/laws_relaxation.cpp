// SPDX-License-Identifier: Apache-2.0
// What every relaxation law must keep: the numbers of a step, and an element that is loaded with them.
#include "every_law.hpp"

namespace {

template <class L>
struct EveryRelaxation : ::testing::Test {};
using RelaxationLaws = AsTypes<Relaxation>::type;
TYPED_TEST_SUITE(EveryRelaxation, RelaxationLaws);

constexpr double far = std::numeric_limits<double>::infinity();

TYPED_TEST(EveryRelaxation, SharesAddUpToOneAndDecayForAnyStep) {
  for (const TypeParam& given : across<TypeParam>())
    for (double dt = 1e-300; dt < 1e7; dt *= 1e3) {
      const Relaxing relaxing = given.prepare().over(dt);
      EXPECT_GT(relaxing.lasting, 0.0);
      EXPECT_NEAR(relaxing.lasting + relaxing.share[0] + relaxing.share[1], 1.0, 1e-15);
      for (int j = 0; j < 2; ++j) {
        EXPECT_GE(relaxing.left[j], 0.0);
        EXPECT_LE(relaxing.left[j], relaxing.during[j]);  // what came later has faded less
        EXPECT_LE(relaxing.during[j], 1.0);
        EXPECT_GT(relaxing.during[j], 0.0);
      }
    }
}

TYPED_TEST(EveryRelaxation, HoldStepsMultiplyAndRampStepsAdd) {
  const auto law = middle<TypeParam>().prepare();
  for (const double dt : {1e-6, 1e-3, 1.0, 1e3}) {
    const Relaxing whole = law.over(dt), half = law.over(0.5 * dt);
    for (int j = 0; j < 2; ++j) {
      EXPECT_NEAR(half.left[j] * half.left[j], whole.left[j], 1e-14);
      EXPECT_NEAR(0.5 * half.during[j] * (1.0 + half.left[j]), whole.during[j], 1e-14);
    }
  }
}

TYPED_TEST(EveryRelaxation, LoadIsTheSameInOneStepOrInMany) {
  const auto law = middle<TypeParam>().prepare();
  std::mt19937_64 generator{3};
  Element coarse, fine;
  for (int i = 0; i < 300; ++i) {
    const double dt = std::pow(10.0, -4.0 + static_cast<double>(generator() % 6));
    const double load = static_cast<double>(generator() % 2001) * 1e-3 - 1.0;
    double last = 0.0;
    for (int k = 0; k < 64; ++k) last = fine.load(load / 64, -far, far, law.over(dt / 64), false);
    EXPECT_NEAR(coarse.load(load, -far, far, law.over(dt), false), last, 1e-11);
  }
}

TYPED_TEST(EveryRelaxation, SlipsAtItsLimitAndConvergesToSecondOrderAfter) {
  // while it slips the force is the limit; what faded meanwhile is taken as even over the step
  const TypeParam given = middle<TypeParam>();
  const auto after = [&](int n) {
    const auto law = given.prepare();
    Element element;
    element.load(1.0, -1.0, 1.0, law.over(1e-12), false);  // at the limit from the start
    for (int i = 0; i < n; ++i)
      EXPECT_NEAR(element.load(8.0 / n, -1.0, 1.0, law.over(3.0 / n), false), 1.0, 1e-14);
    return element.load(-0.4, -far, far, law.over(0.5), false);
  };
  const double first = after(200) - after(400), second = after(400) - after(800);
  if (given.prepare().over(1.0).relaxes) {
    EXPECT_NEAR(first / second, 4.0, 0.1);
  } else {
    EXPECT_NEAR(first, 0.0, 1e-14);
  }
}

TYPED_TEST(EveryRelaxation, YieldsImmediatelyAndOnlyBeyondItsLimits) {
  const auto law = middle<TypeParam>().prepare();
  const Relaxing step = law.over(1e-2);
  Element element;
  double force = 0.0;
  for (int i = 0; i < 30; ++i) force = element.load(0.1, -far, far, step, false);
  Element same = element;
  same.yield(force, -far, far, step);
  EXPECT_EQ(same.elastic, element.elastic);
  element.yield(force, -1.0, 1.0, step);
  EXPECT_NEAR(element.load(0.0, -far, far, law.over(1e-12), false), 1.0, 1e-9);
}

/// Loads evenly to 1 over a time [s] in n steps.
template <class Law>
double ramp(Element& element, const Law& law, double time, int n) {
  double force = 0.0;
  for (int i = 0; i < n; ++i) force = element.load(1.0 / n, -far, far, law.over(time / n), false);
  return force;
}

TEST(Prony, RampAndHoldAreTheClosedForms) {
  const laws::Prony given{0.31, 0.7, 0.26, 5.0};
  const auto law = given.prepare();
  for (const int n : {1, 7, 1000}) {
    Element element;
    const double time = 3.0, hold = 4.0;
    double after_ramp = 0.43, after_hold = 0.43;  // lasting, plus g_j tau_j / T (1 - exp(-T / tau_j)) [...]
    const double share[] = {0.31, 0.26}, tau[] = {0.7, 5.0};
    for (int j = 0; j < 2; ++j) {
      const double part = share[j] * tau[j] / time * (1.0 - std::exp(-time / tau[j]));
      after_ramp += part;
      after_hold += part * std::exp(-hold / tau[j]);
    }
    EXPECT_NEAR(ramp(element, law, time, n), after_ramp, 1e-12);
    EXPECT_NEAR(element.load(0.0, -far, far, law.over(hold), false), after_hold, 1e-12);
    EXPECT_NEAR(element.load(0.0, -far, far, law.over(1e6), false), 0.43, 1e-12);
  }
}

TEST(Prony, SuddenLoadIsElasticAndAHoldEndsAtTheLastingShare) {
  Element element;
  const auto law = laws::Prony{0.5, 1.0, 0.0, 5.0}.prepare();
  EXPECT_NEAR(element.load(1.0, -far, far, law.over(1e-12), false), 1.0, 1e-12);
  EXPECT_NEAR(element.load(0.0, -far, far, law.over(std::log(2.0)), false), 0.75, 1e-12);
  EXPECT_NEAR(element.load(0.0, -far, far, law.over(1e3), false), 0.5, 1e-12);
}

TEST(Prony, UnloadingARelaxedElementPullsUnlessLimitedToPushing) {
  const auto law = laws::Prony{0.5, 1.0, 0.0, 5.0}.prepare();
  for (const bool pushes : {false, true}) {
    Element element;
    element.load(1.0, -far, far, law.over(1e-9), false);
    element.load(0.0, -far, far, law.over(1e3), false);
    const double force = element.load(-1.0, pushes ? 0.0 : -far, far, law.over(1e-9), false);
    EXPECT_NEAR(force, pushes ? 0.0 : -0.5, 1e-9);
  }
}

TEST(Prony, HoldAfterSlidingRelaxesFromTheSlidingForce) {
  const auto law = laws::Prony{0.31, 0.7, 0.26, 5.0}.prepare();
  for (const int n : {1, 40}) {
    Element element;
    for (int i = 0; i < n; ++i)  // 20 s at the limit, over 50 000 stretches
      EXPECT_NEAR(element.drag(1e5 / n, -2.0, 2.0, law.over(20.0 / n), true), 2.0, 1e-14);
    const double left = 0.43 + 0.31 * std::exp(-3.0 / 0.7) + 0.26 * std::exp(-3.0 / 5.0);
    EXPECT_NEAR(element.drag(0.0, -2.0, 2.0, law.over(3.0), false), 2.0 * left, 1e-12);
  }
}

// Slow sliding: what the slip r = v / L renews a second balances what relaxes. With F = f, D_j = q_j and the
// load a that keeps the force: q_j (1 / tau_j + r) = g_j (a + r f), a = r (E - f), (1 - G) E + sum q_j = f.
TEST(Prony, SlowSlidingKeepsItsForceAndHalfOfItsRelaxation) {
  const double g[] = {0.31, 0.26}, tau[] = {0.7, 5.0}, f = 2.0, r = 0.4;
  double by_load = 0.0;  // sum q_j = by_load (a + r f)
  for (int j = 0; j < 2; ++j) by_load += g[j] / (1.0 / tau[j] + r);
  const double lasting = 1.0 - g[0] - g[1];
  const double load = f * (1.0 - lasting - by_load * r) / (lasting / r + by_load);
  const double elastic = f + load / r;
  const auto law = laws::Prony{g[0], tau[0], g[1], tau[1]}.prepare();
  double error[2];
  for (const int fine : {0, 1}) {
    const double dt = fine ? 1e-3 : 2e-3;
    Element element;
    // the slip is the travel less what loads the relaxing tissue
    for (int i = 0; i < 60.0 / dt; ++i)
      EXPECT_LE(element.drag((r * f + load) * dt, -f, f, law.over(dt), true), f);
    error[fine] = std::abs(element.elastic - elastic);
    EXPECT_NEAR(element.elastic, elastic, 1e-2 * elastic);
    for (int j = 0; j < 2; ++j)
      EXPECT_NEAR(element.memory[j], g[j] * (load + r * f) / (1.0 / tau[j] + r), 1e-2 * f);
  }
  EXPECT_NEAR(error[0] / error[1], 2.0, 0.1);  // first order
}

TEST(Prony, SlippingNeverGainsEnergy) {
  const auto law = laws::Prony{0.31, 0.7, 0.26, 5.0}.prepare();
  const auto stored = [&](const Element& element, const Relaxing& relaxing) {  // springs of stiffness 1
    double energy = relaxing.lasting * element.elastic * element.elastic;
    for (int j = 0; j < 2; ++j) energy += element.memory[j] * element.memory[j] / relaxing.share[j];
    return 0.5 * energy;
  };
  std::mt19937_64 generator{5};
  Element element;
  for (int i = 0; i < 20000; ++i) {
    const Relaxing step = law.over(std::pow(10.0, -3.0 + static_cast<double>(generator() % 5)));
    const double wanted = 1e-3 * static_cast<double>(generator() % 2001) - 1.0;
    Element slipped = element;
    slipped.load(wanted, -1.0, 1.0, step, false);
    element.drag(wanted, -1.0, 1.0, step, false);
    ASSERT_LE(stored(element, step), stored(slipped, step) * (1.0 + 1e-12));
  }
}

TEST(PronyAtRest, AdvanceRestoresAndHoldRelaxes) {
  const auto law = laws::PronyAtRest{0.5, 1.0, 0.0, 5.0}.prepare();
  Element element;
  EXPECT_EQ(element.load(1.0, -far, far, law.over(10.0), true), 1.0);  // nothing relaxes during insertion
  EXPECT_NEAR(element.load(0.0, -far, far, law.over(1e3), false), 0.5, 1e-12);
  EXPECT_NEAR(element.load(0.1, -far, far, law.over(1e-3), true), 1.1, 1e-12);  // and all is back
}

}  // namespace
