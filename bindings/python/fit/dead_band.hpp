// SPDX-License-Identifier: Apache-2.0
// Motion without the noise of the measured depth: what moves back and forth within a band is no motion.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace needleforce::fit {

/// Writes the depth as it moves once it has left a band of `half` [m] on either side (a play operator), at
/// the band's leading edge: steady motion comes out unchanged, back and forth by less than 2 `half` as rest.
inline void dead_band(std::span<const double> depth, double half, std::span<double> out) noexcept {
  if (depth.empty()) return;
  double middle = depth[0], side = 0;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const double before = middle;
    middle = std::clamp(middle, depth[i] - half, depth[i] + half);
    if (middle > before) side = half;
    if (middle < before) side = -half;
    out[i] = middle + side;
  }
}

}  // namespace needleforce::fit
