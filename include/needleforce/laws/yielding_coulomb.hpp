// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "../law.hpp"
#include "../rupture.hpp"
#include "coulomb.hpp"

namespace needleforce::laws {

/// Friction along the shaft, and what is left of the contact.
template <class Real>
struct BasicYieldingCoulombMemory : BasicTractionMemory<Real> {
  BasicRemainingContact<Real> contact{};
  Real top = 0.0;  ///< of the layer whose contact it is [m]: the same tissue below begins with a copy

  void check(StateCheck& check, const char* part, double) const noexcept {
    check.numbers(part, static_cast<const BasicTractionMemory<Real>&>(*this));
    contact.check(check, part);
    check.number(part, top, 0.0, 1.0);
  }
  void take_over(const BasicTakenOver<Real>& taken) noexcept {
    BasicTractionMemory<Real>::take_over(taken);
    contact = {};
  }
  void release() noexcept {
    BasicTractionMemory<Real>::release();
    contact = {};
  }
};
using YieldingCoulombMemory = BasicYieldingCoulombMemory<double>;

/// Coulomb friction in a layer whose contact ruptures gradually: where the puncture law breaks it, it begins
/// to yield. With the advance s beyond that depth h_p, and the contact's force F(h), the force is
///
///     f' l + f_c + w exp(-(s / delta)^m) F(h),   w = 1 - (f' h_p + f_c) / F(h_p)
///
/// continuous at h_p, with the peak deeper than h_p. What is intact is pressed in further, and unloads along
/// its own curve. Passive: contact, shaft and cut begin with no more energy than the contact held.
template <class Real>
struct BasicYieldingCoulomb {
  Real per_length;
  Real presliding;
  Real rupture_length;
  Real exponent;

  static constexpr const char* name = "yielding_coulomb";
  static constexpr Family family = Family::friction;
  static constexpr const char* summary =
      "Coulomb friction per embedded length; the contact ruptures gradually after the puncture depth.";
  static constexpr const char* source = "eqs. (7)-(11); Weibull 1939; Daniels 1945";
  static constexpr const char* validity =
      "A straight needle; the rupture depends on the advance alone, not on speed or time.";
  static constexpr std::array<Parameter<BasicYieldingCoulomb, Real>, 4> table{{
      {&BasicYieldingCoulomb::per_length, "per_length", "N/m", 0.0, 1e5, required, "f'",
       "friction force per embedded length while sliding", "sec. 2.2"},
      {&BasicYieldingCoulomb::presliding, "presliding", "m", 1e-9, 5e-2, 20e-6, "s_0",
       "travel that takes the friction from nothing to sliding", "Dahl 1968"},
      {&BasicYieldingCoulomb::rupture_length, "rupture_length", "m", 1e-7, 1e-1, required, "delta",
       "advance over which 63 % of the contact are lost", "Weibull 1939"},
      {&BasicYieldingCoulomb::exponent, "exponent", "1", 1.0, 20.0, 2.0, "m",
       "how the rupture begins: 1 at once, from 2 on smoothly", "Weibull 1939"},
  }};

  struct Prepared {
    using Memory = BasicYieldingCoulombMemory<Real>;
    static constexpr bool keeps_contact = true;  // the layer gives `press` the contact at `yield`
    typename BasicCoulomb<Real>::Prepared shaft_law;
    BasicFibreRupture<Real> rupture;

    void advance(BasicShaft<Real>& shaft, Memory& memory, const BasicMove<Real>& move,
                 const BasicLayerExtent<Real>& extent, const BasicRelaxing<Real>& relaxing) const noexcept {
      shaft_law.advance(shaft, memory, move, extent, relaxing);
    }
    /// What is intact continues to be pressed in: deeper than the puncture by the whole advance.
    Real yield(Memory& memory, const BasicMove<Real>& move, const BasicLayerExtent<Real>& extent,
               const BasicRelaxing<Real>& relaxing) const noexcept {
      if (memory.top != extent.top) memory.contact = {};
      memory.contact.advance(rupture, move, extent, relaxing);
      return larger(0.0, move.deepest - extent.top - memory.contact.recession * (move.deepest - move.depth));
    }
    void press(Memory& memory, Real whole, Real slope) const noexcept {
      const Real tears = memory.contact.by_advance;
      memory.contact.press(whole, slope);
      if (tears < 0.0) memory.contact.by_depth += memory.contact.intact * weight(memory) * slope;
    }
    void pierce(Memory& memory, const BasicContactAtPuncture<Real>& contact) const noexcept {
      shaft_law.pierce(memory, contact);
      const Real length = embedded_length(contact.extent.puncture, contact.extent.top);
      const Real force = contact.whole_force, traction = memory.traction;
      const Real left = force - contact.cut - traction * length;
      memory.top = contact.extent.top;
      memory.contact.begin(contact, force > 0.0 && left > 0.0 ? left / force : 0.0);
      const Real stretch = traction > 0.0 ? traction / shaft_law.stiffness : 0.0;
      share_energy(memory, contact, 0.5 * traction * length * stretch);
    }
    Real force(const BasicShaft<Real>& shaft, const Memory& memory, double velocity) const noexcept {
      return shaft_law.force(shaft, memory, velocity) + memory.contact.force;
    }
    Real by_depth(const BasicShaft<Real>& shaft, const Memory& memory, double velocity) const noexcept {
      return shaft_law.by_depth(shaft, memory, velocity) + memory.contact.by_depth;
    }
    Real by_velocity(const BasicShaft<Real>&, const Memory&, Real) const noexcept { return 0.0; }
    BasicSlip<Real> slip(const BasicShaft<Real>& shaft, const Memory& memory) const noexcept {
      return shaft_law.slip(shaft, memory);
    }

   private:
    static Real weight(const Memory& memory) noexcept {
      return memory.contact.lasting + memory.contact.transient[0] + memory.contact.transient[1];
    }
    /// What is left of the contact recedes so fast that it holds what shaft and cut leave of the work done.
    /// The cut holds no more than half of its force over the travel on which it unloads, `Cut::begin`.
    static void share_energy(Memory& memory, const BasicContactAtPuncture<Real>& contact,
                             Real shaft) noexcept {
      const Real travel = contact.extent.puncture - contact.extent.top;
      const Real cut = smaller(0.5 * contact.cut * travel, contact.free_energy);
      const Real rest = contact.work - shaft - cut, held = weight(memory) * contact.whole_energy;
      if (rest > 1e-6 * held)
        memory.contact.recession = larger(memory.contact.recession, held / rest);
      else
        memory.contact = {};
    }
  };
  Prepared prepare() const noexcept {
    return {{per_length, per_length / presliding, 0.0}, {1.0 / rupture_length, exponent}};
  }
};
using YieldingCoulomb = BasicYieldingCoulomb<double>;

}  // namespace needleforce::laws
