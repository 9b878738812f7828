// SPDX-License-Identifier: Apache-2.0
// What loop.cpp prints of its times, as loop.py does.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

/// Bars over bins that double, in microseconds, of times [ns].
inline void histogram(const char* title, std::vector<std::uint64_t> times) {
  std::sort(times.begin(), times.end());
  const std::size_t n = times.size();
  const auto at = [&](double share) { return 1e-3 * times[static_cast<std::size_t>(share * (n - 1))]; };
  std::printf("%s: %zu steps, median %.3f, p99 %.3f, largest %.3f us\n", title, n, at(0.5), at(0.99),
              at(1.0));
  std::size_t below = 0;
  for (std::uint64_t edge = 2 * std::bit_floor(times[0] | 1); below < n; edge *= 2) {
    const std::size_t count = std::lower_bound(times.begin(), times.end(), edge) - times.begin() - below;
    const std::string bar((50 * count + n - 1) / n, '#');
    std::printf("  below %11.3f us %7zu %s\n", 1e-3 * edge, count, bar.c_str());
    below += count;
  }
}
