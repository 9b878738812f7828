// SPDX-License-Identifier: Apache-2.0
// The path that a bevelled needle cuts, against independent solutions and closed forms.
#include <gtest/gtest.h>

#include <vector>

#include "bending.hpp"

namespace {

using namespace bending_tests;

double guided_tip(FlexibleSettings settings, double step, double depth = 0.08) {
  PlanarInsertion needle = forceless_insertion<1>(settings);
  return insert(needle, depth, static_cast<int>(std::lround(depth / step))).tip[0];
}

/// Volterra's equation with exact kernels, Romberg: insertion_guided_uniform_tip80mm.
constexpr double volterra = 0.002340250250286602;

TEST(BendingPath, MeetsVolterraSolutionOfAGuidedNeedle) {
  EXPECT_NEAR(guided_tip(guided(), 1e-4) / volterra, 1.0, 2e-6);
}

TEST(BendingPath, DoesNotDependOnTheStep) {
  const double reference = guided_tip(guided(), 1e-4);
  for (const double step : {5e-6, 20e-6, 50e-6, 0.2e-3, 0.5e-3, 5e-3})
    EXPECT_NEAR(guided_tip(guided(), step) / reference, 1.0, 1e-8) << step;
}

TEST(BendingPath, ConvergesWithTheSpacingOfThePathInSecondOrder) {
  std::vector<double> errors;
  for (const double spacing : {1e-4, 5e-5}) {
    FlexibleSettings settings = guided();
    settings.beam.elements = 100;
    settings.lengths.path_spacing = spacing;
    errors.push_back(guided_tip(settings, spacing) - volterra);
  }
  EXPECT_NEAR(std::log2(errors[0] / errors[1]), 2.0, 0.3);
}

/// P = P0 (1 - exp(-s / b)) switched on in a long straight channel: path_exp_buildup_Y40mm.
double channel_tip(std::size_t elements) {
  FlexibleSettings settings = thin();
  settings.beam.elements = elements;
  PlanarInsertion needle = forceless_insertion<1>(settings);
  return move(needle, {.depth = 0.1}, {.depth = 0.14}, 40).tip[0];
}

TEST(BendingPath, MeetsTheClosedFormInALongChannel) {
  constexpr double closed_form = 0.005128282422214068;
  EXPECT_NEAR(channel_tip(40) / closed_form, 1.0, 2e-5);
  const double coarse = std::abs(channel_tip(10) - channel_tip(100));
  const double fine = std::abs(channel_tip(20) - channel_tip(100));
  EXPECT_GT(std::log2(coarse / fine), 3.5);  // Hermite elements: fourth order
}

TEST(BendingPath, SteersSteadilyWithTheClosedFormCurvature) {
  PlanarInsertion needle = forceless_insertion<1>(thin());
  const double a = move(needle, {.depth = 0.1}, {.depth = 0.18}, 80).tip[0];
  const double b = needle.step({.depth = 0.181}, 1.0).tip[0], c = needle.step({.depth = 0.182}, 1.0).tip[0];
  EXPECT_NEAR((a - 2.0 * b + c) / 1e-6 / 4.587276942993974, 1.0, 2e-3);
  const BentSample sample = needle.step({.depth = 0.182}, 1.0);
  const double lag = (c - b) / 1e-3 + 0.5e-3 * 4.587276942993974 - sample.tangent[0];
  EXPECT_NEAR(lag / 0.02253456727278706, 1.0, 5e-3);
}

TEST(BendingPath, FlippedBevelIsASuperposition) {
  // a bevel that turns by half a turn at s adds the path of -2 P from there
  const double flip = 0.02, end = 0.05;
  PlanarInsertion turned = forceless_insertion<1>(thin()), plain = forceless_insertion<1>(thin());
  move(turned, {.depth = 0.1}, {.depth = 0.1 + flip}, 20);
  turned.step({.depth = 0.1 + flip, .roll = std::numbers::pi}, 1.0);
  const Base after{.depth = 0.1 + flip, .roll = std::numbers::pi};
  const double both = move(turned, after, {.depth = 0.1 + end, .roll = std::numbers::pi}, 30).tip[0];
  const double whole = move(plain, {.depth = 0.1}, {.depth = 0.1 + end}, 50).tip[0];
  PlanarInsertion later = forceless_insertion<1>(thin());
  const double part = move(later, {.depth = 0.1 + flip}, {.depth = 0.1 + end}, 30).tip[0];
  EXPECT_NEAR(both, whole - 2.0 * part, 1e-5 * whole);
}

TEST(BendingPath, InSpaceIsThatOfThePlaneTurnedByTheRoll) {
  FlexibleSettings settings = guided();
  settings.small_slopes = false;
  PlanarInsertion plane = forceless_insertion<1>(settings);
  const BentSample flat = insert(plane, 0.08, 80);
  for (const double roll : {0.0, 0.5, 2.0, -1.3}) {
    SpatialInsertion space = forceless_insertion<2>(settings);
    const BentSample sample = move(space, {.depth = 0.0, .roll = roll}, {.depth = 0.08, .roll = roll}, 80);
    EXPECT_NEAR(sample.tip[0], flat.tip[0] * std::cos(roll), 1e-12);
    EXPECT_NEAR(sample.tip[1], flat.tip[0] * std::sin(roll), 1e-12);
    EXPECT_NEAR(sample.tip[2], flat.tip[2], 1e-9);
    EXPECT_NEAR(sample.wrench[4], flat.wrench[4] * std::cos(roll), 1e-12);
    EXPECT_NEAR(sample.wrench[3], -flat.wrench[4] * std::sin(roll), 1e-12);
    EXPECT_NEAR(sample.wrench[5], 0.0, 1e-9);
  }
}

TEST(BendingPath, NeedleThatSpinsFastGoesStraight) {
  SpatialInsertion needle = forceless_insertion<2>(guided());
  const double turns = 0.08 / 1e-3;  // one turn a millimetre, far below the bevel's length
  const BentSample sample =
      move(needle, {.depth = 0.0}, {.depth = 0.08, .roll = 2.0 * std::numbers::pi * turns}, 800);
  EXPECT_EQ(sample.status, Status::ok);
  EXPECT_LT(std::hypot(sample.tip[0], sample.tip[1]), 0.05 * volterra);
}

TEST(BendingPath, FastRollGivesTheSamePathInFewStepsAsInMany) {
  std::vector<BentSample> tips;
  for (const int n : {80, 8000}) {
    SpatialInsertion needle = forceless_insertion<2>(guided());
    tips.push_back(move(needle, {.depth = 0.0}, {.depth = 0.08, .roll = 100.0}, n));
  }
  EXPECT_NEAR(tips[0].tip[0], tips[1].tip[0], 1e-8 * volterra);
  EXPECT_NEAR(tips[0].tip[1], tips[1].tip[1], 1e-8 * volterra);
}

TEST(BendingPath, LayersOfOneTissueAreOneLayer) {
  FlexibleSettings settings = guided();
  const double one = guided_tip(settings, 1e-3);
  settings.beam.layer_count = 4;
  for (int i = 1; i < 4; ++i) {
    settings.beam.layers[i] = settings.beam.layers[0];
    settings.beam.layers[i].top = 0.0003 + 0.021 * i;
  }
  EXPECT_NEAR(guided_tip(settings, 1e-3) / one, 1.0, 1e-7);
  settings.beam.layers[1].top = 1e-4;  // thinner than an element
  EXPECT_NEAR(guided_tip(settings, 1e-3) / one, 1.0, 1e-6);
}

/// The tip of a needle that meets, at a depth, a layer with another force on its tip.
double tip_beyond(double top, double modulus, double spacing) {
  FlexibleSettings settings = bending_tests::settings(6.9e-4, modulus, 0.0, 0.0, 0.024);
  settings.beam.layers[1] = {.top = top, .modulus = modulus, .tip_force = 0.05};
  settings.beam.layer_count = 2;
  settings.lengths.path_spacing = spacing;
  return guided_tip(settings, 1e-3, 0.04);
}

TEST(BendingPath, TurnsWhereItMeetsALayerWhateverTheSpacing) {
  for (const double modulus : {5e3, 20e3, 80e3}) {
    for (const double top : {10.0e-3, 10.13e-3, 10.37e-3, 10.66e-3}) {
      const double fine = tip_beyond(top, modulus, 2.5e-5);
      for (const double share : {1.0, 0.5, 0.25})  // of 0.8 mm: second order
        EXPECT_NEAR(tip_beyond(top, modulus, 8e-4 * share) / fine, 1.0, 2e-4 + 2e-3 * share * share)
            << modulus << ' ' << top << ' ' << share;
    }
  }
}

TEST(BendingPath, SectionsOfOneStiffnessAreOneNeedle) {
  FlexibleSettings settings = guided();
  const double one = guided_tip(settings, 1e-3);
  const double stiffness = settings.beam.sections.list[0].stiffness;
  const std::array sections{Section{.end = 0.0123, .stiffness = stiffness},
                            Section{.end = 0.0871, .stiffness = stiffness}, Section{.stiffness = stiffness}};
  settings.beam.sections = Sections(std::span<const Section>(sections));
  EXPECT_NEAR(guided_tip(settings, 1e-3) / one, 1.0, 1e-6);
}

TEST(BendingPath, ShortSectionsAreDoneWhateverTheRounding) {
  // where a section ends, by way of the depth, is not exact: the step once did not end
  FlexibleSettings settings = guided();
  const double one = guided_tip(settings, 1e-3);
  const double stiffness = settings.beam.sections.list[0].stiffness;
  const std::array sections{Section{.end = 3e-9, .stiffness = stiffness},
                            Section{.end = 1.1e-6, .stiffness = stiffness}, Section{.stiffness = stiffness}};
  settings.beam.sections = Sections(std::span<const Section>(sections));
  EXPECT_NEAR(guided_tip(settings, 1e-3) / one, 1.0, 1e-6);
}

TEST(BendingPath, FreeNeedleThatIsBentTakesItsOwnShape) {
  FlexibleSettings settings = guided();
  const std::array sections{Section{.end = 0.01, .stiffness = 0.02, .curvature = 5.0},
                            Section{.stiffness = 0.02}};
  settings.beam.sections = Sections(std::span<const Section>(sections));
  PlanarInsertion needle = forceless_insertion<1>(settings);
  EXPECT_NEAR(needle.step({.depth = -5e-3}, 1.0).tip[0], 0.5 * 5.0 * 0.01 * 0.01, 1e-12);
  const BentSample turned = needle.step({.depth = -5e-3, .roll = std::numbers::pi}, 1.0);
  EXPECT_NEAR(turned.tip[0], -0.5 * 5.0 * 0.01 * 0.01, 1e-12);
  EXPECT_NEAR(turned.wrench[4], 0.0, 1e-12);
}

TEST(BendingPath, PathOfConstantCurvatureIsAnArc) {
  // a channel whose curvature is the needle's own leaves the needle unloaded: a quarter of a circle
  FlexibleSettings settings = thin(0.0);
  settings.small_slopes = false;
  settings.lengths.max_slope = 1.5;
  settings.beam.support.guide_distance = 0.0;
  settings.beam.layers[0].tip_force = 0.0;
  const double curvature = 10.0, length = 0.1;
  const std::array sections{Section{.stiffness = 0.0001662, .curvature = curvature}};
  settings.beam.sections = Sections(std::span<const Section>(sections));
  PlanarInsertion needle = forceless_insertion<1>(settings);
  const BentSample sample = insert(needle, length, 200);
  const double angle = curvature * length;
  EXPECT_NEAR(sample.tip[0] / ((1.0 - std::cos(angle)) / curvature), 1.0, 1e-3);
  EXPECT_NEAR(sample.tip[2] / (std::sin(angle) / curvature), 1.0, 1e-3);
}

}  // namespace
