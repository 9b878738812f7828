// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "coulomb.hpp"

namespace needleforce::laws {

/// Coulomb friction whose depth origin is a surface that recovers: from the puncture depth z_1 it returns as
/// exp(-t/tau) to where a flat punch of the needle's radius would hold it against the forces on the needle,
/// z_res = (f_c + f' l) / k, l = z - z_res, never deeper than z_1; on withdrawal it is pulled up by -f' l /
/// k.
template <class Real>
struct BasicRelaxingSurface {
  Real per_length;
  Real presliding;
  Real recovery_time;
  Real surface_stiffness;
  Real tip_force;

  static constexpr const char* name = "relaxing_surface";
  static constexpr Family family = Family::friction;
  static constexpr bool first_order = true;    // the surface follows the traction of the step before
  static constexpr bool needs_surface = true;  // it is the creep of the tissue's surface, which has but one
  static constexpr const char* summary =
      "Coulomb friction per embedded length below a surface that recovers after the puncture.";
  static constexpr const char* source = "eqs. (7)-(11); Sneddon 1965, static balance of a flat punch";
  static constexpr const char* validity =
      "An order of magnitude for the dimple: the surface around a needle is no flat punch.";
  static constexpr std::array<Parameter<BasicRelaxingSurface, Real>, 5> table{{
      {&BasicRelaxingSurface::per_length, "per_length", "N/m", 0.0, 1e5, required, "f'",
       "friction force per embedded length while sliding", "sec. 2.2"},
      {&BasicRelaxingSurface::presliding, "presliding", "m", 1e-9, 5e-2, 20e-6, "s_0",
       "travel that takes the friction from nothing to sliding", "Dahl 1968"},
      {&BasicRelaxingSurface::recovery_time, "recovery_time", "s", 1e-6, 1e5, required, "tau",
       "time constant with which the dimple recovers", "free: exponential recovery"},
      {&BasicRelaxingSurface::surface_stiffness, "surface_stiffness", "N/m", 1e-3, 1e9, required, "2 E_r R",
       "stiffness of the surface against the needle, a flat punch of its radius", "Sneddon 1965"},
      {&BasicRelaxingSurface::tip_force, "tip_force", "N", 0.0, 1e3, 0.0, "f_c",
       "force at the tip that holds the surface down in addition to friction",
       "Sneddon 1965, static balance"},
  }};

  const char* contradiction() const noexcept {
    return surface_stiffness > per_length
               ? nullptr
               : "surface_stiffness does not exceed per_length: the surface would follow the needle for ever";
  }

  struct Prepared {
    struct Memory : BasicTractionMemory<Real> {
      Real dimple = 1.0;               ///< share of the surface's dimple that has not recovered
      Real embedded_by_stretch = 0.0;  ///< d(embedded) / d(traction / per_length) [m]

      void take_over(const BasicTakenOver<Real>& taken) noexcept {
        BasicTractionMemory<Real>::take_over(taken);
        if (taken.pierced) dimple = taken.dimple;
      }
    };

    typename BasicCoulomb<Real>::Prepared coulomb;
    Real per_time, surface_stiffness, tip_force, presliding;

    /// Where the surface comes to rest, and how that changes with the tip's depth and with the shaft's
    /// traction over its limit.
    struct Rest {
      Real depth, by_depth, by_stretch;
    };
    /// Balance of the surface against what drags it: z_res = (f_c + p l) / k with l = z - z_res. On
    /// withdrawal the traction p is negative, the tip no longer pushes, and the surface is pulled up.
    Rest resting(const BasicLayerExtent<Real>& extent, Real depth, Real traction) const noexcept {
      const Real length = larger(0.0, depth - extent.top), k = surface_stiffness + traction;
      const Real push = coulomb.per_length > 0.0 ? bounded(traction / coulomb.per_length, 0.0, 1.0) : 1.0;
      const Real rest = (tip_force * push + traction * length) / k;
      if (extent.top + rest >= extent.puncture) return {extent.puncture, 0.0, 0.0};
      const Real pushing = push > 0.0 && push < 1.0 ? tip_force : 0.0;
      return {extent.top + rest, length > 0.0 ? traction / k : 0.0,
              (pushing + (length - rest) * coulomb.per_length) / k};
    }
    /// Sets the embedded length below the surface, which the traction holds down.
    Rest embed(BasicShaft<Real>& shaft, const Memory& memory, const BasicMove<Real>& move,
               const BasicLayerExtent<Real>& extent) const noexcept {
      const Rest rest = resting(extent, move.depth - move.shift, memory.traction);
      shaft.embed(extent, move.depth, rest.depth + (extent.puncture - rest.depth) * memory.dimple);
      return rest;
    }
    [[gnu::noinline]] void advance(BasicShaft<Real>& shaft, Memory& memory, const BasicMove<Real>& move,
                                   const BasicLayerExtent<Real>& extent,
                                   const BasicRelaxing<Real>& relaxing) const noexcept {
      const Real before = shaft.embedded;
      if (extent.pierced) memory.dimple *= exp(-move.dt * per_time);
      embed(shaft, memory, move, extent);
      // what the surface adds to the shaft is not strained yet
      const Real bottom = extent.bottom, last = move.depth - move.travel;
      const Real kept = larger(0.0, before + smaller(move.depth, bottom) - smaller(last, bottom));
      if (shaft.embedded > kept) memory.thin(kept / shaft.embedded);
      coulomb.slide(shaft, memory, move, extent, relaxing);
      const Real strained = shaft.embedded;
      const Rest rest = embed(shaft, memory, move, extent);
      if (shaft.embedded > strained) memory.thin(strained / shaft.embedded);
      const Real recovered = shaft.embedded > 0.0 ? 1.0 - memory.dimple : 0.0;
      shaft.embedded_by_depth -= recovered * rest.by_depth;
      memory.embedded_by_stretch = -recovered * rest.by_stretch;
    }
    void pierce(Memory&, const BasicContactAtPuncture<Real>&) const noexcept {}
    Real force(const BasicShaft<Real>& shaft, const Memory& memory, double velocity) const noexcept {
      return coulomb.force(shaft, memory, velocity);
    }
    Real by_depth(const BasicShaft<Real>& shaft, const Memory& memory, double velocity) const noexcept {
      const Real stretching = memory.element.stiffening / presliding;
      return coulomb.by_depth(shaft, memory, velocity) +
             memory.traction * memory.embedded_by_stretch * stretching;
    }
    Real by_velocity(const BasicShaft<Real>&, const Memory&, Real) const noexcept { return 0.0; }
    BasicSlip<Real> slip(const BasicShaft<Real>& shaft, const Memory& memory) const noexcept {
      BasicSlip<Real> slip = coulomb.slip(shaft, memory);
      // the surface stays where the law felt the tip: all of a travel that it does not feel lengthens the
      // shaft
      slip.by_depth = shaft.embedded_by_depth != 0.0 ? memory.traction : 0.0;
      return slip;
    }
  };
  Prepared prepare() const noexcept {
    return {BasicCoulomb<Real>{per_length, presliding, 0.0}.prepare(), 1.0 / recovery_time, surface_stiffness,
            tip_force, presliding};
  }
};
using RelaxingSurface = BasicRelaxingSurface<double>;

}  // namespace needleforce::laws
