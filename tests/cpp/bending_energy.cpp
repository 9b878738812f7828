// SPDX-License-Identifier: Apache-2.0
// Work of a hand that moves the base of a needle along closed paths: none comes out.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "bending.hpp"
#include "solid.hpp"

using namespace bending_tests;

namespace {

/// Moves a needle and adds up what a hand does, from samples alone.
template <std::size_t dimension>
struct Hand {
  FlexibleInsertion<dimension> needle;
  Base at{};
  BentSample last{};
  double work = 0.0, lowest = 0.0, turned = 0.0;
  bool moved = true;

  Hand(const Model& model, FlexibleSettings settings, const Bevel& bevel = {})
      : needle(Insertion(model, any_speed, bevel), [&] {
          settings.small_slopes = false;
          return settings;
        }()) {}

  void start(const Base& base) { last = needle.step(at = base, 1.0); }
  /// To a place in a straight line, in even steps of no more than `step` [m], a tenth of it per radian.
  void go(const Base& to, double step) {
    double length = std::abs(to.depth - at.depth) + 1e-3 * std::abs(to.roll - at.roll);
    for (std::size_t d = 0; d < 2; ++d)
      length = std::max(
          {length, std::abs(to.lateral[d] - at.lateral[d]), 0.1 * std::abs(to.tilt[d] - at.tilt[d])});
    const int n = std::max(1, static_cast<int>(std::ceil(length / step)));
    const Base from = at;
    for (int i = 1; i <= n; ++i) {
      const double share = static_cast<double>(i) / n;
      add(bending::between(from, to, share, from.depth + share * (to.depth - from.depth)));
    }
  }
  void forget() { work = lowest = turned = 0.0; }

