// SPDX-License-Identifier: Apache-2.0
// Lengths of a bending insertion: the bevel, the hole, and how finely the path is kept.
#pragma once

#include <array>

#include "../parameter.hpp"

namespace needleforce::bending {

/// Chosen before the loop.
struct Bending {
  double bevel_length = 0.0;
  double hole_radius = 1e-3;
  double unloading = 1e-4;
  double tip_memory = 1e-3;
  double pressure_friction = 0.0;
  double presliding = 2e-4;
  double path_spacing = 1e-4;
  double max_travel = 20e-3;
  double max_slope = 0.8;

  static constexpr const char* name = "bending";
  static constexpr const char* summary = "Lengths of an insertion with a needle that bends.";
  static constexpr std::array<Parameter<Bending>, 9> table{{
      {&Bending::bevel_length, "bevel_length", "m", 0.0, 0.1, 0.0, "b",
       "travel over which the lateral force on the tip builds up, about the length of the bevel", "free"},
      {&Bending::hole_radius, "hole_radius", "m", 0.0, 1.0, 1e-3, "r_h",
       "a needle that comes back within this distance of its hole goes into it, otherwise it makes a new one",
       "free"},
      {&Bending::unloading, "unloading", "m", 1e-6, 1.0, 1e-4, "s_u",
       "withdrawal over which a layer's tip_force falls to zero", "free"},
      {&Bending::tip_memory, "tip_memory", "m", 1e-6, 1.0, 1e-3, "s_t",
       "travel over which the tip leaves the tissue of `tip_stiffness`, about the needle's diameter", "free"},
      {&Bending::pressure_friction, "pressure_friction", "1", 0.0, 5.0, 0.0, "mu",
       "axial friction per lateral pressure on the shaft, in addition to the friction of the model", "free"},
      {&Bending::presliding, "presliding", "m", 1e-9, 5e-2, 2e-4, "s_0",
       "travel that takes this friction from nothing to sliding", "Dahl 1968"},
      {&Bending::path_spacing, "path_spacing", "m", 1e-5, 2e-3, 1e-4, "h_p",
       "distance between the nodes of the cut path; a needle goes as deep as 3000 of them", "free"},
      {&Bending::max_travel, "max_travel", "m", 1e-6, 0.3, 20e-3, "s_m",
       "a step that goes farther is refused; the cost of a step is bounded by max_travel over path_spacing",
       "free"},
      {&Bending::max_slope, "max_slope", "rad", 1e-3, 1.5, 0.8, "theta_m",
       "largest slope of the needle to its base for which the status is ok", "free"},
  }};
};

}  // namespace needleforce::bending
