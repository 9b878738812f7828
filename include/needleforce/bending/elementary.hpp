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

template <std::size_t n>
inline double horner(double x, const std::array<double, n>& coefficients) noexcept {
  double sum = 0.0;
  for (const double each : coefficients) sum = sum * x + each;
  return sum;
}

/// The nearest whole number of one below 2^51: what is added leaves no room for more.
inline double whole(double x) noexcept {
  constexpr double room = 6755399441055744.0;  // 1.5 * 2^52
  return (x + room) - room;
}

}  // namespace detail

/// Sine and cosine of an angle [rad], as {cos, sin}, to 2e-16; beyond 1e5 those of the library. Moshier 1989,
/// Cephes. Wait-free.
inline std::array<double, 2> cos_sin(double angle) noexcept {
  if (!(std::abs(angle) < 1e5)) return {std::cos(angle), std::sin(angle)};
  const double quarters = detail::whole(angle * (2.0 / std::numbers::pi));
  const double x = ((angle - quarters * 1.57079625129699707031) - quarters * 7.54978941586159635336e-8) -
                   quarters * 5.39030285815811905290e-15;
  const double z = x * x;
  const double s =
      x + x * z *
              detail::horner(z, std::array{1.58962301576546568060e-10, -2.50507477628578072866e-8,
                                           2.75573136213857245213e-6, -1.98412698295895385996e-4,
                                           8.33333333332211858878e-3, -1.66666666666666307295e-1});
  const double c = 1.0 - 0.5 * z +
                   z * z *
                       detail::horner(z, std::array{-1.13585365213876817300e-11, 2.08757008419747316778e-9,
                                                    -2.75573141792967388112e-7, 2.48015872888517045348e-5,
                                                    -1.38888888888730564116e-3, 4.16666666666665929218e-2});
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
  const double r = (halves * 6.93145751953125e-1 - x) + halves * 1.42860682030941723212e-6;
  double sum = 1.0;
  for (int k = 14; k > 0; --k) sum = 1.0 + sum * r / k;
  const auto power = static_cast<std::uint64_t>(1023 - static_cast<std::int64_t>(halves)) << 52;
  return sum * std::bit_cast<double>(power);
}

/// The hyperbolic tangent of x >= 0, to 4e-16. Moshier 1989, Cephes. Wait-free.
inline double tanh_of(double x) noexcept {
  if (x >= 0.625) {
    const double e = falling(2.0 * x);
    return (1.0 - e) / (1.0 + e);
  }
  const double z = x * x;
  const double top = detail::horner(
      z, std::array{-9.64399179425052238628e-1, -9.92877231001918586564e1, -1.61468768441708447952e3});
  const double bottom = detail::horner(
      z, std::array{1.0, 1.12811678491632931402e2, 2.23548839060100448583e3, 4.84406305325125486048e3});
  return x + x * z * top / bottom;
}

}  // namespace needleforce::bending
