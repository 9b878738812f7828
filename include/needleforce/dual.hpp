// SPDX-License-Identifier: Apache-2.0
// A number with its derivatives along N directions, in place of a double: what a law computes with, it
// differentiates. Branches follow the value.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>

#include "scalar.hpp"

namespace needleforce {

/// The derivatives of a number.
template <std::size_t N>
struct Derivatives {
  using type = std::array<double, N>;
};
#if defined(__GNUC__) || defined(__clang__)
/// Eight in pairs, which every processor of this kind takes together, and each a variable of its own, which
/// the compiler keeps in a register: a step takes a third of the time of a loop over numbers.
struct EightDerivatives {
  typedef double Pair __attribute__((vector_size(16), aligned(8)));
  Pair a{}, b{}, c{}, d{};

  double operator[](std::size_t i) const noexcept { return std::bit_cast<std::array<double, 8>>(*this)[i]; }
  [[gnu::always_inline]] friend constexpr EightDerivatives operator*(double slope,
                                                                     const EightDerivatives& x) noexcept {
    return {slope * x.a, slope * x.b, slope * x.c, slope * x.d};
  }
  [[gnu::always_inline]] friend constexpr EightDerivatives operator+(const EightDerivatives& x,
                                                                     const EightDerivatives& y) noexcept {
    return {x.a + y.a, x.b + y.b, x.c + y.c, x.d + y.d};
  }
};
template <>
struct Derivatives<8> {
  using type = EightDerivatives;
};
#endif

/// Forward differentiation. A double is one without derivatives.
template <std::size_t N>
struct Dual {
  // the derivatives first: a copy then moves the same pieces that arithmetic stored, without waiting for them
  typename Derivatives<N>::type by{};  ///< d(value) along each direction
  double value = 0.0;

  constexpr Dual() = default;
  constexpr Dual(double number) noexcept : value(number) {}
  /// The direction `i` itself.
  static Dual direction(double number, std::size_t i) noexcept {
    std::array<double, N> along{};
    along[i] = 1.0;
    Dual result(number);
    result.by = std::bit_cast<typename Derivatives<N>::type>(along);
    return result;
  }

  std::array<double, N> derivatives() const noexcept { return std::bit_cast<std::array<double, N>>(by); }

  friend constexpr Dual operator-(const Dual& a) noexcept { return chain(-a.value, -1.0, a); }
  friend constexpr Dual operator+(const Dual& a, const Dual& b) noexcept {
    return chain(a.value + b.value, 1.0, a, 1.0, b);
  }
  friend constexpr Dual operator-(const Dual& a, const Dual& b) noexcept {
    return chain(a.value - b.value, 1.0, a, -1.0, b);
  }
  friend constexpr Dual operator*(const Dual& a, const Dual& b) noexcept {
    return chain(a.value * b.value, b.value, a, a.value, b);
  }
  friend constexpr Dual operator/(const Dual& a, const Dual& b) noexcept {
    const double ratio = a.value / b.value;
    return chain(ratio, 1.0 / b.value, a, -ratio / b.value, b);
  }
  friend constexpr Dual operator+(const Dual& a, double b) noexcept { return chain(a.value + b, 1.0, a); }
  friend constexpr Dual operator+(double a, const Dual& b) noexcept { return chain(a + b.value, 1.0, b); }
  friend constexpr Dual operator-(const Dual& a, double b) noexcept { return chain(a.value - b, 1.0, a); }
  friend constexpr Dual operator-(double a, const Dual& b) noexcept { return chain(a - b.value, -1.0, b); }
  friend constexpr Dual operator*(const Dual& a, double b) noexcept { return chain(a.value * b, b, a); }
  friend constexpr Dual operator*(double a, const Dual& b) noexcept { return chain(a * b.value, a, b); }
  friend constexpr Dual operator/(const Dual& a, double b) noexcept { return chain(a.value / b, 1.0 / b, a); }
  constexpr Dual& operator+=(const Dual& b) noexcept { return *this = *this + b; }
  constexpr Dual& operator-=(const Dual& b) noexcept { return *this = *this - b; }
  constexpr Dual& operator*=(const Dual& b) noexcept { return *this = *this * b; }

