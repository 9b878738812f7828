// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <numbers>

#include "constant_cutting.hpp"

namespace needleforce::laws {

/// F = J a_c + (pi/4) E' R^2: the energy of the crack that the tip opens, and of holding the slit open for
/// the shaft. The second part is a state: it acts during insertion, also in an existing hole, and its
/// share `recovered` is returned during withdrawal as the slit closes behind the tip.
template <class Real>
struct BasicFracture {
  Real toughness;
  Real crack_length;
  Real plane_strain_modulus;
  Real radius;
  Real recovered;
  Real unloading;

  static constexpr const char* name = "fracture";
  static constexpr Family family = Family::cutting;
  static constexpr bool monotone = true;
  static constexpr bool cuts = true;
  static constexpr const char* summary = "Fracture work of the crack at the tip and work of spreading it.";
  static constexpr const char* source = "Azar & Hayward 2008; Sneddon 1946, pressurised crack";
  static constexpr const char* validity =
      "A sharp rigid needle in quasi-static steady cutting; spreading in linear elasticity.";
  static constexpr std::array<Parameter<BasicFracture, Real>, 6> table{{
      {&BasicFracture::toughness, "toughness", "J/m^2", 0.0, 1e6, required, "J",
       "fracture toughness of the tissue", "Azar & Hayward 2008"},
      {&BasicFracture::crack_length, "crack_length", "m", 1e-6, 1e-1, required, "a_c",
       "width of the crack across the needle: D for a slit, pi D / 2 for half the perimeter",
       "Azar & Hayward 2008"},
      {&BasicFracture::plane_strain_modulus, "plane_strain_modulus", "Pa", 0.0, 1e10, 0.0, "E'",
       "E / (1 - nu^2) of the tissue that is spread; 0 leaves spreading out", "Sneddon 1946"},
      {&BasicFracture::radius, "radius", "m", 0.0, 1e-1, 0.0, "R", "half width to which the slit is spread",
       "Sneddon 1946"},
      {&BasicFracture::recovered, "recovered", "1", 0.0, 1.0, 0.0, "Lambda",
       "share of the work of spreading that comes back on withdrawal", "Azar & Hayward 2008"},
      {&BasicFracture::unloading, "unloading", "m", 1e-9, 5e-2, 20e-6, "s_c",
       "travel over which either force reverses", "free: elastic unloading"},
  }};

  /// Work of spreading over advance [N].
  Real spreading() const noexcept { return 0.25 * std::numbers::pi * plane_strain_modulus * radius * radius; }

  struct Prepared {
    struct Memory {
      Real opened = 0.0;  ///< share of the slit that is open
    };

    typename BasicConstantCutting<Real>::Prepared crack;
    Real spread, recovered;

    Real steady(Real = 0.0) const noexcept { return crack.full + spread; }
    void enter(BasicCut<Real>& cut, Memory& memory, Real depth, Real carried) const noexcept {
      if (carried < 0.0) cut.entry = depth, memory.opened = 1.0;
      cut.front = depth;
    }
    [[gnu::noinline]] void advance(BasicCut<Real>& cut, Memory& memory,
                                   const BasicMove<Real>& move) const noexcept {
      NoMemory none;
      crack.advance(cut, none, move);
      const Real held = cut.held * crack.per_travel;
      memory.opened = bounded(memory.opened + move.travel * crack.per_travel, -held, 1.0 + held);
    }
    Real forceless(const BasicCut<Real>& cut, Real depth) const noexcept {
      return crack.forceless(cut, depth);
    }
    /// 0 above the entry and 1 in the hole, so that no closed path around it gains work.
    Real inside(const BasicCut<Real>& cut, Real depth) const noexcept {
      return bounded((depth - cut.entry) * crack.per_travel, 0.0, 1.0);
    }
    Real force(const BasicCut<Real>& cut, const Memory& memory, Real depth) const noexcept {
      const Real in = inside(cut, depth);
      return crack.force(cut, {}, depth) +
             spread * (recovered * in + (1.0 - recovered) * bounded(memory.opened, 0.0, in));
    }
    Real by_depth(const BasicCut<Real>& cut, const Memory& memory, Real depth) const noexcept {
      const Real in = inside(cut, depth);
      const Real entering = in > 0.0 && in < 1.0 ? 1.0 : 0.0;
      const Real opening = memory.opened < in ? (memory.opened > 0.0 ? 1.0 : 0.0) : entering;
      return crack.by_depth(cut, {}, depth) +
             spread * crack.per_travel * (recovered * entering + (1.0 - recovered) * opening);
    }
  };
  Prepared prepare() const noexcept {
    return {BasicConstantCutting<Real>{toughness * crack_length, unloading}.prepare(), spreading(),
            recovered};
  }
};
using Fracture = BasicFracture<double>;

}  // namespace needleforce::laws
