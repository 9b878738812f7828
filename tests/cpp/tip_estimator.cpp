// SPDX-License-Identifier: Apache-2.0
// Tip and shape estimated in the loop: the filter against the whole covariance, late readings, other frames.
#include "needleforce/bending/tip_estimator.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "bending.hpp"

namespace {

using namespace bending_tests;

constexpr std::size_t no_modes = 0;

/// Covariance of the errors of position at two travels: closed forms of the processes.
double covariance(const PathUncertainty& u, double s, double t) {
  const double less = std::min(s, t), more = std::max(s, t), l = u.common_length;
  const double wiener = u.unevenness * less * less * (3.0 * more - less) / 6.0;
  const double relaxing =
      2.0 * less / l - 1.0 + std::exp(-less / l) + std::exp(-more / l) - std::exp(-(more - less) / l);
  return u.offset * u.offset + u.tilt * u.tilt * s * t + wiener +
         u.common_slope * u.common_slope * l * l * relaxing;
}

/// Solves a x = b by elimination; small and symmetric.
std::vector<double> solved(std::vector<std::vector<double>> a, std::vector<double> b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = k + 1; i < n; ++i) {
      const double factor = a[i][k] / a[k][k];
      for (std::size_t j = k; j < n; ++j) a[i][j] -= factor * a[k][j];
      b[i] -= factor * b[k];
    }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) b[k] -= a[k][j] * b[j];
    b[k] /= a[k][k];
  }
  return b;
}

TEST(PathFilter, IsTheConditionalOfTheWholeCovariance) {
  PathUncertainty u;
  u.unevenness = 1e-3;
  const std::vector<double> at{0.0, 3e-3, 0.011, 0.012, 0.03, 0.055, 0.08};
  const std::vector<double> read{0.3e-3, 0.1e-3, -0.2e-3, 0.4e-3, 1.1e-3, 0.9e-3, 2.2e-3};
  PathFilter<no_modes> filter(u);
  PathFilter<no_modes>::Row row{};
  row[filter.position(0)] = 1.0;
  double before = 0.0;
  for (std::size_t k = 0; k < at.size(); ++k) {
    // in uneven steps: the result does not depend on them
    for (const double share : {0.2, 0.05, 0.75}) filter.advance(share * (at[k] - before));
    filter.take(row, read[k] - filter.expected(row), u.tip_noise * u.tip_noise);
    before = at[k];
  }
  filter.advance(0.1 - before);
  std::vector<std::vector<double>> gram(at.size(), std::vector<double>(at.size()));
  std::vector<double> cross(at.size());
  for (std::size_t i = 0; i < at.size(); ++i) {
    for (std::size_t j = 0; j < at.size(); ++j) gram[i][j] = covariance(u, at[i], at[j]);
    gram[i][i] += u.tip_noise * u.tip_noise;
    cross[i] = covariance(u, at[i], 0.1);
  }
  const std::vector<double> by_reading = solved(gram, read), by_cross = solved(gram, cross);
  double mean = 0.0, variance = covariance(u, 0.1, 0.1);
  for (std::size_t i = 0; i < at.size(); ++i) {
    mean += cross[i] * by_reading[i];
    variance -= cross[i] * by_cross[i];
  }
  EXPECT_NEAR(filter.expected(row), mean, 1e-9);
  EXPECT_NEAR(filter.covariance(row, row), variance, 1e-12);
}

SpatialInsertion needle(double modulus, double tip_force) {
  FlexibleSettings settings = guided();
  settings.beam.layers[0].modulus = modulus;
  settings.beam.layers[0].tip_force = tip_force;
  settings.lengths.path_spacing = 5e-4;
  settings.beam.elements = 20;
  return forceless_insertion<2>(settings);
}

/// Two modes: a tip force 20 % up, a modulus a factor of e up.
std::unique_ptr<TipEstimator> estimator(const PathUncertainty& uncertainty = {}) {
  const std::vector<SpatialInsertion> varied{needle(20e3, 0.24), needle(20e3 * std::numbers::e, 0.2)};
  return std::make_unique<TipEstimator>(needle(20e3, 0.2), varied, uncertainty);
}

