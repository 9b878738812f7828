// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "../law.hpp"

namespace needleforce::laws {

/// f = f' l s: Coulomb friction per embedded length l, with an elastic-slip state s in [-1, 1] that follows
/// the change of depth. Sliding gives s = +-1, the paper's law; at rest s keeps its value, so a hold keeps
/// its friction, but for what relaxes. Long presliding is tissue dragged along before it slides.
template <class Real>
struct BasicCoulomb {
  Real per_length;
  Real presliding;
  Real dimple_ratio;

  static constexpr const char* name = "coulomb";
  static constexpr Family family = Family::friction;
  static constexpr bool monotone = true;
  static constexpr const char* summary =
      "Coulomb friction per embedded length, reversing over a short elastic travel.";
  static constexpr const char* source = "eqs. (7)-(11); Dahl 1968, elastic-slip element";
  static constexpr const char* validity =
      "A straight needle: the paper sees it break down beyond 12 mm. No dependence on speed.";
  static constexpr std::array<Parameter<BasicCoulomb, Real>, 3> table{{
      {&BasicCoulomb::per_length, "per_length", "N/m", 0.0, 1e5, required, "f'",
       "friction force per embedded length while sliding", "sec. 2.2"},
      {&BasicCoulomb::presliding, "presliding", "m", 1e-9, 5e-2, 20e-6, "s_0",
       "travel that takes the friction from nothing to sliding", "Dahl 1968"},
      {&BasicCoulomb::dimple_ratio, "dimple_ratio", "1", 0.0, 1.0, 0.0, "z_s/z_1",
       "share of the puncture depth at which the surface stays: 0 undeformed, 1 deformed", "sec. 2.4"},
  }};

  struct Prepared {
    using Memory = BasicTractionMemory<Real>;
    Real per_length;
    Real stiffness;  // of the element per length [N/m^2]
    Real dimple_ratio;
    Real surface(Real top, Real puncture) const noexcept { return top + dimple_ratio * (puncture - top); }
    Real sliding(Real embedded, double v) const noexcept { return copysign(per_length, v) * embedded; }
    template <class Motion>
    [[gnu::always_inline]] void advance(BasicShaft<Real>& shaft, Memory& memory, const Motion& move,
                                        const BasicLayerExtent<Real>& extent,
                                        const BasicRelaxing<Real>& relaxing) const noexcept {
      shaft.embed(extent, move.depth, surface(extent.top, extent.puncture));
      slide(shaft, memory, move, extent, relaxing);
    }
    /// Drags the tissue along the embedded shaft. Inlined by force: as a call it takes a third of the
    /// shortest step, for move and relaxation then go through memory.
    template <class Motion>
    [[gnu::always_inline]] void slide(const BasicShaft<Real>& shaft, Memory& memory, const Motion& move,
                                      const BasicLayerExtent<Real>& extent,
                                      const BasicRelaxing<Real>& relaxing) const noexcept {
      // a branch, so that the usual step does not wait for the embedded length
      if (2.0 * stiffness * shaft.embedded >= per_length && shaft.embedded > 0.0) [[likely]]
        memory.traction =
            memory.element.drag(stiffness * move.below, -per_length, per_length, relaxing, move.advancing);
      else
        take_hold(shaft, memory, move, extent, relaxing);
    }
    /// Drags the tissue along a shaft that is short, or not in the tissue.
    template <class Motion>
    [[gnu::noinline]] void take_hold(const BasicShaft<Real>& shaft, Memory& memory, const Motion& move,
                                     const BasicLayerExtent<Real>& extent,
                                     const BasicRelaxing<Real>& relaxing) const noexcept {
      const auto [low, high] = shaft.limits(extent, stiffness, -per_length, per_length);
      memory.traction = memory.element.drag(stiffness * move.below, low, high, relaxing, move.advancing);
    }
    void pierce(Memory& memory, const BasicContactAtPuncture<Real>& contact) const noexcept {
      const Real from = surface(contact.extent.top, contact.extent.puncture);
      memory.pierce(contact, embedded_length(contact.depth, from), stiffness, per_length);
    }
    Real force(const BasicShaft<Real>& shaft, const Memory& memory, Real) const noexcept {
      return memory.traction * shaft.embedded;
    }
    Real by_depth(const BasicShaft<Real>& shaft, const Memory& memory, Real) const noexcept {
      return memory.traction * shaft.embedded_by_depth +
             stiffness * memory.element.stiffening * shaft.embedded;
    }
    Real by_velocity(const BasicShaft<Real>&, const Memory&, Real) const noexcept { return 0.0; }
    BasicSlip<Real> slip(const BasicShaft<Real>& shaft, const Memory& memory) const noexcept {
      return slip_along(shaft, memory.traction, memory.element.slipped / stiffness, stiffness);
    }
  };
  Prepared prepare() const noexcept { return {per_length, per_length / presliding, dimple_ratio}; }
};
using Coulomb = BasicCoulomb<double>;

}  // namespace needleforce::laws
