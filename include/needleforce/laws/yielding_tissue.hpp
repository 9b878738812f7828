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
struct YieldingTissueMemory : DraggedTissueMemory {
  RemainingContact contact{};

  void check(StateCheck& check, const char* part, double most) const noexcept {
    DraggedTissueMemory::check(check, part, most);
    contact.check(check, part);
  }
  double held() const noexcept { return force + contact.force; }
  void take_over(const TakenOver& taken) noexcept {
    DraggedTissueMemory::take_over(taken);
    contact = {};
  }
};

/// A layer whose contact goes over to friction along the travel after the puncture. In parallel
///
///     contact: (1 - d) w U'(u_e),  u_e = (h_p - (z_max - z))+      shaft: as `dragged_tissue`, from F_e0 on
///     F_e0 = min(f' l, F_p, 2 k_t U / F_p)                         w = 1 - F_e0 / F_p
///
/// The force is continuous at the puncture, and spring and contact begin with no more energy than the contact
/// held: passive for any parameters.
struct YieldingTissue {
  double per_length;
  double stiffness;
  double rupture_length;
  double resting_surface;
  double brittleness;
  double rupture_time;
  double withdrawal_ratio = 1.0;

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
  static constexpr std::array<Parameter<YieldingTissue>, 7> table{{
      {&YieldingTissue::per_length, "per_length", "N/m", 0.0, 1e5, required, "f'",
       "friction force per embedded length while sliding", "layered law"},
      {&YieldingTissue::stiffness, "stiffness", "N/m", 1e-2, 1e6, required, "k_t",
       "stiffness of the tissue dragged along", "layered law"},
      {&YieldingTissue::rupture_length, "rupture_length", "m", 1e-7, 1e-1, required, "delta",
       "advance over which the contact would be lost at the rate with which it begins to yield",
       "layered law"},
      {&YieldingTissue::resting_surface, "resting_surface", "m", -5e-2, 2e-1, 0.0, "z_r - z_0",
       "depth of the dimple that stays, from the layer's undeformed top", "layered law"},
      {&YieldingTissue::brittleness, "brittleness", "1", 0.0, 100.0, 0.0, "q",
       "how the rupture speeds itself up: 0 is gradual, above 1 the contact snaps after delta / q",
       "Kachanov 1958"},
      {&YieldingTissue::rupture_time, "rupture_time", "s", 0.0, 1.0, 0.0, "tau_r",
       "time constant with which the contact follows its rupture, however fast the tip", "free"},
      {&YieldingTissue::withdrawal_ratio, "withdrawal_ratio", "1", 1e-2, 1e2, 1.0, "rho",
       "friction outwards over friction inwards", "Okamura, Simone & O'Leary 2004"},
  }};

  const char* contradiction() const noexcept {
    return DraggedTissuePassive{per_length, stiffness, rupture_length, resting_surface, withdrawal_ratio}
        .contradiction();
  }

  struct Prepared {
    using Memory = YieldingTissueMemory;
    static constexpr bool own_surface = true;
    static constexpr bool keeps_contact = true;  // the layer gives `press` the contact at `yield`
    DraggedTissuePassive::Prepared dragged;
    Rupture rupture;

    void advance(Shaft& shaft, Memory& memory, const Move& move, const LayerExtent& extent,
                 const Relaxing& relaxing) const noexcept {
      if (!(move.below > 0.0 && move.below < std::min(move.travel, move.depth)))
        return dragged.advance(shaft, memory, move, extent, relaxing);
      // in the step of the puncture only the travel after it strains the tissue
      Move own = move;
      own.travel = move.below;
      dragged.advance(shaft, memory, own, extent, relaxing);
    }
    double yield(Memory& memory, const Move& move, const LayerExtent& extent,
                 const Relaxing& relaxing) const noexcept {
      return memory.contact.advance(rupture, move, extent, relaxing);
    }
    void press(Memory& memory, double whole, double slope) const noexcept {
      memory.contact.press(whole, slope);
    }
    void pierce(Memory& memory, const ContactAtPuncture& contact) const noexcept {
      const double force = contact.whole_force, taken = taken_over(contact, force);
      memory.element = Element{taken};  // fresh: of all states with a force it holds the least energy
      for (int j = 0; j < 2; ++j) memory.element.memory[j] = contact.relaxing.share[j] * taken;
      memory.force = taken;
      memory.peak = 0.0;  // the contact is not the spring's
      memory.contact.begin(contact, force > 0.0 ? 1.0 - taken / force : 0.0);
    }
    double force(const Shaft&, const Memory& memory, double) const noexcept { return memory.held(); }
    double by_depth(const Shaft&, const Memory& memory, double) const noexcept {
      return memory.force_by_depth + memory.contact.by_depth;
    }
    double by_velocity(const Shaft&, const Memory&, double) const noexcept { return 0.0; }
    Slip slip(const Shaft&, const Memory& memory) const noexcept {
      return {memory.element.slipped / dragged.stiffness, memory.force};
    }

   private:
    /// The force [N] of the contact that the spring takes over: F_e0.
    double taken_over(const ContactAtPuncture& contact, double force) const noexcept {
      if (!(force > 0.0)) return 0.0;
      const double length = contact.extent.puncture - contact.extent.top - dragged.resting_surface;
      const double slides =
          dragged.per_length * std::max(0.0, length) / (1.0 + dragged.per_length / dragged.stiffness);
      const double energy = std::clamp(contact.work, 0.0, contact.whole_energy);
      return std::min({slides, force, 2.0 * dragged.stiffness * energy / force});
    }
  };
  Prepared prepare() const noexcept {
    return {{per_length, stiffness, 0.0, resting_surface, withdrawal_ratio},
            {1.0 / rupture_length, brittleness, rupture_time}};
  }
};

}  // namespace needleforce::laws
