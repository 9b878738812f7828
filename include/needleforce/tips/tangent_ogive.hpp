// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "../parameter.hpp"
#include "../sneddon.hpp"
#include "limits.hpp"

namespace needleforce::tips {

/// An arc of radius rho = (R^2 + L^2) / (2 R), tangent to the shank R at the length L from the apex:
/// f = L - sqrt(rho^2 - (r + rho - R)^2), by quadrature of f'. It never saturates; L = R is the hemisphere.
struct TangentOgive {
  double radius;
  double length;

  bool operator==(const TangentOgive&) const = default;

  static constexpr const char* name = "tangent_ogive";
  static constexpr const char* summary = "Arc of a circle turned about the axis, tangent to the shank.";
  static constexpr std::array<Parameter<TangentOgive>, 2> table{{
      {&TangentOgive::radius, "radius", "m", 1e-9, 1e-1, required, "R",
       "radius of the base, where the tip ends", "Sneddon 1965"},
      {&TangentOgive::length, "length", "m", 1e-9, 1.0, required, "L_t", "length from the apex to the base",
       "Sneddon 1965"},
  }};
  static constexpr bool tangent = true;

  Flaw flaw() const noexcept {
    if (length >= radius) return {};
    return {"length", -1, length, "below the radius: the arc would be hollow at the apex",
            "Give a length of at least the radius; equal is a hemisphere."};
  }
  /// rho - R, the offset of the arc's centre beyond the axis.
  double offset() const noexcept { return 0.5 * (length - radius) * (length + radius) / radius; }
  double arc_radius() const noexcept { return offset() + radius; }

  double slope(double r) const noexcept {
    const double c = offset();
    return (r + c) / std::sqrt((radius - r) * (radius + c + c + r));
  }
  double height(double r) const noexcept {
    const double c = offset();
    return r * (r + 2.0 * c) / (length + std::sqrt((radius - r) * (radius + c + c + r)));
  }
  double end() const noexcept { return radius; }
  auto breaks() const noexcept { return no_breaks; }
  double flat() const noexcept { return 0.0; }

  sneddon::Touch touch(double a) const noexcept {
    return a > 0.0 ? sneddon::touch(*this, a) : sneddon::Touch{0.0, 0.0};
  }
  double depth(double a) const noexcept { return touch(a).depth; }
  double contact_radius(double h) const noexcept { return sneddon::contact_radius(*this, h); }
  double force(double a) const noexcept { return touch(a).force; }
  double energy(double a) const noexcept { return sneddon::energy(*this, depth(a), a); }
};

}  // namespace needleforce::tips
