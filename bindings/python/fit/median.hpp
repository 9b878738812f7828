// SPDX-License-Identifier: Apache-2.0
// Medians of long series: a sample of the values bounds the middle one, and only what lies between the bounds
// is ordered.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>

namespace needleforce::fit {

/// Between what values the (k + 1)-th smallest of many certainly is, or most probably.
struct Bracket {
  double low, middle, high;
};

inline Bracket bracket_of(std::span<const double> values, std::size_t k) noexcept {
  constexpr std::size_t samples = 256, margin = 24;  // three standard deviations of the sample's median
  std::array<double, samples> some;
  for (std::size_t i = 0; i < samples; ++i) some[i] = values[i * (values.size() / samples)];
  std::sort(some.begin(), some.end());
  const std::size_t at = k * samples / values.size();
  const double infinite = std::numeric_limits<double>::infinity();
  return {at < margin ? -infinite : some[at - margin], some[at],
          at + margin >= samples ? infinite : some[at + margin]};
}

/// `select` where many values are equal: the middle of the bracket is tried alone.
inline std::span<double> select_tied(std::span<double> values, std::size_t& k,
                                     const Bracket& bracket) noexcept {
  std::size_t below = 0, equal = 0;
  for (const double value : values) below += value < bracket.middle, equal += value == bracket.middle;
  if (k > below && k < below + equal) {
    values[0] = values[1] = bracket.middle, k = 1;
    return values.first(2);
  }
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(k), values.end());
  return values;
}

/// Orders `values` so far that the (k + 1)-th smallest, k > 0, is at k of the span returned, and the k-th
/// smallest among those before it; `k` becomes that place.
inline std::span<double> select(std::span<double> values, std::size_t& k) noexcept {
  constexpr std::size_t few = 2048;
  while (values.size() > few) {
    const Bracket bracket = bracket_of(values, k);
    std::size_t below = 0, within = 0;
    for (const double value : values) below += value < bracket.low, within += value <= bracket.high;
    if (k <= below || k >= within) break;
    if (within - below > values.size() / 2) return select_tied(values, k, bracket);
    within = 0;
    for (const double value : values) {
      values[within] = value;
      within += value >= bracket.low && value <= bracket.high;
    }
    values = values.first(within), k -= below;
  }
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(k), values.end());
  return values;
}

/// The median of the values, which are reordered: the mean of the middle two of an even number; not a number
/// for none, or if one is none.
inline double median(std::span<double> values) noexcept {
  std::size_t faults = values.empty(), middle = values.size() / 2;
  for (const double value : values) faults += value != value;
  if (faults) return std::numeric_limits<double>::quiet_NaN();
  if (values.size() == 1) return values[0];
  const bool odd = values.size() % 2 == 1;
  const std::span<double> ordered = select(values, middle);
  const double upper = ordered[middle];
  return odd ? upper : 0.5 * (*std::max_element(ordered.data(), ordered.data() + middle) + upper);
}

}  // namespace needleforce::fit
