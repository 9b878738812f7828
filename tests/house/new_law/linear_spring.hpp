// SPDX-License-Identifier: Apache-2.0
// A stiffness law for the test of the places for a new law.
#pragma once

#include <array>
#include <limits>

#include "../law.hpp"

namespace needleforce::laws {

/// F = k h.
struct LinearSpring {
  double stiffness;

  static constexpr const char* name = "linear_spring";
  static constexpr Family family = Family::stiffness;
  static constexpr const char* summary = "Linear spring.";
  static constexpr const char* source = "Test law 2026, eq. (2)";
  static constexpr const char* validity = "Tests.";
  static constexpr std::array<Parameter<LinearSpring>, 1> table{{
      {&LinearSpring::stiffness, "stiffness", "N/m", 1e-2, 1e6, required, "k", "force over indentation",
       "Test law 2026"},
  }};

  struct Prepared {
    double stiffness;
    double force(double depth) const noexcept { return stiffness * depth; }
    double slope(double) const noexcept { return stiffness; }
    double energy(double depth) const noexcept { return 0.5 * stiffness * depth * depth; }
    double indentation(double force) const noexcept { return force / stiffness; }
    double reach() const noexcept { return std::numeric_limits<double>::infinity(); }
  };
  Prepared prepare() const noexcept { return {stiffness}; }
};

}  // namespace needleforce::laws
