// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "../law.hpp"

namespace needleforce::laws {

/// Modified Karnopp friction per embedded length, asymmetric (p inwards, n outwards):
///
///     v >= dv/2: C_p + b_p v        v <= -dv/2: C_n + b_n v        between: at most D_p, at least D_n
///
/// In the band the source balances the other forces on the needle, which a prescribed motion does not have:
/// an elastic element in series replaces them. The constants outwards are negative, so friction
/// dissipates.
template <class Real>
struct BasicKarnopp {
  Real coulomb_in;
  Real coulomb_out;
  Real viscous_in;
  Real viscous_out;
  Real static_in;
  Real static_out;
  Real static_band;
  Real presliding;

  static constexpr const char* name = "karnopp";
  static constexpr Family family = Family::friction;
  static constexpr bool breaks_loose = true;  // from the limit at rest to that of sliding, at once
  static constexpr const char* summary =
      "Modified Karnopp friction per embedded length: Coulomb, viscous and static, other inwards than "
      "outwards.";
  static constexpr const char* source = "Simone & Okamura 2002; Okamura, Simone & O'Leary 2004; Karnopp 1985";
  static constexpr const char* validity = "Needle and tissue of its fit, speeds between those of its fit.";
  static constexpr std::array<Parameter<BasicKarnopp, Real>, 8> table{{
      {&BasicKarnopp::coulomb_in, "coulomb_in", "N/m", 0.0, 1e5, required, "C_p",
       "sliding friction per length inwards, without its viscous part", "Okamura, Simone & O'Leary 2004"},
      {&BasicKarnopp::coulomb_out, "coulomb_out", "N/m", -1e5, 0.0, required, "C_n",
       "the same outwards, negative", "Okamura, Simone & O'Leary 2004"},
      {&BasicKarnopp::viscous_in, "viscous_in", "N s/m^2", 0.0, 1e7, required, "b_p",
       "viscous friction per length inwards", "Okamura, Simone & O'Leary 2004"},
      {&BasicKarnopp::viscous_out, "viscous_out", "N s/m^2", 0.0, 1e7, required, "b_n",
       "the same outwards, positive", "Okamura, Simone & O'Leary 2004"},
      {&BasicKarnopp::static_in, "static_in", "N/m", 0.0, 1e5, required, "D_p",
       "greatest friction per length at rest, against going in", "Okamura, Simone & O'Leary 2004"},
      {&BasicKarnopp::static_out, "static_out", "N/m", -1e5, 0.0, required, "D_n",
       "the same against going out, negative", "Okamura, Simone & O'Leary 2004"},
      {&BasicKarnopp::static_band, "static_band", "m/s", 1e-9, 1e-1, 1e-4, "dv",
       "width of the band of velocity that counts as rest", "Karnopp 1985"},
      {&BasicKarnopp::presliding, "presliding", "m", 1e-9, 5e-2, 20e-6, "s_0",
       "travel that takes the friction from nothing to its limit at rest", "free: elastic element in series"},
  }};

  const char* contradiction() const noexcept {
    return static_in >= coulomb_in && static_out <= coulomb_out
               ? nullptr
               : "static_in below coulomb_in, or static_out above coulomb_out: at rest it would hold less "
                 "than it slides with";
  }

  struct Prepared;
  Prepared prepare() const noexcept;
};
using Karnopp = BasicKarnopp<double>;

template <class Real>
struct BasicKarnopp<Real>::Prepared {
  struct Memory : BasicTractionMemory<Real> {
    bool slides = false;

    void take_over(const BasicTakenOver<Real>& taken) noexcept {
      BasicTractionMemory<Real>::take_over(taken);
      slides = false;
    }
    void release() noexcept {
      BasicTractionMemory<Real>::release();
      slides = false;
    }
    void check(StateCheck& check, const char* part, double) const noexcept {
      check.numbers(part, static_cast<const BasicTractionMemory<Real>&>(*this));
      check.flag(part, slides);
    }
  };

