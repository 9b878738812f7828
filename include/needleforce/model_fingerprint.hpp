// SPDX-License-Identifier: Apache-2.0
// A number that distinguishes models and memories.
#pragma once

#include <cstdint>
#include <span>
#include <tuple>
#include <type_traits>
#include <variant>

#include "fingerprint.hpp"
#include "model.hpp"

namespace needleforce {

namespace detail {

template <class T>
void add_numbers(Fingerprint& print, const T& value) noexcept;

template <class... T>
void add_part(Fingerprint& print, const std::variant<T...>& chosen) noexcept {
  print.add(static_cast<std::uint64_t>(chosen.index()));
  dispatch(chosen, [&](const auto& value) { add_numbers(print, value); });
}
template <class Word>
  requires std::is_enum_v<Word>
void add_part(Fingerprint& print, Word word) noexcept {
  print.add(static_cast<std::uint64_t>(word));
}

template <class T>
void add_numbers(Fingerprint& print, const T& value) noexcept {
  if constexpr (requires { T::table; })
    for (const auto& parameter : T::table) print.add(value.*parameter.member);
  if constexpr (requires { T::parts; })
    std::apply([&](const auto&... part) { (add_part(print, value.*part.member), ...); }, T::parts);
  if constexpr (std::is_same_v<T, tips::Profile>)
    for (std::size_t k = 0; k < static_cast<std::size_t>(value.count); ++k)
      print.add(value.radius[k]), print.add(value.rise[k]);
}

}  // namespace detail

/// True if two laws are of one kind and have the same parameters.
template <class... L>
bool same_law(const std::variant<L...>& a, const std::variant<L...>& b) noexcept {
  Fingerprint one, other;
  detail::add_part(one, a);
  detail::add_part(other, b);
  return one.value() == other.value();
}

/// Of a stack of layers: every law and every number in it. For use before the loop.
inline std::uint64_t fingerprint(std::span<const Layer> layers) noexcept {
  Fingerprint print;
  for (const auto& [top, laws] : layers) {
    print.add(top);
    detail::add_part(print, laws.stiffness);
    detail::add_part(print, laws.puncture);
    detail::add_part(print, laws.friction);
    detail::add_part(print, laws.cutting);
    detail::add_part(print, laws.relaxation);
  }
  return print.value();
}

}  // namespace needleforce