  friend constexpr bool operator<(const Dual& a, const Dual& b) noexcept { return a.value < b.value; }
  friend constexpr bool operator>(const Dual& a, const Dual& b) noexcept { return a.value > b.value; }
  friend constexpr bool operator<=(const Dual& a, const Dual& b) noexcept { return a.value <= b.value; }
  friend constexpr bool operator>=(const Dual& a, const Dual& b) noexcept { return a.value >= b.value; }
  friend constexpr bool operator==(const Dual& a, const Dual& b) noexcept { return a.value == b.value; }

  friend constexpr Dual smaller(const Dual& a, const Dual& b) noexcept { return b < a ? b : a; }
  friend constexpr Dual larger(const Dual& a, const Dual& b) noexcept { return a < b ? b : a; }
  friend constexpr Dual bounded(const Dual& a, const Dual& low, const Dual& high) noexcept {
    return a < low ? low : high < a ? high : a;
  }
  friend Dual abs(const Dual& a) noexcept { return std::signbit(a.value) ? -a : a; }
  friend Dual copysign(const Dual& a, const Dual& sign) noexcept {
    return std::signbit(a.value) == std::signbit(sign.value) ? a : -a;
  }
  friend Dual exp(const Dual& a) noexcept { return chain(std::exp(a.value), std::exp(a.value), a); }
  friend Dual expm1(const Dual& a) noexcept { return chain(std::expm1(a.value), std::exp(a.value), a); }
  friend Dual log(const Dual& a) noexcept { return chain(std::log(a.value), 1.0 / a.value, a); }
  friend Dual log1p(const Dual& a) noexcept { return chain(std::log1p(a.value), 1.0 / (1.0 + a.value), a); }
  friend Dual sinh(const Dual& a) noexcept { return chain(std::sinh(a.value), std::cosh(a.value), a); }
  friend Dual tan(const Dual& a) noexcept {
    const double t = std::tan(a.value);
    return chain(t, 1.0 + t * t, a);
  }
  friend Dual tanh(const Dual& a) noexcept {
    const double t = std::tanh(a.value);
    return chain(t, 1.0 - t * t, a);
  }
  friend Dual atanh(const Dual& a) noexcept {
    return chain(std::atanh(a.value), 1.0 / ((1.0 - a.value) * (1.0 + a.value)), a);
  }
  /// At 0, where it is vertical, without derivatives.
  friend Dual sqrt(const Dual& a) noexcept {
    const double root = std::sqrt(a.value);
    return chain(root, root > 0.0 ? 0.5 / root : 0.0, a);
  }
  friend Dual pow(const Dual& a, const Dual& n) noexcept {
    const double power = std::pow(a.value, n.value);
    const double by_exponent = power > 0.0 ? power * std::log(a.value) : 0.0;
    const double by_base = a.value > 0.0 || n.value >= 1.0 ? n.value * std::pow(a.value, n.value - 1.0) : 0.0;
    return chain(power, by_base, a, by_exponent, n);
  }
  friend constexpr double value_of(const Dual& a) noexcept { return a.value; }
  friend constexpr Dual implied(const Dual& root, const Dual& miss, const Dual& slope) noexcept {
    return chain(root.value, slope.value != 0.0 ? -1.0 / slope.value : 0.0, miss);
  }
  friend constexpr Dual at_least(const Dual& a, double low) noexcept {
    return chain(std::max(a.value, low), 1.0, a);
  }

 private:
  static constexpr Dual chain(double number, double slope, const Dual& a) noexcept {
    Dual result(number);
    if constexpr (requires { slope * a.by; })
      result.by = slope * a.by;
    else
      for (std::size_t i = 0; i < N; ++i) result.by[i] = slope * a.by[i];
    return result;
  }
  static constexpr Dual chain(double number, double slope, const Dual& a, double other,
                              const Dual& b) noexcept {
    Dual result(number);
    if constexpr (requires { slope * a.by; })
      result.by = slope * a.by + other * b.by;
    else
      for (std::size_t i = 0; i < N; ++i) result.by[i] = slope * a.by[i] + other * b.by[i];
    return result;
  }
};

}  // namespace needleforce