/// To a depth in steps of 1 mm in 0.1 s, with the estimate after each.
template <class Read>
TipEstimate push(TipEstimator& estimator, double from, double to, Read read) {
  TipEstimate estimate;
  const int n = static_cast<int>(std::lround((to - from) / 1e-3));
  for (int i = 1; i <= n; ++i) {
    estimate = estimator.step({.depth = from + 1e-3 * i}, 0.1);
    read(from + 1e-3 * i);
  }
  return estimator.estimate();
}
const auto nothing = [](double) {};

TEST(TipEstimator, WithoutReadingsItIsTheNeedleWithItsPriorUncertainty) {
  PathUncertainty u;
  const auto filter = estimator(u);
  const TipEstimate estimate = push(*filter, 0.0, 0.06, nothing);
  SpatialInsertion alone = needle(20e3, 0.2), stronger = needle(20e3, 0.24),
                   stiffer = needle(20e3 * std::numbers::e, 0.2);
  double tip = 0.0, by_force = 0.0, by_modulus = 0.0;
  for (int i = 1; i <= 60; ++i) {
    const Base base{.depth = 1e-3 * i};
    tip = alone.step(base, 0.1).tip[0];
    by_force = stronger.step(base, 0.1).tip[0] - tip;
    by_modulus = stiffer.step(base, 0.1).tip[0] - tip;
  }
  EXPECT_NEAR(estimate.tip[0], tip, 1e-12);
  const double variance = covariance(u, 0.06, 0.06) + by_force * by_force + by_modulus * by_modulus;
  EXPECT_NEAR(estimate.covariance[0] / variance, 1.0, 1e-6);
  EXPECT_NEAR(estimate.covariance[2] / covariance(u, 0.06, 0.06), 1.0, 1e-6);
}

TEST(TipEstimator, FollowsANeedleThatDrawsFromItsPrior) {
  // parameters, pose and noise from the filter's own distributions: the error is as large as it expects
  PathUncertainty u;
  u.unevenness = 1e-12;
  u.common_slope = 1e-9;
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  const auto filter = estimator(u);
  double squares = 0.0, alone = 0.0;
  int count = 0;
  for (int trial = 0; trial < 60; ++trial) {
    filter->reset();
    const double a = normal(generator), b = normal(generator);
    SpatialInsertion truth = needle(20e3 * std::exp(b), 0.2 * (1.0 + 0.2 * a)), nominal = needle(20e3, 0.2);
    const std::array<double, 2> offset{u.offset * normal(generator), u.offset * normal(generator)};
    const std::array<double, 2> tilt{u.tilt * normal(generator), u.tilt * normal(generator)};
    std::array<double, 2> tip{};
    for (int i = 1; i <= 60; ++i) {
      const Base base{.depth = 1e-3 * i};
      const BentSample sample = truth.step(base, 0.1);
      for (std::size_t d = 0; d < 2; ++d) tip[d] = sample.tip[d] + offset[d] + tilt[d] * base.depth;
      const BentSample other = nominal.step(base, 0.1);
      filter->step(base, 0.1);
      if (i % 15 == 0)
        filter->tip({tip[0] + u.tip_noise * normal(generator), tip[1] + u.tip_noise * normal(generator)},
                    0.0);
      if (i == 58) {
        const TipEstimate estimate = filter->estimate();
        for (std::size_t d = 0; d < 2; ++d) {
          const double off = tip[d] - estimate.tip[d];
          squares += off * off / estimate.covariance[2 * d];
          alone += std::pow((tip[d] - other.tip[d]) / std::sqrt(estimate.covariance[2 * d]), 2.0);
          ++count;
        }
      }
    }
  }
  EXPECT_NEAR(squares / count, 1.0, 0.35);  // 120 numbers: three standard errors are 0.39
  EXPECT_GT(alone / count, 5.0);            // without the readings
}

