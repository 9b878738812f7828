// SPDX-License-Identifier: Apache-2.0
// A contact that goes over to friction along the travel after a puncture, passive for any motion;
// docs/decisions/0017-gradual-rupture.md.
#pragma once

#include <algorithm>
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
struct Rupture {
  double per_length;   ///< 1 / delta [1/m]
  double brittleness;  ///< q
  double time;         ///< tau [s]

  /// 1 - d after an advance [m] in any time.
  double intact(double advance) const noexcept {
    const double s = std::max(0.0, advance) * per_length;
    if (brittleness < least_brittleness) return std::exp(-s);
    const double left = 1.0 - brittleness * s;
    return left > 0.0 ? std::pow(left, 1.0 / brittleness) : 0.0;
  }
  /// d(intact) / d(advance) [1/m] where `intact` is left; no steeper than a fall over the last micrometre.
  double slope(double advance, double intact) const noexcept {
    const double s = std::max(0.0, advance) * per_length;
    if (brittleness < least_brittleness) return -intact * per_length;
    const double left = std::max(1.0 - brittleness * s, brittleness * per_length * last_travel);
    return -intact * per_length / left;
  }
  /// The share of what the curve has passed that is still intact after a step of dt [s].
  double lagging(double dt) const noexcept { return time > 0.0 ? std::exp(-dt / time) : 0.0; }

 private:
  static constexpr double least_brittleness = 1e-6;  // below, the power loses what the exponential keeps
  static constexpr double last_travel = 1e-6;        // [m] the resolution of a good encoder
};

/// The same for a contact of many fibres in parallel that break at different advances: 1 - d is the share
/// that has not broken yet, by the distribution of Weibull (1939; bundles of fibres: Daniels 1945):
///
///     1 - d = exp(-(s / delta)^m)
///
/// m = 1 begins to fall at once; from m = 2 on the fall begins and ends smoothly.
struct FibreRupture {
  double per_length;  ///< 1 / delta [1/m]
  double exponent;    ///< m

  static constexpr double time = 0.0;  // fibres that break do not lag behind

  /// 1 - d after an advance [m].
  double intact(double advance) const noexcept {
    return std::exp(-std::pow(std::max(0.0, advance) * per_length, exponent));
  }
  /// d(intact) / d(advance) [1/m] where `intact` is left.
  double slope(double advance, double intact) const noexcept {
    const double s = std::max(0.0, advance) * per_length;
    return -intact * exponent * std::pow(s, exponent - 1.0) * per_length;
  }
  double lagging(double) const noexcept { return 0.0; }
};

/// What is left of a contact of force U'(u) after its puncture: its energy is (1 - d) w U(u_e) / k. Neither d
/// nor the relaxation in w ever recovers, and u_e falls k times as fast as the tip recedes: without a source
/// of energy. k is 1, or as large as it takes for a contact that relaxed to hold no more than was paid.
struct RemainingContact {
  double lasting = 0.0;      ///< the part of w that does not relax
  double transient[2] = {};  ///< the parts that do
  double intact = 0.0;       ///< 1 - d
  double recession = 1.0;    ///< k
  double by_advance = 0.0;   ///< d(intact) / d(depth) of the next step [1/m], 0 behind the deepest point
  double force = 0.0;        ///< [N]
  double by_depth = 0.0;     ///< [N/m]

  /// Looks at what came from outside.
  void check(StateCheck& check, const char* part) const noexcept {
    check.numbers(part, *this);
    for (const double share : {lasting, transient[0], transient[1], intact})
      check.number(part, share, 0.0, 1.0);
  }
  /// Begins with a share of the contact's force; what had relaxed stays lost.
  void begin(const ContactAtPuncture& contact, double share) noexcept {
    *this = {};
    if (!(contact.force > 0.0 && contact.work > 0.0)) return;
    double rest = contact.force;
    for (int j = 0; j < 2; ++j) {
      const double part = std::clamp(contact.element.memory[j], 0.0, rest);
      transient[j] = share * contact.left * part / contact.force;
      rest -= part;
    }
    lasting = share * contact.left * rest / contact.force;
    intact = 1.0;
    recession = std::max(1.0, contact.whole_energy / contact.work);
  }
  /// Damage and relaxation of one step; returns the indentation u_e [m] of what is left.
  template <class Curve>
  double advance(const Curve& rupture, const Move& move, const LayerExtent& extent,
                 const Relaxing& relaxing) noexcept {
    const bool tears = move.depth >= move.deepest;
    if (intact > 0.0 && (tears || rupture.time > 0.0)) tear(rupture, move, extent);
    if (!tears) by_advance = 0.0;
    if (!(relaxing.only_at_rest && move.advancing))
      for (int j = 0; j < 2; ++j) transient[j] *= relaxing.left[j];
    return std::max(0.0, extent.puncture - extent.top - recession * (move.deepest - move.depth));
  }
  /// Takes force [N] and slope [N/m] of the whole contact at that indentation.
  void press(double whole, double slope) noexcept {
    const double weight = lasting + transient[0] + transient[1];
    force = intact * weight * whole;
    by_depth = by_advance < 0.0 ? by_advance * weight * whole : intact * weight * recession * slope;
  }

 private:
  template <class Curve>
  void tear(const Curve& rupture, const Move& move, const LayerExtent& extent) noexcept {
    const double advance = move.deepest - extent.puncture;
    const double curve = rupture.intact(advance), lagging = rupture.lagging(move.dt);
    if (curve < intact) intact = curve + (intact - curve) * lagging;
    by_advance = (1.0 - lagging) * rupture.slope(advance, curve);
  }
};

}  // namespace needleforce
