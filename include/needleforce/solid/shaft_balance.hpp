// SPDX-License-Identifier: Apache-2.0
// Forces along the shaft: the minimum of elastic energy minus work, within the bounds of friction.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "condensed_tissue.hpp"
#include "path_layers.hpp"

namespace needleforce::solid {

/// What the shaft does to the tissue at each node of the path.
struct ShaftState {
  using Nodes = std::array<double, max_path_nodes>;
  Nodes force{};          ///< [N], + drags the tissue inwards
  Nodes displacement{};   ///< of the tissue, by all forces [m]
  Nodes anchor{};         ///< how far the shaft has slid past the tissue [m]
  std::size_t known = 0;  ///< nodes, from the surface, whose displacement is up to date
};

/// Adds a force [N] at a node: most of the time of a step; a call for each would take half as much again.
/// Wait-free.
[[gnu::always_inline]] inline void push(ShaftState& shaft, const CondensedTissue& tissue, std::size_t node,
                                        double force) noexcept {
  // restrict, so that the compiler widens the loop
  const double* __restrict row = tissue.row(node);
  double* __restrict displacement = shaft.displacement.data();
  for (std::size_t j = 0; j < shaft.known; ++j) displacement[j] += force * row[j];
}

/// Displacement [m] of a node by the shaft. Wait-free.
inline double displaced(const ShaftState& shaft, const CondensedTissue& tissue, std::size_t node) noexcept {
  const double* row = tissue.row(node);
  double sum = 0.0;
  for (std::size_t j = 0; j < shaft.known; ++j) sum += row[j] * shaft.force[j];
  return sum;
}

/// Adds a force [N] between two nodes. Wait-free.
inline void push(ShaftState& shaft, const CondensedTissue& tissue, const BetweenNodes& at,
                 double force) noexcept {
  if (force == 0.0) return;
  push(shaft, tissue, at.node, (1.0 - at.share) * force);
  push(shaft, tissue, at.node + 1, at.share * force);
}

/// One sweep of projected Gauss-Seidel over the nodes, for a shaft at a depth [m] and a table times `scale`;
/// returns the largest change, as a displacement [m]. Wait-free.
inline double sweep(ShaftState& shaft, const CondensedTissue& tissue, std::span<const FrictionBounds> bounds,
                    double depth, double scale, bool backwards) noexcept {
  double change = 0.0;
  for (std::size_t k = 0; k < shaft.known; ++k) {
    const std::size_t i = backwards ? shaft.known - 1 - k : k;
    const auto& [low, high, compliance] = bounds[i];
    const double gap = depth - shaft.anchor[i] - shaft.displacement[i] - compliance * shaft.force[i];
    const double own = scale * tissue.at(i, i);
    const double by = std::clamp(shaft.force[i] + gap / (own + compliance), low, high) - shaft.force[i];
    if (by == 0.0) continue;
    shaft.force[i] += by;
    push(shaft, tissue, i, scale * by);
    change = std::max(change, std::abs(by) * own);
  }
  return change;
}

/// Nodes at a bound slide, or all: their anchor follows. Returns what they dissipate [J]. Wait-free.
inline double slide(ShaftState& shaft, std::span<const FrictionBounds> bounds, double depth,
                    bool all) noexcept {
  double dissipated = 0.0;
  for (std::size_t i = 0; i < shaft.known; ++i)
    if (all || shaft.force[i] <= bounds[i].low || shaft.force[i] >= bounds[i].high) {
      const double to = depth - shaft.displacement[i] - bounds[i].compliance * shaft.force[i];
      dissipated += shaft.force[i] * (to - shaft.anchor[i]);
      shaft.anchor[i] = to;
    }
  return dissipated;
}

}  // namespace needleforce::solid
