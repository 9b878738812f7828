// SPDX-License-Identifier: Apache-2.0
// Where a needle that is withdrawn begins to slide: its pull, as a mean over bins of travel, first stops
// growing.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "stroke.hpp"

namespace needleforce::fit {

/// Bins of travel from the first sample of a withdrawal: their size [m], how many ahead are compared, and
/// their largest number.
struct TravelBins {
  double size;
  std::size_t ahead, max_count;
};

/// The number of samples of a withdrawal before the first bin of which none of those ahead has a stronger
/// mean pull, a lower force. A sample belongs to the furthest bin so far. `scratch` takes twice as many
/// values as there may be bins, and two more.
inline std::size_t sliding_start(const Stroke& out, const TravelBins& bins,
                                 std::span<double> scratch) noexcept {
  if (out.size() == 0) return 0;
  const std::span<double> mean = scratch.first(bins.max_count + 1);
  const std::span<double> first =
      scratch.subspan(bins.max_count + 1, bins.max_count + 1);  // sample of each bin
  std::size_t bin = 0, count = 0;
  double sum = 0;
  const auto close = [&] {
    mean[bin] = count ? sum / static_cast<double>(count) : std::numeric_limits<double>::infinity();
  };
  first[0] = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double travel = (out.depth[0] - out.depth[i]) / bins.size;
    const double limited = std::clamp(travel, 0.0, static_cast<double>(bins.max_count));
    for (const std::size_t now = static_cast<std::size_t>(limited); bin < now; count = 0, sum = 0)
      close(), first[++bin] = static_cast<double>(i);
    ++count, sum += out.force[i];
  }
  close();
  for (std::size_t k = 0; k <= bin; ++k) {
    const std::size_t ahead = std::min(bins.ahead + 1, bin + 1 - k);
    const auto here = mean.subspan(k, ahead);
    if (mean[k] <= *std::min_element(here.begin(), here.end())) return static_cast<std::size_t>(first[k]);
  }
  return 0;
}

}  // namespace needleforce::fit
