// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>
#include <tuple>

#include "../law.hpp"
#include "../tip.hpp"
#include "../tip_table.hpp"

namespace needleforce::laws {

/// F(h) of any tip on a shank, by Sneddon's integrals before the loop: the reduced modulus times a TipTable.
struct TipContact {
  double reduced_modulus;
  double radius;
  Tip tip{};

  static constexpr const char* name = "tip_contact";
  static constexpr Family family = Family::stiffness;
  static constexpr const char* summary =
      "Any tip on a cylindrical shank, its integrals tabulated before the loop.";
  static constexpr const char* source = "Sneddon 1965; Galin 1953, fixed contact edge";
  static constexpr const char* validity =
      "Small slopes: with a sharp or a long tip a scaling law, not a prediction. The table keeps 1e-8 of the "
      "force at saturation, of a profile with 32 knots 5e-6.";
  static constexpr std::array<Parameter<TipContact>, 2> table{{
      {&TipContact::reduced_modulus, "reduced_modulus", "Pa", 1.0, 1e10, required, "E_r",
       "reduced modulus of needle and tissue", "eq. (4)"},
      {&TipContact::radius, "radius", "m", 1e-6, 1e-1, required, "R",
       "radius of the shank, where the contact stops growing", "Galin 1953"},
  }};
  static constexpr std::tuple parts{Part{&TipContact::tip, "tip", "tip of the needle"}};
  /// What the table keeps of the force at saturation, but for profiles of many knots.
  static constexpr double accuracy = 1e-8;

  tips::Flaw flaw() const noexcept {
    if (valid(tip)) return {};
    return {"tip", -1, 0.0, "not a possible tip", "Check the numbers of the tip."};
  }

  /// On a table of its own, or on one that the layers of an insertion share.
  template <class Table>
  struct OnTable {
    double modulus;  // reduced [Pa]
    Table table;

    double reach() const noexcept { return std::numeric_limits<double>::infinity(); }
    TipTable::Pressed at(double h) const noexcept {
      const auto [force, slope] = table.at(h);
      return {modulus * force, modulus * slope};
    }
    double force(double h) const noexcept { return modulus * table.force(h); }
    double slope(double h) const noexcept { return modulus * table.slope(h); }
    double energy(double h) const noexcept { return modulus * table.energy(h); }
    double indentation(double force) const noexcept { return table.indentation(force / modulus); }
  };
  using Prepared = OnTable<TipTable>;
  /// What a layer keeps: the insertion has the table.
  struct Shared {
    double modulus;  // reduced [Pa]
    OnTable<const TipTable&> on(const TipTable& given) const noexcept { return {modulus, given}; }
  };
  Shared shared() const noexcept { return {reduced_modulus}; }

  Prepared prepare() const noexcept { return {reduced_modulus, TipTable(tip, radius)}; }
};

/// A law of another number than double has a contact of its own: gradient/tip_contact.hpp.
template <class Real>
struct TipContactFor;
template <>
struct TipContactFor<double> {
  using type = TipContact;
};
template <class Real>
using TipContactOf = typename TipContactFor<Real>::type;

}  // namespace needleforce::laws
