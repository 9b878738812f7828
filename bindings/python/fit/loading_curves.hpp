// SPDX-License-Identifier: Apache-2.0
// Loading curves F(h) = sum of a_k phi_k(h; s) in the form that a fit needs, the indentation h and the shape
// s in units of a reference depth L. Allocates nothing, throws nothing.
//
// A curve has `at(h, s, out)`, which writes phi_k, then d phi_k / dh, then d phi_k / ds where it has a shape:
// `columns` in all; h is none below 0. `shape_of` and `unit` give the shape and the amplitudes in SI; a curve
// is `kinked` if its slope may jump at contact.
#pragma once

#include <cmath>
#include <cstddef>

#include "stroke.hpp"

namespace needleforce::fit {

/// a h².
struct ConeCurve {
  static constexpr std::size_t amplitudes = 1, columns = 2;
  static constexpr bool shaped = false;
  static void at(Pair h, double, Pair* out) noexcept { out[0] = h * h, out[1] = 2 * h; }
  static bool kinked(double) noexcept { return false; }
  static double shape_of(double, double) noexcept { return 0; }
  static double unit(std::size_t, double, double depth) noexcept { return 1 / (depth * depth); }
};

/// a h² up to the saturation depth s, then a (2 s h - s²).
struct ConeCylinderCurve {
  static constexpr std::size_t amplitudes = 1, columns = 3;
  static constexpr bool shaped = true;
  static void at(Pair h, double s, Pair* out) noexcept {
    const Pair limit = Pair{} + s, cone = chosen(h < limit, h, limit);
    out[0] = cone * (2 * h - cone), out[1] = 2 * cone, out[2] = 2 * (h - cone);
  }
  static bool kinked(double) noexcept { return false; }
  static double shape_of(double s, double depth) noexcept { return s * depth; }
  static double unit(std::size_t, double, double depth) noexcept { return 1 / (depth * depth); }
};

/// a h^s, in SI a (h / 1 mm)^s.
struct PowerCurve {
  static constexpr std::size_t amplitudes = 1, columns = 3;
  static constexpr bool shaped = true;
  static constexpr double reference_depth = 1e-3;  // [m] that of the law's default
  static void at(Pair h, double s, Pair* out) noexcept {
    out[0] = out[1] = out[2] = Pair{};
    for (int lane = 0; lane < 2; ++lane) {
      if (!(h[lane] > 0)) continue;
      const double logarithm = std::log(h[lane]), power = std::exp(s * logarithm);
      out[0][lane] = power, out[1][lane] = s * power / h[lane], out[2][lane] = power * logarithm;
    }
  }
  static bool kinked(double s) noexcept { return s < 2; }
  static double shape_of(double s, double) noexcept { return s; }
  static double unit(std::size_t, double s, double depth) noexcept {
    return std::pow(reference_depth / depth, s);
  }
};

/// a_1 h + a_2 h².
struct PolynomialCurve {
  static constexpr std::size_t amplitudes = 2, columns = 4;
  static constexpr bool shaped = false;
  static void at(Pair h, double, Pair* out) noexcept {
    out[0] = h, out[1] = h * h, out[2] = chosen(h > 0.0, Pair{1, 1}, Pair{}), out[3] = 2 * h;
  }
  static bool kinked(double) noexcept { return true; }
  static double shape_of(double, double) noexcept { return 0; }
  static double unit(std::size_t k, double, double depth) noexcept {
    return k == 0 ? 1 / depth : 1 / (depth * depth);
  }
};

/// a (exp(s h) - 1).
struct ExponentialCurve {
  static constexpr std::size_t amplitudes = 1, columns = 3;
  static constexpr bool shaped = true;
  static void at(Pair h, double s, Pair* out) noexcept {
    out[0] = out[1] = out[2] = Pair{};
    for (int lane = 0; lane < 2; ++lane) {
      if (!(h[lane] > 0)) continue;
      const double rise = std::expm1(s * h[lane]);
      out[0][lane] = rise, out[1][lane] = s * (rise + 1), out[2][lane] = h[lane] * (rise + 1);
    }
  }
  static bool kinked(double) noexcept { return true; }
  static double shape_of(double s, double depth) noexcept { return s / depth; }
  static double unit(std::size_t, double, double) noexcept { return 1; }
};

}  // namespace needleforce::fit