 private:
  void add(const Base& to) {
    const BentSample now = needle.step(to, 1.0);
    moved = moved && now.moved && !now.buckled;
    pay(last.force, now.force, to.depth - at.depth);
    const auto before = turned_back(last, at), after = turned_back(now, to);
    for (std::size_t d = 0; d < 2; ++d) pay(-before[d], -after[d], to.lateral[d] - at.lateral[d]);
    pay(-before[3], -after[3], to.tilt[0] - at.tilt[0]);
    pay(before[2], after[2], to.tilt[1] - at.tilt[1]);
    lowest = std::min(lowest, work);
    last = now, at = to;
  }
  void pay(double before, double after, double way) {
    const double part = 0.5 * (before + after) * way;
    work += part, turned += std::abs(part);
  }
  /// Lateral force in the frame of the tissue, and the moment by the slopes, as about x and y.
  static std::array<double, 4> turned_back(const BentSample& sample, const Base& base) {
    const double length = std::sqrt(1.0 + base.tilt[0] * base.tilt[0] + base.tilt[1] * base.tilt[1]);
    const std::array<double, 3> t{base.tilt[0] / length, base.tilt[1] / length, 1.0 / length};
    const double q = std::sqrt(1.0 - t[0] * t[0]);
    const std::array<double, 3> x{q, -t[0] * t[1] / q, -t[0] * t[2] / q}, y{0.0, t[2] / q, -t[1] / q};
    std::array<double, 3> f, m;
    for (std::size_t i = 0; i < 3; ++i) {
      f[i] = sample.wrench[0] * x[i] + sample.wrench[1] * y[i] + sample.wrench[2] * t[i];
      m[i] = sample.wrench[3] * x[i] + sample.wrench[4] * y[i] + sample.wrench[5] * t[i];
    }
    // a slope turns about t x e, and the axes a little about t
    const double about = -sample.wrench[5] * t[0] / (length * q);
    const double by_x = (m[1] * t[2] - m[2] * t[1]) / length + about * y[0];
    const double by_y = (m[2] * t[0] - m[0] * t[2]) / length + about * y[1];
    return {f[0], f[1], -by_y, by_x};
  }
};

FlexibleSettings in_gel(double modulus) { return settings(0.0006921, modulus, 0.0, 0.0, 0.024); }

/// Both ways round a rectangle in depth and across, the second time: work over what is turned over.
double rectangle(const Model& model, double along, double step, bool across_first, const Bevel& bevel = {},
                 double tip_force = 0.0) {
  FlexibleSettings gel = in_gel(50e3);
  gel.beam.layers[0].tip_force = tip_force;
  Hand<1> hand(model, gel, bevel);
  hand.start({.depth = -1e-3});
  hand.go({.depth = 0.03}, 1e-4);
  hand.go({.depth = 0.0295}, 1e-4);
  const Base home = hand.at, aside{.depth = home.depth, .lateral = {6e-3, 0.0}},
             deeper{.depth = home.depth + along}, both{.depth = deeper.depth, .lateral = aside.lateral};
  for (int cycle = 0; cycle < 2; ++cycle) {
    hand.forget();
    for (const Base& to : {across_first ? aside : deeper, both, across_first ? deeper : aside, home})
      hand.go(to, step);
  }
  return hand.work / hand.turned;
}

TEST(BendingEnergy, RectanglesOfDepthAndAsideReturnNone) {
  for (const bool across_first : {true, false}) {
    for (const double step : {6e-3, 6e-4, 6e-5}) {
      const double least = step > 1e-3 ? 0.0 : 0.05;  // of the work that is turned over
      EXPECT_GT(rectangle(paper::model(), 15e-6, step, across_first), least) << step;
      EXPECT_GT(rectangle(paper::model(), -3e-4, step, across_first), least) << step;
    }
    EXPECT_NEAR(rectangle(forceless(), 3e-4, 6e-5, across_first), 0.0, 1e-7);
  }
}

TEST(BendingEnergy, RectanglesOfATipThatIsPushedAsideReturnNone) {
  for (const double tip_force : {-0.1, 0.0, 0.1})
    for (const bool across_first : {true, false})
      for (const double step : {6e-4, 6e-5})
        for (const double along : {15e-6, -3e-4, 5e-4})
          EXPECT_GT(rectangle(paper::model(), along, step, across_first, {0.4, 0.1, 1.0}, tip_force), 0.0)
              << step;
}

/// Work along a closed path of depth and of what a tip slips aside, at a rate of one part a millisecond.
double slipped(const Model& model, unsigned seed) {
  std::mt19937 random(seed);
  const auto within = [&](double low, double high) {
    return std::uniform_real_distribution<>(low, high)(random);
  };
  Insertion needle(model, any_speed);
  double depth = 1e-3, force = 0.0, work = 0.0, turned = 0.0, all = 0.0;
  const auto go = [&](double to, double aside) {
    const double travel = (to - depth) / 200.0;
    for (int i = 0; i < 200; ++i) {
      const double after = needle.step_aside(depth += travel, aside / 200.0, 1e-3).cutting;
      const double part = 0.5 * (force + after) * (travel - aside / 200.0);
      force = after, work += part, turned += std::abs(part);
    }
  };
  for (const double to : {1.9e-3, 2.1e-3, 5e-3}) go(to, 0.0);
  const double home = depth;
  work = turned = 0.0;
  for (int turns = 0; turns < 6; ++turns) {
    const double aside = within(-6e-5, 6e-5);
    go(home + within(-1e-4, 2e-5), aside);
    all += aside;
  }
  go(home, -all);
  return turned > 0.0 ? work / turned : 0.0;
}

TEST(BendingEnergy, ATipThatSlipsAsideGetsNothingBackFromItsCut) {
  const laws::Cone cone{1e5, 0.3};
  const laws::PunctureDepth puncture{2e-3};
  const laws::Coulomb none{0.0, 1e-4, 0.0};
  const laws::StickSlip sticks{0.1, 0.04, 3e-3, 5.0, 2000.0};
  const laws::StribeckCutting runs{0.1, 0.04, 1e-3, 5.0, 2000.0, 2e-3};
  for (unsigned seed = 0; seed < 40; ++seed) {
    EXPECT_GT(slipped({cone, puncture, none, laws::ConstantCutting{0.08, 20e-6}}, seed), -1e-9) << seed;
    EXPECT_GT(slipped({cone, puncture, none, laws::Fracture{100.0, 1e-3, 1e5, 5e-4, 0.0, 20e-6}}, seed),
              -1e-9);
    EXPECT_GT(slipped({cone, puncture, none, sticks}, seed), -1e-9) << seed;
    EXPECT_GT(slipped({cone, puncture, none, runs}, seed), -1e-9) << seed;
  }
}

TEST(BendingEnergy, ATipThatSlipsAsideUnloadsItsCutBySoMuch) {
  Insertion needle({laws::Cone{1e5, 0.3}, laws::PunctureDepth{2e-3}, laws::Coulomb{0.0, 1e-4, 0.0},
                    laws::ConstantCutting{0.08, 20e-6}},
                   any_speed);
  for (const double depth : {1.9e-3, 2.1e-3, 5e-3}) needle.step(depth, no_velocity, 1.0);
  EXPECT_NEAR(needle.step_aside(5e-3, 5e-6, 1.0).cutting, 0.06, 1e-12);    // a quarter of its unloading
  EXPECT_EQ(needle.step_aside(5e-3, 1e-3, 1.0).cutting, 0.0);              // and no more than to nothing
  EXPECT_NEAR(needle.step_aside(5.01e-3, 0.0, 1.0).cutting, 0.04, 1e-12);  // from where it loads again
  EXPECT_NEAR(needle.step_aside(5.01e-3, -1e-3, 1.0).cutting, 0.08, 1e-12);
  EXPECT_NEAR(needle.step_aside(5.005e-3, 0.0, 1.0).cutting, 0.06, 1e-12);  // the cut did not run ahead
}

/// How far aside [m] a tip is at a depth; its needle is rolled at 8 mm.
template <class Axial>
double aside_at(const Axial& axial, double depth, double step, double tip_force, double roll = 0.0) {
  FlexibleSettings gel = in_gel(50e3);
  gel.small_slopes = false;
  gel.beam.layers[0].tip_force = tip_force;
  FlexibleInsertion<1, Axial> needle(axial, gel);
  needle.step({.depth = -1e-3}, 1.0);
  const double rolls = std::min(8e-3, depth);
  move(needle, {.depth = -1e-3}, {.depth = rolls}, static_cast<int>(std::ceil((rolls + 1e-3) / step)));
  move(needle, {.depth = rolls}, {.depth = rolls, .roll = roll}, 1);
  return move(needle, {.depth = rolls, .roll = roll}, {.depth = depth, .roll = roll},
              1 + static_cast<int>((depth - rolls) / step))
      .tip[0];
}
template <class Axial>
void expect_one_way_aside(const Axial& axial, double tip_force, double roll) {
  for (const double depth : {7e-3, 14.5e-3, 25e-3}) {
    const double fine = aside_at(axial, depth, 10e-6, tip_force, roll);
    for (const double step : {50e-6, 200e-6, 1e-3})
      EXPECT_NEAR(aside_at(axial, depth, step, tip_force, roll), fine, 0.01 * std::max(std::abs(fine), 2e-3))
          << tip_force << ' ' << roll << ' ' << depth << ' ' << step;
  }
}

constexpr Bevel bevelled{0.4, 0.1, 1.0};

TEST(BendingEnergy, ATipIsPushedAsideAsFarInLongStepsAsInShortOnes) {
  const laws::Coulomb friction{18.6, 20e-6, 0.0};
  const Model harder{laws::Cone{3e5, 0.26}, laws::PunctureDepth{1.5e-3}, friction,
                     laws::ConstantCutting{0.2, 20e-6}};
  const std::array layers{Layer{0.0, paper::model()}, Layer{12e-3, harder}};
  for (const double roll : {0.0, std::numbers::pi}) {
    expect_one_way_aside(Insertion(layers, any_speed, bevelled), 0.0, roll);
    for (const double tip_force : {0.1, -0.1})
      expect_one_way_aside(Insertion(layers, any_speed), tip_force, roll);
  }
  const std::array layer{Layer{0.0, paper::model()}};
  expect_one_way_aside(solid::CondensedInsertion(solid_tests::tissue(5e-4), layer, any_speed, bevelled), 0.0,
                       0.0);
}

TEST(BendingEnergy, ATipThatPuncturesFollowsItsFace) {
  const Insertion axial(paper::model(), any_speed, bevelled);
  const double w = 1.0 / std::tan(0.4 + std::atan(0.1)), unloading = 20e-6;
  for (const double step : {20e-6, 100e-6, 200e-6}) {
    const double way = 3.4e-3 - 3.237e-3;  // since the puncture: w of it aside at most, and its unloading
    EXPECT_LT(w * aside_at(axial, 3.4e-3, step, 0.0), way + unloading) << step;
    EXPECT_GT(w * aside_at(axial, 3.4e-3, step, 0.0), 0.9 * way) << step;
  }
}

TEST(BendingEnergy, BaseMovedAsideDrawsTheTipBackFromItsCut) {
  Hand<1> hand(paper::model(), in_gel(50e3));
  hand.start({.depth = -1e-3});
  hand.go({.depth = 0.03}, 1e-4);
  const double before = hand.last.tip[2];
  EXPECT_NEAR(hand.last.axial.cutting, 0.0776, 1e-9);
  hand.go({.depth = 0.03, .lateral = {6e-3, 0.0}}, 1e-4);
  EXPECT_NEAR(hand.last.tip[2] - before, -0.51e-3, 0.02e-3);
  EXPECT_EQ(hand.last.axial.cutting, 0.0);
  EXPECT_LT(hand.last.force, -0.4);  // the friction is that of a needle that is drawn back
}

TEST(BendingEnergy, ATipThatSpringsOutOfTheTissueHasNoForceLeft) {
  for (const FoundationForm form :
       {FoundationForm::linear, FoundationForm::cubic, FoundationForm::hyperbolic}) {
    FlexibleSettings settings = bending_tests::settings(1.66e-4, 70e3, 0.0, 0.0, 0.037);
    settings.beam.layers[0].form = form;
    settings.beam.layers[0].scale = 1e-3;
    Hand<1> hand(forceless(), settings);
    hand.start({.depth = -1e-3});
    hand.go({.depth = 0.02}, 1e-4);
    hand.go({.depth = 0.02, .lateral = {-3e-3, 0.0}}, 3e-5);
    hand.go({.depth = -2e-3, .lateral = {-3e-3, 0.0}}, 8e-5);
    EXPECT_NEAR(hand.last.force, 0.0, 1e-12);
    EXPECT_NEAR(hand.last.wrench[0], 0.0, 1e-9);
    EXPECT_NEAR(hand.last.tip[0], -3e-3, 1e-9);  // and is straight
    EXPECT_EQ(hand.last.status, Status::ok);
    EXPECT_GE(hand.lowest, -1e-9 * hand.turned);
  }
}

TEST(BendingEnergy, TheSearchForTheForceGivesUpABoundThatAnotherShapeContradicts) {
  ForceSearch search;
  double give = 0.0;
  search.next(0.0, 0.0, 0.0, 0.0, give);  // a tip that was tried outside the tissue: nothing is missing
  EXPECT_DOUBLE_EQ(search.next(0.0, 0.06, 0.0, 0.0, give), 0.06);
}

double drawn(std::mt19937& random, double low, double high) {
  return low * std::pow(high / low, std::uniform_real_distribution<>(0.0, 1.0)(random));
}
double between_two(std::mt19937& random, double low, double high) {
  return std::uniform_real_distribution<>(low, high)(random);
}

FlexibleSettings drawn_settings(std::mt19937& random, bool plain) {
  FlexibleSettings settings = bending_tests::settings(drawn(random, 1e-4, 2e-2), drawn(random, 5e3, 3e5), 0.0,
                                                      0.0, between_two(random, 0.01, 0.05));
  if (random() % 2 == 0) {
    settings.beam.support.guide_distance = Support::no_guide;
    settings.beam.support.needle_length = between_two(random, 0.08, 0.15);
  }
  if (plain) return settings;
  settings.beam.layers[1] = {.top = between_two(random, 2e-3, 15e-3), .modulus = drawn(random, 5e3, 3e5)};
  settings.beam.layer_count = 1 + random() % 2;
  for (std::size_t i = 0; i < settings.beam.layer_count; ++i) {
    LateralLayer& layer = settings.beam.layers[i];
    layer.form = static_cast<FoundationForm>(random() % 4);
    layer.scale = drawn(random, 1e-4, 3e-3);
    if (random() % 3 == 0)
      layer.yielding_modulus = drawn(random, 1e4, 1e6), layer.yield_force = drawn(random, 2.0, 300.0);
    if (random() % 3 == 0) layer.tip_force = between_two(random, 0.0, 0.2);
    if (random() % 3 == 0) layer.tip_stiffness = drawn(random, 10.0, 1e3);
  }
  if (random() % 3 == 0) settings.lengths.bevel_length = drawn(random, 5e-4, 5e-3);
  if (random() % 5 == 0) settings.lengths.pressure_friction = between_two(random, 0.05, 0.5);
  if (random() % 3 == 0) settings.beam.support.pivot_stiffness = drawn(random, 10.0, 1e4);
  if (random() % 3 == 0) settings.beam.support.rotational_compliance = drawn(random, 0.01, 10.0);
  return settings;
}

/// In, along a closed path twice, and with friction out.
template <std::size_t dimension>
Hand<dimension> closed_motion(unsigned seed, bool frictionless, double step) {
  std::mt19937 random(seed);
  Model model = forceless();
  if (!frictionless)
    model = {laws::Cone{drawn(random, 1e4, 2e5), between_two(random, 0.2, 0.5)},
             laws::PunctureDepth{drawn(random, 5e-4, 4e-3)},
             laws::Coulomb{drawn(random, 1.0, 40.0), drawn(random, 1e-5, 5e-4), 0.0},
             laws::ConstantCutting{drawn(random, 0.01, 0.5), drawn(random, 1e-5, 1e-4)}};
  const FlexibleSettings settings = drawn_settings(random, frictionless);
  const Bevel bevel{0.2 + 0.1 * (seed % 7), 0.2, seed % 2 == 0 || frictionless ? 0.0 : 1.0};
  Hand<dimension> hand(model, settings, bevel);
  const double depth = between_two(random, 0.01, 0.04);
  hand.start({.depth = -1e-3});
  hand.go({.depth = depth}, step);
  if (frictionless) hand.go({.depth = depth - 2e-3}, step), hand.forget();
  const Base home = hand.at;
  std::vector<Base> places(4, home);
  for (Base& place : places) {
    place.depth += between_two(random, -5e-3, 1.9e-3);
    for (std::size_t d = 0; d < dimension; ++d) {
      place.lateral[d] = between_two(random, -4e-3, 4e-3);
      place.tilt[d] = between_two(random, -0.05, 0.05);
    }
    if (dimension > 1) place.roll = between_two(random, -2.0, 2.0);
  }
  for (int cycle = 0; cycle < 2; ++cycle) {
    for (const Base& place : places) hand.go(place, step);
    hand.go(home, step);
  }
  if (!frictionless) hand.go({.depth = depth}, step), hand.go({.depth = -1e-3}, step);
  return hand;
}

template <std::size_t dimension>
void expect_none_returned(unsigned seed) {
  const auto hand = closed_motion<dimension>(seed, false, 4e-4);
  if (!hand.moved) return;
  EXPECT_GE(hand.lowest, -1e-9 * hand.turned) << seed;
}

TEST(BendingEnergy, RandomMotionsWithFrictionNeverReturnAny) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    expect_none_returned<1>(seed);
    expect_none_returned<2>(seed + 1000);
  }
}

