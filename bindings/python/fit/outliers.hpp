// SPDX-License-Identifier: Apache-2.0
// Single samples of a force that lie far from their neighbours on both sides, and the smallest step of a
// force.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "median.hpp"

namespace needleforce::fit {

/// The smallest step of a series beyond its rounding, 0 if it is constant.
inline double quantum_of(std::span<const double> values) noexcept {
  double largest = 0, smallest = std::numeric_limits<double>::infinity();
  for (const double value : values) largest = std::max(largest, std::abs(value));
  const double rounding = 1e-12 * std::max(largest, 1e-300);
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double step = std::abs(values[i] - values[i - 1]);
    smallest = std::min(smallest, step > rounding ? step : smallest);
  }
  return std::isinf(smallest) ? 0 : smallest;
}

/// Where a sample is an outlier, see `outliers`.
struct OutlierLimits {
  double level;        // standard deviations from the neighbours
  double quantum;      // [N] that counts as noise
  double max_span;     // of the neighbours over the difference
  double margin;       // on the local noise
  std::size_t local;   // samples whose differences show the noise near a sample
  std::size_t common;  // samples that show the common noise, at most
};

/// A force that continues as its mirror image at both ends.
class Mirrored {
 public:
  explicit Mirrored(std::span<const double> force) noexcept : force_(force) {}
  double at(std::size_t i, int offset) const noexcept {
    const auto n = static_cast<std::ptrdiff_t>(force_.size());
    std::ptrdiff_t k = static_cast<std::ptrdiff_t>(i) + offset;
    k = k < 0 ? -k : k >= n ? 2 * (n - 1) - k : k;
    return force_[static_cast<std::size_t>(k)];
  }
  /// Difference from the mean of the samples three before and after.
  double second(std::size_t i) const noexcept { return std::abs(force_[i] - 0.5 * (at(i, -3) + at(i, 3))); }
  /// Difference from the median of the six neighbours, and the span of the inner four of these.
  std::array<double, 2> residual(std::size_t i) const noexcept {
    std::array near{at(i, -3), at(i, -2), at(i, -1), at(i, 1), at(i, 2), at(i, 3)};
    constexpr std::array<std::array<std::size_t, 2>, 12> network{
        {{1, 2}, {4, 5}, {0, 2}, {3, 5}, {0, 1}, {3, 4}, {2, 5}, {0, 3}, {1, 4}, {2, 4}, {1, 3}, {2, 3}}};
    for (const auto& [a, b] : network) {  // sorts six values without branches
      const double low = std::min(near[a], near[b]), high = std::max(near[a], near[b]);
      near[a] = low, near[b] = high;
    }
    return {std::abs(force_[i] - 0.5 * (near[2] + near[3])), near[4] - near[1]};
  }
  /// Distance from the nearer of two lines: through the three samples before, and after, with the bend of
  /// these.
  double off_lines(std::size_t i) const noexcept {
    const auto off = [&](int side) {
      const double far = at(i, 3 * side), middle = at(i, 2 * side), near = at(i, side);
      const double line = (far + middle + near) / 3.0 + near - far;
      return std::abs(force_[i] - line) + std::abs(far - 2.0 * middle + near);
    };
    return std::min(off(-1), off(1));
  }

 private:
  std::span<const double> force_;
};

/// The (k + 1)-th smallest of a few magnitudes, found by halving the range in which it lies from near a
/// guess.
inline double kth_magnitude(std::span<double> values, std::size_t k, double guess) noexcept {
  const auto below = [&](double level) {
    std::size_t count = 0;
    for (const double value : values) count += value < level;
    return count;
  };
  double low = 0.7 * guess, high = 1.4 * guess;
  std::size_t from = below(low), to = below(high);
  if (!(from <= k && k < to))
    low = 0, from = 0, high = std::numeric_limits<double>::infinity(), to = values.size();
  for (int round = 0; round < 6 && std::isfinite(high) && to - from > 6; ++round) {
    const double middle = 0.5 * (low + high);
    const std::size_t count = below(middle);
    (k < count ? high : low) = middle, (k < count ? to : from) = count;
  }
  std::size_t within = 0;
  for (const double value : values) {
    values[within] = value;
    within += value >= low && value < high;
  }
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(k - from);
  std::nth_element(values.begin(), at, values.begin() + static_cast<std::ptrdiff_t>(within));
  return *at;
}

/// The upper median of every other one of the magnitudes, which is near a guess.
inline double median_of_half(std::span<const double> values, double guess,
                             std::span<double> scratch) noexcept {
  const std::size_t count = (values.size() + 1) / 2;
  for (std::size_t i = 0; i < count; ++i) scratch[i] = values[2 * i];
  return kth_magnitude(scratch.first(count), count / 2, guess);
}

/// Calls found(i) for each outlier i of at least 20 samples: it differs from the median of its six neighbours
/// by more than `level` robust standard deviations of such differences near it, and the neighbours agree.
/// `scratch` takes three times as many values as there are samples.
template <class Function>
void outliers(std::span<const double> force, const OutlierLimits& limits, std::span<double> scratch,
              const Function& found) noexcept {
  const Mirrored mirrored(force);
  const std::size_t n = force.size(), stride = std::max<std::size_t>(n / limits.common, 1);
  const std::span<double> second = scratch.first(n), local = scratch.subspan(n, n),
                          rest = scratch.subspan(2 * n, n);
  for (std::size_t i = 3; i + 3 < n; ++i)
    second[i] = std::abs(force[i] - 0.5 * (force[i - 3] + force[i + 3]));
  for (const std::size_t i : {std::size_t{0}, std::size_t{1}, std::size_t{2}, n - 3, n - 2, n - 1})
    second[i] = mirrored.second(i);
  std::size_t some = 0;
  for (std::size_t i = 0; i < n; i += stride) rest[some++] = mirrored.residual(i)[0];
  const double common = median(rest.first(some));
  const std::size_t rows = std::max<std::size_t>(n / limits.local, 1), length = n / rows;
  for (std::size_t k = 0; k < rows; ++k)
    local[k] = median_of_half(second.subspan(k * length, length), k ? local[k - 1] : common, rest);
  std::copy_n(local.begin(), rows, rest.begin());
  const double usual = median(rest.first(rows));
  for (std::size_t k = 0; k < rows; ++k) {
    const double ratio = usual > 0 ? std::max(local[k] / usual, 1.0 / 3.0) : 1.0;
    // a median of rounded values is rounded
    const double noise = std::hypot(limits.margin * common * ratio, 0.5 * limits.quantum) / 0.6745;
    const double level = limits.level * noise;
    for (std::size_t i = k * length; i < (k + 1 < rows ? (k + 1) * length : n); ++i) {
      if (!(second[i] > 0.5 * level)) continue;
      const auto [size, span] = mirrored.residual(i);
      if (size > level && span < limits.max_span * size && mirrored.off_lines(i) > limits.max_span * size)
        found(i);
    }
  }
}

}  // namespace needleforce::fit
