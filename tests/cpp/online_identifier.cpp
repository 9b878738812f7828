// SPDX-License-Identifier: Apache-2.0
// Least squares a row at a time against closed forms, and parameters recovered from forces by formula.
#include "needleforce/online/online_identifier.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace {

using namespace needleforce;
using online::Expected;
using online::OnlineIdentifier;
using online::OnlinePrior;

TEST(SquareRoot, ALineHasTheCoefficientsAndTheCovarianceOfTheNormalEquations) {
  online::SquareRoot<4> root;
  root.set(0, 0.0, 1e8);
  root.set(1, 0.0, 1e8);
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 1.0);
  long double n = 0, sx = 0, sxx = 0, sy = 0, sxy = 0;
  for (int i = 0; i < 200; ++i) {
    const double x = 0.01 * i, y = 3.0 - 2.0 * x + noise(random);
    root.add({1.0, x}, y);
    n += 1, sx += x, sxx += x * x, sy += y, sxy += x * y;
  }
  const long double det = n * sxx - sx * sx;
  const auto mean = root.mean();
  EXPECT_NEAR(mean[0], static_cast<double>((sxx * sy - sx * sxy) / det), 1e-9);
  EXPECT_NEAR(mean[1], static_cast<double>((n * sxy - sx * sy) / det), 1e-9);
  EXPECT_NEAR(root.variance(0), static_cast<double>(sxx / det), 1e-9);
  EXPECT_NEAR(root.variance({1.0, 2.0}), static_cast<double>((sxx - 4 * sx + 4 * n) / det), 1e-9);
}

TEST(SquareRoot, APriorAndAReadingAreWeightedByTheirVariances) {
  online::SquareRoot<4> root;
  root.set(0, 5.0, 2.0);
  const auto found = root.add({1.0}, 8.0);  // variances 4 and 1
  EXPECT_NEAR(root.mean()[0], (5.0 / 4.0 + 8.0) / (1.0 / 4.0 + 1.0), 1e-12);
  EXPECT_NEAR(root.variance(0), 1.0 / (1.0 / 4.0 + 1.0), 1e-12);
  EXPECT_NEAR(found.squared, 9.0 / 5.0, 1e-12);
  EXPECT_NEAR(found.widening, 5.0, 1e-12);
}

TEST(SquareRoot, WhatComesInFrontLeavesTheMarginalDistributionOfTheOthers) {
  online::SquareRoot<6> root;
  for (std::size_t i = 0; i < 3; ++i) root.set(i, 0.0, 10.0);
  std::mt19937 random(2);
  std::normal_distribution<double> number(0.0, 1.0);
  for (int i = 0; i < 30; ++i) root.add({number(random), number(random), number(random)}, number(random));
  const auto before = root;
  root.shift(2);
  for (std::size_t i = 0; i < 3; ++i) root.set(i, 1.0, 3.0);  // the first of them is forgotten
  EXPECT_NEAR(root.variance(3), before.variance(1), 1e-12);
  EXPECT_NEAR(root.mean()[4], before.mean()[2], 1e-12);
  EXPECT_NEAR(root.variance({0.0, 0.0, 0.0, 1.0, 1.0}), before.variance({0.0, 1.0, 1.0}), 1e-12);
  EXPECT_NEAR(root.mean()[0], 1.0, 1e-12);
}

/// The source paper's force inwards, for a tip by Sneddon's closed form.
double paper(double h, double modulus, double angle) {
  if (h <= 0.0) return 0.0;
  return h < 5e-3 ? 2.0 / std::numbers::pi * modulus * std::tan(angle) * h * h : 0.1 + 40.0 * h;
}

TEST(OnlineIdentifier, TheTipOfThePriorGivesTheModulus) {
  for (const double angle : {0.2618, 0.6}) {
    OnlinePrior prior{};
    prior.tip = tips::Cone{angle};
    prior.layers = 1;
    OnlineIdentifier online(prior);
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0.0, 1e-3);
    for (int i = 0; i < 10000; ++i) {
      const double z = -2e-3 + 2e-6 * i;
      online.step(paper(z, 2e5, angle) + noise(random), z, 1e-3);
    }
    const auto layer = online.layer(0);
    EXPECT_EQ(online.pierced(), 1u);
    EXPECT_NEAR(layer.modulus.value, 2e5, 3.0 * layer.modulus.sd + 4e3);
    EXPECT_LT(layer.modulus.sd, 2e4);
    EXPECT_NEAR(layer.friction.value, 40.0, 4.0);
    EXPECT_NEAR(layer.cutting.value, 0.1, 0.04);
    EXPECT_NEAR(layer.puncture_depth, 5e-3, 5e-5);
  }
}

TEST(OnlineIdentifier, APriorThreeTimesTooStiffIsGivenUp) {
  OnlinePrior prior{};
  prior.layers = 1;
  prior.same_tissue = true;
  prior.layer[0].modulus = {6e5, 3e4};  // and is sure of it
  OnlineIdentifier online(prior);
  for (int i = 0; i < 6500; ++i) {
    const double z = -2e-3 + 1e-6 * i;
    online.step(paper(z, 2e5, 45.0 * tips::degree) + 1e-3 * std::sin(1.7 * i), z, 1e-3);
  }
  const auto modulus = online.layer(0).modulus;
  EXPECT_LT(std::abs(modulus.value - 2e5), 2.0 * modulus.sd);
  EXPECT_GT(std::abs(modulus.value - 6e5), 2.0 * modulus.sd);
}

TEST(OnlineIdentifier, ForceAheadHoldsWhatComes) {
  OnlineIdentifier online;
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0.0, 2e-3);
  int held = 0, asked = 0;
  for (int i = 0; i < 6000; ++i) {
    const double z = -2e-3 + 1e-6 * i;
    online.step(paper(z, 2e5, 45.0 * tips::degree) + noise(random), z, 1e-3);
    if (i < 3000 || i % 100) continue;
    const auto last = online.ahead(5e-4).at.back();
    const double comes = paper(z + 5e-4, 2e5, 45.0 * tips::degree);
    held += last.low <= comes && comes <= last.high;
    ++asked;
  }
  EXPECT_EQ(asked, 30);
  EXPECT_GE(held, 27);
}

TEST(OnlineIdentifier, ALeapOfTheDepthIsAnotherNeedle) {
  OnlineIdentifier online;
  for (int i = 0; i < 5000; ++i) online.step(paper(-2e-3 + 2e-6 * i, 2e5, 0.6), -2e-3 + 2e-6 * i, 1e-3);
  EXPECT_EQ(online.pierced(), 1u);
  online.step(0.0, -30e-3, 1e-3);
  EXPECT_EQ(online.pierced(), 0u);
  EXPECT_FALSE(online.layer(0).touched);
  EXPECT_EQ(online.regime(), online::Regime::unknown);
}

}  // namespace