  BasicKarnopp<Real> law;
  Real stiffness;  // of the element per length [N/m^2]

  bool inwards(double v) const noexcept { return v >= 0.5 * law.static_band; }
  bool outwards(double v) const noexcept { return v <= -0.5 * law.static_band; }
  Real high(double v) const noexcept {
    return inwards(v) ? law.coulomb_in + law.viscous_in * v : law.static_in;
  }
  Real low(double v) const noexcept {
    return outwards(v) ? law.coulomb_out + law.viscous_out * v : law.static_out;
  }
  Real surface(Real top, Real) const noexcept { return top; }
  Real sliding(Real embedded, double v) const noexcept {
    return embedded *
           (std::signbit(v) ? law.coulomb_out + law.viscous_out * v : law.coulomb_in + law.viscous_in * v);
  }
  /// Loads the element between limits that may have fallen below its force.
  void load(Memory& memory, const BasicMove<Real>& move, const BasicTraction<Real>& limits,
            const BasicRelaxing<Real>& relaxing) const noexcept {
    const auto [low, high] = limits;
    memory.element.yield(memory.traction, low, high, relaxing);
    memory.traction = memory.element.drag(stiffness * move.below, low, high, relaxing, move.advancing);
  }
  /// Sticks until the limit at rest is reached, at any speed of the needle: the slip has no speed then.
  /// Then slides until the needle rests or reverses.
  [[gnu::noinline]] void advance(BasicShaft<Real>& shaft, Memory& memory, const BasicMove<Real>& move,
                                 const BasicLayerExtent<Real>& extent,
                                 const BasicRelaxing<Real>& relaxing) const noexcept {
    shaft.embed(extent, move.depth, extent.top);
    const double v = move.velocity;
    if (move.waits) {  // neither sticks nor slides anew, but relaxes
      const Real limit = abs(memory.traction);
      memory.traction = memory.element.drag(0.0, -limit, limit, relaxing, move.advancing);
      return;
    }
    const bool moves = inwards(v) || outwards(v);
    memory.slides = memory.slides && moves && !(memory.traction * v < 0.0);
    if (!memory.slides) {
      const Memory before = memory;
      load(memory, move, shaft.limits(extent, stiffness, law.static_out, law.static_in), relaxing);
      if (moves && memory.element.stiffening == 0.0) memory = before, memory.slides = true;
    }
    if (memory.slides) load(memory, move, shaft.limits(extent, stiffness, low(v), high(v)), relaxing);
  }
  void pierce(Memory& memory, const BasicContactAtPuncture<Real>& contact) const noexcept {
    memory.pierce(contact, embedded_length(contact.depth, contact.extent.top), stiffness, law.coulomb_in);
  }
  Real force(const BasicShaft<Real>& shaft, const Memory& memory, Real) const noexcept {
    return memory.traction * shaft.embedded;
  }
  Real by_depth(const BasicShaft<Real>& shaft, const Memory& memory, Real) const noexcept {
    return memory.traction * shaft.embedded_by_depth + stiffness * memory.element.stiffening * shaft.embedded;
  }
  BasicSlip<Real> slip(const BasicShaft<Real>& shaft, const Memory& memory) const noexcept {
    return slip_along(shaft, memory.traction, memory.element.slipped / stiffness, stiffness);
  }
  Real by_velocity(const BasicShaft<Real>& shaft, const Memory& memory, double v) const noexcept {
    if (memory.element.stiffening > 0.0 || !memory.slides) return 0.0;
    return shaft.embedded * (inwards(v) ? law.viscous_in : outwards(v) ? law.viscous_out : 0.0);
  }
};

template <class Real>
inline typename BasicKarnopp<Real>::Prepared BasicKarnopp<Real>::prepare() const noexcept {
  return {*this, std::max({static_in, -static_out, coulomb_in, -coulomb_out}) / presliding};
}

}  // namespace needleforce::laws
