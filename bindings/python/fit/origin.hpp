// SPDX-License-Identifier: Apache-2.0
// The origin of a rising force: least squares of b + c (z - z0)^p for many origins z0 and five exponents p.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "stroke.hpp"

namespace needleforce::fit {

/// Exponents 1, 1 1/4, 1 1/2, 1 3/4 and 2: of a flat punch, a sphere and a cone, and between them.
inline constexpr std::size_t exponents = 5;

/// The least sum of squares over the exponents, and its baseline b [N].
struct OriginFit {
  double squares = std::numeric_limits<double>::infinity(), baseline = 0;
};

/// A rise: depths, the forces less their mean, that mean, and the unit of the depth past the origin.
struct Rise {
  std::span<const double> depth, centred;
  double mean, inverse_range;

  /// Samples before the first one past an origin, from which on the shapes are above 0.
  std::size_t before(double origin) const noexcept {
    std::size_t i = 0;
    while (i < depth.size() && !(depth[i] > origin)) ++i;
    return i;
  }
};

/// Depth past an origin in the rise's unit, and its fourth root.
template <class T>
struct Past {
  T depth, root;
};
inline Past<double> past_at(const Rise& rise, std::size_t i, double origin) noexcept {
  const double past = std::max(rise.depth[i] - origin, 0.0) * rise.inverse_range;
  return {past, std::sqrt(std::sqrt(past))};
}
inline Past<Pair> past_pair(const Rise& rise, std::size_t i, double origin) noexcept {
  const Pair from = (pair_at(&rise.depth[i]) - origin) * rise.inverse_range;
  const Pair past = chosen(from > 0.0, from, Pair{});
  return {past, Pair{std::sqrt(std::sqrt(past[0])), std::sqrt(std::sqrt(past[1]))}};
}

/// Sums of each shape, of its square and of its product with the force.
template <class T>
struct ShapeSums {
  std::array<T, exponents> shape{}, square{}, force{};

