// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "../law.hpp"

namespace needleforce::laws {

/// The tip breaks through once it passes a given depth.
struct PunctureDepth {
  double depth;

  static constexpr const char* name = "puncture_depth";
  static constexpr Family family = Family::puncture;
  static constexpr const char* summary = "Puncture once the tip passes a given depth.";
  static constexpr const char* source = "sec. 2.4, z_1";
  static constexpr const char* validity = "Specific to needle, tissue and speed.";
  static constexpr std::array<Parameter<PunctureDepth>, 1> table{{
      {&PunctureDepth::depth, "depth", "m", 0.0, 0.5, required, "z_1",
       "depth of the tip at puncture; 0 is a surface without resistance", "sec. 2.4"},
  }};

  template <class Stiffness>
  double puncture_depth(const Stiffness&) const noexcept {
    return depth;
  }
  bool breaks(double, double) const noexcept { return true; }
};

}  // namespace needleforce::laws
