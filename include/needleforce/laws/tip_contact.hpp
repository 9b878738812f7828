// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <variant>

#include "../contact.hpp"
#include "../law.hpp"
#include "../tip.hpp"

namespace needleforce::laws {

/// F(h) of any tip on a shank, by Sneddon's integrals before the loop. In it F is a polynomial of the fifth
/// degree in u = sqrt(h) on each of 40 blocks, which meets F and dF/du = 4 E_r a u at both ends and the
/// middle; the block with the largest error is halved until there are 40. Slope and energy belong to that F
/// exactly.
struct TipContact {
  double reduced_modulus;
  double radius;
  Tip tip{};

  static constexpr const char* name = "tip_contact";
  static constexpr Family family = Family::stiffness;
  static constexpr const char* summary =
      "Any tip on a cylindrical shank, its integrals tabulated before the loop.";
  static constexpr const char* source = "Sneddon 1965; Galin 1953, fixed contact edge";
  static constexpr const char* validity =
      "Small slopes: with a sharp or a long tip a scaling law, not a prediction. The table keeps 1e-8 of the "
      "force at saturation, of a profile with 32 knots 5e-6.";
  static constexpr std::array<Parameter<TipContact>, 2> table{{
      {&TipContact::reduced_modulus, "reduced_modulus", "Pa", 1.0, 1e10, required, "E_r",
       "reduced modulus of needle and tissue", "eq. (4)"},
      {&TipContact::radius, "radius", "m", 1e-6, 1e-1, required, "R",
       "radius of the shank, where the contact stops growing", "Galin 1953"},
  }};
  static constexpr std::tuple parts{Part{&TipContact::tip, "tip", "tip of the needle"}};
  /// What the table keeps of the force at saturation, but for profiles of many knots.
  static constexpr double accuracy = 1e-8;

  tips::Flaw flaw() const noexcept {
    if (valid(tip)) return {};
    return {"tip", -1, 0.0, "not a possible tip", "Check the numbers of the tip."};
  }

  struct Prepared {
    static constexpr std::size_t capacity = 40;
    using Polynomial = std::array<double, 6>;  // F of u - edge, coefficients from the constant on [N/m^(k/2)]

    std::array<double, capacity + 1> edge;  // u at the ends of the blocks [m^(1/2)]
    std::array<Polynomial, capacity> block;
    std::array<double, capacity + 1> stored;  // energy at the ends [J]
    double last_force, last_slope;            // where F continues linearly [N], [N/m]
    std::size_t count;

    double reach() const noexcept { return std::numeric_limits<double>::infinity(); }

    double force(double h) const noexcept {
      const double u = std::sqrt(h), end = edge[count];
      if (u >= end) return last_force + last_slope * (h - end * end);
      const std::size_t k = find(edge, u);
      return value(block[k], u - edge[k]);
    }
    double slope(double h) const noexcept {
      const double u = std::sqrt(h);
      if (u >= edge[count]) return last_slope;
      const std::size_t k = find(edge, u);
      return by_root(block[k], u - edge[k], u);
    }
    double energy(double h) const noexcept {
      const double u = std::sqrt(h), end = edge[count], beyond = h - end * end;
      if (u >= end) return stored[count] + beyond * (last_force + 0.5 * last_slope * beyond);
      const std::size_t k = find(edge, u);
      return stored[k] + work(block[k], edge[k], u - edge[k]);
    }
    double indentation(double force) const noexcept {
      const double end = edge[count] * edge[count];
      if (force >= last_force) return end + (force - last_force) / last_slope;
      std::array<double, capacity + 1> forces;
      for (std::size_t k = 0; k < count; ++k) forces[k] = block[k][0];
      const std::size_t k = find(forces, force);
      const double u = sneddon::detail::root([&](double x) { return value(block[k], x) - force; }, 0.0,
                                             edge[k + 1] - edge[k], 0.0) +
                       edge[k];
      return u * u;
    }

