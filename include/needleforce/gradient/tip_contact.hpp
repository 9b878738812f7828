// SPDX-License-Identifier: Apache-2.0
// The contact of any tip with derivatives. The table of the law stays as it is: Sneddon's force is the least
// work for its contact radius, so that its derivatives by modulus and radius are closed forms.
#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include "../dual.hpp"
#include "../laws/tip_contact.hpp"

namespace needleforce::laws {

/// F = E_r phi(h): dF/dE_r = phi, and beyond the depth h_s at which the contact reaches the shank,
/// dF/dR = 2 E_r (h - h_s).
template <std::size_t N>
struct DualTipContact {
  using Number = Dual<N>;
  Number reduced_modulus;
  Number radius;
  Tip tip{};

  static constexpr const char* name = TipContact::name;
  static constexpr std::array<Parameter<DualTipContact, Number>, 2> table{{
      {&DualTipContact::reduced_modulus, "reduced_modulus", "Pa", 1.0, 1e10, required, "E_r", "", ""},
      {&DualTipContact::radius, "radius", "m", 1e-6, 1e-1, required, "R", "", ""},
  }};

  /// The law on a table, which is of a modulus of 1.
  template <class Table>
  struct OnTable {
    Number modulus;     ///< [Pa]
    Number radius;      ///< [m]
    double saturation;  ///< h_s [m], infinity where the tip ends before the shank
    Table table;

    Number reach() const noexcept { return std::numeric_limits<double>::infinity(); }
    Number force(const Number& h) const noexcept {
      const double beyond = std::max(0.0, h.value - saturation);
      return modulus * (table.force(h.value) + table.slope(h.value) * (h - h.value) +
                        2.0 * beyond * (radius - radius.value));
    }
    /// Its own slope by differences: only a spring softer than the contact asks for it, at a puncture.
    Number slope(const Number& h) const noexcept {
      const double near = 1e-4 * std::max(h.value, 1e-9), above = table.slope(h.value + near);
      const double bends = (above - table.slope(std::max(0.0, h.value - near))) / (2.0 * near);
      const double edge = h.value > saturation ? 2.0 : 0.0;
      return modulus * (table.slope(h.value) + bends * (h - h.value) + edge * (radius - radius.value));
    }
    Number energy(const Number& h) const noexcept {
      const double beyond = std::max(0.0, h.value - saturation);
      return modulus * (table.energy(h.value) + table.force(h.value) * (h - h.value) +
                        beyond * beyond * (radius - radius.value));
    }
    Number indentation(const Number& reached) const noexcept {
      const Number h = table.indentation(reached.value / modulus.value);
      return implied(h, force(h) - reached, slope(h));
    }
  };
  using Prepared = OnTable<TipTable>;
  /// What a layer keeps: the insertion has the table.
  struct Shared {
    Number modulus, radius;
    double saturation;
    OnTable<const TipTable&> on(const TipTable& given) const noexcept {
      return {modulus, radius, saturation, given};
    }
  };
  Prepared prepare() const noexcept {
    return {reduced_modulus, radius, saturation(), TipTable(tip, radius.value)};
  }
  Shared shared() const noexcept { return {reduced_modulus, radius, saturation()}; }

 private:
  double saturation() const noexcept {
    return dispatch(tip, [&](const auto& shape) {
      const bool reached = radius.value < sneddon::last_radius(shape);
      return reached ? sneddon::depth(shape, radius.value) : std::numeric_limits<double>::infinity();
    });
  }
};

template <std::size_t N>
struct TipContactFor<Dual<N>> {
  using type = DualTipContact<N>;
};

}  // namespace needleforce::laws
