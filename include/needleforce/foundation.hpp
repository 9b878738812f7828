// SPDX-License-Identifier: Apache-2.0
// Winkler foundation of a beam in an elastic medium, every reading of the paper's friction force, and the
// pressure of a nonlinear foundation. docs/decisions/0015-nonlinear-foundation.md
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "needle.hpp"
#include "scalar.hpp"
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

/// A shaft whose foundation has the modulus K [Pa]: beta = (K / 4 EI)^(1/4) [1/m].
inline double beam_wavenumber(const Needle& needle, double modulus) noexcept {
  return std::sqrt(std::sqrt(0.25 * modulus / needle.bending_stiffness()));
}

/// The embedded length [m] over which the lateral offset of a shaft from the path that its tip has cut grows
/// to the settlement D/2, for a lateral force P [N] at the tip: the shaft lags its path by the angle
/// P / sqrt(K EI) (steady steering of a beam attached to its path).
inline double deflection_length(const Needle& needle, double modulus, double lateral_force) noexcept {
  const double root = std::sqrt(modulus * needle.bending_stiffness());
  return 0.5 * needle.outer_diameter * root / lateral_force;
}

/// The length [m] behind the tip over which a long shaft is off its path: an offset that grows by the angle
/// of `deflection_length` over this length, and is zero beyond, has the mean square of that of steady
/// steering, (angle / beta) exp(-beta x) sin(beta x).
inline double bending_length(const Needle& needle, double modulus) noexcept {
  return std::cbrt(0.375) / beam_wavenumber(needle, modulus);
}

/// The pressure of a nonlinear foundation over its slope at the origin [m], odd in the settlement. Each form
/// has one length u_c [m], the settlement at which the nonlinear part counts as much as the linear one, and
/// three functions of a settlement y = u / u_c >= 0:
///
///     pressure(y) = p / (k_1 u_c)      energy(y) = its integral
///     both(y, x) = [energy(y + x) - energy(y - x)] / 2     for 0 <= x <= y, without cancellation
///
/// The last is the integral of the mean pressure on two sides of a shaft, y further in on one, less on the
/// other.
namespace foundations {

/// p = k_1 u + k_3 u^3, hardening; u_c = sqrt(k_1 / k_3).
struct Cubic {
  template <class Real>
  static Real pressure(Real y) noexcept {
    return y * (1.0 + y * y);
  }
  template <class Real>
  static Real energy(Real y) noexcept {
    return y * y * (0.5 + 0.25 * y * y);
  }
  template <class Real>
  static Real both(Real y, Real x) noexcept {
    return x * y * (1.0 + y * y + x * x);
  }
};

/// p = k_1 u / (1 + k_1 u / p_u), softening; u_c = p_u / k_1.
struct Hyperbolic {
  template <class Real>
  static Real pressure(Real y) noexcept {
    return y / (1.0 + y);
  }
  template <class Real>
  static Real energy(Real y) noexcept {
    return y > 0.1 ? y - log1p(y) : small_energy(y);
  }
  template <class Real>
  static Real both(Real y, Real x) noexcept {
    // x - artanh(t), t = x / (1 + y), as x y / (1 + y) - (artanh(t) - t)
    const Real t = x / (1.0 + y);
    const Real rest = t > 0.1 ? atanh(t) - t : t * t * t * tail(t * t);
    return x * y / (1.0 + y) - rest;
  }

 private:
  /// 1/3 + s/5 + s^2/7 + ..., s <= 0.01.
  template <class Real>
  static Real tail(Real s) noexcept {
    return 1.0 / 3 + s * (1.0 / 5 + s * (1.0 / 7 + s * (1.0 / 9 + s * (1.0 / 11 + s * (1.0 / 13 + s / 15)))));
  }
  /// y - ln(1 + y) by ln(1 + y) = 2 artanh(y / (2 + y)).
  template <class Real>
  static Real small_energy(Real y) noexcept {
    const Real t = y / (2.0 + y);
    return t * y - 2.0 * t * t * t * tail(t * t);
  }
};

/// p = p_u tanh(k_1 u / p_u), softening; u_c = p_u / k_1.
struct Tanh {
  template <class Real>
  static Real pressure(Real y) noexcept {
    return tanh(y);
  }
  /// ln cosh y.
  template <class Real>
  static Real energy(Real y) noexcept {
    if (y > 1.0) return y + log1p(exp(-2.0 * y)) - 0.69314718055994530942;
    const Real half = sinh(0.5 * y);
    return log1p(2.0 * half * half);
  }
  /// artanh(tanh y tanh x), and the same where that would be close to 1.
  template <class Real>
  static Real both(Real y, Real x) noexcept {
    if (x < 1.0) return atanh(tanh(y) * tanh(x));
    const Real apart = exp(-2.0 * (y - x)), total = exp(-2.0 * (y + x));
    return x + 0.5 * (log1p(total) - log1p(apart));
  }
};

}  // namespace foundations

/// The form of a foundation's pressure, by name.
enum class FoundationForm { linear, cubic, hyperbolic, tanh };
inline constexpr std::array<const char*, 4> foundation_form_names{"linear", "cubic", "hyperbolic", "tanh"};

/// The pressure p [Pa] of a foundation of slope `stiffness` [Pa/m] at the origin, at a `settlement` [m] of
/// either sign. `scale` [m] is sqrt(k_1 / k_3) of a cubic form and p_u / k_1 of the others.
inline double foundation_pressure(FoundationForm form, double settlement, double stiffness,
                                  double scale) noexcept {
  const double y = std::abs(settlement) / scale, unit = std::copysign(stiffness * scale, settlement);
  switch (form) {
    case FoundationForm::cubic:
      return unit * foundations::Cubic::pressure(y);
    case FoundationForm::hyperbolic:
      return unit * foundations::Hyperbolic::pressure(y);
    case FoundationForm::tanh:
      return unit * foundations::Tanh::pressure(y);
    case FoundationForm::linear:
      break;
  }
  return stiffness * settlement;
}

/// The energy per area [J/m^2] that a foundation stores, the integral of `foundation_pressure`.
inline double foundation_energy(FoundationForm form, double settlement, double stiffness,
                                double scale) noexcept {
  const double y = std::abs(settlement) / scale, unit = stiffness * scale * scale;
  switch (form) {
    case FoundationForm::cubic:
      return unit * foundations::Cubic::energy(y);
    case FoundationForm::hyperbolic:
      return unit * foundations::Hyperbolic::energy(y);
    case FoundationForm::tanh:
      return unit * foundations::Tanh::energy(y);
    case FoundationForm::linear:
      break;
  }
  return 0.5 * stiffness * settlement * settlement;
}

}  // namespace needleforce