  void add(const Past<T>& past, T f) noexcept {
    T value = past.depth;
    for (std::size_t k = 0; k < exponents; ++k, value *= past.root)
      shape[k] += value, square[k] += value * value, force[k] += value * f;
  }
};

inline ShapeSums<double> shape_sums(const Rise& rise, double origin, std::size_t first) noexcept {
  ShapeSums<Pair> pairs;
  ShapeSums<double> sums;
  std::size_t i = first;
  for (; i + 1 < rise.depth.size(); i += 2) pairs.add(past_pair(rise, i, origin), pair_at(&rise.centred[i]));
  if (i < rise.depth.size()) sums.add(past_at(rise, i, origin), rise.centred[i]);
  for (std::size_t k = 0; k < exponents; ++k) {
    sums.shape[k] += pairs.shape[k][0] + pairs.shape[k][1];
    sums.square[k] += pairs.square[k][0] + pairs.square[k][1];
    sums.force[k] += pairs.force[k][0] + pairs.force[k][1];
  }
  return sums;
}

/// The sum of squares of the force less `height` times the shape of one exponent, both about their means:
/// squared sample by sample, because a difference of sums could be negative.
inline double residual_squares(const Rise& rise, double origin, std::size_t first, std::size_t exponent,
                               double height, double mean) noexcept {
  Pair pairs{};
  double rest = 0;
  std::size_t i = first;
  for (std::size_t k = 0; k < first; ++k) {
    const double left = rise.centred[k] + height * mean;
    rest += left * left;
  }
  for (; i + 1 < rise.depth.size(); i += 2) {
    const auto [past, root] = past_pair(rise, i, origin);
    Pair value = past;
    for (std::size_t k = 0; k < exponent; ++k) value *= root;
    const Pair left = pair_at(&rise.centred[i]) - height * (value - mean);
    pairs += left * left;
  }
  if (i < rise.depth.size()) {
    const auto [past, root] = past_at(rise, i, origin);
    double value = past;
    for (std::size_t k = 0; k < exponent; ++k) value *= root;
    const double left = rise.centred[i] - height * (value - mean);
    rest += left * left;
  }
  return pairs[0] + pairs[1] + rest;
}

/// The best exponent at one origin, with c >= 0. The sums choose it; its squares are exact.
inline OriginFit fit_at_origin(const Rise& rise, double origin) noexcept {
  const std::size_t first = rise.before(origin);
  const ShapeSums<double> sums = shape_sums(rise, origin, first);
  const double n = static_cast<double>(rise.depth.size());
  std::size_t best = 0;
  double most = -1, best_height = 0;
  for (std::size_t k = 0; k < exponents; ++k) {
    const double mean = sums.shape[k] / n, spread = sums.square[k] - mean * sums.shape[k];
    const double height = std::max(sums.force[k], 0.0) / std::max(spread, 1e-300);
    if (height * sums.force[k] > most) most = height * sums.force[k], best = k, best_height = height;
  }
  const double mean = sums.shape[best] / n;
  return {residual_squares(rise, origin, first, best, best_height, mean), rise.mean - best_height * mean};
}

/// Least squares at each of the origins for depths [m] and forces [N]; `centred` takes as many values as
/// there are forces.
inline void fit_origins(const Stroke& rise, std::span<const double> origins, std::span<double> centred,
                        std::span<OriginFit> fits) noexcept {
  const auto [low, high] = std::minmax_element(rise.depth.begin(), rise.depth.end());
  double sum = 0;
  for (const double force : rise.force) sum += force;
  const double mean = sum / static_cast<double>(rise.size()), range = *high - *low;
  for (std::size_t i = 0; i < rise.size(); ++i) centred[i] = rise.force[i] - mean;
  const Rise given{rise.depth, centred.first(rise.size()), mean, range > 0 ? 1 / range : 1.0};
  for (std::size_t k = 0; k < origins.size(); ++k) fits[k] = fit_at_origin(given, origins[k]);
}

/// The variance of a series, (n,) about its mean.
inline double variance_of(std::span<const double> values) noexcept {
  const double n = static_cast<double>(values.size());
  double sum = 0, squares = 0;
  for (const double value : values) sum += value;
  for (const double value : values) squares += (value - sum / n) * (value - sum / n);
  return squares / n;
}

/// The variance of the mean of ten neighbours relative to that of ten independent values: 1 for white noise,
/// and for few values. `scratch` takes a tenth as many.
inline double correlation_of_tens(std::span<const double> values, std::span<double> scratch) noexcept {
  constexpr std::size_t group = 10;
  const std::size_t groups = values.size() / group;
  if (groups < 5) return 1;
  for (std::size_t k = 0; k < groups; ++k) {
    double sum = 0;
    for (std::size_t i = 0; i < group; ++i) sum += values[group * k + i];
    scratch[k] = sum / group;
  }
  const double variance = variance_of(values), rounding = 1e-13 * values.front();
  if (!(variance > rounding * rounding)) return 1;  // a constant
  return std::max(1.0, group * (variance_of(scratch.first(groups)) / std::max(variance, 1e-300)));
}

/// The origin of a rise: its depth and the earliest that is not excluded, the baseline, and the variance
/// about the fit.
struct Origin {
  double depth, earliest, baseline, variance;
};

/// What excludes an origin: a rise of the sum of squares by `max_rise` variances, at least `noise` squared,
/// times the correlation of the force before the origin, which has `min_free` values at least.
struct OriginLimits {
  double noise, max_rise;
  std::size_t min_free;
};

/// The origin of least squares: the best of a grid over all depths, then of a finer one near it. `scratch`
/// takes as many values as there are forces.
inline Origin fit_origin(const Stroke& rise, const OriginLimits& limits, std::span<double> scratch) noexcept {
  constexpr std::size_t n_coarse = 64, n_fine = 33;
  std::array<double, n_coarse> coarse;
  std::array<double, n_fine> fine;
  std::array<OriginFit, n_coarse> fits;
  std::array<OriginFit, n_fine> finer;
  const auto least = [](const OriginFit& a, const OriginFit& b) { return a.squares < b.squares; };
  const double first = rise.depth.front(), step = (rise.depth.back() - first) / n_coarse;
  for (std::size_t k = 0; k < n_coarse; ++k) coarse[k] = static_cast<double>(k) * step + first;
  fit_origins(rise, coarse, scratch, fits);
  const auto best =
      static_cast<std::size_t>(std::min_element(fits.begin(), fits.end(), least) - fits.begin());
  const double from = coarse[best ? best - 1 : 0], to = coarse[std::min(best + 1, n_coarse - 1)];
  for (std::size_t k = 0; k < n_fine; ++k)
    fine[k] = static_cast<double>(k) * ((to - from) / (n_fine - 1)) + from;
  fine.back() = to;
  fit_origins(rise, fine, scratch, finer);
  const auto at =
      static_cast<std::size_t>(std::min_element(finer.begin(), finer.end(), least) - finer.begin());
  const double lowest = finer[at].squares;
  const double variance = lowest / static_cast<double>(std::max<std::size_t>(rise.size(), 4) - 3);
  const auto place = std::lower_bound(rise.depth.begin(), rise.depth.end(), fine[at]) - rise.depth.begin();
  const std::size_t free = std::min(std::max(static_cast<std::size_t>(place), limits.min_free), rise.size());
  const double rise_allowed = limits.max_rise * std::max(limits.noise * limits.noise, variance) *
                              correlation_of_tens(rise.force.first(free), scratch);
  double earliest = fine[at];
  for (std::size_t k = 0; k < n_coarse; ++k)
    if (fits[k].squares <= lowest + rise_allowed) earliest = std::min(earliest, coarse[k]);
  return {fine[at], earliest - (coarse[1] - coarse[0]), finer[at].baseline, variance};
}

}  // namespace needleforce::fit
