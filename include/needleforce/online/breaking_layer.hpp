// SPDX-License-Identifier: Apache-2.0
// A layer whose force falls: whether that is a puncture, and what it leaves of the force.
#pragma once

#include <algorithm>

#include "../events/detection.hpp"
#include "regime.hpp"
#include "tissue_learnt.hpp"

namespace needleforce::online {

/// A fall that comes back, beyond what noise makes of it, was none; one that stays without having been
/// confirmed is one after a millimetre.
class BreakingLayer {
 public:
  /// The force [N] fell to what it is now, in a regime that continues if this is no puncture.
  void begin(const events::Detection& event, double force, Regime whole) noexcept {
    whole_ = whole;
    fall_ = event.size;
    layer_.probability = event.probability;
    layer_.puncture_depth = event.depth;
    layer_.puncture_force = force + event.size;
  }
  Regime whole() const noexcept { return whole_; }
  bool likely() const noexcept { return layer_.probability > 0.5; }
  bool came_back(double force, double noise) const noexcept {
    return force > layer_.puncture_force - 0.25 * fall_ + 2.0 * noise;
  }
  bool stays(double depth) const noexcept { return depth - layer_.puncture_depth > 1e-3; }
  /// Before the fall [N].
  double whole_force() const noexcept { return layer_.puncture_force; }
  /// The layer as it is with a force [N].
  LayerLearnt layer(double force) const noexcept {
    LayerLearnt now = layer_;
    now.remaining = now.puncture_force > 0.0 ? std::clamp(force / now.puncture_force, 0.0, 1.0) : 0.0;
    return now;
  }

  void check(StateCheck& check) const noexcept {
    layer_.check(check);
    check.word("regime", whole_, Regime::rest);
    check.number("numbers", fall_, -1e15, 1e15);
  }

 private:
  LayerLearnt layer_{};
  Regime whole_ = Regime::unknown;
  double fall_ = 0.0;
};

}  // namespace needleforce::online