TEST(TipEstimator, ALateReadingCountsForTheTimeItIsOf) {
  const auto now = estimator(), late = estimator();
  const std::array<double, 2> reading{4e-3, -1e-3};
  push(*now, 0.0, 0.04, nothing);
  ASSERT_TRUE(now->tip(reading, 0.0));
  const TipEstimate after = push(*now, 0.04, 0.047, nothing);
  push(*late, 0.0, 0.047, nothing);
  ASSERT_TRUE(late->tip(reading, 0.7));
  const TipEstimate same = late->estimate();
  for (std::size_t d = 0; d < 2; ++d) {
    // what the tissue does in 7 mm is not known again: 2e-5 m
    EXPECT_NEAR(same.tip[d], after.tip[d], 0.03 * std::abs(after.tip[d]));
    EXPECT_NEAR(same.covariance[2 * d] / after.covariance[2 * d], 1.0, 0.1);
  }
}

TEST(TipEstimator, RefusesWhatCannotBe) {
  const auto filter = estimator();
  EXPECT_FALSE(filter->tip({0.0, 0.0}, 0.0));  // before any step
  push(*filter, 0.0, 0.04, nothing);
  const TipEstimate before = filter->estimate();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(filter->tip({nan, 0.0}, 0.0));
  EXPECT_FALSE(filter->tip({0.0, 0.0}, nan));
  EXPECT_FALSE(filter->tip({0.0, 0.0}, -0.1));
  EXPECT_FALSE(filter->tip({0.0, 0.0}, 60.0));
  EXPECT_FALSE(filter->wrench({nan, 0.0, 0.0, 0.0, 0.0, 0.0}));
  EXPECT_EQ(filter->rejected(), 0u);
  EXPECT_FALSE(filter->tip({-0.05, 0.0}, 0.0));  // another frame
  EXPECT_FALSE(filter->tip({-0.05, 0.0}, 0.0));
  EXPECT_EQ(filter->rejected(), 2u);
  EXPECT_EQ(filter->estimate().tip, before.tip);
  EXPECT_TRUE(filter->tip({before.tip[0], before.tip[1]}, 0.0));
  EXPECT_EQ(filter->rejected(), 0u);
}

TEST(TipEstimator, WrenchFindsTheForceOfTheTip) {
  // a needle whose tip force is one standard deviation up: nothing but the wrench reports it
  PathUncertainty u;
  u.wrench_error = 0.01;
  const auto filter = estimator(u);
  SpatialInsertion truth = needle(20e3, 0.24);
  push(*filter, 0.0, 0.06, [&](double depth) {
    const BentSample sample = truth.step({.depth = depth}, 0.1);
    filter->wrench(sample.wrench);
  });
  EXPECT_NEAR(filter->mode(0), 1.0, 0.3);
  EXPECT_LT(filter->mode_variance(0), 0.3);
  const auto standing = estimator(u);  // one wrench a millimetre of motion
  standing->step({.depth = 0.01}, 0.1);
  const std::array<double, 6> as_simulated = standing->estimate().sample.wrench;
  EXPECT_TRUE(standing->wrench(as_simulated));
  EXPECT_FALSE(standing->wrench(as_simulated));
}

TEST(TipEstimator, OneWrenchOfASpikeChangesNothing) {
  PathUncertainty u;
  u.wrench_error = 0.05;
  const auto filter = estimator(u), undisturbed = estimator(u);
  SpatialInsertion truth = needle(20e3, 0.24);
  push(*filter, 0.0, 0.06, [&](double depth) {
    undisturbed->step({.depth = depth}, 0.1);
    const BentSample sample = truth.step({.depth = depth}, 0.1);
    if (std::abs(depth - 0.03) < 1e-6) {
      EXPECT_FALSE(filter->wrench({500.0, 0.0, 0.0, 0.0, 5.0, 0.0}));
    }
    EXPECT_EQ(filter->wrench(sample.wrench), undisturbed->wrench(sample.wrench));
  });
  EXPECT_EQ(filter->mode(0), undisturbed->mode(0));
}

TEST(TipEstimator, AfterARefusedStepNoWrenchIsTaken) {
  const auto filter = estimator();
  const TipEstimate before = push(*filter, 0.0, 0.05, nothing);
  const TipEstimate refused = filter->step({.depth = std::numeric_limits<double>::quiet_NaN()}, 0.1);
  EXPECT_EQ(refused.tip, before.tip);
  EXPECT_FALSE(filter->wrench(before.sample.wrench));
  EXPECT_EQ(filter->estimate().tip, before.tip);
  EXPECT_EQ(filter->mode(0), 0.0);
}

