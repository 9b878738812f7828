// SPDX-License-Identifier: Apache-2.0
// The needle: a straight tube or rod of circular section.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <tuple>

#include "parameter.hpp"
#include "tip.hpp"

namespace needleforce {

/// Section, length and material of a needle; `inner_diameter` 0 is a solid rod.
struct Needle {
  double outer_diameter;
  double inner_diameter;
  double length;
  double young_modulus;
  double poisson_ratio;
  std::optional<Tip> tip{};

  static constexpr const char* name = "needle";
  static constexpr const char* summary = "Straight needle of circular section.";
  static constexpr std::array<Parameter<Needle>, 5> table{{
      {&Needle::outer_diameter, "outer_diameter", "m", 1e-5, 2e-2, required, "D",
       "outer diameter of the shaft", "eq. (8)"},
      {&Needle::inner_diameter, "inner_diameter", "m", 0.0, 2e-2, 0.0, "d",
       "diameter of the lumen, 0 for a solid needle", "beam theory"},
      {&Needle::length, "length", "m", 1e-3, 1.0, required, "L", "free length from clamp to tip",
       "beam theory"},
      {&Needle::young_modulus, "young_modulus", "Pa", 1e6, 1e12, required, "E_1",
       "Young's modulus of the needle", "eq. (4)"},
      {&Needle::poisson_ratio, "poisson_ratio", "1", 0.0, 0.5, 0.3, "nu_1", "Poisson ratio of the needle",
       "eq. (4)"},
  }};

  static constexpr std::tuple parts{Part{&Needle::tip, "tip", "tip of the needle", true}};

  tips::Flaw flaw() const noexcept {
    if (inner_diameter < outer_diameter) return {};
    return {"inner_diameter", -1, inner_diameter, "not below the outer diameter",
            "Give the lumen's diameter, 0 for a solid needle."};
  }

  /// Second moment of area [m^4].
  double second_moment() const noexcept {
    return std::numbers::pi * (std::pow(outer_diameter, 4) - std::pow(inner_diameter, 4)) / 64.0;
  }
  /// Bending stiffness E I [N m^2].
  double bending_stiffness() const noexcept { return young_modulus * second_moment(); }
};

}  // namespace needleforce
