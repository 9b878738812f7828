// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "../parameter.hpp"
#include "../sneddon.hpp"
#include "limits.hpp"

namespace needleforce::tips {

/// f = R_t - sqrt(R_t^2 - r^2): the exact sphere. h = a artanh(x), F = E_r R_t^2 [(1 + x^2) artanh(x) - x],
/// x = a / R_t. It is tangent to its shank: the contact comes ever closer to R_t and never reaches it.
struct Sphere {
  double radius;

  bool operator==(const Sphere&) const = default;

  static constexpr const char* name = "sphere";
  static constexpr const char* summary = "Exact sphere, of which half is the tip.";
  static constexpr std::array<Parameter<Sphere>, 1> table{{
      {&Sphere::radius, "radius", "m", 1e-9, 1.0, required, "R_t", "radius of the sphere",
       "Sneddon 1965, sec. 5"},
  }};
  static constexpr bool tangent = true;

  double slope(double r) const noexcept { return r / std::sqrt((radius - r) * (radius + r)); }
  double height(double r) const noexcept { return r * r / (radius + std::sqrt((radius - r) * (radius + r))); }
  double end() const noexcept { return radius; }
  auto breaks() const noexcept { return no_breaks; }
  double flat() const noexcept { return 0.0; }

  double depth(double a) const noexcept { return a * std::atanh(a / radius); }
  double contact_radius(double h) const noexcept { return sneddon::contact_radius(*this, h); }
  double force(double a) const noexcept {
    const double x = a / radius, y = x * x;
    if (x > 0.3) return radius * radius * ((1.0 + y) * std::atanh(x) - x);
    // the closed form cancels at small x; its series does not
    double sum = 0.0, power = x * y;
    for (int k = 1; k <= 15; ++k, power *= y) sum += power * (1.0 / (2 * k - 1) + 1.0 / (2 * k + 1));
    return radius * radius * sum;
  }
  double energy(double a) const noexcept { return sneddon::energy(*this, depth(a), a); }
};

}  // namespace needleforce::tips
