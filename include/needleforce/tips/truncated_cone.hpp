// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "../parameter.hpp"
#include "../sneddon.hpp"
#include "limits.hpp"

namespace needleforce::tips {

/// f = (r - b)_+ cot(alpha): h = a cot(alpha) arccos(b/a), F = E_r cot(alpha) [a^2 arccos(b/a) + b sqrt(a^2 -
/// b^2)]. The contact is the flat face b from the start.
struct TruncatedCone {
  double half_angle;
  double flat_radius;

  bool operator==(const TruncatedCone&) const = default;

  static constexpr const char* name = "truncated_cone";
  static constexpr const char* summary = "Cone cut off across its axis.";
  static constexpr std::array<Parameter<TruncatedCone>, 2> table{{
      {&TruncatedCone::half_angle, "half_angle", "rad", 0.1 * degree, 89.9 * degree, required, "alpha",
       "angle between the axis and the generator", "Sneddon 1965"},
      {&TruncatedCone::flat_radius, "flat_radius", "m", 1e-9, 1e-1, required, "b", "radius of the flat face",
       "Sneddon 1965"},
  }};

  double cotangent() const noexcept { return 1.0 / std::tan(half_angle); }
  double slope(double r) const noexcept { return r < flat_radius ? 0.0 : cotangent(); }
  double height(double r) const noexcept { return r < flat_radius ? 0.0 : (r - flat_radius) * cotangent(); }
  double end() const noexcept { return endless; }
  auto breaks() const noexcept { return std::array{flat_radius}; }
  double flat() const noexcept { return flat_radius; }

  double depth(double a) const noexcept { return a > flat_radius ? cotangent() * a * angle(a) : 0.0; }
  double contact_radius(double h) const noexcept { return sneddon::contact_radius(*this, h, flat_radius); }
  double force(double a) const noexcept {
    return a > flat_radius ? cotangent() * (a * a * angle(a) + flat_radius * chord(a)) : 0.0;
  }
  double energy(double a) const noexcept { return sneddon::energy(*this, depth(a), a); }

 private:
  double chord(double a) const noexcept { return std::sqrt((a - flat_radius) * (a + flat_radius)); }
  // arccos(b/a), exact as a comes down to b
  double angle(double a) const noexcept { return std::atan2(chord(a), flat_radius); }
};

}  // namespace needleforce::tips
