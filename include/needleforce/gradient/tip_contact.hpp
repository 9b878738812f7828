// SPDX-License-Identifier: Apache-2.0
// The contact of any tip with derivatives. The table of the law stays as it is: Sneddon's force is the least
// work for its contact radius, so that its derivatives by modulus and radius are closed forms.
#pragma once

#include <algorithm>
#include <limits>
#include <variant>

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

  struct Prepared {
    TipContact::Prepared plain{};
    Number share;       ///< E_r over its value
    Number radius;      ///< [m]
    double modulus;     ///< [Pa]
    double saturation;  ///< h_s [m], infinity where the tip ends before the shank

    Number reach() const noexcept { return plain.reach(); }
    Number force(const Number& h) const noexcept {
      const double beyond = std::max(0.0, h.value - saturation);
      return plain.force(h.value) * share + plain.slope(h.value) * (h - h.value) +
             2.0 * modulus * beyond * (radius - radius.value);
    }
    Number slope(const Number& h) const noexcept {
      const double near = 1e-4 * std::max(h.value, 1e-9), above = plain.slope(h.value + near);
      const double bends = (above - plain.slope(std::max(0.0, h.value - near))) / (2.0 * near);
      const double edge = h.value > saturation ? 2.0 * modulus : 0.0;
      return plain.slope(h.value) * share + bends * (h - h.value) + edge * (radius - radius.value);
    }
    Number energy(const Number& h) const noexcept {
      const double beyond = std::max(0.0, h.value - saturation);
      return plain.energy(h.value) * share + plain.force(h.value) * (h - h.value) +
             modulus * beyond * beyond * (radius - radius.value);
    }
    Number indentation(const Number& reached) const noexcept {
      const Number h = plain.indentation(reached.value);
      return implied(h, force(h) - reached, slope(h));
    }
  };
  Prepared prepare() const noexcept {
    const double modulus = reduced_modulus.value, shank = radius.value;
    const double saturation = std::visit(
        [&](const auto& shape) {
          const bool reached = shank < sneddon::last_radius(shape);
          return reached ? sneddon::depth(shape, shank) : std::numeric_limits<double>::infinity();
        },
        tip);
    return {TipContact{modulus, shank, tip}.prepare(), reduced_modulus / modulus, radius, modulus,
            saturation};
  }
};

template <std::size_t N>
struct TipContactFor<Dual<N>> {
  using type = DualTipContact<N>;
};

}  // namespace needleforce::laws
