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
template <class Real>
struct BasicCone {
  Real reduced_modulus;
  Real half_angle;

  static constexpr const char* name = "cone";
  static constexpr Family family = Family::stiffness;
  static constexpr const char* summary =
      "Bare cone on an elastic half-space: force grows with the square of the depth.";
  static constexpr const char* source = "eq. (6); Sneddon 1965";
  static constexpr const char* validity =
      "Small slopes (half angle above 60 degrees) and contact radius below the needle's: with a thin sharp "
      "needle a "
      "scaling law, not a prediction.";
  static constexpr std::array<Parameter<BasicCone, Real>, 2> table{{
      {&BasicCone::reduced_modulus, "reduced_modulus", "Pa", 1.0, 1e10, required, "E_r",
       "reduced modulus of needle and tissue", "eq. (4)"},
      {&BasicCone::half_angle, "half_angle", "rad", 0.1 * tips::degree, 89.9 * tips::degree, required,
       "alpha", "angle between the needle's axis and the generator of the cone", "eq. (5)"},
  }};

  struct Prepared {
    Real coefficient;  // F = coefficient h^2 [N/m^2]
    Real reach() const noexcept { return std::numeric_limits<double>::infinity(); }
    Real force(Real h) const noexcept { return coefficient * h * h; }
    Real slope(Real h) const noexcept { return 2.0 * coefficient * h; }
    Real energy(Real h) const noexcept { return coefficient * h * h * h / 3.0; }
    Real indentation(Real force) const noexcept { return sqrt(force / coefficient); }
  };
  Prepared prepare() const noexcept { return {2.0 / std::numbers::pi * reduced_modulus * tan(half_angle)}; }
};
using Cone = BasicCone<double>;

}  // namespace needleforce::laws
