// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "../law.hpp"

namespace needleforce::laws {

/// The tip breaks through once the stiffness force passes a given force.
template <class Real>
struct BasicPunctureForce {
  Real force;

  static constexpr const char* name = "puncture_force";
  static constexpr Family family = Family::puncture;
  static constexpr const char* summary = "Puncture once the stiffness force passes a given force.";
  static constexpr const char* source = "sec. 2.1, maximum stiffness force";
  static constexpr const char* validity = "Specific to needle, tissue and speed.";
  static constexpr std::array<Parameter<BasicPunctureForce, Real>, 1> table{{
      {&BasicPunctureForce::force, "force", "N", 0.0, 1e3, required, "F_p",
       "stiffness force at puncture; 0 is a surface without resistance", "sec. 2.1"},
  }};

  template <class Contact>
  Real puncture_depth(const Contact& stiffness) const noexcept {
    return stiffness.indentation(force);
  }
  bool breaks(Real reached, Real) const noexcept { return reached >= force; }
};
using PunctureForce = BasicPunctureForce<double>;

}  // namespace needleforce::laws
