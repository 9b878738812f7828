// SPDX-License-Identifier: Apache-2.0
// Which parameters a gradient has: places in a stack of layers, and the same layers with derivatives along
// them.
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <variant>

#include "../dual.hpp"
#include "../model.hpp"
#include "tip_contact.hpp"

namespace needleforce {

/// One parameter of a stack of layers.
struct Direction {
  std::size_t layer = 0;
  std::size_t part = 0;   ///< a `Family`, or `top`
  std::size_t index = 0;  ///< row of the law's table

  static constexpr std::size_t top = 5;
  bool operator==(const Direction&) const = default;
};

namespace detail {

/// Calls `visit` with each of the five laws and the number of its family.
template <class Laws, class Visit>
constexpr void each_law(Laws& laws, Visit visit) noexcept {
  std::visit([&](auto& law) { visit(law, std::size_t{0}); }, laws.stiffness);
  std::visit([&](auto& law) { visit(law, std::size_t{1}); }, laws.puncture);
  std::visit([&](auto& law) { visit(law, std::size_t{2}); }, laws.friction);
  std::visit([&](auto& law) { visit(law, std::size_t{3}); }, laws.cutting);
  std::visit([&](auto& law) { visit(law, std::size_t{4}); }, laws.relaxation);
}

/// A number that is the direction `at` wherever `along` has it, or none of them.
template <std::size_t N>
Dual<N> seeded(double number, const Direction& at, std::span<const Direction> along) noexcept {
  Dual<N> result = number;
  for (std::size_t i = 0; i < along.size() && i < N; ++i)
    if (along[i] == at) result += Dual<N>::direction(0.0, i);
  return result;
}

/// The law of the same name and values with derivatives.
template <class Lifted, class L, std::size_t N>
Lifted lifted(const L& law, std::size_t layer, std::size_t part, std::span<const Direction> along) noexcept {
  Lifted result{};
  for (std::size_t k = 0; k < L::table.size(); ++k)
    result.*Lifted::table[k].member = seeded<N>(law.*L::table[k].member, {layer, part, k}, along);
  if constexpr (requires { law.tip; }) result.tip = law.tip;
  return result;
}

/// The same for a law of a list; both lists have one order.
template <class Lifted, std::size_t N, class... L>
Lifted lifted(const std::variant<L...>& laws, std::size_t layer, std::size_t part,
              std::span<const Direction> along) noexcept {
  Lifted result;
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    ((laws.index() == I ? void(result.template emplace<I>(lifted<std::variant_alternative_t<I, Lifted>, L, N>(
                              *std::get_if<I>(&laws), layer, part, along)))
                        : void()),
     ...);
  }(std::index_sequence_for<L...>{});
  return result;
}

}  // namespace detail

/// A layer with derivatives along some parameters; those of other layers leave it as it is.
template <std::size_t N>
BasicLayer<Dual<N>> with_derivatives(const Layer& layer, std::size_t number,
                                     std::span<const Direction> along) noexcept {
  using Number = Dual<N>;
  const Model& laws = layer.laws;
  return {detail::seeded<N>(layer.top, {number, Direction::top, 0}, along),
          {detail::lifted<BasicStiffness<Number>, N>(laws.stiffness, number, 0, along),
           detail::lifted<BasicPuncture<Number>, N>(laws.puncture, number, 1, along),
           detail::lifted<BasicFriction<Number>, N>(laws.friction, number, 2, along),
           detail::lifted<BasicCutting<Number>, N>(laws.cutting, number, 3, along),
           detail::lifted<BasicRelaxation<Number>, N>(laws.relaxation, number, 4, along)}};
}

/// Calls `visit(direction, name of the parameter)` for every parameter of a stack, from the surface down: the
/// first layer's top is fixed at the surface.
template <class Visit>
void each_parameter(std::span<const Layer> layers, Visit visit) {
  for (std::size_t i = 0; i < layers.size(); ++i) {
    detail::each_law(layers[i].laws, [&]<class L>(const L&, std::size_t part) {
      for (std::size_t k = 0; k < L::table.size(); ++k) visit(Direction{i, part, k}, L::table[k].name);
    });
    if (i > 0) visit(Direction{i, Direction::top, 0}, "top");
  }
}

}  // namespace needleforce
