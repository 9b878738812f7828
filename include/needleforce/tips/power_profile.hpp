// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "../parameter.hpp"
#include "limits.hpp"

namespace needleforce::tips {

/// f = f_1 (r / r_1)^n. h = f(a) (sqrt(pi)/2) n Gamma(n/2) / Gamma((n+1)/2), F = 2 n / (n+1) E_r a h.
struct PowerProfile {
  double exponent;
  double reference_radius;
  double reference_height;

  bool operator==(const PowerProfile&) const = default;

  static constexpr const char* name = "power_profile";
  static constexpr const char* summary =
      "Power of the radius: 1 a cone, 2 a paraboloid, higher ever blunter.";
  static constexpr std::array<Parameter<PowerProfile>, 3> table{{
      {&PowerProfile::exponent, "exponent", "1", 1.0, 32.0, required, "n", "power of the radius",
       "Sneddon 1965, sec. 5"},
      {&PowerProfile::reference_radius, "reference_radius", "m", 1e-9, 1.0, required, "r_1",
       "radius at which the profile has risen by f_1", "Sneddon 1965, sec. 5"},
      {&PowerProfile::reference_height, "reference_height", "m", 1e-12, 1.0, required, "f_1",
       "height of the profile at the radius r_1", "Sneddon 1965, sec. 5"},
  }};

  /// Depth over the height of the profile at the contact's edge.
  double depth_ratio() const noexcept {
    return 0.5 * std::sqrt(std::numbers::pi) * exponent * std::tgamma(0.5 * exponent) /
           std::tgamma(0.5 * (exponent + 1.0));
  }
  double slope(double r) const noexcept {
    return exponent * reference_height / reference_radius * std::pow(r / reference_radius, exponent - 1.0);
  }
  double height(double r) const noexcept {
    return reference_height * std::pow(r / reference_radius, exponent);
  }
  double end() const noexcept { return endless; }
  auto breaks() const noexcept { return no_breaks; }
  double flat() const noexcept { return 0.0; }

  double depth(double a) const noexcept { return depth_ratio() * height(a); }
  double contact_radius(double h) const noexcept {
    return reference_radius * std::pow(h / (depth_ratio() * reference_height), 1.0 / exponent);
  }
  double force(double a) const noexcept { return 2.0 * exponent / (exponent + 1.0) * a * depth(a); }
  double energy(double a) const noexcept { return exponent / (2.0 * exponent + 1.0) * force(a) * depth(a); }
};

}  // namespace needleforce::tips
