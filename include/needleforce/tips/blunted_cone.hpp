// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "../parameter.hpp"
#include "../sneddon.hpp"
#include "limits.hpp"

namespace needleforce::tips {

/// A parabolic cap r^2 / (2 R_t) up to the transition radius b, a cone beyond. With q = sqrt(a^2 - b^2),
///   h = a (a - q) / R_t + a cot(alpha) arccos(b/a),
///   F = E_r {2 (a - q)^2 (2 a + q) / (3 R_t) + cot(alpha) [a^2 arccos(b/a) + b q]};
/// below b the cap alone. b = R_t cot(alpha), the default, joins without an edge; b = R_t cos(alpha), tangent
/// to a true sphere, is usual with atomic force microscopes and leaves one.
struct BluntedCone {
  double half_angle;
  double tip_radius;
  double transition_radius;  // 0: R_t cot(alpha)

  bool operator==(const BluntedCone&) const = default;

  static constexpr const char* name = "blunted_cone";
  static constexpr const char* summary = "Cone with a rounded apex.";
  static constexpr std::array<Parameter<BluntedCone>, 3> table{{
      {&BluntedCone::half_angle, "half_angle", "rad", 0.1 * degree, 89.9 * degree, required, "alpha",
       "angle between the axis and the generator", "Briscoe, Sebastian & Adams 1994"},
      {&BluntedCone::tip_radius, "tip_radius", "m", 1e-9, 1e-1, required, "R_t",
       "radius of curvature of the cap", "Briscoe, Sebastian & Adams 1994"},
      {&BluntedCone::transition_radius, "transition_radius", "m", 0.0, 1e2, 0.0, "b",
       "radius where the cap becomes the cone, 0 for the smooth transition R_t cot(alpha)",
       "Briscoe, Sebastian & Adams 1994"},
  }};

  double cotangent() const noexcept { return 1.0 / std::tan(half_angle); }
  double smooth_transition() const noexcept { return tip_radius * cotangent(); }
  double transition() const noexcept {
    return transition_radius > 0.0 ? transition_radius : smooth_transition();
  }
  /// Beyond the smooth transition the slope would fall: the contact would jump over the hollow.
  Flaw flaw() const noexcept {
    if (transition_radius <= smooth_transition() * (1.0 + 1e-9)) return {};
    return {"transition_radius", -1, transition_radius,
            "beyond tip_radius cot(half_angle), where the slope would fall",
            "Give a smaller one, or 0 for the smooth transition."};
  }

  double slope(double r) const noexcept { return r < transition() ? r / tip_radius : cotangent(); }
  double height(double r) const noexcept {
    const double b = transition();
    return r < b ? 0.5 * r * r / tip_radius : 0.5 * b * b / tip_radius + (r - b) * cotangent();
  }
  double end() const noexcept { return endless; }
  auto breaks() const noexcept { return std::array{transition()}; }
  double flat() const noexcept { return 0.0; }

  double depth(double a) const noexcept {
    const double b = transition();
    if (a <= b) return a * a / tip_radius;
    const double q = std::sqrt((a - b) * (a + b));
    return a * (b * b / (a + q) / tip_radius + cotangent() * std::atan2(q, b));
  }
  double contact_radius(double h) const noexcept {
    const double within = std::sqrt(tip_radius * h), b = transition();
    return within <= b ? within : sneddon::contact_radius(*this, h, b);
  }
  double force(double a) const noexcept {
    const double b = transition();
    if (a <= b) return 4.0 / 3.0 * a * a * a / tip_radius;
    const double q = std::sqrt((a - b) * (a + b)), gap = b * b / (a + q);  // a - q without cancelling
    return 2.0 / 3.0 * gap * gap * (2.0 * a + q) / tip_radius +
           cotangent() * (a * a * std::atan2(q, b) + b * q);
  }
  double energy(double a) const noexcept { return sneddon::energy(*this, depth(a), a); }
};

}  // namespace needleforce::tips
