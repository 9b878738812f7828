// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <tuple>

#include "../parameter.hpp"
#include "cone.hpp"
#include "limits.hpp"

namespace needleforce::tips {

/// Which cone is equivalent to a bevel: the paper's own reading, or that of equal length, volume or bisected
/// wedge.
enum class BevelEquivalence { paper_half_angle, equal_length, equal_volume, wedge_bisector };
inline constexpr std::array<const char*, 4> bevel_equivalence_names{"paper_half_angle", "equal_length",
                                                                    "equal_volume", "wedge_bisector"};

/// A plane cut at the angle alpha to the axis, and its equivalent cone: tan(alpha_eq) is tan(alpha)
/// as the paper reads it, half of it at equal length, a third at equal volume, or tan(alpha/2).
struct LancetBevel {
  double half_angle;
  BevelEquivalence equivalence = BevelEquivalence::paper_half_angle;

  bool operator==(const LancetBevel&) const = default;

  static constexpr const char* name = "lancet_bevel";
  static constexpr const char* summary = "Bevel of a lancet, taken as an equivalent cone.";
  static constexpr std::array<Parameter<LancetBevel>, 1> table{{
      {&LancetBevel::half_angle, "half_angle", "rad", 0.1 * degree, 89.9 * degree, required, "alpha",
       "angle between the axis and the plane of the bevel", "eq. (5)"},
  }};

  static constexpr std::tuple parts{
      Part{&LancetBevel::equivalence, "equivalence", "reading of the bevel", true}};

  Cone equivalent_cone() const noexcept {
    const double tangent = std::tan(half_angle);
    switch (equivalence) {
      case BevelEquivalence::equal_length:
        return {std::atan(tangent / 2.0)};
      case BevelEquivalence::equal_volume:
        return {std::atan(tangent / 3.0)};
      case BevelEquivalence::wedge_bisector:
        return {0.5 * half_angle};
      default:
        return {half_angle};
    }
  }

  /// Lateral force [N] of an axial force [N] on the bevel's face with a friction coefficient:
  /// eta F cot(alpha + atan(mu)), eta the share of the force that acts on the face. 0 where friction holds
  /// it.
  double lateral_force(double axial, double friction_coefficient, double share) const noexcept {
    const double angle = half_angle + std::atan(friction_coefficient);
    return angle < 0.5 * std::numbers::pi ? share * axial / std::tan(angle) : 0.0;
  }

  double slope(double r) const noexcept { return equivalent_cone().slope(r); }
  double height(double r) const noexcept { return equivalent_cone().height(r); }
  double end() const noexcept { return endless; }
  auto breaks() const noexcept { return no_breaks; }
  double flat() const noexcept { return 0.0; }

  double depth(double a) const noexcept { return equivalent_cone().depth(a); }
  double contact_radius(double h) const noexcept { return equivalent_cone().contact_radius(h); }
  double force(double a) const noexcept { return equivalent_cone().force(a); }
  double energy(double a) const noexcept { return equivalent_cone().energy(a); }
};

}  // namespace needleforce::tips