TEST(BendingEnergy, RandomMotionsWithoutFrictionTakeNoneAsTheStepShrinks) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    // what a hand adds up from samples is of second order in the step
    const auto coarse = closed_motion<1>(seed, true, 2e-4), fine = closed_motion<1>(seed, true, 5e-5);
    EXPECT_LT(std::abs(coarse.work), 1e-4 * coarse.turned) << seed;
    EXPECT_LT(std::abs(fine.work), 8e-6 * fine.turned) << seed;
  }
}

TEST(BendingEnergy, OwnFunctionsAreThoseOfTheLibrary) {
  for (int k = 1; k < 20000; ++k) {
    const long double angle = 0.037L * k - 370.0L, x = 1e-3L * k;
    const auto [cosine, sine] = bending::cos_sin(static_cast<double>(angle));
    const long double at = static_cast<double>(angle), up = static_cast<double>(x);
    EXPECT_NEAR(cosine, static_cast<double>(std::cos(at)), 4e-16);
    EXPECT_NEAR(sine, static_cast<double>(std::sin(at)), 4e-16);
    EXPECT_NEAR(bending::falling(static_cast<double>(x)) / static_cast<double>(std::exp(-up)), 1.0, 4e-16);
    EXPECT_NEAR(bending::tanh_of(static_cast<double>(x)) / static_cast<double>(std::tanh(up)), 1.0, 5e-16);
  }
}

}  // namespace
