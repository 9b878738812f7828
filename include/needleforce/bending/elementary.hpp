// SPDX-License-Identifier: Apache-2.0
// Elementary functions of the same bits on every machine: a stiff tissue makes much of the last one, and the
// libraries of C differ in it.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace needleforce::bending {

namespace detail {

/// Coefficients of Taylor's series, the highest first: 1/(first + 16)!, in steps of two down to 1/first!.
template <int first>
inline constexpr auto inverse_factorials = [] {
  std::array<double, 9> made{};
  double factorial = 1.0;  // exact up to 18!
  for (int n = 1, k = 8; n <= first + 16; ++n) {
    factorial *= n;
    if ((n - first) % 2 == 0 && n >= first) made[static_cast<std::size_t>(k--)] = 1.0 / factorial;
  }
  return made;
}();

/// x - x^3/3! + ... for z = -x^2, the sine; for z = x^2 the hyperbolic sine. |x| <= 0.8.
inline double odd_series(double x, double z) noexcept {
  double sum = 0.0;
  for (const double each : inverse_factorials<1>) sum = sum * z + each;
  return x * sum;
}

/// 1 - x^2/2! + ... in the same way.
inline double even_series(double z) noexcept {
  double sum = 0.0;
  for (const double each : inverse_factorials<2>) sum = sum * z + each;
  return 1.0 + z * sum;
}

/// The nearest whole number of one below 2^51: what is added leaves no room for more.
inline double whole(double x) noexcept {
  constexpr double room = 6755399441055744.0;  // 1.5 * 2^52
  return (x + room) - room;
}

}  // namespace detail

/// Sine and cosine of an angle [rad], as {cos, sin}, to 3e-16; beyond 1e5 those of the library. Wait-free.
inline std::array<double, 2> cos_sin(double angle) noexcept {
  if (!(std::abs(angle) < 1e5)) return {std::cos(angle), std::sin(angle)};
  const double quarters = detail::whole(angle * (2.0 / std::numbers::pi));
  // pi/2 in three parts, of which the first two times the number of quarters are exact
  const double x =
      ((angle - quarters * 0x1.921fb54p0) - quarters * 0x4.42d184p-32) - quarters * 0x6.9898cc51701b8p-60;
  const double s = detail::odd_series(x, -x * x), c = detail::even_series(-x * x);
  switch (static_cast<int>(quarters) & 3) {
    case 0:
      return {c, s};
    case 1:
      return {-s, c};
    case 2:
      return {-c, -s};
    default:
      return {s, -c};
  }
}

/// e^-x for x >= 0, to 3e-16. Wait-free.
inline double falling(double x) noexcept {
  if (!(x < 700.0)) return 0.0;
  const double halves = detail::whole(x * std::numbers::log2e);
  const double r = (halves * 0x0.b17217fp0 - x) + halves * 0x0.7d1cf79abc9e3bp-28;  // ln 2 in two parts
  double sum = 1.0;
  for (int k = 14; k > 0; --k) sum = 1.0 + sum * r / k;
  const auto power = static_cast<std::uint64_t>(1023 - static_cast<std::int64_t>(halves)) << 52;
  return sum * std::bit_cast<double>(power);
}

/// The hyperbolic tangent of x >= 0, to 4e-16. Wait-free.
inline double tanh_of(double x) noexcept {
  if (x < 0.625) return detail::odd_series(x, x * x) / detail::even_series(x * x);
  const double e = falling(2.0 * x);
  return (1.0 - e) / (1.0 + e);
}

}  // namespace needleforce::bending
