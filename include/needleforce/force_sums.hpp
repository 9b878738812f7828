// SPDX-License-Identifier: Apache-2.0
// What a step adds up over its layers: contacts that push the tip, and friction along the shaft.
#pragma once

#include "memory.hpp"
#include "sample.hpp"

namespace needleforce {

/// The contacts of all layers that are not pierced.
template <class Real>
struct BasicPressed {
  Real force = 0.0;    ///< [N]
  double slope = 0.0;  ///< [N/m]
  bool touched = false, beyond = false, punctured = false;
  /// Adds that of a layer, with the tip at `depth` [m].
  template <class Layer, class State>
  void add(const Layer& layer, const State& state, double depth) noexcept {
    force += state.contact_force;
    slope += value_of(state.contact_slope);
    touched |= depth > layer.top;
    beyond |= layer.beyond(depth);
  }
};

/// Friction along the shaft: force [N], its derivatives, and whether a layer holds the needle.
template <class Real>
struct BasicDragged {
  Real force = 0.0;
  double by_depth = 0.0;
  double by_velocity = 0.0;
  bool hold = false;
  void operator+=(const BasicDragged<Real>& other) noexcept {
    force += other.force;
    by_depth += other.by_depth;
    by_velocity += other.by_velocity;
    hold |= other.hold;
  }
};

/// Their sum with that of the tip. At the next interface the force is the larger of cut and contact: they
/// share one tip.
template <class Real, class Motion>
[[gnu::always_inline]] inline BasicSample<Real> summed(const Motion& move, const BasicPressed<Real>& contacts,
                                                       const BasicDragged<Real>& shafts,
                                                       const BasicTipForce<Real>& tip) noexcept {
  const bool pushes = contacts.force > tip.force;
  const Real stiffness = pushes ? contacts.force - tip.force : 0.0;
  return {.depth = value_of(move.depth),
          .velocity = move.velocity,
          .force = stiffness + shafts.force + tip.force,
          .stiffness = stiffness,
          .friction = shafts.force,
          .cutting = tip.force,
          .force_by_depth = shafts.by_depth + (pushes ? contacts.slope : value_of(tip.by_depth)),
          .force_by_velocity = shafts.by_velocity,
          .status = contacts.beyond ? Status::outside_range : Status::ok,
          .punctured = contacts.punctured};
}

}  // namespace needleforce
