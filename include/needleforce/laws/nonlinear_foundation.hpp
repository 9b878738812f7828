// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <type_traits>

#include "../foundation.hpp"
#include "../law.hpp"

namespace needleforce::laws {

/// Coulomb friction from the pressure p(u) of a nonlinear Winkler foundation on both sides of a shaft that
/// bends. Its hole is open by the settlement D/2; at x behind the tip the shaft is off its path by
/// w = (D/2) x / L, on the length b behind the tip, so that one side settles by D/2 + w and the other by
/// D/2 - w, not below 0, where it loses contact. With P the energy of p, and X = min(l, b) / L,
///
///     f = f' l m(l)      l m = L [P(1 + X) - P(max(0, 1 - X))] / 2 p(1) + l - min(l, b)
///
/// m = 1 for a linear foundation in contact on both sides, for a straight shaft, and for a short one: there
/// it is the paper's line. Elastic slip as in `coulomb`.
template <class Form, class Real>
struct BasicNonlinearFoundation {
  Real per_length;
  Real settlement_ratio;
  Real deflection_length;
  Real bending_length;
  Real presliding;
  Real dimple_ratio;

  static constexpr bool is_cubic = std::is_same_v<Form, foundations::Cubic>;
  static constexpr bool is_hyperbolic = std::is_same_v<Form, foundations::Hyperbolic>;
  static constexpr const char* name = is_cubic        ? "cubic_foundation"
                                      : is_hyperbolic ? "hyperbolic_foundation"
                                                      : "tanh_foundation";
  static constexpr Family family = Family::friction;
  // where the limit rises with depth faster than the elastic slip, the least limit on the way is missed
  static constexpr bool first_order = true;
  static constexpr const char* summary =
      is_cubic ? "Friction of a bent shaft on a foundation that hardens, p = k_1 u + k_3 u^3."
      : is_hyperbolic
          ? "Friction of a bent shaft on a foundation that softens, p = k_1 u / (1 + k_1 u / p_u)."
          : "Friction of a bent shaft on a foundation that softens, p = p_u tanh(k_1 u / p_u).";
  static constexpr const char* source =
      "eqs. (7)-(11) and sec. 3, future work; free: offset of the shaft linear behind the tip";
  static constexpr const char* validity =
      "A shaft that bends in one plane, small slopes; no dependence on speed. A log separates "
      "settlement_ratio from deflection_length where one side loses contact.";
  static constexpr std::array<Parameter<BasicNonlinearFoundation, Real>, 6> table{{
      {&BasicNonlinearFoundation::per_length, "per_length", "N/m", 0.0, 1e5, required, "f'",
       "friction force per embedded length while sliding, of a straight shaft", "sec. 2.2"},
      {&BasicNonlinearFoundation::settlement_ratio, "settlement_ratio", "1", 0.0, 10.0, required, "r",
       is_cubic ? "settlement D/2 over sqrt(k_1 / k_3); 0 is a linear foundation"
                : "settlement D/2 over p_u / k_1; 0 is a linear foundation",
       "sec. 3, future work"},
      {&BasicNonlinearFoundation::deflection_length, "deflection_length", "m", 1e-3, 1e2, required, "L",
       "length behind the tip over which the shaft's offset from its path grows to D/2", "free: geometry"},
      {&BasicNonlinearFoundation::bending_length, "bending_length", "m", 1e-4, 1.0, 1.0, "b",
       "length behind the tip over which the shaft is off its path", "free: geometry"},
      {&BasicNonlinearFoundation::presliding, "presliding", "m", 1e-9, 5e-2, 20e-6, "s_0",
       "travel that takes the friction of a straight shaft from nothing to sliding", "Dahl 1968"},
      {&BasicNonlinearFoundation::dimple_ratio, "dimple_ratio", "1", 0.0, 1.0, 0.0, "z_s/z_1",
       "share of the puncture depth at which the surface stays: 0 undeformed, 1 deformed", "sec. 2.4"},
  }};

  struct Prepared {
    struct Memory : BasicTractionMemory<Real> {
      Real limit_by_depth = 0.0;  ///< of the sliding friction per embedded length, while it slips [N/m^2]
    };

    Real per_length;
    Real stiffness;  // of the element per length [N/m^2]
    Real dimple_ratio;
    Real ratio, by_length;  // settlement D/2 over u_c, and what the offset adds to it a length [1/m]
    Real bending_length;
    Real unit;  // 1 / (by_length pressure(ratio)) [m]

