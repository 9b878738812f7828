// SPDX-License-Identifier: Apache-2.0
// One element for all laws with tissue that deforms elastically, relaxes and slips.
#pragma once

#include <algorithm>
#include <cmath>

#include "scalar.hpp"

namespace needleforce {

/// One step of the tip, the input of every law.
template <class Real>
struct BasicMove {
  Real depth;        ///< [m] after the step, past the undeformed surface
  Real travel;       ///< [m] of the step
  Real below;        ///< [m] of the travel below the undeformed surface
  double velocity;   ///< [m/s]; rate terms follow it, geometry follows `travel`
  Real dt;           ///< [s]
  double deepest;    ///< [m] the greatest depth so far
  bool advancing;    ///< going deeper than ever, and not at rest
  bool withdrawing;  ///< behind the greatest depth by more than noise
  Real shift = 0.0;  ///< from where friction feels the tip to `depth`, within the noise [m]
  bool waits =
      false;  ///< noise explains the travel, which is therefore left out, and the needle may be moving
};
using Move = BasicMove<double>;

/// The same step for laws of another kind of number.
template <class Real>
BasicMove<Real> numbers_of(const Move& move) noexcept {
  if constexpr (is_plain<Real>)
    return move;
  else
    return {move.depth,   move.travel,    move.below,       move.velocity, move.dt,
            move.deepest, move.advancing, move.withdrawing, move.shift,    move.waits};
}

/// Relaxation over one step: an elastic force f becomes lasting f + two relaxing memories.
template <class Real>
struct BasicRelaxing {
  Real lasting = 1.0;           ///< share that does not relax
  Real share[2] = {};           ///< g_j, relaxing shares
  Real left[2] = {1.0, 1.0};    ///< a_j = exp(-dt / tau_j), remaining after a step
  Real during[2] = {1.0, 1.0};  ///< (1 - a_j) tau_j / dt, remaining of a load applied evenly over the step
  bool relaxes = false;         ///< false: purely elastic
  bool only_at_rest = false;    ///< nothing relaxes while the tip advances
  bool restores = false;        ///< and its advance restores the memories (as fitted to recordings)
};
using Relaxing = BasicRelaxing<double>;
/// Of a layer that does not relax.
template <class Real>
inline constexpr BasicRelaxing<Real> no_relaxing{};

/// An elastic force with its relaxing memories; [N], or [N/m] for a force per length. Exact for a load
/// applied evenly over the step, so that the step's size does not matter at constant velocity.
template <class Real>
struct BasicElement {
  Real elastic = 0.0;     ///< without relaxation
  Real memory[2] = {};    ///< q_j
  Real stiffening = 1.0;  ///< d(force) / d(elastic) in the last step, 0 at a limit, where it slips
  Real slipped = 0.0;     ///< what the limits left of the load wanted in the last step

  /// Adds `wanted` to the elastic force, or as much of it as keeps the force within low..high; returns the
  /// force. standing + per_load * wanted, where it does not slip. Wait-free.
  [[gnu::always_inline]] Real load(Real wanted, Real low, Real high, const BasicRelaxing<Real>& relaxing,
                                   bool advancing) noexcept {
    if (!relaxing.relaxes) return slip(wanted, low, high);
    if (relaxing.only_at_rest && advancing)
      return relaxing.restores ? refresh(wanted, low, high, relaxing)
                               : relax(wanted, low, high, locked(relaxing));
    return relax(wanted, low, high, relaxing);
  }

  /// The same for tissue that slips along a shaft: slip brings the shaft to tissue that has not relaxed, all
  /// of it after some stretches of slip, so that a hold after long sliding relaxes from the sliding force and
  /// slow sliding keeps it. Along the line of equal force towards its state of least energy: this only
  /// dissipates. Wait-free.
  [[gnu::always_inline]] Real drag(Real wanted, Real low, Real high, const BasicRelaxing<Real>& relaxing,
                                   bool advancing) noexcept {
    return relaxing.relaxes ? drag_relaxing(wanted, low, high, relaxing, advancing) : slip(wanted, low, high);
  }

  /// Continues under another relaxation: relaxed shares are kept, a new term starts with nothing relaxed, and
  /// without relaxation the force stays the same. Wait-free.
  void continue_with(const BasicRelaxing<Real>& before, const BasicRelaxing<Real>& now) noexcept {
    if (before.relaxes && !now.relaxes) elastic = before.lasting * elastic + memory[0] + memory[1];
    for (int j = 0; j < 2; ++j)
      memory[j] =
          before.share[j] > 1e-9 ? memory[j] * (now.share[j] / before.share[j]) : now.share[j] * elastic;
  }

