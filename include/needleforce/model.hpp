// SPDX-License-Identifier: Apache-2.0
// A model: one law for each part of the force, checked and prepared before the loop.
#pragma once

#include <variant>

#include "laws/all.hpp"

namespace needleforce {

/// One law of each family. Plain values: what an insertion needs, and nothing else.
struct Model {
  Stiffness stiffness;
  Puncture puncture;
  Friction friction;
  Cutting cutting;
};

namespace detail {
template <class Variant>
struct prepared_variant;
template <class... L>
struct prepared_variant<std::variant<L...>> {
  using type = std::variant<typename L::Prepared...>;
};
}  // namespace detail

/// A family's laws with everything computed that does not change in the loop.
template <class Laws>
using Prepared = typename detail::prepared_variant<Laws>::type;

/// True if every number of every law lies in its range.
inline bool valid(const Model& model) noexcept {
  const auto inside = [](const auto& law) { return first_invalid(law) == nullptr; };
  return std::visit(inside, model.stiffness) && std::visit(inside, model.puncture) &&
         std::visit(inside, model.friction) && std::visit(inside, model.cutting);
}

template <class... L>
Prepared<std::variant<L...>> prepare(const std::variant<L...>& laws) noexcept {
  return std::visit([](const auto& law) { return Prepared<std::variant<L...>>{law.prepare()}; }, laws);
}

/// The depth [m] at which the model punctures, whatever its criterion.
inline double puncture_depth(const Puncture& puncture, const Prepared<Stiffness>& stiffness) noexcept {
  return std::visit([](const auto& law, const auto& contact) { return law.puncture_depth(contact); },
                    puncture, stiffness);
}

}  // namespace needleforce
