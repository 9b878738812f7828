// SPDX-License-Identifier: Apache-2.0
// A solid, condensed onto the nodes of the needle's path: all that the loop needs of a mesh.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

namespace needleforce::solid {

inline constexpr std::size_t max_path_nodes = 64;

/// Displacement along the path at each node for a unit force at each node [m/N], both spread over a spacing
/// to either side. Plain values; `fault` is the check.
struct CondensedTissue {
  std::size_t nodes = 0;  ///< 2 to 64, the first at the surface
  double spacing = 0.0;   ///< between nodes [m]
  /// Symmetric, positive definite; row i begins at i * max_path_nodes.
  std::array<double, max_path_nodes * max_path_nodes> compliance{};

  const double* row(std::size_t i) const noexcept { return compliance.data() + i * max_path_nodes; }
  double at(std::size_t i, std::size_t j) const noexcept { return row(i)[j]; }
  /// Depth of the last node [m].
  double length() const noexcept { return spacing * static_cast<double>(nodes - 1); }
};

namespace detail {
/// True if elimination meets positive pivots only. The matrix is a copy.
inline bool positive_definite(CondensedTissue tissue) noexcept {
  auto entry = [&](std::size_t i, std::size_t j) -> double& {
    return tissue.compliance[i * max_path_nodes + j];
  };
  for (std::size_t k = 0; k < tissue.nodes; ++k) {
    if (!(entry(k, k) > 0.0)) return false;
    for (std::size_t i = k + 1; i < tissue.nodes; ++i) {
      const double share = entry(i, k) / entry(k, k);
      for (std::size_t j = k + 1; j < tissue.nodes; ++j) entry(i, j) -= share * entry(k, j);
    }
  }
  return true;
}
}  // namespace detail

/// What is wrong with a table, nullptr if nothing is. Not for the loop.
inline const char* fault(const CondensedTissue& tissue) noexcept {
  if (tissue.nodes < 2 || tissue.nodes > max_path_nodes) return "the number of nodes is not 2 to 64";
  if (!(tissue.spacing >= 1e-6 && tissue.spacing <= 0.1)) return "the spacing is not 1e-6 to 0.1 m";
  for (std::size_t i = 0; i < tissue.nodes; ++i)
    for (std::size_t j = 0; j < tissue.nodes; ++j) {
      const double value = tissue.at(i, j), scale = std::sqrt(std::abs(tissue.at(i, i) * tissue.at(j, j)));
      if (!(std::abs(value) <= 1e9)) return "a compliance is not finite, or above 1e9 m/N";
      if (std::abs(value - tissue.at(j, i)) > 1e-6 * scale) return "the compliance is not symmetric";
    }
  return detail::positive_definite(tissue) ? nullptr : "the compliance is not positive definite";
}

/// Where a force acts between two nodes.
struct BetweenNodes {
  std::size_t node = 0;
  double share = 0.0;  ///< of the node behind it

  static BetweenNodes at(double distance, const CondensedTissue& tissue) noexcept {
    const double place = std::clamp(distance / tissue.spacing, 0.0, static_cast<double>(tissue.nodes - 1));
    const auto node = std::min(static_cast<std::size_t>(place), tissue.nodes - 2);
    return {node, place - static_cast<double>(node)};
  }
  double of(std::span<const double> values) const noexcept {
    return (1.0 - share) * values[node] + share * values[node + 1];
  }
  /// Displacement by a unit force at the same place, as the nodes have it [m/N].
  double spread(const CondensedTissue& tissue) const noexcept {
    const double near = 1.0 - share;
    return near * near * tissue.at(node, node) + 2.0 * near * share * tissue.at(node, node + 1) +
           share * share * tissue.at(node + 1, node + 1);
  }
  /// The same of a force that is spread no wider on its way between two nodes than at them [m/N].
  double compliance(const CondensedTissue& tissue) const noexcept {
    return (1.0 - share) * tissue.at(node, node) + share * tissue.at(node + 1, node + 1);
  }
};

}  // namespace needleforce::solid
