// SPDX-License-Identifier: Apache-2.0
// Rest under noise of the measured depth: travel that slipped within the range of the noise is returned at
// the force at which it slipped. docs/decisions/0016-depth-noise.md.
#pragma once

#include <array>
#include <cmath>

#include "scalar.hpp"
#include "state_check.hpp"

namespace needleforce {

/// What slipped in a step: its travel [m], and the work per travel [N] that it dissipates, with the sign of
/// the force. A force that grows with the length of the shaft leaves out what strains the added length.
template <class Real>
struct BasicSlip {
  Real travel = 0.0, force = 0.0;
  Real by_depth = 0.0;  ///< d(force) / d(depth) where nothing is strained [N/m]
};
using Slip = BasicSlip<double>;

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
template <class Real>
struct BasicReturnableSlip {
  Real energy = 0.0;  ///< paid and not returned yet [J]; negative for a debt
  Real behind = 0.0;  ///< travel forward that lifts the weight before the law feels any [m]
  Real lowest = 0.0;  ///< largest `behind` since the needle moved [m]
  Real shift = 0.0;   ///< from where the law feels the tip to where it is shown [m]
  Real still = 0.0;   ///< how long it has rested, up to the rest time [s]

  /// Looks at what came from outside. Wait-free.
  void check(StateCheck& check, const char* part) const noexcept {
    check.numbers(part, energy);
    check.numbers(part, std::array{behind, lowest, shift}, 1e3);
    check.number(part, behind, 0.0, 1e3);
    check.number(part, still, 0.0, 1e9);
  }
  /// What a law with a force feels of a travel [m] in a step of `dt` [s]. Wait-free.
  Real felt(Real travel, const BasicSlip<Real>& law, Real dt, const DepthNoise& noise) noexcept {
    if (law.force == 0.0) *this = {};
    const Real pull = abs(law.force), growth = law.by_depth;  // of |force| along the force, both ways
    const Real left =
        law.force * travel < 0.0 ? sink(-abs(travel), pull, growth) : lift(abs(travel), pull, growth, noise);
    rest(left, dt, noise);
    const Real felt = copysign(left, travel);
    shift += travel - felt;
    shift -= copysign(smaller(abs(shift), abs(left)), shift);
    return felt;
  }
  /// True while the noise explains the travel of a needle that may be moving.
  bool waits(Real left, const DepthNoise& noise) const noexcept {
    return left == 0.0 && still < noise.rest_time;
  }

  /// Adds what slipped in a step, at the smaller of the forces before and after it. Wait-free.
  void add(Real before, const BasicSlip<Real>& slip, const DepthNoise& noise) noexcept {
    if (!(before * slip.force > 0.0)) {
      *this = {};
      return;
    }
    const Real now = abs(slip.force);
    if (slip.travel * slip.force > 0.0) energy += smaller(abs(before), now) * abs(slip.travel);
    energy = smaller(energy, noise.range * now);
  }

 private:
  /// The work of a travel along which the force grows, so that sinking and lifting take the same.
  static Real work(Real travel, Real pull, Real growth) noexcept {
    return travel * (pull + 0.5 * growth * travel);
  }
  Real sink(Real travel, Real pull, Real growth) noexcept {
    const Real sunk = smaller(-travel, larger(0.0, energy / pull));
    energy += work(-sunk, pull, growth);
    behind += sunk;
    lowest = larger(lowest, behind);
    return travel + sunk;
  }
  Real lift(Real travel, Real pull, Real growth, const DepthNoise& noise) noexcept {
    const Real lifted = smaller(travel, behind);
    energy = smaller(energy + work(lifted, pull, growth), noise.range * (pull + growth * lifted));
    behind -= lifted;
    return travel - lifted;
  }
  /// A needle that rests may show any depth of the range above the lowest that it showed. It rests if for the
  /// rest time it is slower than one that leaves the range in it.
  void rest(Real left, Real dt, const DepthNoise& noise) noexcept {
    const bool rested = still >= noise.rest_time;
    still = bounded(still + dt - abs(left) * noise.rest_time / noise.range, 0.0, noise.rest_time);
    lowest = still > 0.0 ? larger(lowest + left, behind) : behind;
    if (!rested && still >= noise.rest_time && left >= 0.0) {
      behind += larger(0.0, noise.range - lowest);
      lowest = larger(lowest, noise.range);
    }
    behind = smaller(behind, noise.range);
  }
};
using ReturnableSlip = BasicReturnableSlip<double>;

}  // namespace needleforce
