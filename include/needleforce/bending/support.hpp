// SPDX-License-Identifier: Apache-2.0
// What holds the needle: the base that the robot moves, the guide, and the surface of the tissue.
#pragma once

#include <array>
#include <limits>

#include "../parameter.hpp"

namespace needleforce::bending {

/// A needle slides through a guide at a fixed distance above the tissue, or is held at its hub, which comes
/// down with it. Either clamps it, or gives by a compliance. At the surface it may turn about a pivot.
struct Support {
  double guide_distance = no_guide;
  double needle_length = 1.0;
  double lateral_compliance = 0.0;
  double rotational_compliance = 0.0;
  double pivot_stiffness = 0.0;

  static constexpr double no_guide = std::numeric_limits<double>::infinity();
  static constexpr const char* name = "support";
  static constexpr const char* summary = "Guide or hub that holds the needle, and the pivot at the surface.";
  static constexpr std::array<Parameter<Support>, 5> table{{
      {&Support::guide_distance, "guide_distance", "m", 0.0, no_guide, no_guide, "g",
       "distance of the guide's exit above the surface; infinity: the needle is held at its hub", "free"},
      {&Support::needle_length, "needle_length", "m", 1e-3, 1.0, required, "L", "length from hub to tip",
       "beam theory"},
      {&Support::lateral_compliance, "lateral_compliance", "m/N", 0.0, 1.0, 0.0, "c_y",
       "lateral motion of the needle at the base per lateral force; 0: none", "free"},
      {&Support::rotational_compliance, "rotational_compliance", "rad/(N m)", 0.0, 1e4, 0.0, "c_r",
       "rotation of the needle at the base per moment; 0: clamped", "free"},
      {&Support::pivot_stiffness, "pivot_stiffness", "N/m", 0.0, 1e7, 0.0, "k_p",
       "lateral force of the surface on the needle per offset from the point of entry", "free"},
  }};

  /// Length [m] between the base and the surface when the tip has travelled `depth` [m]. Wait-free.
  double free_length(double depth) const noexcept {
    const double from_hub = needle_length - depth;
    return from_hub < guide_distance ? from_hub : guide_distance;
  }
  /// False where the hub would be in the tissue or, of a guided needle, below the guide. Wait-free.
  bool reaches(double depth) const noexcept {
    const double above = guide_distance == no_guide ? 0.0 : guide_distance;
    return needle_length - depth >= above * (1.0 - 1e-9);
  }
};

}  // namespace needleforce::bending
