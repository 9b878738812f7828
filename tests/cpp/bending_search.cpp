// SPDX-License-Identifier: Apache-2.0
// Equilibrium in tissue that yields or is nonlinear, whatever the base does: found, and the right one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "bending.hpp"

using namespace bending_tests;

namespace {

constexpr int insertions = 20, steps = 16;

double between(std::mt19937& random, double low, double high) {
  return low * std::pow(high / low, std::uniform_real_distribution<>(0.0, 1.0)(random));
}

/// A skin and what is below, from gel to hide; a guide near or far.
FlexibleSettings drawn(std::mt19937& random, FoundationForm form) {
  FlexibleSettings settings = guided();
  settings.beam.layer_count = 2;
  settings.beam.elements = 30;
  settings.lengths.max_slope = 1.5;
  settings.lengths.path_spacing = 5e-4;
  settings.lengths.max_travel = 0.02;
  settings.lengths.tip_memory = between(random, 1e-3, 1e-2);
  settings.beam.support.guide_distance = between(random, 5e-3, 0.05);
  settings.beam.support.rotational_compliance = between(random, 0.5, 10.0);
  const double modulus = between(random, 5e3, 5e5), tip_force = between(random, 0.02, 0.6);
  for (std::size_t j = 0; j < 2; ++j) {
    LateralLayer& layer = settings.beam.layers[j];
    layer = {.modulus = modulus, .tip_force = tip_force};
    layer.tip_stiffness = between(random, 20.0, 300.0);
    layer.form = form;
    if (form == FoundationForm::linear) {
      layer.yielding_modulus = between(random, 2e4, 4e6);
      layer.yield_force = between(random, 2.0, 800.0);
    } else {
      layer.scale = between(random, 5e-5, 2e-3);
    }
  }
  settings.beam.layers[1].top = 2e-3;
  return settings;
}

/// The needle and one with many more iterations go through the same random motions of the base; the largest
/// distance of their tips [m].
template <std::size_t dimension>
double distance(unsigned seed, FoundationForm form) {
  std::mt19937 random(seed);
  std::normal_distribution<> aside(0.0, 2e-3);
  FlexibleSettings settings = drawn(random, form);
  auto needle = forceless_insertion<dimension>(settings);
  settings.beam.max_iterations = 300;
  settings.beam.tolerance = 1e-12;
  auto patient = forceless_insertion<dimension>(settings);
  const double step = between(random, 1e-3, 5e-3);
  double apart = 0.0;
  Base base;
  for (int i = 0; i < 2 * steps; ++i) {
    if (i % 2 != 0) {
      base.depth += step;
    } else {
      for (std::size_t d = 0; d < dimension; ++d)
        base.lateral[d] = std::clamp(base.lateral[d] + aside(random), -8e-3, 8e-3);
    }
    const BentSample found = needle.step(base, 1.0), exact = patient.step(base, 1.0);
    EXPECT_EQ(found.status, Status::ok) << "insertion " << seed << ", step " << i;
    for (std::size_t d = 0; d < dimension; ++d)
      apart = std::max(apart, std::abs(found.tip[d] - exact.tip[d]));
  }
  return apart;
}

}  // namespace

TEST(BendingSearch, FindsTheEquilibriumOfTissueThatYields) {
  for (unsigned seed = 0; seed < insertions; ++seed) {
    EXPECT_LT(distance<1>(seed, FoundationForm::linear), 1e-7) << seed;
    EXPECT_LT(distance<2>(seed, FoundationForm::linear), 1e-7) << seed;
  }
}

TEST(BendingSearch, FindsTheEquilibriumOfEachNonlinearFoundation) {
  for (const FoundationForm form : {FoundationForm::cubic, FoundationForm::hyperbolic, FoundationForm::tanh})
    for (unsigned seed = 0; seed < insertions; ++seed) {
      EXPECT_LT(distance<1>(seed, form), 1e-8) << seed;
      EXPECT_LT(distance<2>(seed, form), 1e-8) << seed;
    }
}

TEST(BendingSearch, MotionsAcrossOfWholeSpacingsOfThePathLeaveNoRemainder) {
  // which by rounding may be below zero, and a push without motion across then had no end
  FlexibleSettings settings = guided();
  settings.beam.layers[0].yielding_modulus = 1e5;
  settings.beam.layers[0].yield_force = 50.0;
  settings.lengths.path_spacing = 2e-4;
  for (int whole = 1; whole <= 60; ++whole) {
    auto needle = forceless_insertion<2>(settings);
    Base base{.lateral = {1.5e-4, 0.0}};
    needle.step(base, 1.0);
    base.depth = 5e-3;
    needle.step(base, 1.0);
    base.lateral[0] = 1.5e-4 + 2e-4 * whole;
    EXPECT_EQ(needle.step(base, 1.0).status, Status::ok);
    base.depth = 6e-3;
    const BentSample pushed = needle.step(base, 1.0);
    EXPECT_EQ(pushed.status, Status::ok) << whole;
    EXPECT_TRUE(std::isfinite(pushed.tip[0])) << whole;
  }
}
