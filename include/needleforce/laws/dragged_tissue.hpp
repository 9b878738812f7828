// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "../law.hpp"

namespace needleforce::laws {

/// Memory of the dragged tissue, the same in both forms of the law.
template <class Real>
struct BasicDraggedTissueMemory {
  BasicElement<Real> element{};  ///< the tissue's spring [N]
  Real force = 0.0;              ///< [N]
  Real force_by_depth = 0.0;     ///< [N/m]
  Real peak = 0.0;               ///< force at puncture [N]

  void check(StateCheck& check, const char* part, double most) const noexcept {
    check.numbers(part, element);
    check.numbers(part, std::array{force, force_by_depth});
    check.number(part, peak, 0.0, most);
  }
  Real held() const noexcept { return force; }
  void take_over(const BasicTakenOver<Real>& taken) noexcept {
    element = BasicElement<Real>{taken.held};
    force = taken.held;
  }
  void release() noexcept {
    element = BasicElement<Real>{};
    force = force_by_depth = 0.0;
  }
};
using DraggedTissueMemory = BasicDraggedTissueMemory<double>;

/// The law that real recordings support: after the puncture one spring k_t with a Coulomb limit connects the
/// tissue to the shaft, and its surface follows:
///
///     u = F_e / k_t    l = z - z_r - u    -rho f' l <= F <= f' l + (F_p - f' l)+ exp(-(z_max - z_1) / delta)
///
/// rho is the friction outwards over that inwards. The rupture is gradual, and a layer that no longer pushes
/// is released when its embedded length l is zero on withdrawal. `z_r` is the resting surface, a dimple that
/// stays. Passive: the spring takes over no more energy than the contact held, which does not hold for a
/// force taken over unchanged (as fitted to recordings).
template <bool passive, class Real>
struct BasicDraggedTissue {
  Real per_length;
  Real stiffness;
  Real rupture_length;
  Real resting_surface;
  Real withdrawal_ratio = 1.0;

  static constexpr const char* name = passive ? "dragged_tissue" : "dragged_tissue_as_fitted";
  static constexpr Family family = Family::friction;
  static constexpr bool cuts = true;                   // its gradual rupture is the force at the tip
  static constexpr bool stands_alone = true;           // layers add up wherever the tip is in the others
  static constexpr bool first_order = true;            // the surface follows the spring of the step before
  static constexpr bool may_return_energy = !passive;  // spring and contact need not hold the same energy
  static constexpr const char* summary =
      passive ? "Tissue dragged by a spring with a Coulomb limit, gradual rupture, moving surface; passive."
              : "Tissue dragged by a spring with a Coulomb limit, in the form fitted to recordings; may "
                "return energy.";
  static constexpr const char* source = "layered law; eqs. (7)-(11), the Coulomb limit";
  static constexpr const char* validity =
      "Skin on muscle and gelatine at 1 to 3 mm/s, in, hold, out; other motions are extrapolation.";
  static constexpr std::array<Parameter<BasicDraggedTissue, Real>, 5> table{{
      {&BasicDraggedTissue::per_length, "per_length", "N/m", 0.0, 1e5, required, "f'",
       "friction force per embedded length while sliding", "layered law"},
      {&BasicDraggedTissue::stiffness, "stiffness", "N/m", 1e-2, 1e6, required, "k_t",
       "stiffness of the tissue dragged along", "layered law"},
      {&BasicDraggedTissue::rupture_length, "rupture_length", "m", 1e-7, 1e-1, required, "delta",
       "advance over which the force of the puncture falls to that of friction", "layered law"},
      {&BasicDraggedTissue::resting_surface, "resting_surface", "m", -5e-2, 2e-1, 0.0, "z_r - z_0",
       "depth of the dimple that stays, from the layer's undeformed top", "layered law"},
      {&BasicDraggedTissue::withdrawal_ratio, "withdrawal_ratio", "1", 1e-2, 1e2, 1.0, "rho",
       "friction outwards over friction inwards", "Okamura, Simone & O'Leary 2004"},
  }};

  const char* contradiction() const noexcept {
    return per_length * withdrawal_ratio < stiffness
               ? nullptr
               : "the friction outwards reaches stiffness: on withdrawal the surface would never be released";
  }