    Real surface(Real top, Real puncture) const noexcept { return top + dimple_ratio * (puncture - top); }
    /// The embedded length l times the mean m [m], and its derivative.
    struct Mean {
      Real length, slope;
    };
    Mean effective(Real embedded) const noexcept {
      const Real bent = smaller(embedded, bending_length);
      const Real x = bent * by_length;
      const bool contact = x <= ratio;  // on both sides
      const Real least = larger(0.0, ratio - x);
      const Real whole = contact ? Form::both(ratio, x) : 0.5 * Form::energy(ratio + x);
      const Real slope = 0.5 * (Form::pressure(ratio + x) + Form::pressure(least)) / Form::pressure(ratio);
      return {unit * whole + (embedded - bent), embedded < bending_length ? slope : 1.0};
    }
    Real sliding(Real embedded, double v) const noexcept {
      return copysign(per_length, v) * effective(embedded).length;
    }
    /// The sliding friction per length [N/m] of a shaft of that length.
    Real limit(Real length) const noexcept {
      const Real measured = larger(shortest, length);
      return per_length * effective(measured).length / measured;
    }
    /// Drags the tissue along the whole shaft with its mean traction. That limit depends on the length down
    /// to the tip, through all layers, so that a layer divided in two remains the same tissue. Any limit that
    /// depends on the depth alone is passive: docs/decisions/0015-nonlinear-foundation.md.
    [[gnu::noinline]] void advance(BasicShaft<Real>& shaft, Memory& memory, const BasicMove<Real>& move,
                                   const BasicLayerExtent<Real>& extent,
                                   const BasicRelaxing<Real>& relaxing) const noexcept {
      shaft.embed(extent, move.depth, surface(extent.top, extent.puncture));
      const Real above = larger(0.0, shaft.surface - extent.root);
      const Real length = larger(shortest, shaft.embedded > 0.0 ? move.depth - shaft.surface + above : 1.0);
      const Mean mean = effective(length);
      const Real most = per_length * mean.length / length;
      const auto [low, high] = shaft.limits(extent, stiffness, -most, most);
      memory.traction = memory.element.drag(stiffness * move.below, low, high, relaxing, move.advancing);
      memory.limit_by_depth = 0.0;
      if (memory.element.stiffening != 0.0 || !(shaft.embedded > 0.0)) return;
      const Real rise = per_length * (mean.slope - mean.length / length) / length;
      const bool grows = memory.traction > 0.0 && high < most;  // with the energy that a new length holds
      memory.limit_by_depth = grows ? 2.0 * stiffness : copysign(1.0, memory.traction) * rise;
    }
    void pierce(Memory& memory, const BasicContactAtPuncture<Real>& contact) const noexcept {
      const Real length =
          embedded_length(contact.depth, surface(contact.extent.top, contact.extent.puncture));
      memory.pierce(contact, length, stiffness, length > 0.0 ? limit(length) : 0.0);
    }
    Real force(const BasicShaft<Real>& shaft, const Memory& memory, Real) const noexcept {
      return memory.traction * shaft.embedded;
    }
    Real by_depth(const BasicShaft<Real>& shaft, const Memory& memory, Real) const noexcept {
      const Real loading = stiffness * memory.element.stiffening + memory.limit_by_depth;
      return memory.traction * shaft.embedded_by_depth + loading * shaft.embedded;
    }
    Real by_velocity(const BasicShaft<Real>&, const Memory&, Real) const noexcept { return 0.0; }
    BasicSlip<Real> slip(const BasicShaft<Real>& shaft, const Memory& memory) const noexcept {
      return slip_along(shaft, memory.traction, memory.element.slipped / stiffness, stiffness);
    }
  };
  Prepared prepare() const noexcept {
    const Real ratio = at_least(settlement_ratio, negligible_ratio), by_length = ratio / deflection_length;
    const Real unit = 1.0 / (by_length * Form::pressure(ratio));
    return {per_length, per_length / presliding, dimple_ratio, ratio, by_length, bending_length, unit};
  }

 private:
  static constexpr double negligible_ratio = 1e-12;  // every form is linear to rounding there
  static constexpr double shortest = 1e-12;          // [m], below an atom, where the mean is 1
};

template <class Form>
using NonlinearFoundation = BasicNonlinearFoundation<Form, double>;
using CubicFoundation = NonlinearFoundation<foundations::Cubic>;
using HyperbolicFoundation = NonlinearFoundation<foundations::Hyperbolic>;
using TanhFoundation = NonlinearFoundation<foundations::Tanh>;

}  // namespace needleforce::laws
