// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "../law.hpp"
#include "../rupture.hpp"
#include "dragged_tissue.hpp"

namespace needleforce::laws {

/// The tissue dragged along, and what is left of the contact.
template <class Real>
struct BasicYieldingTissueMemory : BasicDraggedTissueMemory<Real> {
  BasicRemainingContact<Real> contact{};

  void check(StateCheck& check, const char* part, double most) const noexcept {
    BasicDraggedTissueMemory<Real>::check(check, part, most);
    contact.check(check, part);
  }
  Real held() const noexcept { return this->force + contact.force; }
  void take_over(const BasicTakenOver<Real>& taken) noexcept {
    BasicDraggedTissueMemory<Real>::take_over(taken);
    contact = {};
  }
};
using YieldingTissueMemory = BasicYieldingTissueMemory<double>;

/// A layer whose contact goes over to friction along the travel after the puncture. In parallel
///
///     contact: (1 - d) w U'(u_e),  u_e = (h_p - (z_max - z))+      shaft: as `dragged_tissue`, from F_e0 on
///     F_e0 = min(f' l, F_p, 2 k_t U / F_p)                         w = 1 - F_e0 / F_p
///
/// The force is continuous at the puncture, and spring and contact begin with no more energy than the contact
/// held: passive for any parameters.
template <class Real>
struct BasicYieldingTissue {
  Real per_length;
  Real stiffness;
  Real rupture_length;
  Real resting_surface;
  Real brittleness;
  Real rupture_time;
  Real withdrawal_ratio = 1.0;

  static constexpr const char* name = "yielding_tissue";
  static constexpr Family family = Family::friction;
  static constexpr bool cuts = true;          // what is left of the contact is the force at the tip
  static constexpr bool stands_alone = true;  // as dragged_tissue
  static constexpr bool first_order = true;   // as dragged_tissue
  static constexpr const char* summary =
      "Tissue dragged by a spring with a Coulomb limit; the contact yields gradually or snaps; passive.";
  static constexpr const char* source = "layered law; Kachanov 1958; eqs. (7)-(11), the Coulomb limit";
  static constexpr const char* validity =
      "Skin on muscle and gelatine at 1 to 3 mm/s, in, hold, out; other motions are extrapolation.";
  static constexpr std::array<Parameter<BasicYieldingTissue, Real>, 7> table{{
      {&BasicYieldingTissue::per_length, "per_length", "N/m", 0.0, 1e5, required, "f'",
       "friction force per embedded length while sliding", "layered law"},
      {&BasicYieldingTissue::stiffness, "stiffness", "N/m", 1e-2, 1e6, required, "k_t",
       "stiffness of the tissue dragged along", "layered law"},
      {&BasicYieldingTissue::rupture_length, "rupture_length", "m", 1e-7, 1e-1, required, "delta",
       "advance over which the contact would be lost at the rate with which it begins to yield",
       "layered law"},
      {&BasicYieldingTissue::resting_surface, "resting_surface", "m", -5e-2, 2e-1, 0.0, "z_r - z_0",
       "depth of the dimple that stays, from the layer's undeformed top", "layered law"},
      {&BasicYieldingTissue::brittleness, "brittleness", "1", 0.0, 100.0, 0.0, "q",
       "how the rupture speeds itself up: 0 is gradual, above 1 the contact snaps after delta / q",
       "Kachanov 1958"},
      {&BasicYieldingTissue::rupture_time, "rupture_time", "s", 0.0, 1.0, 0.0, "tau_r",
       "time constant with which the contact follows its rupture, however fast the tip", "free"},
      {&BasicYieldingTissue::withdrawal_ratio, "withdrawal_ratio", "1", 1e-2, 1e2, 1.0, "rho",
       "friction outwards over friction inwards", "Okamura, Simone & O'Leary 2004"},
  }};

  const char* contradiction() const noexcept {
    return BasicDraggedTissue<true, Real>{per_length, stiffness, rupture_length, resting_surface,
                                          withdrawal_ratio}
        .contradiction();
  }

  struct Prepared {
    using Memory = BasicYieldingTissueMemory<Real>;
    static constexpr bool own_surface = true;
    static constexpr bool keeps_contact = true;  // the layer gives `press` the contact at `yield`
    typename BasicDraggedTissue<true, Real>::Prepared dragged;
    BasicRupture<Real> rupture;

    void advance(BasicShaft<Real>& shaft, Memory& memory, const BasicMove<Real>& move,
                 const BasicLayerExtent<Real>& extent, const BasicRelaxing<Real>& relaxing) const noexcept {
      if (!(move.below > 0.0 && move.below < smaller(move.travel, move.depth)))
        return dragged.advance(shaft, memory, move, extent, relaxing);
      // in the step of the puncture only the travel after it strains the tissue
      BasicMove<Real> own = move;
      own.travel = move.below;
      dragged.advance(shaft, memory, own, extent, relaxing);
    }
    Real yield(Memory& memory, const BasicMove<Real>& move, const BasicLayerExtent<Real>& extent,
               const BasicRelaxing<Real>& relaxing) const noexcept {
      return memory.contact.advance(rupture, move, extent, relaxing);
    }
    void press(Memory& memory, Real whole, Real slope) const noexcept { memory.contact.press(whole, slope); }
    void pierce(Memory& memory, const BasicContactAtPuncture<Real>& contact) const noexcept {
      const Real force = contact.whole_force, taken = taken_over(contact, force);
      memory.element =
          BasicElement<Real>{taken};  // fresh: of all states with a force it holds the least energy
      for (int j = 0; j < 2; ++j) memory.element.memory[j] = contact.relaxing.share[j] * taken;
      memory.force = taken;
      memory.peak = 0.0;  // the contact is not the spring's
      memory.contact.begin(contact, force > 0.0 ? 1.0 - taken / force : 0.0);
    }
    Real force(const BasicShaft<Real>&, const Memory& memory, Real) const noexcept { return memory.held(); }
    Real by_depth(const BasicShaft<Real>&, const Memory& memory, Real) const noexcept {
      return memory.force_by_depth + memory.contact.by_depth;
    }
    Real by_velocity(const BasicShaft<Real>&, const Memory&, Real) const noexcept { return 0.0; }
    BasicSlip<Real> slip(const BasicShaft<Real>&, const Memory& memory) const noexcept {
      return {memory.element.slipped / dragged.stiffness, memory.force};
    }

   private:
    /// The force [N] of the contact that the spring takes over: F_e0.
    Real taken_over(const BasicContactAtPuncture<Real>& contact, Real force) const noexcept {
      if (!(force > 0.0)) return 0.0;
      const Real length = contact.extent.puncture - contact.extent.top - dragged.resting_surface;
      const Real slides =
          dragged.per_length * larger(0.0, length) / (1.0 + dragged.per_length / dragged.stiffness);
      const Real energy = bounded(contact.work, 0.0, contact.whole_energy);
      return std::min({slides, force, 2.0 * dragged.stiffness * energy / force});
    }
  };
  Prepared prepare() const noexcept {
    return {{per_length, stiffness, 0.0, resting_surface, withdrawal_ratio},
            {1.0 / rupture_length, brittleness, rupture_time}};
  }
};
using YieldingTissue = BasicYieldingTissue<double>;

}  // namespace needleforce::laws
