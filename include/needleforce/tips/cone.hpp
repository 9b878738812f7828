// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "../parameter.hpp"
#include "limits.hpp"

namespace needleforce::tips {

/// f = r cot(alpha). `half_angle` is measured from the needle's axis, so the generator rises by
/// cot(half_angle).
struct Cone {
  double half_angle;

  bool operator==(const Cone&) const = default;

  static constexpr const char* name = "cone";
  static constexpr const char* summary = "Cone with its apex on the needle's axis.";
  static constexpr std::array<Parameter<Cone>, 1> table{{
      {&Cone::half_angle, "half_angle", "rad", 0.1 * degree, 89.9 * degree, required, "alpha",
       "angle between the axis and the generator", "Sneddon 1965, sec. 5"},
  }};

  double cotangent() const noexcept { return 1.0 / std::tan(half_angle); }
  double slope(double) const noexcept { return cotangent(); }
  double height(double r) const noexcept { return r * cotangent(); }
  double end() const noexcept { return endless; }
  auto breaks() const noexcept { return no_breaks; }
  double flat() const noexcept { return 0.0; }

  /// Depth of the apex below the undeformed surface at contact radius a [m]: Sneddon's h(a).
  double depth(double a) const noexcept { return 0.5 * std::numbers::pi * a * cotangent(); }
  /// Contact radius [m] at depth h >= 0 [m]: the inverse of depth().
  double contact_radius(double h) const noexcept { return 2.0 * h * std::tan(half_angle) / std::numbers::pi; }
  /// Force over reduced modulus [m^2] at contact radius a.
  double force(double a) const noexcept { return 0.5 * std::numbers::pi * a * a * cotangent(); }
  /// Stored energy over reduced modulus [m^3] at contact radius a.
  double energy(double a) const noexcept { return force(a) * depth(a) / 3.0; }
  /// Length [m] from the apex to the section of radius r.
  double length(double r) const noexcept { return height(r); }
};

}  // namespace needleforce::tips
