// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "../law.hpp"

namespace needleforce::laws {

/// F = F_1 (h / h_1)^n: n = 1 a flat punch, 3/2 a paraboloid, 2 a cone; in between, what a log often shows.
struct PowerLaw {
  double reference_force;
  double exponent;
  double reference_depth;

  static constexpr const char* name = "power_law";
  static constexpr Family family = Family::stiffness;
  static constexpr const char* summary = "Free power of the depth, from flat punch to cone and beyond.";
  static constexpr const char* source = "Sneddon 1965, profiles c r^m with n = 1 + 1/m";
  static constexpr const char* validity =
      "A profile that is a power of the radius for n up to 2; otherwise the needle, tissue and speed of its "
      "fit.";
  static constexpr std::array<Parameter<PowerLaw>, 3> table{{
      {&PowerLaw::reference_force, "reference_force", "N", 1e-9, 1e6, required, "F_1",
       "force at the depth h_1", "Sneddon 1965"},
      {&PowerLaw::exponent, "exponent", "1", 1.0, 6.0, required, "n", "power of the depth", "Sneddon 1965"},
      {&PowerLaw::reference_depth, "reference_depth", "m", 1e-6, 1.0, 1e-3, "h_1",
       "depth at which the force is F_1", "Sneddon 1965"},
  }};

  struct Prepared {
    double force_1, exponent, per_depth;
    double reach() const noexcept { return std::numeric_limits<double>::infinity(); }
    double force(double h) const noexcept { return force_1 * std::pow(h * per_depth, exponent); }
    double slope(double h) const noexcept {
      return force_1 * exponent * per_depth * std::pow(h * per_depth, exponent - 1.0);
    }
    double energy(double h) const noexcept { return force(h) * h / (exponent + 1.0); }
    double indentation(double force) const noexcept {
      return std::pow(force / force_1, 1.0 / exponent) / per_depth;
    }
  };
  Prepared prepare() const noexcept { return {reference_force, exponent, 1.0 / reference_depth}; }
};

}  // namespace needleforce::laws
