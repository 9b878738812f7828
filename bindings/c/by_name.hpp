// SPDX-License-Identifier: Apache-2.0
// Laws chosen and filled by name, from the plain structs of needleforce.h. For use before the loop.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>

#include "needleforce.h"
#include "needleforce/model.hpp"

namespace needleforce::c {

inline bool same(const char* one, const char* other) noexcept { return one && std::strcmp(one, other) == 0; }

/// Sets the fault and returns false.
inline bool refuse(nf_fault& why, const char* law, const char* quantity, const char* reason,
                   double value = 0.0, double low = 0.0, double high = 0.0) noexcept {
  why = {why.layer, law, quantity, reason, value, low, high};
  return false;
}

/// True if this memory can hold a T; otherwise false and `why`.
template <class T>
bool holds(const void* memory, std::size_t size, nf_fault& why) noexcept {
  static_assert(alignof(T) <= alignof(double));
  if (!memory || size < sizeof(T))
    return refuse(why, "memory", "size", "is less than what it needs", double(size), double(sizeof(T)));
  if (reinterpret_cast<std::uintptr_t>(memory) % alignof(T))
    return refuse(why, "memory", "address", "is not aligned as a double");
  return true;
}

/// The parameters given, up to the one without a name.
template <std::size_t most>
std::span<const nf_parameter> given(const nf_parameter (&parameters)[most]) noexcept {
  std::size_t n = 0;
  while (n < most && parameters[n].name) ++n;
  return {parameters, n};
}

template <class T>
const Parameter<T>* parameter_named(const char* name) noexcept {
  for (const Parameter<T>& parameter : T::table)
    if (same(name, parameter.name)) return &parameter;
  return nullptr;
}

/// Fills the table's parameters: those given, otherwise their defaults.
template <class T>
bool fill(T& value, std::span<const nf_parameter> parameters, nf_fault& why) noexcept {
  for (const Parameter<T>& parameter : T::table) value.*parameter.member = parameter.initial;
  std::array<bool, T::table.size()> known{};
  for (const nf_parameter& number : parameters) {
    const Parameter<T>* parameter = parameter_named<T>(number.name);
    if (!parameter)
      return refuse(why, T::name, number.name ? number.name : "name", "is no parameter of it", number.value);
    if (std::exchange(known[static_cast<std::size_t>(parameter - T::table.data())], true))
      return refuse(why, T::name, number.name, "is given twice", number.value);
    value.*parameter->member = number.value;
  }
  const Parameter<T>* bad = first_invalid(value);
  if (!bad) return true;
  const double number = value.*bad->member;
  const bool missing = bad->initial != bad->initial && number != number;
  return refuse(why, T::name, bad->name, missing ? "is missing or not a number" : "is outside its range",
                number, bad->low, bad->high);
}

template <class T, std::size_t most>
bool fill(T& value, const nf_parameter (&parameters)[most], nf_fault& why) noexcept {
  static_assert(T::table.size() < most, "the arrays of needleforce.h hold fewer parameters than this table");
  return fill(value, given(parameters), why);
}

inline bool fill_profile(tips::Profile& profile, const nf_tip& tip, nf_fault& why) noexcept {
  const bool fits = tip.radii && tip.heights && tip.knots <= tips::Profile::capacity;
  if (!fits) return refuse(why, "profile", "knots", "are missing or too many", double(tip.knots), 2.0, 32.0);
  profile.count = static_cast<int>(tip.knots);
  profile.radius.fill(tips::endless);
  for (std::size_t k = 0; k < tip.knots; ++k) {
    profile.radius[k] = tip.radii[k];
    profile.rise[k] = tip.heights[k];
  }
  return true;
}

inline bool fill_word(tips::BevelEquivalence& word, const nf_tip& tip, nf_fault& why) noexcept {
  if (!tip.equivalence) return true;
  for (std::size_t i = 0; i < tips::bevel_equivalence_names.size(); ++i)
    if (same(tip.equivalence, tips::bevel_equivalence_names[i])) {
      word = static_cast<tips::BevelEquivalence>(i);
      return true;
    }
  return refuse(why, tip.name, "equivalence", "is none of the known readings of a bevel");
}

template <class Shape>
bool fill_tip(Shape& shape, const nf_tip& tip, nf_fault& why) noexcept {
  if constexpr (std::is_same_v<Shape, tips::Profile>) {
    if (tip.parameters[0].name)
      return refuse(why, "profile", tip.parameters[0].name, "is no parameter of it");
    if (!fill_profile(shape, tip, why)) return false;
  } else {
    if (tip.knots) return refuse(why, Shape::name, "knots", "are for a profile alone", double(tip.knots));
    if (!fill(shape, tip.parameters, why)) return false;
  }
  if constexpr (requires { shape.equivalence; })
    if (!fill_word(shape.equivalence, tip, why)) return false;
  const tips::Flaw flaw = flaw_of(shape);
  return !flaw.limit || refuse(why, Shape::name, flaw.quantity, flaw.limit, flaw.value);
}

/// The value of a variant that has this name, filled by `fill_value`.
template <class Fill, class... T>
bool choose(const char* name, std::variant<T...>& chosen, nf_fault& why, const char* what,
            Fill fill_value) noexcept {
  bool known = false, filled = false;
  const auto attempt = [&]<class Value>(Value value) {
    if (known || !same(name, Value::name)) return;
    known = true;
    filled = fill_value(value);
    chosen = value;
  };
  (attempt(T{}), ...);
  return known ? filled : refuse(why, name, what, name ? "is of no known name" : "is missing");
}

template <class Law>
bool fill_parts(Law& law, const nf_law& named, nf_fault& why) noexcept {
  if constexpr (requires { law.tip; }) {
    if (!named.tip) return refuse(why, Law::name, "tip", "is missing");
    return choose(named.tip->name, law.tip, why, "tip",
                  [&](auto& shape) { return fill_tip(shape, *named.tip, why); });
  } else {
    return !named.tip || refuse(why, Law::name, "tip", "is not taken by this law");
  }
}

template <class Laws>
bool choose_law(const nf_law& named, Laws& laws, nf_fault& why, const char* family) noexcept {
  return choose(named.name, laws, why, family,
                [&](auto& law) { return fill(law, named.parameters, why) && fill_parts(law, named, why); });
}

/// A layer with its laws; false and `why` for the first fault.
inline bool read_layer(const nf_layer& named, Layer& layer, nf_fault& why) noexcept {
  layer.top = named.top;
  const bool elastic = !named.relaxation.name;
  return choose_law(named.stiffness, layer.laws.stiffness, why, "stiffness") &&
         choose_law(named.puncture, layer.laws.puncture, why, "puncture") &&
         choose_law(named.friction, layer.laws.friction, why, "friction") &&
         choose_law(named.cutting, layer.laws.cutting, why, "cutting") &&
         (elastic || choose_law(named.relaxation, layer.laws.relaxation, why, "relaxation"));
}

}  // namespace needleforce::c