  struct Prepared {
    using Memory = BasicDraggedTissueMemory<Real>;
    // the surface moves with the force and may be above the undeformed one
    static constexpr bool own_surface = true;
    Real per_length, stiffness, per_rupture, resting_surface, withdrawal_ratio;

    [[gnu::noinline]] void advance(BasicShaft<Real>& shaft, Memory& memory, const BasicMove<Real>& move,
                                   const BasicLayerExtent<Real>& extent,
                                   const BasicRelaxing<Real>& relaxing) const noexcept {
      shaft.surface = extent.top + resting_surface + memory.element.elastic / stiffness;
      if (!extent.pierced) return;
      // down to the tip, through all layers: layers of dragged tissue add up
      shaft.embedded = embedded_length(move.depth, shaft.surface);
      // what still pushes the tip unloads first, as the force would jump; above the layer nothing pushes
      if (shaft.embedded == 0.0 && move.withdrawing && (memory.force <= 0.0 || move.depth <= extent.top))
        return memory.release();
      const Real grip = per_length * shaft.embedded;
      const Real above = larger(0.0, memory.peak - grip);
      const Real torn = above > 0.0 ? exp(-(move.deepest - extent.puncture) * per_rupture) : 0.0;
      const Real high = grip + above * torn;
      memory.force = memory.element.drag(stiffness * move.travel, -withdrawal_ratio * grip, high, relaxing,
                                         move.advancing);
      memory.force_by_depth = slope(shaft, memory, grip, torn, move);
    }
    void pierce(Memory& memory, const BasicContactAtPuncture<Real>& contact) const noexcept {
      memory.element = contact.element;
      memory.peak = contact.force;
      if constexpr (passive) weaken(memory.element, contact);
    }
    Real force(const BasicShaft<Real>&, const Memory& memory, Real) const noexcept { return memory.force; }
    Real by_depth(const BasicShaft<Real>&, const Memory& memory, Real) const noexcept {
      return memory.force_by_depth;
    }
    Real by_velocity(const BasicShaft<Real>&, const Memory&, Real) const noexcept { return 0.0; }
    BasicSlip<Real> slip(const BasicShaft<Real>&, const Memory& memory) const noexcept {
      return {memory.element.slipped / stiffness, memory.force};
    }

   private:
    /// No more energy than the contact held: F_e^2 / 2 k_t <= U, and for the relaxing shares, where the
    /// contact is stiffer than the spring, by the ratio of the two.
    void weaken(BasicElement<Real>& element, const BasicContactAtPuncture<Real>& contact) const noexcept {
      const Real most = sqrt(2.0 * stiffness * contact.energy);
      const Real share = element.elastic > most ? most / element.elastic : 1.0;
      const Real relaxing = contact.slope > stiffness ? sqrt(stiffness / contact.slope) : 1.0;
      element.elastic *= share;
      for (Real& memory : element.memory) memory *= smaller(share, relaxing);
    }
    /// d(force)/d(depth): the spring, or the limit it slides along.
    Real slope(const BasicShaft<Real>& shaft, const Memory& memory, Real grip, Real torn,
               const BasicMove<Real>& move) const noexcept {
      if (memory.element.stiffening > 0.0) return stiffness * memory.element.stiffening;
      if (shaft.embedded <= 0.0 && memory.force <= 0.0) return 0.0;
      if (memory.force < 0.0) return -withdrawal_ratio * per_length;
      const Real above = larger(0.0, memory.peak - grip) * torn;
      const Real tears = move.depth >= move.deepest ? above * per_rupture : 0.0;
      return per_length * (above > 0.0 ? 1.0 - torn : 1.0) - tears;
    }
  };
  Prepared prepare() const noexcept {
    return {per_length, stiffness, 1.0 / rupture_length, resting_surface, withdrawal_ratio};
  }
};

template <bool passive>
using DraggedTissue = BasicDraggedTissue<passive, double>;
using DraggedTissuePassive = DraggedTissue<true>;
using DraggedTissueAsFitted = DraggedTissue<false>;

}  // namespace needleforce::laws
