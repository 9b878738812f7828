// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "../law.hpp"

namespace needleforce::laws {

/// F = F_1 (h / h_1)^n: n = 1 a flat punch, 3/2 a paraboloid, 2 a cone; in between, what a log often shows.
template <class Real>
struct BasicPowerLaw {
  Real reference_force;
  Real exponent;
  Real reference_depth;

  static constexpr const char* name = "power_law";
  static constexpr Family family = Family::stiffness;
  static constexpr const char* summary = "Free power of the depth, from flat punch to cone and beyond.";
  static constexpr const char* source = "Sneddon 1965, profiles c r^m with n = 1 + 1/m";
  static constexpr const char* validity =
      "A profile that is a power of the radius for n up to 2; otherwise the needle, tissue and speed of its "
      "fit.";
  static constexpr std::array<Parameter<BasicPowerLaw, Real>, 3> table{{
      {&BasicPowerLaw::reference_force, "reference_force", "N", 1e-9, 1e6, required, "F_1",
       "force at the depth h_1", "Sneddon 1965"},
      {&BasicPowerLaw::exponent, "exponent", "1", 1.0, 6.0, required, "n", "power of the depth",
       "Sneddon 1965"},
      {&BasicPowerLaw::reference_depth, "reference_depth", "m", 1e-6, 1.0, 1e-3, "h_1",
       "depth at which the force is F_1", "Sneddon 1965"},
  }};

  struct Prepared {
    Real force_1, exponent, per_depth;
    Real reach() const noexcept { return std::numeric_limits<double>::infinity(); }
    Real force(Real h) const noexcept { return force_1 * pow(h * per_depth, exponent); }
    Real slope(Real h) const noexcept {
      return force_1 * exponent * per_depth * pow(h * per_depth, exponent - 1.0);
    }
    Real energy(Real h) const noexcept { return force(h) * h / (exponent + 1.0); }
    Real indentation(Real force) const noexcept { return pow(force / force_1, 1.0 / exponent) / per_depth; }
  };
  Prepared prepare() const noexcept { return {reference_force, exponent, 1.0 / reference_depth}; }
};
using PowerLaw = BasicPowerLaw<double>;

}  // namespace needleforce::laws