TEST(TipEstimator, SlopesThatCannotBeAreLeftOut) {
  const auto filter = estimator(), without = estimator();
  const TipEstimate before = push(*filter, 0.0, 0.05, nothing);
  push(*without, 0.0, 0.05, nothing);
  const std::array<double, 2> far{3.0, 0.0}, none{std::numeric_limits<double>::quiet_NaN(), 0.0};
  EXPECT_FALSE(filter->tip({before.tip[0], before.tip[1]}, 0.0, &none));
  EXPECT_EQ(filter->estimate().tip, before.tip);
  EXPECT_TRUE(filter->tip({before.tip[0] + 1e-3, before.tip[1]}, 0.0, &far));
  without->tip({before.tip[0] + 1e-3, before.tip[1]}, 0.0);
  EXPECT_EQ(filter->estimate().tip, without->estimate().tip);
}

TEST(TipEstimator, AnAxisThatIsKnownIsNoTiltOfTheEntry) {
  // a tracker whose axis leans by 0.05: tips and slopes at the entry and above it show the same lean, once
  const auto filter = estimator();
  std::array<TipEstimator::Plane, 101> errors{};
  for (std::size_t k = 0; k < errors.size(); ++k) errors[k] = {0.05 * 1e-3 * static_cast<double>(k), 0.0};
  filter->expect(errors, 1e-3);
  SpatialInsertion alone = needle(20e3, 0.2);
  const std::array<double, 2> slope{0.05, 0.0};
  for (const double depth : {-1e-3, 0.0}) {
    filter->step({.depth = depth}, 0.1);
    alone.step({.depth = depth}, 0.1);
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(filter->tip({0.0, 0.0}, 0.0, &slope));
  }
  double straight = 0.0;
  const TipEstimate estimate =
      push(*filter, 0.0, 0.08, [&](double depth) { straight = alone.step({.depth = depth}, 0.1).tip[0]; });
  EXPECT_NEAR(estimate.tip[0], straight + 0.05 * 0.08, 5e-4);
}

TEST(TipEstimator, ANeedleThatIsTooSteepGoesOn) {
  FlexibleSettings settings = guided();
  settings.beam.layers[0].tip_force = 0.6;
  settings.lengths.max_slope = 0.02;
  const SpatialInsertion steep = forceless_insertion<2>(settings);
  SpatialInsertion alone = steep;
  const auto filter =
      std::make_unique<TipEstimator>(steep, std::span<const SpatialInsertion>(), PathUncertainty{});
  bool reported = false;
  for (int i = 1; i <= 60; ++i) {
    const TipEstimate estimate = filter->step({.depth = 1e-3 * i}, 0.1);
    const BentSample sample = alone.step({.depth = 1e-3 * i}, 0.1);
    reported |= sample.status == Status::outside_range;
    for (std::size_t d = 0; d < 3; ++d) EXPECT_NEAR(estimate.tip[d], sample.tip[d], 1e-12);
  }
  EXPECT_TRUE(reported);
}

TEST(TipEstimator, AnotherInsertionHasAnotherPoseOfTheSameNeedle) {
  const auto filter = estimator(), fresh = estimator();
  const auto readings = [&](double depth) {
    const BentSample& here = filter->estimate().sample;
    if (depth > 0.02) filter->tip({here.tip[0] + 0.8e-3, here.tip[1] - 0.5e-3}, 0.0);
  };
  push(*filter, 0.0, 0.05, readings);
  const double known = filter->mode_variance(0), mode = filter->mode(0);
  for (int i = 9; i >= 0; --i) filter->step({.depth = 5e-3 * i}, 0.1);
  filter->step({.depth = -2e-3}, 0.1);
  for (double aside : {4e-3, 8e-3}) filter->step({.depth = -2e-3, .lateral = {aside, 0.0}}, 0.1);
  EXPECT_FALSE(filter->tip({0.0, 0.0}, 0.3));  // of the path before
  const TipEstimate outside = filter->estimate();
  EXPECT_LT(known, 0.95);
  EXPECT_EQ(filter->mode_variance(0), known);
  EXPECT_EQ(filter->mode(0), mode);
  const TipEstimate at_first = fresh->step({.depth = -2e-3, .lateral = {8e-3, 0.0}}, 0.1);
  EXPECT_NEAR(outside.covariance[0], at_first.covariance[0], 1e-9);
  EXPECT_NEAR(outside.tip[0], at_first.tip[0], 1e-9);
}

