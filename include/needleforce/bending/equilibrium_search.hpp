// SPDX-License-Identifier: Apache-2.0
// Towards equilibrium in steps, each of which solves linear equations.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "beam_foundation.hpp"

namespace needleforce::bending {

/// Where the tissue yields, or the needle is in space, the stiffnesses of one shape are not those of the
/// next: steps alone go back and forth, or converge slowly. A step that goes beyond the least energy along
/// its direction is shortened, and the two steps before improve a step (D. G. Anderson, J. ACM 12, 547,
/// 1965).
template <std::size_t dimension>
class EquilibriumSearch {
 public:
  using Equations = BeamEquations<dimension>;
  using Shape = std::array<NodeValue<dimension>, max_nodes>;

  /// Steps of less than `near` [m] are not shortened: they are rounding, or the last of a kink.
  EquilibriumSearch(BeamMesh<dimension>& mesh, double near) noexcept
      : mesh_(mesh), count_(mesh.count()), near_(near) {}

  /// Compares the forces at the present shape, from its equations, with the last step. True if that was too
  /// long and was shortened: these equations are of no use then. Wait-free.
  bool shortened(const Equations& equations) noexcept {
    missing(equations);
    if (steps_ < 2 || shortenings_ == max_shortenings || change_ < near_)
      return false;  // the first brings the base to its place
    const double work = dot(missing_, step_);
    if (!(work > overshoot * std::abs(work_))) return false;
    share_ *= std::clamp(work_ / (work_ - work), 0.1, 0.9);
    ++shortenings_;
    known_ = 0;
    move();
    return true;
  }

  /// Takes a step towards the solution of the equations; returns the distance to it of the farthest node [m].
  /// Wait-free.
  double advance(const Equations& solved) noexcept {
    change_ = 0.0;
    Shape off;
    const auto nodes = mesh_.nodes();
    for (std::size_t i = 0; i < count_; ++i)
      for (std::size_t d = 0; d < dimension; ++d) {
        shape_[i].y[d] = nodes[i].place[d];
        shape_[i].r[d] = mesh_.h() * nodes[i].slope[d];
        off[i].y[d] = solved.value[i].y[d] - shape_[i].y[d];
        off[i].r[d] = solved.value[i].r[d] - shape_[i].r[d];
        change_ = std::max(change_, std::abs(off[i].y[d]));
      }
    copy(off, step_);
    if (steps_ > 0) improve(solved.value, off);
    ++steps_;
    shortenings_ = 0;
    share_ = 1.0;
    work_ = dot(missing_, step_);
    move();
    return change_;
  }

 private:
  static constexpr double overshoot = 0.9;
  static constexpr std::size_t max_shortenings = 3;

  /// Uses the last two steps: how the distance to the solution changed with the solution.
  void improve(const Shape& solution, const Shape& off) noexcept {
    if (known_ > 0) {
      auto& [solutions, offs] = changes_[known_ % 2];
      subtract(solution, last_.solution, solutions);
      subtract(off, last_.off, offs);
      const auto shares = least_squares(off);
      for (std::size_t k = 0; k < std::min<std::size_t>(known_, 2); ++k)
        add(-shares[(known_ - k) % 2], changes_[(known_ - k) % 2].solution);
      if (!(dot(missing_, step_) < 0.0)) {
        copy(off, step_);
        known_ = 0;
      }
    }
    ++known_;
    copy(solution, last_.solution);
    copy(off, last_.off);
  }
  /// The shares of the changes that leave the least of a distance.
  std::array<double, 2> least_squares(const Shape& off) const noexcept {
    const Shape &now = changes_[known_ % 2].off, &before = changes_[(known_ + 1) % 2].off;
    const double aa = dot(now, now), a = dot(now, off);
    std::array<double, 2> shares{};
    double& newest = shares[known_ % 2];
    if (!(aa > 0.0)) return shares;
    newest = a / aa;
    if (known_ < 2) return shares;
    const double ab = dot(now, before), bb = dot(before, before), b = dot(before, off);
    const double left = bb - ab * ab / aa;
    if (!(left > 1e-10 * bb)) return shares;
    const double older = (b - ab * a / aa) / left;
    shares[(known_ + 1) % 2] = older;
    newest = (a - ab * older) / aa;
    return shares;
  }

  /// Forces that are missing for equilibrium at the present shape, negative.
  void missing(const Equations& equations) noexcept {
    for (std::size_t i = 0; i < count_; ++i)
      for (std::size_t d = 0; d < dimension; ++d) {
        missing_[i].y[d] = -equations.value[i].y[d];
        missing_[i].r[d] = -equations.value[i].r[d];
        add_product(equations.diagonal[i], i, d, missing_[i]);
        if (i + 1 < count_) add_product(equations.upper[i], i + 1, d, missing_[i]);
        if (i > 0) add_product(equations.lower[i - 1], i - 1, d, missing_[i]);
      }
  }
  void add_product(const Block& block, std::size_t node, std::size_t d,
                   NodeValue<dimension>& sum) const noexcept {
    const double y = mesh_[node].place[d], r = mesh_.h() * mesh_[node].slope[d];
    sum.y[d] += block.yy * y + block.yr * r;
    sum.r[d] += block.ry * y + block.rr * r;
  }

  /// The nodes at the share of the step.
  void move() noexcept {
    const auto nodes = mesh_.nodes();
    for (std::size_t i = 0; i < count_; ++i)
      for (std::size_t d = 0; d < dimension; ++d) {
        nodes[i].place[d] = shape_[i].y[d] + share_ * step_[i].y[d];
        nodes[i].slope[d] = (shape_[i].r[d] + share_ * step_[i].r[d]) / mesh_.h();
      }
  }
  void copy(const Shape& from, Shape& to) const noexcept { std::copy_n(from.begin(), count_, to.begin()); }
  void add(double share, const Shape& change) noexcept {
    for (std::size_t i = 0; i < count_; ++i)
      for (std::size_t d = 0; d < dimension; ++d) {
        step_[i].y[d] += share * change[i].y[d];
        step_[i].r[d] += share * change[i].r[d];
      }
  }
  void subtract(const Shape& a, const Shape& b, Shape& difference) const noexcept {
    for (std::size_t i = 0; i < count_; ++i)
      for (std::size_t d = 0; d < dimension; ++d) {
        difference[i].y[d] = a[i].y[d] - b[i].y[d];
        difference[i].r[d] = a[i].r[d] - b[i].r[d];
      }
  }
  double dot(const Shape& a, const Shape& b) const noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < count_; ++i)
      for (std::size_t d = 0; d < dimension; ++d) sum += a[i].y[d] * b[i].y[d] + a[i].r[d] * b[i].r[d];
    return sum;
  }

  /// A solution of linear equations, and its distance from the shape for which they were made.
  struct Solution {
    Shape solution, off;
  };

  BeamMesh<dimension>& mesh_;
  std::size_t count_, steps_ = 0, known_ = 0, shortenings_ = 0;
  double near_, share_ = 1.0, work_ = 0.0, change_ = 0.0;
  Shape shape_, step_, missing_;  // of the nodes in use alone
  Solution last_;
  std::array<Solution, 2> changes_;
};

}  // namespace needleforce::bending
