// SPDX-License-Identifier: Apache-2.0
// The number that a law computes with: a double, or one that carries derivatives (dual.hpp). The laws call
// these functions without `std::`, so that each kind of number finds its own.
#pragma once

#include <cmath>
#include <type_traits>

namespace needleforce {

using std::abs, std::exp, std::expm1, std::log, std::log1p, std::sqrt, std::pow, std::copysign;
using std::atanh, std::sinh, std::tan, std::tanh;

// std::min, std::max and std::clamp for every kind of number, under names that no program has of its own
constexpr double smaller(double a, double b) noexcept { return b < a ? b : a; }
constexpr double larger(double a, double b) noexcept { return a < b ? b : a; }
constexpr double bounded(double number, double low, double high) noexcept {
  return number < low ? low : high < number ? high : number;
}

/// The plain number.
constexpr double value_of(double number) noexcept { return number; }

/// Where `miss`, which grows by `slope`, is zero: `root`, found by its value. A number with derivatives gets
/// those of the implicit function.
constexpr double implied(double root, double, double) noexcept { return root; }

/// No less than `low`; a number that is raised keeps its derivatives.
constexpr double at_least(double number, double low) noexcept { return larger(number, low); }

/// False for numbers that carry derivatives.
template <class Real>
inline constexpr bool is_plain = std::is_same_v<Real, double>;

}  // namespace needleforce
