// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "../law.hpp"
#include "../tips/limits.hpp"

namespace needleforce::laws {

/// F = (2/pi) E_r tan(alpha) h^2: a rigid cone of infinite height, pressed into an elastic half-space.
struct Cone {
  double reduced_modulus;
  double half_angle;

  static constexpr const char* name = "cone";
  static constexpr Family family = Family::stiffness;
  static constexpr const char* summary =
      "Bare cone on an elastic half-space: force grows with the square of the depth.";
  static constexpr const char* source = "eq. (6); Sneddon 1965";
  static constexpr const char* validity =
      "Small slopes (half angle above 60 degrees) and contact radius below the needle's: with a thin sharp "
      "needle a "
      "scaling law, not a prediction.";
  static constexpr std::array<Parameter<Cone>, 2> table{{
      {&Cone::reduced_modulus, "reduced_modulus", "Pa", 1.0, 1e10, required, "E_r",
       "reduced modulus of needle and tissue", "eq. (4)"},
      {&Cone::half_angle, "half_angle", "rad", 0.1 * tips::degree, 89.9 * tips::degree, required, "alpha",
       "angle between the needle's axis and the generator of the cone", "eq. (5)"},
  }};

  struct Prepared {
    double coefficient;  // F = coefficient h^2 [N/m^2]
    double reach() const noexcept { return std::numeric_limits<double>::infinity(); }
    double force(double h) const noexcept { return coefficient * h * h; }
    double slope(double h) const noexcept { return 2.0 * coefficient * h; }
    double energy(double h) const noexcept { return coefficient * h * h * h / 3.0; }
    double indentation(double force) const noexcept { return std::sqrt(force / coefficient); }
  };
  Prepared prepare() const noexcept {
    return {2.0 / std::numbers::pi * reduced_modulus * std::tan(half_angle)};
  }
};

}  // namespace needleforce::laws