    /// The block whose left edge is at or below x, in a fixed number of steps.
    std::size_t find(const std::array<double, capacity + 1>& edges, double x) const noexcept {
      std::size_t k = 0;
      for (const std::size_t step : {32u, 16u, 8u, 4u, 2u, 1u})
        if (k + step < count && edges[k + step] <= x) k += step;
      return k;
    }
    static double value(const Polynomial& c, double x) noexcept {
      return c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5]))));
    }
    /// dF/dh = dF/du / (2 u); at the very surface its limit.
    static double by_root(const Polynomial& c, double x, double u) noexcept {
      if (!(u > 0.0)) return c[2];
      return (c[1] + x * (2.0 * c[2] + x * (3.0 * c[3] + x * (4.0 * c[4] + x * 5.0 * c[5])))) / (2.0 * u);
    }
    /// Integral of F dh = 2 u F du from the left edge.
    static double work(const Polynomial& c, double left, double x) noexcept {
      double sum = 0.0;
      for (std::size_t n = c.size(); n > 0; --n) {
        const auto power = static_cast<double>(n);
        sum = x * (2.0 * c[n - 1] * (left / power + x / (power + 1.0)) + sum);
      }
      return sum;
    }
  };

  Prepared prepare() const noexcept {
    return std::visit([this](const auto& shape) { return tabulate(shape); }, tip);
  }

 private:
  /// F over reduced modulus and dF/du at u = sqrt(h).
  struct Node {
    double u, force, by_u;
  };
  template <class TipShape>
  static Node node(const TipShape& shape, double u, double limit) noexcept {
    if (!(u > 0.0)) return {0.0, 0.0, 0.0};
    const Reach reach = reach_at_depth(shape, u * u, limit);
    return {u, reach.force, 4.0 * reach.contact_radius * u};
  }
  /// The quintic through force and derivative at 0, w/2 and w.
  static Prepared::Polynomial quintic(const Node& left, const Node& middle, const Node& right) noexcept {
    const double w = right.u - left.u;
    const double a = w * left.by_u, d = right.force - left.force, b = w * right.by_u;
    // what the cubic through the ends leaves at the middle, of value and derivative
    const double value = middle.force - left.force - 0.5 * d - 0.125 * (a - b);
    const double by = w * middle.by_u - 1.5 * d + 0.25 * (a + b);
    // t^2 (1-t)^2 (p + q (t - 1/2)): 1/16 at the middle, its derivative q/16
    const double p = 16.0 * value, q = 16.0 * by, e = p - 0.5 * q;
    const double c2 = 3.0 * d - 2.0 * a - b + e, c3 = a + b - 2.0 * d - 2.0 * e + q, c4 = e - 2.0 * q;
    return {left.force, a / w, c2 / (w * w), c3 / (w * w * w), c4 / (w * w * w * w), q / (w * w * w * w * w)};
  }

  struct Block {
    Node left, middle, right;
    double error;
  };
  template <class TipShape>
  static Block fitted(const TipShape& shape, const Node& left, const Node& right, double limit,
                      double scale) noexcept {
    Block block{left, node(shape, 0.5 * (left.u + right.u), limit), right, 0.0};
    const auto polynomial = quintic(left, block.middle, right);
    for (const double t : {0.2, 0.8}) {
      const double x = t * (right.u - left.u);
      const Node at = node(shape, left.u + x, limit);
      const double miss = std::abs(Prepared::value(polynomial, x) - at.force);
      // between the error of the whole and that of the force there
      block.error = std::max(block.error, miss / std::sqrt(at.force * scale));
    }
    return block;
  }

  /// The depths at which the contact reaches a break of the profile, and the last one, in ascending order.
  template <class TipShape>
  static std::size_t starts(const TipShape& shape, double limit,
                            std::array<double, Prepared::capacity + 1>& u) noexcept {
    std::size_t n = 0;
    u[n++] = 0.0;
    for (const double b : shape.breaks())
      if (b > shape.flat() && b < limit) {
        const double at = std::sqrt(sneddon::depth(shape, b));
        if (at > u[n - 1]) u[n++] = at;
      }
    const double end = sneddon::is_tangent<TipShape>() ? std::min(limit, shape.end() * (1.0 - 1e-9)) : limit;
    const double last = std::sqrt(sneddon::depth(shape, end));
    // a flat face saturates at once: one block of any width is exact
    u[n] = last > u[n - 1] ? last : u[n - 1] + std::sqrt(limit);
    return n;
  }

  template <class TipShape>
  Prepared tabulate(const TipShape& shape) const noexcept {
    const double limit = saturation_radius(shape, radius);
    std::array<double, Prepared::capacity + 1> u{};
    std::array<Block, Prepared::capacity> blocks{};
    std::size_t count = starts(shape, limit, u);
    const double scale = node(shape, u[count], limit).force;
    for (std::size_t k = 0; k < count; ++k)
      blocks[k] = fitted(shape, node(shape, u[k], limit), node(shape, u[k + 1], limit), limit, scale);
    while (count < Prepared::capacity) {
      const auto end = blocks.begin() + static_cast<std::ptrdiff_t>(count);
      const auto worst = std::max_element(blocks.begin(), end,
                                          [](const Block& a, const Block& b) { return a.error < b.error; });
      if (!(worst->error > 1e-15)) break;
      const Block whole = *worst;
      std::move_backward(worst + 1, end, end + 1);
      worst[0] = fitted(shape, whole.left, whole.middle, limit, scale);
      worst[1] = fitted(shape, whole.middle, whole.right, limit, scale);
      ++count;
    }
    return prepared(blocks, count);
  }

  Prepared prepared(const std::array<Block, Prepared::capacity>& blocks, std::size_t count) const noexcept {
    Prepared result{};
    result.count = count;
    for (std::size_t k = 0; k < count; ++k) {
      const auto& [left, middle, right, error] = blocks[k];
      result.edge[k] = left.u;
      result.edge[k + 1] = right.u;
      result.block[k] = quintic(left, middle, right);
      for (double& coefficient : result.block[k]) coefficient *= reduced_modulus;
      result.stored[k + 1] = result.stored[k] + Prepared::work(result.block[k], left.u, right.u - left.u);
    }
    const Node& last = blocks[count - 1].right;
    result.last_force = reduced_modulus * last.force;
    result.last_slope = reduced_modulus * last.by_u / (2.0 * last.u);
    return result;
  }
};

/// A law of another number than double has a contact of its own: gradient/tip_contact.hpp.
template <class Real>
struct TipContactFor;
template <>
struct TipContactFor<double> {
  using type = TipContact;
};
template <class Real>
using TipContactOf = typename TipContactFor<Real>::type;

}  // namespace needleforce::laws
