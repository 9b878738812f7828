// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "../law.hpp"
#include "../tips/limits.hpp"

namespace needleforce::laws {

/// Cone on a cylindrical shank: as the cone up to h_s = (pi/2) R cot(alpha), then linear with slope 2 E_r R.
template <class Real>
struct BasicConeCylinder {
  Real reduced_modulus;
  Real half_angle;
  Real radius;

  static constexpr const char* name = "cone_cylinder";
  static constexpr Family family = Family::stiffness;
  static constexpr const char* summary =
      "Cone on a cylindrical shank: the contact stops growing at the needle's radius.";
  static constexpr const char* source = "Sneddon 1965; Galin 1953, fixed contact edge";
  static constexpr const char* validity =
      "Small slopes (half angle above 60 degrees): with a sharp needle a scaling law, not a prediction.";
  static constexpr std::array<Parameter<BasicConeCylinder, Real>, 3> table{{
      {&BasicConeCylinder::reduced_modulus, "reduced_modulus", "Pa", 1.0, 1e10, required, "E_r",
       "reduced modulus of needle and tissue", "eq. (4)"},
      {&BasicConeCylinder::half_angle, "half_angle", "rad", 0.1 * tips::degree, 89.9 * tips::degree, required,
       "alpha", "angle between the needle's axis and the generator of the cone", "eq. (5)"},
      {&BasicConeCylinder::radius, "radius", "m", 1e-6, 1e-1, required, "R",
       "radius of the shank, where the contact stops growing", "Galin 1953"},
  }};

  struct Prepared {
    Real coefficient;  // F = coefficient h^2 up to saturation [N/m^2]
    Real saturation;   // depth at which the contact reaches the shank [m]
    Real reach() const noexcept { return std::numeric_limits<double>::infinity(); }
    Real force(Real h) const noexcept {
      return h <= saturation ? coefficient * h * h : coefficient * saturation * (2.0 * h - saturation);
    }
    Real slope(Real h) const noexcept { return 2.0 * coefficient * (h <= saturation ? h : saturation); }
    Real energy(Real h) const noexcept {
      if (h <= saturation) return coefficient * h * h * h / 3.0;
      return coefficient * saturation * (h * h - saturation * h + saturation * saturation / 3.0);
    }
    Real indentation(Real force) const noexcept {
      const Real edge = coefficient * saturation * saturation;
      if (force <= edge) return sqrt(force / coefficient);
      return 0.5 * (force / (coefficient * saturation) + saturation);
    }
  };
  Prepared prepare() const noexcept {
    const Real tangent = tan(half_angle);
    return {2.0 / std::numbers::pi * reduced_modulus * tangent, 0.5 * std::numbers::pi * radius / tangent};
  }
};
using ConeCylinder = BasicConeCylinder<double>;

}  // namespace needleforce::laws
