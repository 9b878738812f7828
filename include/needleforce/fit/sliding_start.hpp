// SPDX-License-Identifier: Apache-2.0
// Where a needle that is withdrawn begins to slide: its pull, as a mean over bins of travel, first stops
// growing.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "stroke.hpp"

namespace needleforce::fit {

/// Bins of travel from the first sample of a withdrawal: their size [m], how many ahead are compared, and
/// their largest number.
struct TravelBins {
  double size;
  std::size_t ahead, max_count;
};

/// The number of samples of a withdrawal before the first bin of which none of those ahead has a stronger
/// mean pull, a lower force. A sample belongs to the furthest bin so far.
inline std::size_t sliding_start(const Stroke& out, const TravelBins& bins) {
  if (out.size() == 0) return 0;
  std::vector<double> mean;
  std::vector<std::size_t> first;  // sample of each bin
  std::size_t bin = 0, count = 0;
  double sum = 0;
  const auto close = [&] {
    mean.push_back(count ? sum / static_cast<double>(count) : std::numeric_limits<double>::infinity());
  };
  first.push_back(0);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double travel =
        std::clamp((out.depth[0] - out.depth[i]) / bins.size, 0.0, static_cast<double>(bins.max_count));
    for (const std::size_t now = std::max(bin, static_cast<std::size_t>(travel)); bin < now; ++bin)
      close(), first.push_back(i), count = 0, sum = 0;
    ++count, sum += out.force[i];
  }
  close();
  for (std::size_t k = 0; k < mean.size(); ++k) {
    const std::size_t end = std::min(k + bins.ahead + 1, mean.size());
    if (mean[k] <= *std::min_element(mean.begin() + static_cast<std::ptrdiff_t>(k),
                                     mean.begin() + static_cast<std::ptrdiff_t>(end)))
      return first[k];
  }
  return 0;
}

}  // namespace needleforce::fit
