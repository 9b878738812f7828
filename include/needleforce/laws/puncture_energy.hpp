// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "../law.hpp"

namespace needleforce::laws {

/// The tip breaks through once the work done on the tissue passes a given energy.
struct PunctureEnergy {
  double energy;

  static constexpr const char* name = "puncture_energy";
  static constexpr Family family = Family::puncture;
  static constexpr const char* summary = "Puncture once the work of indentation passes a given energy.";
  static constexpr const char* source = "Azar & Hayward 2008, U_p";
  static constexpr const char* validity = "Specific to needle, tissue and speed.";
  static constexpr std::array<Parameter<PunctureEnergy>, 1> table{{
      {&PunctureEnergy::energy, "energy", "J", 0.0, 1e2, required, "U_p",
       "work of indentation at puncture; 0 is a surface without resistance", "Azar & Hayward 2008"},
  }};

  /// Bisection between doubling bounds.
  template <class Stiffness>
  double puncture_depth(const Stiffness& stiffness) const noexcept {
    double low = 0.0, high = 1e-6;
    while (high < 1e9 && stiffness.energy(high) < energy) low = high, high *= 2.0;
    for (int i = 0; i < 100 && energy > 0.0; ++i) {
      const double middle = 0.5 * (low + high);
      (stiffness.energy(middle) < energy ? low : high) = middle;
    }
    return energy > 0.0 ? high : 0.0;
  }
  bool breaks(double, double work) const noexcept { return work >= energy; }
};

}  // namespace needleforce::laws
