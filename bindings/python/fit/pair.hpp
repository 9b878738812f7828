// SPDX-License-Identifier: Apache-2.0
// Two doubles side by side, added and compared at once: a type of g++ and clang on every target, the same
// arithmetic in plain C++ for other compilers. NEEDLEFORCE_PLAIN_PAIR takes the plain one, for the test that
// compares them.
#pragma once

#include <cstddef>

namespace needleforce::fit {

#if (defined(__GNUC__) || defined(__clang__)) && !defined(NEEDLEFORCE_PLAIN_PAIR)

using Pair = double __attribute__((vector_size(16)));

/// The first value where a comparison holds, the second elsewhere; of pairs in each lane.
template <class Comparison, class T>
T chosen(Comparison holds, T yes, T no) noexcept {
  return holds ? yes : no;
}

#else

struct Pair {
  double lanes[2];

  double& operator[](std::size_t lane) noexcept { return lanes[lane]; }
  double operator[](std::size_t lane) const noexcept { return lanes[lane]; }
  Pair& operator+=(Pair b) noexcept { return lanes[0] += b[0], lanes[1] += b[1], *this; }
  Pair& operator-=(Pair b) noexcept { return lanes[0] -= b[0], lanes[1] -= b[1], *this; }
  Pair& operator*=(Pair b) noexcept { return lanes[0] *= b[0], lanes[1] *= b[1], *this; }
  Pair& operator/=(Pair b) noexcept { return lanes[0] /= b[0], lanes[1] /= b[1], *this; }
  Pair& operator+=(double b) noexcept { return *this += Pair{b, b}; }
};

inline Pair operator+(Pair a, Pair b) noexcept { return a += b; }
inline Pair operator-(Pair a, Pair b) noexcept { return a -= b; }
inline Pair operator*(Pair a, Pair b) noexcept { return a *= b; }
inline Pair operator/(Pair a, Pair b) noexcept { return a /= b; }
inline Pair operator+(Pair a, double b) noexcept { return a + Pair{b, b}; }
inline Pair operator-(Pair a, double b) noexcept { return a - Pair{b, b}; }
inline Pair operator*(Pair a, double b) noexcept { return a * Pair{b, b}; }
inline Pair operator/(Pair a, double b) noexcept { return a / Pair{b, b}; }
inline Pair operator+(double a, Pair b) noexcept { return Pair{a, a} + b; }
inline Pair operator-(double a, Pair b) noexcept { return Pair{a, a} - b; }
inline Pair operator*(double a, Pair b) noexcept { return Pair{a, a} * b; }
inline Pair operator/(double a, Pair b) noexcept { return Pair{a, a} / b; }

struct Lanes {
  bool holds[2];
};
inline Lanes operator>(Pair a, Pair b) noexcept { return {{a[0] > b[0], a[1] > b[1]}}; }
inline Lanes operator<(Pair a, Pair b) noexcept { return b > a; }
inline Lanes operator>(Pair a, double b) noexcept { return a > Pair{b, b}; }

template <class T>
T chosen(bool holds, T yes, T no) noexcept {
  return holds ? yes : no;
}
inline Pair chosen(Lanes in, Pair yes, Pair no) noexcept {
  return {{in.holds[0] ? yes[0] : no[0], in.holds[1] ? yes[1] : no[1]}};
}

#endif

inline Pair pair_at(const double* first) noexcept { return Pair{first[0], first[1]}; }

}  // namespace needleforce::fit
