// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "../parameter.hpp"
#include "limits.hpp"

namespace needleforce::tips {

/// f = r^2 / (2 R_t): what a sphere is close to its pole. h = a^2 / R_t, F = (4/3) E_r a^3 / R_t.
struct Paraboloid {
  double radius;

  bool operator==(const Paraboloid&) const = default;

  static constexpr const char* name = "paraboloid";
  static constexpr const char* summary = "Paraboloid of revolution, a sphere close to its pole.";
  static constexpr std::array<Parameter<Paraboloid>, 1> table{{
      {&Paraboloid::radius, "radius", "m", 1e-9, 1.0, required, "R_t", "radius of curvature at the apex",
       "Sneddon 1965, sec. 5"},
  }};

  double slope(double r) const noexcept { return r / radius; }
  double height(double r) const noexcept { return 0.5 * r * r / radius; }
  double end() const noexcept { return endless; }
  auto breaks() const noexcept { return no_breaks; }
  double flat() const noexcept { return 0.0; }

  double depth(double a) const noexcept { return a * a / radius; }
  double contact_radius(double h) const noexcept { return std::sqrt(radius * h); }
  double force(double a) const noexcept { return 4.0 / 3.0 * a * a * a / radius; }
  double energy(double a) const noexcept { return 0.4 * force(a) * depth(a); }
};

}  // namespace needleforce::tips
