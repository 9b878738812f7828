// SPDX-License-Identifier: Apache-2.0
// What a step adds up over its layers: contacts that push the tip, and friction along the shaft.
#pragma once

#include "scalar.hpp"

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

}  // namespace needleforce
