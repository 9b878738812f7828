// SPDX-License-Identifier: Apache-2.0
// Which layer of a replaced model is which of the one before it.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "model.hpp"

namespace needleforce {

/// Where the layers of a model begin [m], from the surface down.
struct Tops {
  std::array<double, max_layers> depth{};
  std::size_t count = 0;

  std::size_t nearest(double to) const noexcept {
    std::size_t best = 0;
    for (std::size_t i = 1; i < count; ++i)
      if (std::abs(depth[i] - to) < std::abs(depth[best] - to)) best = i;
    return best;
  }
  /// The layer in which a depth lies.
  std::size_t around(double at) const noexcept {
    std::size_t i = 0;
    while (i + 1 < count && depth[i + 1] <= at) ++i;
    return i;
  }
};

/// The layer of `old` that goes on as layer `i` of `now`, or `old.count` for one that was added. Equally many
/// layers are the same ones in order; otherwise those are the same whose tops are nearest to each other.
/// Wait-free.
inline std::size_t counterpart(const Tops& old, const Tops& now, std::size_t i) noexcept {
  if (old.count == now.count) return i;
  const std::size_t nearest = old.nearest(now.depth[i]);
  return now.nearest(old.depth[nearest]) == i ? nearest : old.count;
}

}  // namespace needleforce
