// SPDX-License-Identifier: Apache-2.0
// A number of 64 digits of two instead of 53, for which the laws are compiled: differences of it are exact
// enough to check derivatives.
#pragma once

#include <cmath>

#include "needleforce/gradient/gradient_insertion.hpp"

namespace needleforce {

struct Wide {
  // where a double may stand: memories of laws are bytes aligned so
  typedef long double Digits __attribute__((aligned(8)));
  Digits value = 0.0L;
  constexpr Wide() = default;
  constexpr Wide(double number) noexcept : value(number) {}
  static constexpr Wide of(long double number) noexcept {
    Wide result;
    result.value = number;
    return result;
  }
  friend constexpr Wide operator-(Wide a) noexcept { return of(-a.value); }
  friend constexpr Wide operator+(Wide a, Wide b) noexcept { return of(a.value + b.value); }
  friend constexpr Wide operator-(Wide a, Wide b) noexcept { return of(a.value - b.value); }
  friend constexpr Wide operator*(Wide a, Wide b) noexcept { return of(a.value * b.value); }
  friend constexpr Wide operator/(Wide a, Wide b) noexcept { return of(a.value / b.value); }
  constexpr Wide& operator+=(Wide b) noexcept { return *this = *this + b; }
  constexpr Wide& operator-=(Wide b) noexcept { return *this = *this - b; }
  constexpr Wide& operator*=(Wide b) noexcept { return *this = *this * b; }
  friend constexpr bool operator==(Wide a, Wide b) noexcept { return a.value == b.value; }
  friend constexpr auto operator<=>(Wide a, Wide b) noexcept { return a.value <=> b.value; }

  friend constexpr Wide smaller(Wide a, Wide b) noexcept { return b < a ? b : a; }
  friend constexpr Wide larger(Wide a, Wide b) noexcept { return a < b ? b : a; }
  friend constexpr Wide bounded(Wide a, Wide low, Wide high) noexcept {
    return a < low ? low : high < a ? high : a;
  }
  friend Wide abs(Wide a) noexcept { return of(std::fabs(a.value)); }
  friend Wide copysign(Wide a, Wide sign) noexcept { return of(std::copysign(a.value, sign.value)); }
  friend Wide exp(Wide a) noexcept { return of(std::exp(a.value)); }
  friend Wide expm1(Wide a) noexcept { return of(std::expm1(a.value)); }
  friend Wide log(Wide a) noexcept { return of(std::log(a.value)); }
  friend Wide log1p(Wide a) noexcept { return of(std::log1p(a.value)); }
  friend Wide sinh(Wide a) noexcept { return of(std::sinh(a.value)); }
  friend Wide tan(Wide a) noexcept { return of(std::tan(a.value)); }
  friend Wide tanh(Wide a) noexcept { return of(std::tanh(a.value)); }
  friend Wide atanh(Wide a) noexcept { return of(std::atanh(a.value)); }
  friend Wide sqrt(Wide a) noexcept { return of(std::sqrt(a.value)); }
  friend Wide pow(Wide a, Wide n) noexcept { return of(std::pow(a.value, n.value)); }
  friend constexpr double value_of(Wide a) noexcept { return static_cast<double>(a.value); }
  friend constexpr Wide implied(Wide root, Wide, Wide) noexcept { return root; }
  friend constexpr Wide at_least(Wide a, double low) noexcept { return larger(a, low); }
};

/// The table of a tip is one of doubles: a cone stands in its place, so that the list is complete.
struct WideTip : laws::BasicCone<Wide> {
  struct Prepared : laws::BasicCone<Wide>::Prepared {};
  Prepared prepare() const noexcept { return {laws::BasicCone<Wide>::prepare()}; }
};
template <>
struct laws::TipContactFor<Wide> {
  using type = WideTip;
};

/// A layer of wide numbers. `moved` is a parameter that differs from the layer's by `by`.
template <class Lifted, class L>
Lifted widened(const L& law, std::size_t part, const Direction& moved, long double by) noexcept {
  Lifted result{};
  for (std::size_t k = 0; k < L::table.size(); ++k) {
    const long double number = law.*L::table[k].member;
    const bool here = moved.part == part && moved.index == k;
    result.*Lifted::table[k].member = Wide::of(here ? number + by : number);
  }
  return result;
}
template <class Lifted, class... L>
Lifted widened(const std::variant<L...>& laws, std::size_t part, const Direction& moved,
               long double by) noexcept {
  Lifted result;
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    ((laws.index() == I ? void(result.template emplace<I>(widened<std::variant_alternative_t<I, Lifted>, L>(
                              *std::get_if<I>(&laws), part, moved, by)))
                        : void()),
     ...);
  }(std::index_sequence_for<L...>{});
  return result;
}
inline BasicLayer<Wide> widened(const Layer& layer, const Direction& moved, long double by) noexcept {
  const Model& laws = layer.laws;
  return {layer.top,
          {widened<BasicStiffness<Wide>>(laws.stiffness, 0, moved, by),
           widened<BasicPuncture<Wide>>(laws.puncture, 1, moved, by),
           widened<BasicFriction<Wide>>(laws.friction, 2, moved, by),
           widened<BasicCutting<Wide>>(laws.cutting, 3, moved, by),
           widened<BasicRelaxation<Wide>>(laws.relaxation, 4, moved, by)}};
}

}  // namespace needleforce
