// SPDX-License-Identifier: Apache-2.0
// A contact that goes over to friction along the travel after a puncture, passive for any motion;
// docs/decisions/0017-gradual-rupture.md.
#pragma once

#include <cmath>

#include "memory.hpp"

namespace needleforce {

/// How much of a contact the advance s [m] past a puncture leaves intact. What is left carries the load, so
/// that damage d speeds itself up (Kachanov 1958):
///
///     dd/ds = (1 - d)^(1 - q) / delta      1 - d = (1 - q s / delta)^(1 / q)
///
/// q = 0 is exp(-s / delta); q = 1 falls evenly over delta; a larger q yields slowly and then snaps at
/// delta / q. The snap takes a time: d follows that curve with the time constant tau.
template <class Real>
struct BasicRupture {
  Real per_length;   ///< 1 / delta [1/m]
  Real brittleness;  ///< q
  Real time;         ///< tau [s]

  /// 1 - d after an advance [m] in any time.
  Real intact(Real advance) const noexcept {
    const Real s = larger(0.0, advance) * per_length;
    if (brittleness < least_brittleness) return exp(-s) * gradual(s);
    const Real left = 1.0 - brittleness * s;
    return left > 0.0 ? pow(left, 1.0 / brittleness) : 0.0;
  }
  /// d(intact) / d(advance) [1/m] where `intact` is left; no steeper than a fall over the last micrometre.
  Real slope(Real advance, Real intact) const noexcept {
    const Real s = larger(0.0, advance) * per_length;
    if (brittleness < least_brittleness) return -intact * per_length;
    const Real left = larger(1.0 - brittleness * s, brittleness * per_length * last_travel);
    return -intact * per_length / left;
  }
  /// The share of what the curve has passed that is still intact after a step of dt [s].
  Real lagging(Real dt) const noexcept { return time > 0.0 ? exp(-dt / time) : 0.0; }

 private:
  /// 1, with what a power that is left out changes by the brittleness.
  Real gradual(const Real& s) const noexcept {
    if constexpr (is_plain<Real>)
      return 1.0;
    else
      return 1.0 - 0.5 * s * s * (brittleness - value_of(brittleness));
  }
  static constexpr double least_brittleness = 1e-6;  // below, the power loses what the exponential keeps
  static constexpr double last_travel = 1e-6;        // [m] the resolution of a good encoder
};
using Rupture = BasicRupture<double>;

/// The same for a contact of many fibres in parallel that break at different advances: 1 - d is the share
/// that has not broken yet, by the distribution of Weibull (1939; bundles of fibres: Daniels 1945):
///
///     1 - d = exp(-(s / delta)^m)
///
/// m = 1 begins to fall at once; from m = 2 on the fall begins and ends smoothly.
template <class Real>
struct BasicFibreRupture {
  Real per_length;  ///< 1 / delta [1/m]
  Real exponent;    ///< m

  static constexpr double time = 0.0;  // fibres that break do not lag behind

  /// 1 - d after an advance [m].
  Real intact(Real advance) const noexcept { return exp(-pow(larger(0.0, advance) * per_length, exponent)); }
  /// d(intact) / d(advance) [1/m] where `intact` is left.
  Real slope(Real advance, Real intact) const noexcept {
    const Real s = larger(0.0, advance) * per_length;
    return -intact * exponent * pow(s, exponent - 1.0) * per_length;
  }
  Real lagging(Real) const noexcept { return 0.0; }
};
using FibreRupture = BasicFibreRupture<double>;

/// What is left of a contact of force U'(u) after its puncture: its energy is (1 - d) w U(u_e) / k. Neither d
/// nor the relaxation in w ever recovers, and u_e falls k times as fast as the tip recedes: without a source
/// of energy. k is 1, or as large as it takes for a contact that relaxed to hold no more than was paid.
template <class Real>
struct BasicRemainingContact {
  Real lasting = 0.0;      ///< the part of w that does not relax
  Real transient[2] = {};  ///< the parts that do
  Real intact = 0.0;       ///< 1 - d
  Real recession = 1.0;    ///< k
  Real by_advance = 0.0;   ///< d(intact) / d(depth) of the next step [1/m], 0 behind the deepest point
  Real force = 0.0;        ///< [N]
  Real by_depth = 0.0;     ///< [N/m]

  /// Looks at what came from outside.
  void check(StateCheck& check, const char* part) const noexcept {
    check.numbers(part, *this);
    for (const Real share : {lasting, transient[0], transient[1], intact})
      check.number(part, share, 0.0, 1.0);
  }
  /// Begins with a share of the contact's force; what had relaxed stays lost.
  void begin(const BasicContactAtPuncture<Real>& contact, Real share) noexcept {
    *this = {};
    if (!(contact.force > 0.0 && contact.work > 0.0)) return;
    Real rest = contact.force;
    for (int j = 0; j < 2; ++j) {
      const Real part = bounded(contact.element.memory[j], 0.0, rest);
      transient[j] = share * contact.left * part / contact.force;
      rest -= part;
    }
    lasting = share * contact.left * rest / contact.force;
    intact = 1.0;
    recession = larger(1.0, contact.whole_energy / contact.work);
  }
  /// Damage and relaxation of one step; returns the indentation u_e [m] of what is left.
  template <class Curve>
  Real advance(const Curve& rupture, const BasicMove<Real>& move, const BasicLayerExtent<Real>& extent,
               const BasicRelaxing<Real>& relaxing) noexcept {
    const bool tears = move.depth >= move.deepest;
    if (intact > 0.0 && (tears || rupture.time > 0.0)) tear(rupture, move, extent);
    if (!tears) by_advance = 0.0;
    if (!(relaxing.only_at_rest && move.advancing))
      for (int j = 0; j < 2; ++j) transient[j] *= relaxing.left[j];
    return larger(0.0, extent.puncture - extent.top - recession * (move.deepest - move.depth));
  }
  /// Takes force [N] and slope [N/m] of the whole contact at that indentation.
  void press(Real whole, Real slope) noexcept {
    const Real weight = lasting + transient[0] + transient[1];
    force = intact * weight * whole;
    by_depth = by_advance < 0.0 ? by_advance * weight * whole : intact * weight * recession * slope;
  }

 private:
  template <class Curve>
  void tear(const Curve& rupture, const BasicMove<Real>& move,
            const BasicLayerExtent<Real>& extent) noexcept {
    const Real advance = move.deepest - extent.puncture;
    const Real curve = rupture.intact(advance), lagging = rupture.lagging(move.dt);
    if (curve < intact) intact = curve + (intact - curve) * lagging;
    by_advance = (1.0 - lagging) * rupture.slope(advance, curve);
  }
};
using RemainingContact = BasicRemainingContact<double>;

}  // namespace needleforce
