// SPDX-License-Identifier: Apache-2.0
// The contact of any tip on a shank as a table, made before the loop: one serves all layers that the needle
// enters, whatever their moduli.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "contact.hpp"
#include "tip.hpp"

namespace needleforce {

/// F(h) for a reduced modulus of 1, by Sneddon's integrals. F is a polynomial of the fifth degree in u =
/// sqrt(h) on each of 40 blocks, which meets F and dF/du = 4 a u at both ends and the middle; the block with
/// the largest error is halved until there are 40. Kept are the values at the ends, of which the cubic
/// follows, and what bends it to meet the middle: so small that single precision adds no error that counts.
/// Slope and energy belong to that F exactly.
class TipTable {
 public:
  TipTable() = default;
  TipTable(const Tip& tip, double shank_radius) noexcept { tabulate(tip, shank_radius); }

  /// F [m^2] and dF/dh [m].
  struct Pressed {
    double force, slope;
  };
  /// Both with one search.
  Pressed at(double h) const noexcept {
    const double u = std::sqrt(h), end = last_root();
    if (u >= end) return {last_force() + last_slope() * (h - end * end), last_slope()};
    const std::size_t k = find(u);
    const Block inside = block(k);
    return {inside.value(u - left_of(k)), inside.by_depth(u - left_of(k), u)};
  }
  double force(double h) const noexcept { return at(h).force; }
  double slope(double h) const noexcept { return at(h).slope; }
  /// Sums the blocks above: for a puncture, not for every step.
  double energy(double h) const noexcept {
    const double u = std::sqrt(h), end = last_root(), beyond = h - end * end;
    const std::size_t k = u >= end ? count_ : find(u);
    double sum = 0.0;
    for (std::size_t i = 0; i < k; ++i) sum += block(i).work(left_of(i), right_of(i) - left_of(i));
    if (k == count_) return sum + beyond * (last_force() + 0.5 * last_slope() * beyond);
    return sum + block(k).work(left_of(k), u - left_of(k));
  }
  double indentation(double force) const noexcept {
    const double end = last_root() * last_root();
    if (force >= last_force()) return end + (force - last_force()) / last_slope();
    std::size_t k = 0;
    while (k + 1 < count_ && node_[k + 1].force <= force) ++k;
    const Block inside = block(k);
    const auto miss = [&](double x) { return inside.value(x) - force; };
    const double u = sneddon::detail::root(miss, 0.0, right_of(k) - left_of(k), 0.0) + left_of(k);
    return u * u;
  }
  /// Root of the depth [m^(1/2)] from which F is straight, and F there [m^2].
  double last_root() const noexcept { return end_; }
  double last_force() const noexcept { return node_[count_].force; }
  double last_slope() const noexcept { return node_[count_].by_root / (2.0 * last_root()); }
  /// Calls `visit` with every number that the table consists of.
  template <class Visit>
  void each(Visit visit) const noexcept {
    for (std::size_t k = 0; k < count_; ++k)
      for (const float each : {edge_[k], bend_[k].even, bend_[k].odd}) visit(static_cast<double>(each));
    for (std::size_t k = 0; k <= count_; ++k) visit(node_[k].force), visit(node_[k].by_root);
    visit(end_);
  }

 private:
  static constexpr std::size_t capacity = 40;
  /// F [m^2] and dF/du [m^(3/2)].
  struct Node {
    double force, by_root;
  };
  /// What bends the cubic through the ends of a block: t^2 (1-t)^2 (even + odd (t - 1/2)), of the rise of F.
  struct Bend {
    float even = 0.0f, odd = 0.0f;
  };
  /// F over x = u - edge as a polynomial of t = x / width, its coefficients from the constant on [m^2].
  struct Block {
    double per_width;
    std::array<double, 6> c;

