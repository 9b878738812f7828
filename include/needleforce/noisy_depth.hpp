// SPDX-License-Identifier: Apache-2.0
// A measured depth in front of the step of a whole needle, whose shaft and tip cannot be felt apart.
#pragma once

#include <algorithm>
#include <cmath>

#include "returnable_slip.hpp"

namespace needleforce {

/// The account of `ReturnableSlip` for all that a needle dissipates. Where it is felt, it stays while slip is
/// returned; as the needle moves on, it comes back to the depth that is shown.
struct NoisyDepth {
  ReturnableSlip slip{};
  double shown = 0.0;  ///< last [m]

  /// Where a needle that is felt at `at` [m], with a force [N], is felt when `depth` is shown. Wait-free.
  double felt(double depth, double at, double force, double dt, const DepthNoise& noise) noexcept {
    const double apart = shown - at, travel = depth - shown;
    shown = depth;
    const double left = slip.felt(travel, {.force = force}, dt, noise);
    return at + left + (left * force > 0.0 ? caught_up(apart, left, force) : 0.0);
  }
  /// A needle that is not felt elsewhere. Wait-free.
  double exactly(double depth) noexcept {
    *this = {.shown = depth};
    return depth;
  }
  /// Adds what a step dissipated [J] between two forces [N]. Wait-free.
  void add(double before, double dissipated, double now, const DepthNoise& noise) noexcept {
    slip.add(before, {now != 0.0 ? dissipated / now : 0.0, now}, noise);
  }

 private:
  /// A needle that lags moves on by as much again as it is felt to move, which the account pays; one that is
  /// ahead by half of it less, which the base pays.
  double caught_up(double apart, double left, double force) noexcept {
    if (apart * left < 0.0) return std::copysign(std::min(std::abs(apart), 0.5 * std::abs(left)), apart);
    const double pull = std::abs(force), paid = std::max(0.0, slip.energy / pull);
    const double by = std::min({std::abs(apart), std::abs(left), paid});
    slip.energy -= pull * by;
    return std::copysign(by, left);
  }
};

}  // namespace needleforce
