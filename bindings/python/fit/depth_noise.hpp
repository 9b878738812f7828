// SPDX-License-Identifier: Apache-2.0
// The noise of a measured depth, and the depth averaged over neighbouring samples.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "median.hpp"

namespace needleforce::fit {

/// Standard deviation of white noise in a series, from the median of its second differences, which a trend
/// does not affect: they have 6 times its variance. `scratch` takes as many values as the series.
inline double second_difference_noise(std::span<const double> values, std::span<double> scratch) noexcept {
  if (values.size() < 3) return 0;
  const std::size_t n = values.size() - 2;
  for (std::size_t i = 0; i < n; ++i)
    scratch[i] = std::abs((values[i + 2] - values[i + 1]) - (values[i + 1] - values[i]));
  return median(scratch.first(n)) / 0.6745 / std::sqrt(6.0);
}

/// Whether the noise of `second_difference_noise` exceeds a limit: most series are decided by counting.
inline bool noise_exceeds(std::span<const double> values, double limit, std::span<double> scratch) noexcept {
  const double level = limit * std::sqrt(6.0) * 0.6745;
  std::size_t above = 0;
  for (std::size_t i = 0; i + 2 < values.size(); ++i)
    above += !(std::abs((values[i + 2] - values[i + 1]) - (values[i + 1] - values[i])) < 0.999 * level);
  return 2 * above + 8 >= values.size() && second_difference_noise(values, scratch) > limit;
}

/// The largest of the values so far at each of them.
inline void running_max(std::span<const double> values, std::span<double> out) noexcept {
  double largest = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < values.size(); ++i)
    out[i] = largest = values[i] > largest ? values[i] : largest;
}

/// The steps of a depth: how many of them are none, the smallest other one, and how many are hardly larger.
struct Steps {
  std::size_t moving = 0;
  double smallest = std::numeric_limits<double>::infinity();
  std::size_t small = 0;
};

inline Steps steps_of(std::span<const double> depth) noexcept {
  Steps steps;
  for (std::size_t i = 1; i < depth.size(); ++i) {
    const double step = std::abs(depth[i] - depth[i - 1]);
    steps.moving += step > 0;
    steps.smallest = std::min(steps.smallest, step > 0 ? step : steps.smallest);
  }
  if (steps.moving + 1 == depth.size()) return steps;  // never at rest
  for (std::size_t i = 1; i < depth.size(); ++i)
    steps.small += std::abs(depth[i] - depth[i - 1]) <= 1.5 * steps.smallest;
  return steps;
}

/// Standard deviation [m] of the noise of a depth, with the rounding of one that moves in steps of a quantum:
/// more than half of its steps are the smallest one or none. `scratch` takes as many values as the depth.
inline double depth_noise(std::span<const double> depth, std::span<double> scratch) noexcept {
  if (depth.size() < 3) return 0;
  const double scatter = second_difference_noise(depth, scratch);
  const Steps steps = steps_of(depth);
  const std::size_t count = depth.size() - 1;
  // at rest, or never at rest: no steps of a quantum
  if (steps.moving == 0 || steps.moving == count || 2 * steps.small <= count) return scatter;
  return std::hypot(scatter, steps.smallest / std::sqrt(12.0));
}

/// Calls found(i) for the alternating minima and maxima of a depth, at least `min_travel` apart, the last
/// extreme of a motion that continues included.
template <class Function>
void reversals(std::span<const double> depth, double min_travel, const Function& found) {
  enum class Motion { unknown, rising, falling } motion = Motion::unknown;
  std::size_t low = 0, high = 0;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    if (motion != Motion::falling && depth[i] > depth[high]) high = i;
    if (motion != Motion::rising && depth[i] < depth[low]) low = i;
    if (motion != Motion::rising && depth[i] - depth[low] > min_travel) {
      found(low), motion = Motion::rising, high = i;
    } else if (motion != Motion::falling && depth[high] - depth[i] > min_travel) {
      found(high), motion = Motion::falling, low = i;
    }
  }
  found(motion == Motion::rising ? high : low);
}

/// Writes the average over `half` samples on either side of each, fewer at the ends, where it is symmetric
/// too. `sums` takes one value more than there are.
inline void moving_average(std::span<const double> values, std::size_t half, std::span<double> sums,
                           std::span<double> out) noexcept {
  const std::size_t n = values.size();
  sums[0] = 0;
  for (std::size_t i = 0; i < n; ++i) sums[i + 1] = sums[i] + (values[i] - values[0]);
  const auto mean = [&](std::size_t i, std::size_t reach) {
    return values[0] + (sums[i + reach + 1] - sums[i - reach]) / static_cast<double>(2 * reach + 1);
  };
  const std::size_t margin = std::min(half, n / 2);
  for (std::size_t i = 0; i < margin; ++i) out[i] = mean(i, i);
  for (std::size_t i = margin; i + margin < n; ++i) out[i] = mean(i, margin);
  for (std::size_t i = std::max(n - margin, margin); i < n; ++i) out[i] = mean(i, n - 1 - i);
}

}  // namespace needleforce::fit
