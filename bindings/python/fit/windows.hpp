// SPDX-License-Identifier: Apache-2.0
// Two windows of a series compared at every place, and robust standard deviations of such comparisons.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

namespace needleforce::fit {

/// Two windows of `window` values, `gap` values apart; near the end of a series the second window's own slope
/// shows the decline after it if `near_end`.
struct Windows {
  std::size_t window, gap;
  bool near_end;

  std::size_t apart() const noexcept { return window + gap; }
  /// Places at which both windows lie within n values; 0 for none.
  std::size_t places(std::size_t n) const noexcept {
    const std::size_t needed = apart() + window;
    return n < needed ? 0 : n - needed + 1;
  }
};

/// What a comparison finds at each place: the fall between the means, its excess over the larger of those
/// just before and after it, the fall bent about the windows' slopes, and the excess with the end of a line
/// for the first mean.
struct Compared {
  std::span<double> fall, excess, bent, line;
};

/// Compares the windows in `centred`, a series without its mean. `scratch` takes four times as many values,
/// and two more.
inline void compare_windows(std::span<const double> centred, const Windows& windows,
                            std::span<double> scratch, const Compared& out) noexcept {
  const std::size_t n = centred.size(), w = windows.window, apart = windows.apart(),
                    count = windows.places(n);
  const std::span<double> sums = scratch.first(n + 1), moments = scratch.subspan(n + 1, n + 1),
                          mean = scratch.subspan(2 * n + 2, n), slope = scratch.subspan(3 * n + 2, n);
  const double middle = static_cast<double>(n) / 2, width = static_cast<double>(w),
               distance = static_cast<double>(apart);
  const auto place = [&](std::size_t i) { return static_cast<double>(i) - middle; };
  sums[0] = moments[0] = 0;
  for (std::size_t i = 0; i < n; ++i) {
    sums[i + 1] = sums[i] + centred[i];
    moments[i + 1] = moments[i] + centred[i] * place(i);
  }
  const double inertia = 12 / (width * width * width - width);
  for (std::size_t i = 0; i + w <= n; ++i) {
    const double total = sums[i + w] - sums[i];
    mean[i] = total / width;
    slope[i] = (moments[i + w] - moments[i] - (place(i) + (width - 1) / 2) * total) * inertia;
  }
  for (std::size_t i = 0; i < count; ++i) out.fall[i] = mean[i] - mean[i + apart];
  const std::size_t shift = apart + w;
  for (std::size_t i = 0; i < count; ++i) {
    const double before = slope[i], after = slope[i + apart], fall = out.fall[i];
    double decline =
        windows.near_end ? std::max(-distance * after, 0.0) : std::numeric_limits<double>::infinity();
    if (i + shift < count) decline = std::max(out.fall[i + shift], 0.0);
    if (i >= shift) decline = std::max(decline, out.fall[i - shift]);
    out.excess[i] = fall - decline;
    out.bent[i] = fall + 0.5 * distance * (before + after);
    out.line[i] = fall + 0.5 * (width * before - decline);
  }
}

/// Where the first run of at least `length` values above a level starts; the number of values if there is
/// none.
inline std::size_t first_run(std::span<const double> values, double level, std::size_t length) noexcept {
  std::size_t run = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    run = values[i] > level ? run + 1 : 0;
    if (run >= length) return i + 1 - length;
  }
  return values.size();
}

/// The (k + 1)-th smallest of the values, which are reordered.
inline double kth(std::span<double> values, std::size_t k) noexcept {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(k);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The magnitude about the median below which the share 1 / `part` of the values lies; 0 for fewer than four
/// values. `scratch` takes as many values.
inline double spread_of_part(std::span<const double> values, std::size_t part,
                             std::span<double> scratch) noexcept {
  const std::size_t n = values.size();
  if (n < 4) return 0;
  const std::span<double> some = scratch.first(n);
  std::copy(values.begin(), values.end(), some.begin());
  const double middle = kth(some, n / 2);
  for (double& value : some) value = std::abs(value - middle);
  return kth(some, n / part);
}

}  // namespace needleforce::fit
