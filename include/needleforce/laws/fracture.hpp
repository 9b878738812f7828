// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <numbers>

#include "constant_cutting.hpp"

namespace needleforce::laws {

/// F = J a_c + (pi/4) E' R^2: the energy of the crack that the tip opens, and of holding the slit open for
/// the shaft. The second part is a state: it acts during insertion, also in an existing hole, and its
/// share `recovered` is returned during withdrawal as the slit closes behind the tip.
struct Fracture {
  double toughness;
  double crack_length;
  double plane_strain_modulus;
  double radius;
  double recovered;
  double unloading;

  static constexpr const char* name = "fracture";
  static constexpr Family family = Family::cutting;
  static constexpr bool monotone = true;
  static constexpr bool cuts = true;
  static constexpr const char* summary = "Fracture work of the crack at the tip and work of spreading it.";
  static constexpr const char* source = "Azar & Hayward 2008; Sneddon 1946, pressurised crack";
  static constexpr const char* validity =
      "A sharp rigid needle in quasi-static steady cutting; spreading in linear elasticity.";
  static constexpr std::array<Parameter<Fracture>, 6> table{{
      {&Fracture::toughness, "toughness", "J/m^2", 0.0, 1e6, required, "J",
       "fracture toughness of the tissue", "Azar & Hayward 2008"},
      {&Fracture::crack_length, "crack_length", "m", 1e-6, 1e-1, required, "a_c",
       "width of the crack across the needle: D for a slit, pi D / 2 for half the perimeter",
       "Azar & Hayward 2008"},
      {&Fracture::plane_strain_modulus, "plane_strain_modulus", "Pa", 0.0, 1e10, 0.0, "E'",
       "E / (1 - nu^2) of the tissue that is spread; 0 leaves spreading out", "Sneddon 1946"},
      {&Fracture::radius, "radius", "m", 0.0, 1e-1, 0.0, "R", "half width to which the slit is spread",
       "Sneddon 1946"},
      {&Fracture::recovered, "recovered", "1", 0.0, 1.0, 0.0, "Lambda",
       "share of the work of spreading that comes back on withdrawal", "Azar & Hayward 2008"},
      {&Fracture::unloading, "unloading", "m", 1e-9, 5e-2, 20e-6, "s_c",
       "travel over which either force reverses", "free: elastic unloading"},
  }};

  /// Work of spreading over advance [N].
  double spreading() const noexcept {
    return 0.25 * std::numbers::pi * plane_strain_modulus * radius * radius;
  }

  struct Prepared {
    struct Memory {
      double opened = 0.0;  ///< share of the slit that is open
    };

    ConstantCutting::Prepared crack;
    double spread, recovered;

    double steady(double = 0.0) const noexcept { return crack.full + spread; }
    void enter(Cut& cut, Memory& memory, double depth, double carried) const noexcept {
      if (carried < 0.0) cut.entry = depth, memory.opened = 1.0;
      cut.front = depth;
    }
    [[gnu::noinline]] void advance(Cut& cut, Memory& memory, const Move& move) const noexcept {
      NoMemory none;
      crack.advance(cut, none, move);
      const double held = cut.held * crack.per_travel;
      memory.opened = std::clamp(memory.opened + move.travel * crack.per_travel, -held, 1.0 + held);
    }
    double forceless(const Cut& cut, double depth) const noexcept { return crack.forceless(cut, depth); }
    /// 0 above the entry and 1 in the hole, so that no closed path around it gains work.
    double inside(const Cut& cut, double depth) const noexcept {
      return std::clamp((depth - cut.entry) * crack.per_travel, 0.0, 1.0);
    }
    double force(const Cut& cut, const Memory& memory, double depth) const noexcept {
      const double in = inside(cut, depth);
      return crack.force(cut, {}, depth) +
             spread * (recovered * in + (1.0 - recovered) * std::clamp(memory.opened, 0.0, in));
    }
    double by_depth(const Cut& cut, const Memory& memory, double depth) const noexcept {
      const double in = inside(cut, depth);
      const double entering = in > 0.0 && in < 1.0 ? 1.0 : 0.0;
      const double opening = memory.opened < in ? (memory.opened > 0.0 ? 1.0 : 0.0) : entering;
      return crack.by_depth(cut, {}, depth) +
             spread * crack.per_travel * (recovered * entering + (1.0 - recovered) * opening);
    }
  };
  Prepared prepare() const noexcept {
    return {ConstantCutting{toughness * crack_length, unloading}.prepare(), spreading(), recovered};
  }
};

}  // namespace needleforce::laws
