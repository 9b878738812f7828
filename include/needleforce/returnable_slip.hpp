// SPDX-License-Identifier: Apache-2.0
// Rest under noise of the measured depth: travel that slipped within the range of the noise is returned at
// the force at which it slipped. docs/decisions/0016-depth-noise.md.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "state_check.hpp"

namespace needleforce {

/// What slipped in a step: its travel [m], and the work per travel [N] that it dissipates, with the sign of
/// the force. A force that grows with the length of the shaft leaves out what strains the added length.
struct Slip {
  double travel = 0.0, force = 0.0;
  double by_depth = 0.0;  ///< d(force) / d(depth) where nothing is strained [N/m]
};

/// The noise of the measured depth at rest.
struct DepthNoise {
  double range = 0.0;      ///< [m]
  double rest_time = 0.0;  ///< a needle that moves leaves the range within this time [s]
};

inline constexpr double speed_at_rest = 1e-4;  ///< [m/s] slower is a hold, whatever the velocity's noise

/// Of `Limits::depth_noise` [m].
inline DepthNoise noise_of(double half_range) noexcept {
  return {2.0 * half_range, 2.0 * half_range / speed_at_rest};
}

/// Energy of recent slip, as if it had lifted a weight: on the way back the weight sinks first, forward again
/// it is lifted first, and the force stays. It returns no more than slip and lifting have paid, so a passive
/// law stays passive.
struct ReturnableSlip {
  double energy = 0.0;  ///< paid and not returned yet [J]; negative for a debt
  double behind = 0.0;  ///< travel forward that lifts the weight before the law feels any [m]
  double lowest = 0.0;  ///< largest `behind` since the needle moved [m]
  double shift = 0.0;   ///< from where the law feels the tip to where it is shown [m]
  double still = 0.0;   ///< how long it has rested, up to the rest time [s]

  /// Looks at what came from outside. Wait-free.
  void check(StateCheck& check, const char* part) const noexcept {
    check.numbers(part, energy);
    check.numbers(part, std::array{behind, lowest, shift}, 1e3);
    check.number(part, behind, 0.0, 1e3);
    check.number(part, still, 0.0, 1e9);
  }
  /// What a law with a force feels of a travel [m] in a step of `dt` [s]. Wait-free.
  double felt(double travel, const Slip& law, double dt, const DepthNoise& noise) noexcept {
    if (law.force == 0.0) *this = {};
    const double pull = std::abs(law.force), growth = law.by_depth;  // of |force| along the force, both ways
    const double left = law.force * travel < 0.0 ? sink(-std::abs(travel), pull, growth)
                                                 : lift(std::abs(travel), pull, growth, noise);
    rest(left, dt, noise);
    const double felt = std::copysign(left, travel);
    shift += travel - felt;
    shift -= std::copysign(std::min(std::abs(shift), std::abs(left)), shift);
    return felt;
  }
  /// True while the noise explains the travel of a needle that may be moving.
  bool waits(double left, const DepthNoise& noise) const noexcept {
    return left == 0.0 && still < noise.rest_time;
  }

  /// Adds what slipped in a step, at the smaller of the forces before and after it. Wait-free.
  void add(double before, const Slip& slip, const DepthNoise& noise) noexcept {
    if (!(before * slip.force > 0.0)) {
      *this = {};
      return;
    }
    const double now = std::abs(slip.force);
    if (slip.travel * slip.force > 0.0) energy += std::min(std::abs(before), now) * std::abs(slip.travel);
    energy = std::min(energy, noise.range * now);
  }

 private:
  /// The work of a travel along which the force grows, so that sinking and lifting take the same.
  static double work(double travel, double pull, double growth) noexcept {
    return travel * (pull + 0.5 * growth * travel);
  }
  double sink(double travel, double pull, double growth) noexcept {
    const double sunk = std::min(-travel, std::max(0.0, energy / pull));
    energy += work(-sunk, pull, growth);
    behind += sunk;
    lowest = std::max(lowest, behind);
    return travel + sunk;
  }
  double lift(double travel, double pull, double growth, const DepthNoise& noise) noexcept {
    const double lifted = std::min(travel, behind);
    energy = std::min(energy + work(lifted, pull, growth), noise.range * (pull + growth * lifted));
    behind -= lifted;
    return travel - lifted;
  }
  /// A needle that rests may show any depth of the range above the lowest that it showed. It rests if for the
  /// rest time it is slower than one that leaves the range in it.
  void rest(double left, double dt, const DepthNoise& noise) noexcept {
    const bool rested = still >= noise.rest_time;
    still = std::clamp(still + dt - std::abs(left) * noise.rest_time / noise.range, 0.0, noise.rest_time);
    lowest = still > 0.0 ? std::max(lowest + left, behind) : behind;
    if (!rested && still >= noise.rest_time && left >= 0.0) {
      behind += std::max(0.0, noise.range - lowest);
      lowest = std::max(lowest, noise.range);
    }
    behind = std::min(behind, noise.range);
  }
};

}  // namespace needleforce
