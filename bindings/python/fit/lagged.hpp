// SPDX-License-Identifier: Apache-2.0
// Products of a residual with itself some samples later, what autocovariances are made of, and of series with
// one another: on one core, whatever a library of matrices would do with long series.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "stroke.hpp"

namespace needleforce::fit {

/// products[k] = sum over t of residual[t] * residual[t + k]; lags beyond the residual give 0.
inline void lagged_products(std::span<const double> residual, std::span<double> products) noexcept {
  constexpr std::size_t lanes = 6;  // neighbouring lags share their loads and add in parallel
  const std::size_t n = residual.size();
  for (std::size_t first = 0; first < products.size(); first += lanes) {
    std::array<Pair, lanes> sum{};
    std::size_t t = 0;
    for (; t + first + lanes < n; t += 2) {
      const Pair now = pair_at(&residual[t]);
      for (std::size_t k = 0; k < lanes; ++k) sum[k] += now * pair_at(&residual[t + first + k]);
    }
    for (; t < n; ++t)
      for (std::size_t k = 0; k < lanes && t + first + k < n; ++k)
        sum[k][0] += residual[t] * residual[t + first + k];
    for (std::size_t k = 0; k < std::min(lanes, products.size() - first); ++k)
      products[first + k] = sum[k][0] + sum[k][1];
  }
}

/// The sum of products of two series of equal length.
inline double product_of(std::span<const double> a, std::span<const double> b) noexcept {
  std::array<Pair, 4> sums{};
  std::size_t i = 0;
  for (; i + 8 <= a.size(); i += 8)
    for (std::size_t k = 0; k < 4; ++k) sums[k] += pair_at(&a[i + 2 * k]) * pair_at(&b[i + 2 * k]);
  double rest = 0;
  for (; i < a.size(); ++i) rest += a[i] * b[i];
  const Pair all = (sums[0] + sums[1]) + (sums[2] + sums[3]);
  return all[0] + all[1] + rest;
}

/// The sum of a series, of halves down to 128 values each in eight parts: errors grow with the logarithm of
/// the length only.
inline double pairwise_sum(std::span<const double> values) noexcept {
  const std::size_t n = values.size(), half = n / 2 - n / 2 % 8;
  if (n > 128) return pairwise_sum(values.first(half)) + pairwise_sum(values.subspan(half));
  double rest = 0;
  std::size_t i = 0;
  if (n >= 8) {
    std::array<Pair, 4> part;
    for (std::size_t k = 0; k < 4; ++k) part[k] = pair_at(&values[2 * k]);
    for (i = 8; i + 8 <= n; i += 8)
      for (std::size_t k = 0; k < 4; ++k) part[k] += pair_at(&values[i + 2 * k]);
    rest = ((part[0][0] + part[0][1]) + (part[1][0] + part[1][1])) +
           ((part[2][0] + part[2][1]) + (part[3][0] + part[3][1]));
  }
  for (; i < n; ++i) rest += values[i];
  return rest;
}

}  // namespace needleforce::fit
