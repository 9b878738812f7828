// SPDX-License-Identifier: Apache-2.0
// A parameter table: the only place with a quantity's name, unit, range, meaning and source.
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>

namespace needleforce {

/// Marks a parameter that has no default and must be given.
inline constexpr double required = std::numeric_limits<double>::quiet_NaN();

/// One parameter of T: its member, its name, and the closed range outside which it is refused.
template <class T, class Number = double>
struct Parameter {
  Number T::* member;
  const char* name;
  const char* unit;  ///< SI; "1" for a ratio
  double low;
  double high;
  double initial;      ///< the default, or `required`
  const char* symbol;  ///< the letter in the source's equation
  const char* meaning;
  const char* source;
};

/// A member of T that is no number: a tip, or a choice among words. T lists them in a tuple `parts`; one
/// that may be left out keeps what a new T has.
template <class T, class Value>
struct Part {
  Value T::* member;
  const char* name;
  const char* meaning;
  bool optional = false;
};

/// A struct of SI doubles with a name, a sentence and a parameter table.
template <class T>
concept Parameterised = requires {
  { T::name } -> std::convertible_to<const char*>;
  { T::summary } -> std::convertible_to<const char*>;
  T::table.size();
};

/// The first parameter outside its range (or not finite), or nullptr. Wait-free, allocates nothing.
template <Parameterised T>
constexpr const Parameter<T>* first_invalid(const T& value) noexcept {
  for (const Parameter<T>& parameter : T::table) {
    const double number = value.*parameter.member;
    if (!(number >= parameter.low && number <= parameter.high)) return &parameter;
  }
  return nullptr;
}

}  // namespace needleforce
