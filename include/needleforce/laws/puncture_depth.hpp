// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "../law.hpp"

namespace needleforce::laws {

/// The tip breaks through once it passes a given depth.
template <class Real>
struct BasicPunctureDepth {
  Real depth;

  static constexpr const char* name = "puncture_depth";
  static constexpr Family family = Family::puncture;
  static constexpr const char* summary = "Puncture once the tip passes a given depth.";
  static constexpr const char* source = "sec. 2.4, z_1";
  static constexpr const char* validity = "Specific to needle, tissue and speed.";
  static constexpr std::array<Parameter<BasicPunctureDepth, Real>, 1> table{{
      {&BasicPunctureDepth::depth, "depth", "m", 0.0, 0.5, required, "z_1",
       "depth of the tip at puncture; 0 is a surface without resistance", "sec. 2.4"},
  }};

  template <class Contact>
  Real puncture_depth(const Contact&) const noexcept {
    return depth;
  }
  bool breaks(Real, Real) const noexcept { return true; }
};
using PunctureDepth = BasicPunctureDepth<double>;

}  // namespace needleforce::laws
