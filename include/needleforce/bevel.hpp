// SPDX-License-Identifier: Apache-2.0
// The sideways push of a bevelled tip, estimated from the cutting force.
#pragma once

#include <array>
#include <numbers>

#include "parameter.hpp"
#include "tips/lancet_bevel.hpp"

namespace needleforce {

/// A bevel's face, cut at an angle alpha to the axis, pushes the tip sideways by eta F_cut cot(alpha +
/// atan(mu)), where eta is the share of the cutting force that acts on the face and not at the edge. It is
/// known for few needles, so that it is 0 unless given: then there is no estimate.
struct Bevel {
  double half_angle = 0.5 * std::numbers::pi;
  double friction_coefficient = 0.0;
  double face_share = 0.0;

  static constexpr const char* name = "bevel";
  static constexpr const char* summary = "Sideways push of a bevelled tip, from the cutting force.";
  static constexpr std::array<Parameter<Bevel>, 3> table{{
      {&Bevel::half_angle, "half_angle", "rad", 0.1 * tips::degree, 90.0 * tips::degree,
       0.5 * std::numbers::pi, "alpha", "angle between the axis and the plane of the bevel",
       "Misra et al. 2010"},
      {&Bevel::friction_coefficient, "friction_coefficient", "1", 0.0, 2.0, 0.0, "mu_b",
       "friction coefficient of tissue on the face", "Misra et al. 2010"},
      {&Bevel::face_share, "face_share", "1", 0.0, 1.0, 0.0, "eta",
       "share of the cutting force on the face; 0: no estimate", "Misra et al. 2010"},
  }};

  /// Lateral over cutting force [1].
  double lateral_ratio() const noexcept {
    return tips::LancetBevel{half_angle}.lateral_force(1.0, friction_coefficient, face_share);
  }
};

}  // namespace needleforce
