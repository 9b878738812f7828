// SPDX-License-Identifier: Apache-2.0
// Several numbers at a time, as many as the processor takes. Each has the value that it has alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

// by the vector types of these compilers; with others each member is stepped alone
#if defined(__GNUC__) || defined(__clang__)
#define NEEDLEFORCE_LANES
#endif

// AVX2 has no multiply-add, so that bits stay those of any machine. Not 512 bits: g++ settles what a mask is
// before it inlines, and memory is the limit by then.
#if defined(NEEDLEFORCE_LANES) && defined(__x86_64__)
#define NEEDLEFORCE_WIDE [[gnu::target("avx2"), gnu::flatten]]
#else
#define NEEDLEFORCE_WIDE
#endif

namespace needleforce {

/// The most numbers that are worked on at a time.
inline constexpr std::size_t most_lanes = 4;

/// A number of each member; room for whole lanes.
using Column = std::vector<double>;

namespace detail {

/// How many numbers this processor takes at a time.
inline std::size_t lanes_here() noexcept {
#ifndef NEEDLEFORCE_LANES
  return 0;
#elif defined(__x86_64__)
  return __builtin_cpu_supports("avx2") ? 4 : 2;
#else
  return 2;
#endif
}

#ifdef NEEDLEFORCE_LANES
template <std::size_t width>
struct LanesOf {
  typedef double type __attribute__((vector_size(8 * width)));
  typedef std::int64_t mask __attribute__((vector_size(8 * width)));
  /// The same where they stand in a column.
  typedef double standing __attribute__((vector_size(8 * width), aligned(8), may_alias));
};
template <std::size_t width>
using Lanes = typename LanesOf<width>::type;

// Lanes go in and out by reference: without AVX a compiler warns of a function that returns them.
template <class Number>
[[gnu::always_inline]] inline void read(Number& lanes, const double* from) noexcept {
  lanes = *reinterpret_cast<const typename LanesOf<sizeof(Number) / 8>::standing*>(from);
}
template <class Number>
[[gnu::always_inline]] inline void write(double* to, const Number& lanes) noexcept {
  *reinterpret_cast<typename LanesOf<sizeof(Number) / 8>::standing*>(to) = lanes;
}
template <class Number>
[[gnu::always_inline]] inline void raise(Number& number, const Number& least) noexcept {
  number = number < least ? least : number;
}
template <class Number>
[[gnu::always_inline]] inline void lower(Number& number, const Number& most) noexcept {
  number = most < number ? most : number;
}
template <class Number>
[[gnu::always_inline]] inline void make_positive(Number& number) noexcept {
  number = number < 0.0 ? -number : number;
}

/// True if one of the lanes of a mask is set.
template <std::size_t width, class Mask>
[[gnu::always_inline]] inline bool any(const Mask& mask) noexcept {
  auto found = mask[0];
  for (std::size_t i = 1; i < width; ++i) found |= mask[i];
  return found != 0;
}
#endif

}  // namespace detail
}  // namespace needleforce