TEST(TipEstimator, OneStepToAnotherPlaceInTissueIsAnotherInsertion) {
  const auto filter = estimator();
  const auto readings = [&](double depth) {
    const BentSample& here = filter->estimate().sample;
    if (depth > 0.02) filter->tip({here.tip[0] + 1.5e-3, here.tip[1]}, 0.0);
  };
  push(*filter, 0.0, 0.05, readings);
  for (int i = 9; i >= 0; --i) filter->step({.depth = 5e-3 * i}, 0.1);
  filter->step({.depth = -1e-3}, 0.1);
  const TipEstimate elsewhere = filter->step({.depth = 2e-3, .lateral = {8e-3, 0.0}}, 0.1);
  EXPECT_GT(elsewhere.covariance[0], 0.9e-6);  // as at any entry
  EXPECT_NEAR(elsewhere.tip[0], elsewhere.sample.tip[0], 2e-4);
}

TEST(TipEstimator, TimeThatRefusedStepsTakePassesForAllNeedles) {
  // with friction that depends on speed, a needle that waited less would be pushed faster
  const laws::Karnopp friction{.coulomb_in = 10.0,
                               .coulomb_out = -10.0,
                               .viscous_in = 100.0,
                               .viscous_out = 100.0,
                               .static_in = 10.0,
                               .static_out = -10.0,
                               .static_band = 1e-4,
                               .presliding = 20e-6};
  const Model model{laws::Polynomial{1.0, 0.0}, laws::PunctureDepth{0.0}, friction, laws::NoCutting{}};
  const SpatialInsertion pushed(Insertion(model, {.max_speed = 1.0, .hold_time = 0.05}), guided());
  const std::vector<SpatialInsertion> varied{pushed};
  const auto filter = std::make_unique<TipEstimator>(pushed, varied, PathUncertainty{});
  for (int i = 0; i <= 2000; ++i) filter->step({.depth = 2e-5 * i}, 1e-3);
  for (int i = 0; i < 30; ++i) filter->step({.depth = std::numeric_limits<double>::quiet_NaN()}, 1e-3);
  const TipEstimate after = filter->step({.depth = 2e-5 * 2031}, 1e-3);
  EXPECT_TRUE(filter->wrench(after.sample.wrench));
  EXPECT_EQ(filter->mode_variance(0), 1.0);
}

TEST(TipEstimator, BeginsAnewWithAUsedNeedle) {
  SpatialInsertion used = needle(20e3, 0.2);
  used.step({.depth = 0.04}, 0.1);
  const auto filter =
      std::make_unique<TipEstimator>(used, std::span<const SpatialInsertion>(), PathUncertainty{});
  EXPECT_EQ(filter->step({.depth = -1e-3}, 0.1).sample.status, Status::ok);
}

TEST(TipEstimator, ShapeEndsAtTheEstimatedTipAndBeginsAtTheBase) {
  const auto filter = estimator();
  push(*filter, 0.0, 0.05, nothing);
  filter->tip({3e-3, 1e-3}, 0.0);
  std::vector<Vector> points;
  filter->shape([&](const Vector& point) { points.push_back(point); });
  const TipEstimate estimate = filter->estimate();
  for (std::size_t d = 0; d < 2; ++d) EXPECT_NEAR(points.back()[d], estimate.tip[d], 2e-5);
  EXPECT_NEAR(points.front()[0], 0.0, 1e-12);
  EXPECT_NEAR(points.front()[1], 0.0, 1e-12);
}

}  // namespace
