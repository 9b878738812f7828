// SPDX-License-Identifier: Apache-2.0
// Winkler foundation of a beam in an elastic medium, and every reading of the paper's friction force.
#pragma once

#include <cmath>
#include <numbers>

#include "needle.hpp"
#include "tissue.hpp"

namespace needleforce {

/// Foundation modulus K [Pa] after Vesic 1961 for a beam of width b [m]: force per length over deflection.
/// The paper's eq. (9), there ascribed to Biot; the subgrade reaction is K / b [Pa/m]. `embedment_factor` 2
/// is resistance on both sides.
inline double vesic_modulus(const Needle& needle, const Tissue& tissue, double width,
                            double embedment_factor = 1.0) noexcept {
  const double ratio = tissue.young_modulus * std::pow(width, 4) / needle.bending_stiffness();
  return embedment_factor * 0.65 * plane_strain_modulus(tissue) * std::pow(ratio, 1.0 / 12.0);
}

/// Foundation modulus [Pa] after Biot 1937; `half_width` [m]. Constants and half-width convention are
/// unconfirmed.
inline double biot_modulus(const Needle& needle, const Tissue& tissue, double half_width) noexcept {
  const double transverse = 1.0 - tissue.poisson_ratio * tissue.poisson_ratio;
  const double ratio =
      tissue.young_modulus * std::pow(half_width, 4) / (transverse * needle.bending_stiffness());
  return 0.95 * plane_strain_modulus(tissue) * std::pow(ratio, 0.108);
}

/// How eqs. (7)-(11), dimensionally inconsistent as printed, are read as a force per length.
enum class FrictionReading {
  paper_width,      ///< A: (9) over the paper's own b = pi D: f' = mu K D / 2
  projected_width,  ///< B: (9) over the projected width D: f' = mu pi K D / 2
  beam_width,       ///< C: b = D everywhere: f' = mu pi K D / 2
  lame,        ///< exact linear plane-strain hole opened by its own radius: f' = mu pi D E_2 / (1 + nu_2)
  literal_mm,  ///< (11) evaluated in N, mm, MPa as printed: flagged, not invariant under change of units
};

/// Friction per embedded length over the friction coefficient [N/m] under one reading.
inline double friction_per_length(FrictionReading reading, const Needle& needle, const Tissue& tissue,
                                  double embedment_factor = 1.0) noexcept {
  using std::numbers::pi;
  const double diameter = needle.outer_diameter;
  const double wide = vesic_modulus(needle, tissue, pi * diameter, embedment_factor);
  switch (reading) {
    case FrictionReading::paper_width:
      return 0.5 * wide * diameter;
    case FrictionReading::projected_width:
      return 0.5 * pi * wide * diameter;
    case FrictionReading::beam_width:
      return 0.5 * pi * diameter * vesic_modulus(needle, tissue, diameter, embedment_factor);
    case FrictionReading::lame:
      return pi * diameter * tissue.young_modulus / (1.0 + tissue.poisson_ratio);
    case FrictionReading::literal_mm:
      break;
  }
  const double diameter_mm = 1e3 * diameter;
  const double wide_MPa = 1e-6 * wide;
  return 1e3 * 0.5 * pi * diameter_mm * diameter_mm * wide_MPa;
}

}  // namespace needleforce