  /// Slips at once if the limits fell below its last force, as they do at a reversal of the velocity: a load
  /// counts from there, for any step. Wait-free.
  void yield(Real force, Real low, Real high, const BasicRelaxing<Real>& relaxing) noexcept {
    const Real excess = force - bounded(force, low, high);
    elastic -= excess;
    for (int j = 0; j < 2; ++j) memory[j] -= relaxing.share[j] * excess;
  }

 private:
  /// The same without time to relax.
  static BasicRelaxing<Real> locked(BasicRelaxing<Real> relaxing) noexcept {
    for (int j = 0; j < 2; ++j) relaxing.left[j] = relaxing.during[j] = 1.0;
    return relaxing;
  }
  static Real within(Real low, Real force, Real high) noexcept {
    return smaller(larger(low, force), high);  // without a branch, which std::clamp is
  }

  [[gnu::always_inline]] Real slip(Real wanted, Real low, Real high) noexcept {
    const Real free = elastic + wanted;
    elastic = within(low, free, high);
    slipped = free - elastic;
    stiffening = elastic > low && elastic < high ? 1.0 : 0.0;
    return elastic;
  }

  /// Load and renewal in one call: what slipped, on which the next step waits, does not go through memory.
  [[gnu::noinline]] Real drag_relaxing(Real wanted, Real low, Real high, const BasicRelaxing<Real>& relaxing,
                                       bool advancing) noexcept {
    const bool locks = relaxing.only_at_rest && advancing;
    const Real force =
        locks ? load(wanted, low, high, relaxing, advancing) : relaxed(wanted, low, high, relaxing);
    // with locked dashpots only where the tip cuts fresh tissue: what recordings of a withdrawal show
    const bool renews = relaxing.only_at_rest ? advancing && !relaxing.restores : true;
    if (renews && stiffening == 0.0) renew(force, relaxing);
    return force;
  }
  /// `slipped` over |force| counts the stretches of the tissue.
  [[gnu::always_inline]] void renew(Real force, const BasicRelaxing<Real>& relaxing) noexcept {
    const Real old = abs(force) > 1e-300 ? exp(-abs(slipped * (1.0 / force))) : 0.0;
    elastic = force + old * (elastic - force);
    for (int j = 0; j < 2; ++j) {
      const Real held = relaxing.share[j] * force;
      memory[j] = held + old * (memory[j] - held);
    }
  }

  void take_hold(Real force, const BasicRelaxing<Real>& relaxing) noexcept {
    elastic = force;
    for (int j = 0; j < 2; ++j) memory[j] = relaxing.share[j] * force;
  }

  [[gnu::noinline]] Real refresh(Real wanted, Real low, Real high,
                                 const BasicRelaxing<Real>& relaxing) noexcept {
    const Real force = slip(wanted, low, high);
    take_hold(force, relaxing);
    return force;
  }

  [[gnu::noinline]] Real relax(Real wanted, Real low, Real high,
                               const BasicRelaxing<Real>& relaxing) noexcept {
    return relaxed(wanted, low, high, relaxing);
  }
  [[gnu::always_inline]] Real relaxed(Real wanted, Real low, Real high,
                                      const BasicRelaxing<Real>& relaxing) noexcept {
    Real standing = relaxing.lasting * elastic, per_load = relaxing.lasting;
    for (int j = 0; j < 2; ++j) {
      standing += memory[j] * relaxing.left[j];
      per_load += relaxing.share[j] * relaxing.during[j];
    }
    const Real free = standing + per_load * wanted, per = 1.0 / per_load;
    Real force = free;
    if (!(free > low && free < high)) {
      // a branch, and reciprocals: what it remembers need not wait for the force
      force = free >= high ? high : low;
      if (force != free) wanted = (force - standing) * per;
    }
    slipped = (free - force) * per;
    elastic += wanted;
    for (int j = 0; j < 2; ++j)
      memory[j] = memory[j] * relaxing.left[j] + relaxing.share[j] * relaxing.during[j] * wanted;
    stiffening = force > low && force < high ? per_load : 0.0;
    return force;
  }
};
using Element = BasicElement<double>;

}  // namespace needleforce