    double value(double x) const noexcept {
      const double t = x * per_width;
      return c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))));
    }
    /// dF/dh = dF/du / (2 u); at the very surface its limit.
    double by_depth(double x, double u) const noexcept {
      const double t = x * per_width;
      if (!(u > 0.0)) return c[2] * per_width * per_width;
      const double by_t = c[1] + t * (2.0 * c[2] + t * (3.0 * c[3] + t * (4.0 * c[4] + t * 5.0 * c[5])));
      return by_t * per_width / (2.0 * u);
    }
    /// Integral of F dh = 2 u F du from the left edge.
    double work(double left, double x) const noexcept {
      const double t = x * per_width;
      double sum = 0.0;
      for (std::size_t n = c.size(); n > 0; --n) {
        const auto power = static_cast<double>(n);
        sum = 2.0 * c[n - 1] * (left / power + x / (power + 1.0)) + t * sum;
      }
      return x * sum;
    }
  };
  /// What the middle at w/2 asks for, of the polynomial and of its derivative a sixteenth each.
  static Bend bend(double w, const Node& left, const Node& middle, const Node& right) noexcept {
    const double a = w * left.by_root, d = right.force - left.force, b = w * right.by_root;
    const double value = middle.force - left.force - 0.5 * d - 0.125 * (a - b);
    const double by = w * middle.by_root - 1.5 * d + 0.25 * (a + b);
    if (!(d > 0.0)) return {};
    return {static_cast<float>(16.0 * value / d), static_cast<float>(16.0 * by / d)};
  }
  static Block quintic(double w, const Node& left, const Bend& bend, const Node& right) noexcept {
    const double a = w * left.by_root, d = right.force - left.force, b = w * right.by_root;
    const double q = d * static_cast<double>(bend.odd), e = d * static_cast<double>(bend.even) - 0.5 * q;
    return {1.0 / w,
            {left.force, a, 3.0 * d - 2.0 * a - b + e, a + b - 2.0 * d - 2.0 * e + q, e - 2.0 * q, q}};
  }
  double left_of(std::size_t k) const noexcept { return static_cast<double>(edge_[k]); }
  double right_of(std::size_t k) const noexcept { return k + 1 < count_ ? left_of(k + 1) : end_; }
  Block block(std::size_t k) const noexcept {
    return quintic(right_of(k) - left_of(k), node_[k], bend_[k], node_[k + 1]);
  }
  /// The block whose left edge is at or below u, or less than a rounding above it: edges are counted, several
  /// at a time, which takes less than to halve.
  std::size_t find(double u) const noexcept {
    const auto at = static_cast<float>(u);
    int below = -1;
    for (const float edge : edge_) below += edge <= at ? 1 : 0;
    return static_cast<std::size_t>(below < 0 ? 0 : below);
  }

  /// Not inlined: what follows is then compiled once, and not for each tip.
  [[gnu::noinline]] static Node node(const Tip& tip, double u, double limit) noexcept {
    if (!(u > 0.0)) return {0.0, 0.0};
    const Reach reach = dispatch(tip, [&](const auto& shape) { return reach_at_depth(shape, u * u, limit); });
    return {reach.force, 4.0 * reach.contact_radius * u};
  }
  struct Fitted {
    double from, to;  // u
    Node left, right;
    Bend bend;
    double error;
  };
  static Fitted fitted(const Tip& tip, double from, double to, const Node& left, const Node& right,
                       double limit, double scale) noexcept {
    const Node middle = node(tip, 0.5 * (from + to), limit);
    Fitted block{from, to, left, right, bend(to - from, left, middle, right), 0.0};
    const Block polynomial = quintic(to - from, left, block.bend, right);
    for (const double t : {0.2, 0.8}) {
      const double x = t * (to - from);
      const Node at = node(tip, from + x, limit);
      const double miss = std::abs(polynomial.value(x) - at.force);
      // between the error of the whole and that of the force there
      block.error = std::max(block.error, miss / std::sqrt(at.force * scale));
    }
    return block;
  }

  /// Roots of the depths at which the contact reaches a break of the profile, and of the last one, in
  /// ascending order.
  template <class TipShape>
  static std::size_t starts(const TipShape& shape, double limit,
                            std::array<double, capacity + 1>& u) noexcept {
    std::size_t n = 0;
    u[n++] = 0.0;
    for (const double b : shape.breaks())
      if (b > shape.flat() && b < limit) {
        const double at = kept(std::sqrt(sneddon::depth(shape, b)));
        if (at > u[n - 1] && std::isfinite(at)) u[n++] = at;
      }
    const double end = sneddon::is_tangent<TipShape>() ? std::min(limit, shape.end() * (1.0 - 1e-9)) : limit;
    const double last = std::sqrt(sneddon::depth(shape, end));
    // a flat face saturates at once: one block of any width is exact
    u[n] = last > u[n - 1] ? last : u[n - 1] + std::sqrt(limit);
    return n;
  }

  void tabulate(const Tip& tip, double shank_radius) noexcept {
    const double limit =
        dispatch(tip, [&](const auto& shape) { return saturation_radius(shape, shank_radius); });
    std::array<double, capacity + 1> u{};
    std::array<Fitted, capacity> blocks{};
    std::size_t count = dispatch(tip, [&](const auto& shape) { return starts(shape, limit, u); });
    const double scale = node(tip, u[count], limit).force;
    for (std::size_t k = 0; k < count; ++k)
      blocks[k] =
          fitted(tip, u[k], u[k + 1], node(tip, u[k], limit), node(tip, u[k + 1], limit), limit, scale);
    while (count < capacity) {
      const auto end = blocks.begin() + static_cast<std::ptrdiff_t>(count);
      const auto worst = std::max_element(blocks.begin(), end,
                                          [](const Fitted& a, const Fitted& b) { return a.error < b.error; });
      if (!(worst->error > 1e-15)) break;
      const Fitted whole = *worst;
      const double middle = kept(0.5 * (whole.from + whole.to));
      if (!(middle > whole.from && std::isfinite(middle))) break;  // beyond single precision
      std::move_backward(worst + 1, end, end + 1);
      const Node between = node(tip, middle, limit);
      worst[0] = fitted(tip, whole.from, middle, whole.left, between, limit, scale);
      worst[1] = fitted(tip, middle, whole.to, between, whole.right, limit, scale);
      ++count;
    }
    count_ = count;
    edge_.fill(std::numeric_limits<float>::infinity());  // no depth is beyond those that are not used
    for (std::size_t k = 0; k < count; ++k) {
      edge_[k] = static_cast<float>(blocks[k].from);
      node_[k] = blocks[k].left;
      bend_[k] = blocks[k].bend;
    }
    node_[count] = blocks[count - 1].right;
    end_ = blocks[count - 1].to;
  }
  /// An edge as it is kept: the block may begin a little before a break of the profile, or after it.
  static double kept(double u) noexcept { return static_cast<double>(static_cast<float>(u)); }

  std::array<float, capacity> edge_{};  // u where the blocks begin [m^(1/2)]
  std::array<Bend, capacity> bend_{};
  std::array<Node, capacity + 1> node_{};  // at the ends of the blocks
  double end_ = 0.0;                       // u where the last one ends [m^(1/2)]
  std::size_t count_ = 0;
};

}  // namespace needleforce
