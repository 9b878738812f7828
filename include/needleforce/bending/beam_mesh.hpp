// SPDX-License-Identifier: Apache-2.0
// Nodes along the needle from the base to the tip.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "../state_check.hpp"
#include "beam_element.hpp"
#include "needle_section.hpp"

namespace needleforce::bending {

inline constexpr std::size_t max_elements = 100;
inline constexpr std::size_t max_nodes = max_elements + max_sections + 2;

/// A node: its distance from the surface, along the needle above and along the path in the tissue, where it
/// is positive [m]; deflection [m], slope [1], where the path is [m] and its direction [1], and by how much
/// the needle is longer than its path from here to the next node [m].
template <std::size_t dimension>
struct BeamNode {
  double travel = 0.0;
  std::array<double, dimension> place{}, slope{}, path{}, along{};
  double longer = 0.0;
  std::array<double, dimension> drag{}, drag_before{};  ///< slope to the path of the friction from here on
};

/// Length [m] of the needle along an element of h, at an angle t to the path: sqrt(1 + t^2) = 1 + s - s^2 /
/// 2, s = t^2 / 2 = longer / h.
inline double element_length(double h, double longer) noexcept {
  const double more = std::clamp(longer, -0.5 * h, 0.5 * h);
  return h + more * (1.0 - 0.5 * more / h);
}

/// Nodes at the base, where the needle's section changes above the surface, at the surface, and evenly in the
/// tissue: the elements stretch with the tip. They hold the last shape.
template <std::size_t dimension>
class BeamMesh {
 public:
  using Node = BeamNode<dimension>;

  static constexpr double shortest_embedded = 5e-5;  // [m]; below, the foundation acts at the surface
  static constexpr double shortest_free = 1e-6;      // [m]; below, the base is at the surface

  /// Places the nodes of a needle that has `free_length` [m] between its base and the surface, or its tip
  /// above it, and `embedded` [m] in the tissue, with elements of no less than `shortest_element` [m]
  /// Another number of nodes takes its values from the old shape.
  void place(const Sections& sections, std::size_t elements, double shortest_element, double free_length,
             double embedded) noexcept {
    const bool in_tissue = embedded >= shortest_embedded;
    const double length = free_length + (in_tissue ? 0.0 : embedded);
    const double to_tip = in_tissue ? embedded : 0.0;
    std::array<double, max_sections + 2> above;
    std::size_t surface = 0;
    if (length > shortest_free) {
      above[surface++] = -length;
      for (std::size_t i = sections.count - 1; i-- > 0;) {
        const double at = to_tip - sections.list[i].end;
        if (at > -length + shortest_free && at < -shortest_free) above[surface++] = at;
      }
    }
    const std::size_t most = static_cast<std::size_t>(embedded / shortest_element);
    const std::size_t in = in_tissue ? std::clamp<std::size_t>(most, 1, elements) : 0;
    const double h = in_tissue ? embedded / static_cast<double>(in) : std::max(length, shortest_free);
    if (count_ > 0 && !(in == embedded_ && surface == surface_)) transfer(above, surface, in, h);
    set(above, surface, in, h, nodes_);
    surface_ = surface, embedded_ = in, h_ = h, count_ = surface + in + 1;
  }

  std::span<const Node> nodes() const noexcept { return {nodes_.data(), count_}; }
  std::span<Node> nodes() noexcept { return {nodes_.data(), count_}; }
  /// Lateral place [m] of the shaft in element e in the tissue, by its shape functions.
  std::array<double, dimension> place_in(std::size_t e, const std::array<double, 4>& shape) const noexcept {
    const Node &a = nodes_[surface_ + e], &b = nodes_[surface_ + e + 1];
    std::array<double, dimension> place;
    for (std::size_t d = 0; d < dimension; ++d)
      place[d] = shape[0] * a.place[d] + shape[1] * h_ * a.slope[d] + shape[2] * b.place[d] +
                 shape[3] * h_ * b.slope[d];
    return place;
  }
  const Node& operator[](std::size_t i) const noexcept { return nodes_[i]; }
  const Node& tip() const noexcept { return nodes_[count_ - 1]; }
  const Node& base() const noexcept { return nodes_[0]; }
  std::size_t count() const noexcept { return count_; }
  std::size_t surface() const noexcept { return surface_; }    ///< number of the node at the surface
  std::size_t embedded() const noexcept { return embedded_; }  ///< number of elements in the tissue
  /// Looks at a mesh from outside: numbers of nodes that agree, elements no longer than a needle. Wait-free.
  void check(StateCheck& check) const noexcept {
    check.require("beam.count",
                  surface_ <= max_sections + 1 && embedded_ <= max_elements &&
                      (count_ == 0 ? surface_ + embedded_ == 0 : count_ == surface_ + embedded_ + 1));
    check.number("beam.h", h_, shortest_free, 10.0);
    check.numbers("beam.nodes", nodes_);
  }
  double h() const noexcept { return h_; }  ///< length of an element in the tissue; scale of rotations [m]

 private:
  using Above = std::array<double, max_sections + 2>;
  static void set(const Above& above, std::size_t surface, std::size_t in, double h,
                  std::array<Node, max_nodes>& nodes) noexcept {
    for (std::size_t i = 0; i < surface; ++i) nodes[i].travel = above[i];
    for (std::size_t i = 0; i <= in; ++i) nodes[surface + i].travel = h * static_cast<double>(i);
  }
  /// First values for another mesh, on the old curve; from a tip above or below the old one, straight on.
  void transfer(const Above& above, std::size_t surface, std::size_t in, double h) noexcept {
    std::array<Node, max_nodes> next;
    set(above, surface, in, h, next);
    std::size_t k = 0;
    for (std::size_t i = 0; i < surface + in + 1; ++i) {
      while (k + 2 < count_ && nodes_[k + 1].travel < next[i].travel) ++k;
      interpolate(k, next[i]);
    }
    nodes_ = next;
  }
  void interpolate(std::size_t k, Node& node) const noexcept {
    const Node &a = nodes_[k], &b = nodes_[count_ > 1 ? k + 1 : k];
    const double length = b.travel - a.travel;
    const double xi = length > 0.0 ? (node.travel - a.travel) / length : 0.0;
    const auto shape = hermite(std::clamp(xi, 0.0, 1.0));
    for (std::size_t d = 0; d < dimension; ++d) {
      node.slope[d] = a.slope[d] + std::clamp(xi, 0.0, 1.0) * (b.slope[d] - a.slope[d]);
      node.place[d] = shape[0] * a.place[d] + shape[1] * length * a.slope[d] + shape[2] * b.place[d] +
                      shape[3] * length * b.slope[d];
      if (xi > 1.0) node.place[d] += (node.travel - b.travel) * b.slope[d];
    }
    node.drag = a.drag, node.drag_before = a.drag_before;
  }

  std::array<Node, max_nodes> nodes_{};
  std::size_t count_ = 0, surface_ = 0, embedded_ = 0;
  double h_ = 1.0;
};

}  // namespace needleforce::bending
