// SPDX-License-Identifier: Apache-2.0
// The fit of loading curves against curves made by closed forms and against every point of a fine grid.
#include "fit/loading.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <numeric>
#include <random>
#include <vector>

using namespace needleforce;
using namespace needleforce::fit;

namespace {

constexpr double contact = 4e-3, indentation = 8e-3, zero = 0.05;
const std::vector<double> places{-0.9, -0.7, -0.5, -0.3, -0.1, 0.1, 0.3, 0.5, 0.7};

struct Samples {
  std::vector<double> depth, force;
  operator Stroke() const { return {depth, force}; }
};

Samples loading(const std::function<double(double)>& curve, std::size_t n, double noise) {
  std::mt19937 random(1);
  std::normal_distribution<double> error(0.0, 1.0);
  Samples s;
  for (std::size_t i = 0; i < n; ++i) {
    s.depth.push_back((contact + indentation) * static_cast<double>(i) / static_cast<double>(n - 1));
    s.force.push_back(zero + curve(std::max(s.depth.back() - contact, 0.0)) + noise * error(random));
  }
  return s;
}

/// The fit from a contact depth that is 0.6 mm too deep.
template <class Curve>
LoadingResult fitted(const Samples& s, const std::vector<double>& shapes, double low, double high) {
  std::vector<double> workspace(loading_workspace(s.depth.size()));
  const double start = contact + 0.6e-3;
  return fit_loading<Curve>(s, {start, s.depth.back() - start, {places, -1, 0.9}, {shapes, low, high}},
                            workspace);
}

TEST(Loading, ConeWithoutNoise) {
  const auto r = fitted<ConeCurve>(loading([](double h) { return 2e4 * h * h; }, 3001, 0), {0}, 0, 0);
  EXPECT_NEAR(r.amplitudes[0], 2e4, 1e-4);
  EXPECT_NEAR(r.contact_depth, contact, 1e-11);
  EXPECT_NEAR(r.offset, zero, 1e-10);
}

TEST(Loading, ConeOnACylinderWithoutNoise) {
  const auto curve = [](double h) { return h < 3e-3 ? 2e4 * h * h : 2e4 * (6e-3 * h - 9e-6); };
  const auto r = fitted<ConeCylinderCurve>(loading(curve, 3001, 0), {0.05, 0.2, 0.5, 1}, 0.002, 3);
  EXPECT_NEAR(r.amplitudes[0], 2e4, 1e-3);
  EXPECT_NEAR(r.shape, 3e-3, 1e-10);
  EXPECT_NEAR(r.contact_depth, contact, 1e-10);
}

TEST(Loading, PowerLawWithoutNoise) {
  const auto curve = [](double h) { return 0.04 * std::pow(1e3 * h, 1.6); };
  const auto r = fitted<PowerCurve>(loading(curve, 3001, 0), {1.05, 1.5, 2, 3}, 1, 6);
  EXPECT_NEAR(r.amplitudes[0], 0.04, 1e-8);
  EXPECT_NEAR(r.shape, 1.6, 1e-7);
}

TEST(Loading, PolynomialWithoutNoise) {
  const auto r =
      fitted<PolynomialCurve>(loading([](double h) { return 40 * h + 1.2e4 * h * h; }, 3001, 0), {0}, 0, 0);
  EXPECT_NEAR(r.amplitudes[0], 40, 1e-5);
  EXPECT_NEAR(r.amplitudes[1], 1.2e4, 1e-3);
}

TEST(Loading, ExponentialWithoutNoise) {
  const auto curve = [](double h) { return 0.1 * std::expm1(300 * h); };
  const auto r = fitted<ExponentialCurve>(loading(curve, 3001, 0), {0.03, 0.3, 1, 3, 8}, 1e-3, 30);
  EXPECT_NEAR(r.amplitudes[0], 0.1, 1e-7);
  EXPECT_NEAR(r.shape, 300, 1e-4);
}

TEST(Loading, AmplitudesAreNotNegative) {
  const auto concave =
      fitted<PolynomialCurve>(loading([](double h) { return std::sqrt(h); }, 900, 1e-3), {0}, 0, 0);
  EXPECT_GE(concave.amplitudes[0], 0);
  EXPECT_EQ(concave.amplitudes[1], 0);
  const auto falling = fitted<ConeCurve>(loading([](double h) { return -2e4 * h * h; }, 900, 0), {0}, 0, 0);
  EXPECT_EQ(falling.amplitudes[0], 0);
}

TEST(Loading, WhatIsNotFiniteHasNoSum) {
  Samples s = loading([](double h) { return 2e4 * h * h; }, 900, 0);
  s.force[100] = NAN;
  EXPECT_FALSE(std::isfinite(fitted<ConeCurve>(s, {0}, 0, 0).sse));
}

/// Sum of squares of force = a g(h) + b, a >= 0, in closed form.
double line_sum(const Samples& s, const std::function<double(double)>& g, double place) {
  double sg = 0, sf = 0, gg = 0, gf = 0, ff = 0;
  const auto n = static_cast<double>(s.depth.size());
  for (std::size_t i = 0; i < s.depth.size(); ++i) {
    const double x = g(std::max(s.depth[i] - place, 0.0)), f = s.force[i];
    sg += x, sf += f, gg += x * x, gf += x * f, ff += f * f;
  }
  const double along = std::max(gf - sg * sf / n, 0.0), size = gg - sg * sg / n;
  return ff - sf * sf / n - (size > 0 ? along * along / size : 0);
}

TEST(Loading, NoPointOfAFineGridIsBetter) {
  const auto curve = [](double h) {
    return h < 2e-3 ? 3e4 * h * h : 3e4 * (4e-3 * h - 4e-6) + 0.03 * std::sin(2e3 * h);
  };
  for (const std::size_t n : {200, 1500, 4000}) {
    const Samples s = loading(curve, n, 0.02);
    const double cylinder = fitted<ConeCylinderCurve>(s, {0.05, 0.2, 0.5, 1}, 0.002, 3).sse;
    const double power = fitted<PowerCurve>(s, {1.05, 1.5, 2, 3}, 1, 6).sse;
    for (int i = 0; i < 60; ++i)
      for (int k = 0; k < 40; ++k) {
        const double place = (0.5 + 9.5 * i / 60) * 1e-3, saturation = (k + 1) * 0.2e-3,
                     exponent = 1 + 0.1 * k;
        const auto shank = [&](double h) {
          return h < saturation ? h * h : saturation * (2 * h - saturation);
        };
        const auto steep = [&](double h) { return std::pow(1e3 * h, exponent); };
        EXPECT_LE(cylinder, line_sum(s, shank, place) * (1 + 1e-9));
        EXPECT_LE(power, line_sum(s, steep, place) * (1 + 1e-9));
      }
  }
}

template <class Curve>
void slopes_are_finite_differences(double s) {
  constexpr std::size_t a = Curve::amplitudes;
  for (const double h : {0.11, 0.47, 1.3}) {
    std::array<Pair, 4> at, up, down;
    Curve::at(Pair{h, h}, s, at.data());
    Curve::at(Pair{h + 1e-6, h}, s, up.data());
    Curve::at(Pair{h - 1e-6, h}, s, down.data());
    for (std::size_t k = 0; k < a; ++k) EXPECT_NEAR(at[a + k][0], (up[k][0] - down[k][0]) / 2e-6, 1e-6);
    if (!Curve::shaped) continue;
    Curve::at(Pair{h, h}, s + 1e-6, up.data());
    Curve::at(Pair{h, h}, s - 1e-6, down.data());
    for (std::size_t k = 0; k < a; ++k) EXPECT_NEAR(at[2 * a + k][0], (up[k][0] - down[k][0]) / 2e-6, 1e-6);
  }
}

TEST(Loading, SlopesAreFiniteDifferences) {
  slopes_are_finite_differences<ConeCurve>(0);
  slopes_are_finite_differences<ConeCylinderCurve>(0.4);
  slopes_are_finite_differences<PowerCurve>(1.7);
  slopes_are_finite_differences<PolynomialCurve>(0);
  slopes_are_finite_differences<ExponentialCurve>(2.5);
}

}  // namespace
