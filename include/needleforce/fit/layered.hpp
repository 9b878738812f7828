// SPDX-License-Identifier: Apache-2.0
// The layered law for identification: the engine itself, run along a recorded motion for many sets of
// numbers.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>

#include "../insertion.hpp"

namespace needleforce::fit {

/// Parameters of one layer as a log identifies them; depths in the recording's own zero.
struct LayerNumbers {
  double coefficient;      ///< c [N/m^2], force c h^2 before the contact saturates
  double saturation;       ///< h_s [m]
  double top;              ///< z_0 [m]
  double puncture;         ///< z_1 [m]
  double per_length;       ///< f' [N/m]
  double stiffness;        ///< k_t [N/m]
  double rupture_length;   ///< delta [m]
  double resting_surface;  ///< z_r - z_0 [m]
  double brittleness;      ///< q, of a contact that yields
};

/// Shares and time constants [s] of relaxation, the same in every layer.
struct RelaxationNumbers {
  double share_1, time_1, share_2, time_2;
};

/// Only c and h_s set the force; they are given here for a cone of 45 degrees, whose tangent is 1.
inline laws::ConeCylinder contact_of(const LayerNumbers& layer) noexcept {
  constexpr double half = 0.5 * std::numbers::pi;
  return {half * layer.coefficient, 0.5 * half, layer.saturation / half};
}

/// The form that was fitted to recordings and may return energy; the one that drops what its spring may not
/// take over; and the one whose contact yields along the travel after the puncture. The last two are passive.
enum class LayeredForm { as_fitted, passive, yielding };

template <class Relaxation>
Model laws_of(const LayerNumbers& layer, const Friction& friction,
              const RelaxationNumbers& relaxation) noexcept {
  return {contact_of(layer), laws::PunctureDepth{layer.puncture - layer.top}, friction, laws::NoCutting{},
          Relaxation{relaxation.share_1, relaxation.time_1, relaxation.share_2, relaxation.time_2}};
}

inline Model laws_of(const LayerNumbers& layer, const RelaxationNumbers& relaxation,
                     LayeredForm form) noexcept {
  const auto& [c, h_s, top, puncture, per_length, stiffness, length, surface, brittleness] = layer;
  switch (form) {
    case LayeredForm::passive:
      return laws_of<laws::Prony>(layer, laws::DraggedTissuePassive{per_length, stiffness, length, surface},
                                  relaxation);
    case LayeredForm::yielding:
      return laws_of<laws::PronyLocked>(
          layer, laws::YieldingTissue{per_length, stiffness, length, surface, brittleness, 0.0}, relaxation);
    default:
      return laws_of<laws::PronyAtRest>(
          layer, laws::DraggedTissueAsFitted{per_length, stiffness, length, surface}, relaxation);
  }
}

/// Force (n,) [N] of one layer at `depth` [m] after steps of `dt` [s]; NaN throughout where the engine
/// refuses the numbers. Layers of dragged tissue add up, so that a stack is the sum of its layers.
inline void layer_force(const LayerNumbers& layer, const RelaxationNumbers& relaxation, LayeredForm form,
                        std::span<const double> depth, std::span<const double> dt, double* force) noexcept {
  Insertion insertion(laws_of(layer, relaxation, form),
                      {.max_speed = std::numeric_limits<double>::infinity()});
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const Sample sample = insertion.step(depth[i] - layer.top, no_velocity, dt[i]);
    const bool answered = sample.status == Status::ok || sample.status == Status::outside_range;
    force[i] = answered ? sample.force : std::numeric_limits<double>::quiet_NaN();
  }
}

}  // namespace needleforce::fit
