// SPDX-License-Identifier: Apache-2.0
// Scans over whole recordings against sorting, closed forms and sums written out.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "fit/depth_noise.hpp"
#include "fit/lag.hpp"
#include "fit/lagged.hpp"
#include "fit/median.hpp"
#include "fit/origin.hpp"
#include "fit/outliers.hpp"
#include "fit/sliding_start.hpp"
#include "fit/windows.hpp"

using namespace needleforce::fit;

namespace {

using Series = std::vector<double>;

Series white(std::size_t n, double size, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> error(0.0, size);
  Series values(n);
  for (double& value : values) value = error(random);
  return values;
}

double median_by_sorting(Series values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

TEST(Median, IsThatOfTheSortedValues) {
  for (const std::size_t n : {1u, 2u, 3u, 10u, 2048u, 2049u, 2050u, 30000u, 30001u}) {
    Series smooth = white(n, 1.0), tied = smooth, constant(n, 2.0), sorted = smooth;
    for (double& value : tied) value = std::round(value);
    std::sort(sorted.begin(), sorted.end());
    for (const Series& values : {smooth, tied, constant, sorted}) {
      Series copy = values;
      EXPECT_EQ(median(copy), median_by_sorting(values)) << n;
    }
  }
}

TEST(Median, IsNoNumberIfAValueIsNone) {
  Series values = white(5000, 1.0), none;
  values[17] = std::nan("");
  EXPECT_TRUE(std::isnan(median(values)));
  EXPECT_TRUE(std::isnan(median(none)));
}

/// A depth at a steady speed with white noise.
Series steady(std::size_t n, double noise) {
  Series depth = white(n, noise);
  for (std::size_t i = 0; i < n; ++i) depth[i] += 1e-6 * static_cast<double>(i);
  return depth;
}

TEST(DepthNoise, IsItsStandardDeviationAtASteadySpeed) {
  Series scratch(40000);
  const Series depth = steady(40000, 5e-6);
  EXPECT_NEAR(depth_noise(depth, scratch), 5e-6, 0.1e-6);
  EXPECT_TRUE(noise_exceeds(depth, 4.5e-6, scratch));
  EXPECT_FALSE(noise_exceeds(depth, 5.5e-6, scratch));
  EXPECT_NEAR(depth_noise(steady(40000, 0), scratch), 0.0, 1e-15);
}

TEST(DepthNoise, OfAQuantumIsThatOfRounding) {
  constexpr double quantum = 20e-6;
  Series depth = steady(40000, 0), scratch(40000);
  for (double& z : depth) z = std::round(z / quantum) * quantum;
  EXPECT_NEAR(depth_noise(depth, scratch), quantum / std::sqrt(12.0), 1e-9);
}

TEST(MovingAverage, KeepsALineAndIsAMeanWithin) {
  Series line(101), sums(102), out(101), values = white(101, 1.0);
  std::iota(line.begin(), line.end(), 0.0);
  for (const std::size_t half : {1u, 7u, 50u, 200u}) {
    moving_average(line, half, sums, out);
    for (std::size_t i = 0; i < line.size(); ++i) EXPECT_NEAR(out[i], line[i], 1e-12);
    moving_average(values, half, sums, out);
    const std::size_t reach = std::min<std::size_t>(half, 30);
    const auto first = values.begin() + 30 - static_cast<std::ptrdiff_t>(reach);
    const double sum = std::accumulate(first, first + static_cast<std::ptrdiff_t>(2 * reach + 1), 0.0);
    EXPECT_NEAR(out[30], sum / static_cast<double>(2 * reach + 1), 1e-12) << half;
  }
}

TEST(Reversals, AreTheExtremesOfAZigzagWithNoise) {
  Series depth;
  for (int i = 0; i < 400; ++i) depth.push_back(std::abs(i % 200 - 100) / 100.0);
  std::vector<std::size_t> found;
  reversals(depth, 0.1, [&](std::size_t i) { found.push_back(i); });
  EXPECT_EQ(found, (std::vector<std::size_t>{0, 100, 200, 300, 399}));
}

/// A rise of one exponent from an origin.
struct Rising {
  Series depth, force;
  Rising(double origin, double exponent, double noise) : force(white(200, noise)) {
    for (std::size_t i = 0; i < 200; ++i) {
      depth.push_back(1e-3 * static_cast<double>(i) / 199);
      force[i] += 0.3 + 5e3 * std::pow(std::max(depth[i] - origin, 0.0), exponent);
    }
  }
  Origin found(double noise) const {
    Series scratch(200);
    return fit_origin({depth, force}, {noise, 9.0, 5}, scratch);
  }
};

TEST(Origin, OfARiseIsFoundWhateverItsExponent) {
  for (const double exponent : {1.0, 1.25, 1.5, 1.75, 2.0}) {
    const double peak = 5e3 * std::pow(0.5e-3, exponent), noise = 1e-3 * peak;
    const Origin origin = Rising(0.5e-3, exponent, noise).found(noise);
    EXPECT_NEAR(origin.depth, 0.5e-3, 20e-6) << exponent;
    EXPECT_NEAR(origin.baseline, 0.3, 5 * noise) << exponent;
    EXPECT_NEAR(std::sqrt(origin.variance), noise, 0.2 * noise) << exponent;
    EXPECT_LT(origin.earliest, 0.5e-3);
    EXPECT_GT(origin.earliest, 0.3e-3);
  }
}

TEST(Origin, SquaresAreThoseOfTheBestExponentWrittenOut) {
  const Rising rise(0.4e-3, 1.5, 1e-4);
  const Series origins{-0.1e-3, 0.2e-3, 0.39e-3, 0.8e-3};
  Series centred(200);
  std::vector<OriginFit> fits(origins.size());
  fit_origins({rise.depth, rise.force}, origins, centred, fits);
  const double mean = std::accumulate(rise.force.begin(), rise.force.end(), 0.0) / 200;
  for (std::size_t k = 0; k < origins.size(); ++k) {
    double least = std::numeric_limits<double>::infinity();
    for (const double exponent : {1.0, 1.25, 1.5, 1.75, 2.0}) {
      Series shape(200);
      for (std::size_t i = 0; i < 200; ++i)
        shape[i] = std::pow(std::max(rise.depth[i] - origins[k], 0.0) / 1e-3, exponent);
      const double middle = std::accumulate(shape.begin(), shape.end(), 0.0) / 200;
      double product = 0, square = 0, rest = 0;
      for (std::size_t i = 0; i < 200; ++i)
        product += (shape[i] - middle) * rise.force[i], square += (shape[i] - middle) * (shape[i] - middle);
      const double height = std::max(product, 0.0) / square;
      for (std::size_t i = 0; i < 200; ++i) {
        const double left = rise.force[i] - mean - height * (shape[i] - middle);
        rest += left * left;
      }
      least = std::min(least, rest);
    }
    EXPECT_NEAR(fits[k].squares, least, 1e-9 * least) << k;
  }
}

TEST(Outliers, AreSingleSamplesAndNoSteps) {
  Series force = white(4000, 1e-3), scratch(3 * force.size());
  for (std::size_t i = 2000; i < 4000; ++i) force[i] += 1.0;  // a step
  force[500] += 0.05, force[1500] -= 0.05, force[0] += 0.1;
  std::vector<std::size_t> found;
  outliers(force, {5.0, quantum_of(force), 0.5, 1.25, 200, 2000}, scratch,
           [&](std::size_t i) { found.push_back(i); });
  EXPECT_EQ(found, (std::vector<std::size_t>{0, 500, 1500}));
}

TEST(Outliers, QuantumIsTheSmallestStep) {
  EXPECT_DOUBLE_EQ(quantum_of(Series{1.0, 1.5, 1.5, 1.25, 3.0}), 0.25);
  EXPECT_EQ(quantum_of(Series(10, 2.0)), 0.0);
}

TEST(SlidingStart, IsWhereThePullStopsGrowing) {
  Series depth, force;
  for (int i = 0; i < 1000; ++i) {
    depth.push_back(10e-3 - 1e-5 * i);
    force.push_back(-std::min(1e-5 * i / 1e-3, 1.0) + 1e-5 * i);  // pulls by 1 N after 1 mm, then by less
  }
  Series scratch(2 * 10000 + 2);
  const std::size_t found = sliding_start({depth, force}, {0.25e-3, 8, 10000}, scratch);
  EXPECT_NEAR(static_cast<double>(found), 100, 1.0);
}

TEST(Windows, ADropIsTheFallBetweenTheMeans) {
  Series values(60, 1.0), scratch(4 * 60 + 2);
  std::fill(values.begin() + 30, values.end(), -1.0);
  const Windows windows{5, 0, true};
  std::vector<Series> rows(4, Series(windows.places(60)));
  compare_windows(values, windows, scratch, {rows[0], rows[1], rows[2], rows[3]});
  const auto most = std::max_element(rows[0].begin(), rows[0].end());
  EXPECT_EQ(most - rows[0].begin(), 25);  // the first window ends with the 30th value
  EXPECT_NEAR(*most, 2.0, 1e-12);
  EXPECT_NEAR(rows[1][25], 2.0, 1e-12);
}

TEST(Windows, ASteadyDeclineHasNoExcessAndNoBentFall) {
  Series values(200), scratch(4 * 200 + 2);
  for (std::size_t i = 0; i < 200; ++i) values[i] = 100.0 - static_cast<double>(i);
  const Windows windows{8, 16, false};
  std::vector<Series> rows(4, Series(windows.places(200)));
  compare_windows(values, windows, scratch, {rows[0], rows[1], rows[2], rows[3]});
  for (std::size_t i = 0; i < rows[0].size(); ++i) {
    EXPECT_NEAR(rows[0][i], 24.0, 1e-9);
    EXPECT_NEAR(rows[2][i], 0.0, 1e-9);
    EXPECT_LE(rows[1][i], 1e-9);
  }
}

TEST(Windows, ARunIsTheFirstOfItsLength) {
  const Series values{0, 2, 2, 0, 2, 2, 2, 0, 2, 2, 2};
  EXPECT_EQ(first_run(values, 1.0, 2), 1u);
  EXPECT_EQ(first_run(values, 1.0, 3), 4u);
  EXPECT_EQ(first_run(values, 1.0, 4), values.size());
}

TEST(Windows, HalfOfNormalValuesLieWithinTheirKnownShareOfTheDeviation) {
  const Series values = white(20001, 3.0);
  Series scratch(values.size());
  EXPECT_NEAR(spread_of_part(values, 2, scratch), 0.6745 * 3.0, 0.05);
  EXPECT_NEAR(spread_of_part(values, 4, scratch), 0.3186 * 3.0, 0.05);
}

TEST(Products, AreThoseWrittenOut) {
  const Series a = white(1003, 1.0, 1), b = white(1003, 1.0, 2);
  EXPECT_NEAR(product_of(a, b), std::inner_product(a.begin(), a.end(), b.begin(), 0.0), 1e-10);
  EXPECT_NEAR(pairwise_sum(a), std::accumulate(a.begin(), a.end(), 0.0), 1e-10);
}

/// A force that relaxes by a line and follows the travel over 0.2 mm, a lag behind it.
TEST(Lag, HasTheLeastSquaresWhereTheForceFollows) {
  constexpr double lag = 0.03, stretch = 0.2e-3;
  Series time, force, travel;
  for (int i = 0; i < 400; ++i) {
    const double t = 1e-3 * i;
    time.push_back(t), travel.push_back(2e-3 * std::max(t - 0.15, 0.0));
    const double late = 2e-3 * std::max(t - lag - 0.15, 0.0) / stretch;
    force.push_back(1.0 - 0.1 * t - 2.0 * std::min(late, 1.0));
  }
  const Series lags{0.0, 0.01, 0.02, 0.03, 0.04, 0.05}, stretches{0.1e-3, 0.2e-3, 0.4e-3};
  Series squares(lags.size()), scratch(3 * time.size());
  squares_by_lag({time, force, time, travel}, Follows::linearly, lags, stretches, 1e-6, scratch, squares);
  EXPECT_EQ(std::min_element(squares.begin(), squares.end()) - squares.begin(), 3);
  EXPECT_NEAR(squares[3], 0.0, 1e-9);
  EXPECT_GT(squares[2], 1e-3);
}

}  // namespace
