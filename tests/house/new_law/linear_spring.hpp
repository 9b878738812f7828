// SPDX-License-Identifier: Apache-2.0
// A stiffness law for the test of the places for a new law.
#pragma once

#include <array>
#include <limits>

#include "../law.hpp"

namespace needleforce::laws {

/// F = k h.
template <class Real>
struct BasicLinearSpring {
  Real stiffness;

  static constexpr const char* name = "linear_spring";
  static constexpr Family family = Family::stiffness;
  static constexpr const char* summary = "Linear spring.";
  static constexpr const char* source = "Test law 2026, eq. (2)";
  static constexpr const char* validity = "Tests.";
  static constexpr std::array<Parameter<BasicLinearSpring, Real>, 1> table{{
      {&BasicLinearSpring::stiffness, "stiffness", "N/m", 1e-2, 1e6, required, "k", "force over indentation",
       "Test law 2026"},
  }};

  struct Prepared {
    Real stiffness;
    Real force(Real depth) const noexcept { return stiffness * depth; }
    Real slope(Real) const noexcept { return stiffness; }
    Real energy(Real depth) const noexcept { return 0.5 * stiffness * depth * depth; }
    Real indentation(Real force) const noexcept { return force / stiffness; }
    Real reach() const noexcept { return std::numeric_limits<double>::infinity(); }
  };
  Prepared prepare() const noexcept { return {stiffness}; }
};
using LinearSpring = BasicLinearSpring<double>;

}  // namespace needleforce::laws
