// SPDX-License-Identifier: Apache-2.0
// By how much a needle that bends is shorter along its path than a straight one, to the second order of
// slopes.
#pragma once

#include <array>
#include <cstddef>

#include "beam_mesh.hpp"

namespace needleforce::bending {

/// Lengths [m] that the tip lacks along its path for the travel of the base.
struct Shortening {
  double free = 0.0;      ///< above the surface
  double embedded = 0.0;  ///< in the tissue, by the slope to the path
  double weighted = 0.0;  ///< the same, each place by its share of the way from the surface to the tip
  double aside = 0.0;     ///< mean of the shaft's place times the slope to the path of its friction
  double passing = 0.0;   ///< what that gains per travel of the tip where the needle stays

  double whole() const noexcept { return free + embedded; }
  /// Looks at what came from outside. Wait-free.
  void check(StateCheck& check) const noexcept { check.numbers("beam.shortening", *this); }
};

/// The shortening at which a needle is as short as it was taken to be. Where it goes back and forth, as that
/// of a tip that is about to leave the tissue does, the next try is between the last two.
class ShapeSearch {
 public:
  /// The next to try after one whose solution was `found`. Wait-free.
  Shortening next(const Shortening& tried, const Shortening& found) noexcept {
    const double off = found.whole() - tried.whole();
    const double slope = (before_ - off) / (tried.whole() - tried_);
    const double share = before_ * off < 0.0 && slope > 1.0 ? 1.0 / slope : 1.0;
    before_ = off;
    tried_ = tried.whole();
    Shortening result = found;
    result.free = tried.free + share * (found.free - tried.free);
    result.embedded = tried.embedded + share * (found.embedded - tried.embedded);
    return result;
  }

 private:
  double before_ = 0.0, tried_ = 0.0;
};

/// Of the embedded needle: the half of (y' - T)^2, less T' v, with the direction T of the path and the offset
/// v of the needle from it; and at the surface, which is across the axis, less T v. Friction along the path
/// counts a place by the share of friction below it.
template <std::size_t dimension>
void shorten_embedded(BeamMesh<dimension>& mesh, Shortening& result) noexcept {
  result.embedded = result.weighted = result.aside = result.passing = 0.0;
  const std::size_t n = mesh.embedded();
  if (n == 0) return;
  const auto nodes = mesh.nodes().subspan(mesh.surface());
  const double h = mesh.h(), per_h = 1.0 / h, per_n = 1.0 / static_cast<double>(n);
  for (std::size_t d = 0; d < dimension; ++d) {
    double whole = 0.0, weighted = 0.0, aside = 0.0, passing = 0.0;
    for (std::size_t e = 0; e < n; ++e) {
      const auto &a = nodes[e], &b = nodes[e + 1];
      const auto squares = slope_squares(b.place[d] - a.place[d], h * a.slope[d], h * b.slope[d], per_h);
      const double along = 0.5 * (a.along[d] + b.along[d]), turn = b.along[d] - a.along[d];
      const double middle = 0.5 * (a.place[d] + b.place[d]) + (h / 12.0) * (a.slope[d] - b.slope[d]);
      const double path = 0.5 * h * along * along + 0.5 * turn * (a.path[d] + b.path[d]);
      const double share = static_cast<double>(e) + 0.5;
      whole += squares.whole + path;
      weighted += share * (squares.whole + path) + squares.weighted + along * middle;
      const double drag = 0.5 * (nodes[e].drag[d] + nodes[e].drag_before[d]);
      aside += drag * middle;
      passing += drag * share * (b.place[d] - a.place[d]);
      const double longer = squares.whole + path - (b.along[d] * b.place[d] - a.along[d] * a.place[d]);
      nodes[e].longer = d == 0 ? longer : nodes[e].longer + longer;
    }
    const double end = nodes[n].along[d] * nodes[n].place[d];
    const double surface = nodes[0].along[d] * (nodes[0].place[d] - nodes[0].path[d]);
    nodes[0].longer -= surface;
    result.embedded += whole - end + nodes[0].along[d] * nodes[0].path[d];
    result.weighted += per_n * weighted - end;
    result.aside += per_n * aside;
    result.passing += per_n * per_n * per_h * passing;
  }
}

/// Friction turns along the shaft while that slides, by a share of what is left.
template <std::size_t dimension>
void turn_drag(BeamMesh<dimension>& mesh, double share) noexcept {
  const auto nodes = mesh.nodes().subspan(mesh.surface());
  for (std::size_t e = 0; e + 1 < nodes.size(); ++e) {
    BeamNode<dimension>&a = nodes[e], &b = nodes[e + 1];
    for (std::size_t d = 0; d < dimension; ++d) {
      const double slope = (b.place[d] - a.place[d]) / mesh.h() - 0.5 * (a.along[d] + b.along[d]);
      a.drag_before[d] = a.drag[d];
      a.drag[d] += share * (slope - a.drag[d]);
    }
  }
  BeamNode<dimension>& tip = nodes.back();
  for (std::size_t d = 0; d < dimension; ++d) {
    tip.drag_before[d] = tip.drag[d];
    tip.drag[d] += share * (tip.slope[d] - tip.along[d] - tip.drag[d]);
  }
}

}  // namespace needleforce::bending
