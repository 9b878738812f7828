// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "../law.hpp"

namespace needleforce::laws {

/// The tip breaks through once the work done on the tissue passes a given energy.
template <class Real>
struct BasicPunctureEnergy {
  Real energy;

  static constexpr const char* name = "puncture_energy";
  static constexpr Family family = Family::puncture;
  static constexpr const char* summary = "Puncture once the work of indentation passes a given energy.";
  static constexpr const char* source = "Azar & Hayward 2008, U_p";
  static constexpr const char* validity = "Specific to needle, tissue and speed.";
  static constexpr std::array<Parameter<BasicPunctureEnergy, Real>, 1> table{{
      {&BasicPunctureEnergy::energy, "energy", "J", 0.0, 1e2, required, "U_p",
       "work of indentation at puncture; 0 is a surface without resistance", "Azar & Hayward 2008"},
  }};

  /// Bisection between doubling bounds.
  template <class Contact>
  Real puncture_depth(const Contact& stiffness) const noexcept {
    double low = 0.0, high = 1e-6;
    while (high < 1e9 && stiffness.energy(high) < energy) low = high, high *= 2.0;
    for (int i = 0; i < 100 && energy > 0.0; ++i) {
      const double middle = 0.5 * (low + high);
      (stiffness.energy(middle) < energy ? low : high) = middle;
    }
    if (!(energy > 0.0)) return 0.0;
    const Real depth = high;
    return implied(depth, Real(stiffness.energy(depth) - energy), Real(stiffness.force(depth)));
  }
  bool breaks(Real, Real work) const noexcept { return work >= energy; }
};
using PunctureEnergy = BasicPunctureEnergy<double>;

}  // namespace needleforce::laws
