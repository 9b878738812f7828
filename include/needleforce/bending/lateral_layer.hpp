// SPDX-License-Identifier: Apache-2.0
// What one layer of tissue does across the needle: its foundation, and the push on a bevelled tip.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>

#include "../foundation.hpp"
#include "../parameter.hpp"
#include "elementary.hpp"

namespace needleforce::bending {

/// Lateral force per length p(u) [N/m] of a layer on a shaft that is off its cut path by u [m], and the
/// lateral force on the tip while it cuts there.
struct LateralLayer {
  double top = 0.0;
  double modulus = required;
  double scale = 1.0;
  double tip_force = 0.0;
  double yielding_modulus = 0.0;
  double yield_force = 1e4;
  double tip_stiffness = 0.0;
  FoundationForm form = FoundationForm::linear;

  static constexpr const char* name = "lateral_layer";
  static constexpr const char* summary = "Lateral foundation of a layer and lateral force on the tip in it.";
  static constexpr std::array<Parameter<LateralLayer>, 7> table{{
      {&LateralLayer::top, "top", "m", 0.0, 1.0, 0.0, "z", "travel in tissue at which the layer begins",
       "free"},
      {&LateralLayer::modulus, "modulus", "Pa", 0.0, 1e8, required, "K",
       "foundation modulus at small offsets, lateral force per length over offset", "Winkler foundation"},
      {&LateralLayer::scale, "scale", "m", 1e-7, 1.0, 1.0, "u_c",
       "offset at which a nonlinear form departs from the linear one: sqrt(k_1 / k_3) or p_u / k_1",
       "sec. 3, future work"},
      {&LateralLayer::tip_force, "tip_force", "N", -100.0, 100.0, 0.0, "P",
       "lateral force on the tip while it cuts, towards the bevel's point; that of the bevel's face is added",
       "Misra et al. 2010"},
      {&LateralLayer::yielding_modulus, "yielding_modulus", "Pa", 0.0, 1e8, 0.0, "K_2",
       "foundation modulus of the tissue that yields sideways, in parallel to the form; 0: none does",
       "free: elastic, then perfectly plastic"},
      {&LateralLayer::yield_force, "yield_force", "N/m", 1e-6, 1e7, 1e4, "q_2",
       "lateral force per length at which it yields: the shaft cuts it, and it stays where it is",
       "free: elastic, then perfectly plastic"},
      {&LateralLayer::tip_stiffness, "tip_stiffness", "N/m", 0.0, 1e6, 0.0, "k_t",
       "lateral stiffness of the tissue ahead of a tip at rest, which the tip leaves as it cuts",
       "free: linear"},
  }};
  static constexpr std::tuple parts{Part{&LateralLayer::form, "form", "form of the foundation", true}};

  bool linear() const noexcept { return straight() && !yields(); }
  /// True where the form is linear.
  bool straight() const noexcept { return form == FoundationForm::linear || modulus == 0.0; }
  bool yields() const noexcept { return yielding_modulus > 0.0; }
  /// Offset [m] at which the tissue yields.
  double yield_offset() const noexcept { return yield_force / yielding_modulus; }
};

/// A force per length at one offset: p over u, and the derivative of p, both [Pa].
struct Secant {
  double secant, tangent;
};

/// The foundation at the offset u >= 0 [m]. Wait-free.
inline Secant stiffness_at(const LateralLayer& layer, double offset) noexcept {
  const double y = offset / layer.scale, k = layer.modulus;
  switch (layer.form) {
    case FoundationForm::cubic:
      return {k * (1.0 + y * y), k * (1.0 + 3.0 * y * y)};
    case FoundationForm::hyperbolic: {
      const double one = 1.0 / (1.0 + y);
      return {k * one, k * one * one};
    }
    case FoundationForm::tanh: {
      const double t = tanh_of(y);
      return {y > 1e-8 ? k * t / y : k, k * (1.0 - t * t)};
    }
    default:
      return {k, k};
  }
}

/// Energy per length [J/m] of the foundation at the offset u >= 0 [m]. Wait-free.
inline double energy_per_length(const LateralLayer& layer, double offset) noexcept {
  const double form = foundation_energy(layer.form, offset, layer.modulus, layer.scale);
  if (!layer.yields()) return form;
  const double limit = layer.yield_offset(), elastic = std::min(offset, limit);
  return form + layer.yielding_modulus * elastic * (0.5 * elastic + (offset - elastic));
}

}  // namespace needleforce::bending
