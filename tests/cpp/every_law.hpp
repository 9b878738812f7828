// SPDX-License-Identifier: Apache-2.0
// What the contract tests of the laws share. A law on a list in laws/all.hpp earns them by standing there.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "needleforce/model.hpp"

using namespace needleforce;

// Dimensions: with lengths times s and stresses times m, forces are times m s^2, energies m s^3. The units of
// the table say how each parameter follows, so a formula that disagrees with a unit fails, whatever the law.
constexpr double s = 1.5, m = 3.0;

template <class V>
struct AsTypes;
template <class... L>
struct AsTypes<std::variant<L...>> {
  using type = ::testing::Types<L...>;
};
template <class... V>
struct Joined;
template <class... A>
struct Joined<std::variant<A...>> {
  using type = std::variant<A...>;
};
template <class... A, class... B, class... Rest>
struct Joined<std::variant<A...>, std::variant<B...>, Rest...> : Joined<std::variant<A..., B...>, Rest...> {};

/// A law with every number in the middle of its range, in the sense of a logarithm where the range spans
/// decades.
template <Parameterised L>
L middle() {
  L law{};
  for (const auto& parameter : L::table) {
    const bool wide = parameter.low > 0.0 && parameter.high > 100.0 * parameter.low;
    law.*parameter.member =
        wide ? std::sqrt(parameter.low * parameter.high) : 0.5 * (parameter.low + parameter.high);
  }
  return law;
}

/// The middle, and the middle with one number at either end of its range.
template <Parameterised L>
std::vector<L> across() {
  std::vector<L> laws{middle<L>()};
  for (const auto& parameter : L::table)
    for (const double end : {parameter.low, parameter.high}) {
      laws.push_back(middle<L>());
      laws.back().*parameter.member = end;
    }
  return laws;
}

/// Calls `visit` with the middle of every law on a list.
template <class Laws, class Visit>
void with_each(Visit visit) {
  [&]<class... L>(std::variant<L...>*) { (visit(middle<L>()), ...); }(static_cast<Laws*>(nullptr));
}

/// What a unit such as "N/m^2" becomes when lengths are times s and stresses times m; times stay.
inline double unit_factor(const std::string& unit, double s, double m) {
  double factor = 1.0, sign = 1.0;
  for (std::size_t at = 0; at < unit.size();) {
    const std::size_t end = std::min(unit.find_first_of(" /", at), unit.size());
    const std::string word = unit.substr(at, end - at), name = word.substr(0, word.find('^'));
    const double power = sign * (name.size() < word.size() ? std::stod(word.substr(name.size() + 1)) : 1.0);
    const double base = name == "m"    ? s
                        : name == "Pa" ? m
                        : name == "N"  ? m * s * s
                        : name == "J"  ? m * s * s * s
                        : name == "1" || name == "rad" || name == "s"
                            ? 1.0
                            : std::numeric_limits<double>::quiet_NaN();  // unknown: every comparison fails
    factor *= std::pow(base, power);
    if (end < unit.size() && unit[end] == '/') sign = -1.0;
    at = end + 1;
  }
  return factor;
}

/// The law in a world with lengths times s and stresses times m.
template <Parameterised L>
L scaled(L law, double s, double m) {
  for (const auto& parameter : L::table) law.*parameter.member *= unit_factor(parameter.unit, s, m);
  return law;
}

/// Travels in and out [m], their sizes spread evenly over six decades up to `largest`; always the same.
inline std::vector<double> random_travels(int n, double largest = 1e-2) {
  std::mt19937_64 generator{1};
  std::uniform_real_distribution<double> decade{-6.0, 0.0};
  std::vector<double> travels;
  double depth = 0.0;
  for (int i = 0; i < n; ++i) {
    const double size = largest * std::pow(10.0, decade(generator));
    const bool inwards =
        std::abs(depth) > 2.0 * largest ? depth < 0.0 : generator() % 2 == 0;  // not far away
    travels.push_back(inwards ? size : -size);
    depth += travels.back();
  }
  return travels;
}

/// The travel [m] over which a growing quantity makes half its way: a law's own scale.
template <class Quantity>
inline double half_way(Quantity quantity) {
  double low = 0.0, high = 1.0;
  const double half = 0.5 * (quantity(low) + quantity(high));
  for (int i = 0; i < 60; ++i) (quantity(0.5 * (low + high)) < half ? low : high) = 0.5 * (low + high);
  return high;
}

/// The least work of the paths that follow the first travels, one more each time, and close straight to the
/// start, over the work that was turned over on the way; the integral itself is good to 1e-4.
template <class Advance, class Force>
inline double least_closed_work(double scale, Advance advance, Force force) {
  struct Walk {
    double state = 0.0, z = 0.0, work = 0.0, turned = 0.0;
  } walk;
  const auto move = [&](Walk& w, double travel) {
    const int steps = static_cast<int>(std::ceil(std::abs(travel) / (0.01 * scale)));
    for (int i = 0; i < steps; ++i) {
      const double before = force(w.state, w.z), dz = travel / steps;
      w.state = advance(w.state, w.z, dz);
      w.z += dz;
      const double part = 0.5 * (before + force(w.state, w.z)) * dz;
      w.work += part;
      w.turned += std::abs(part);
    }
  };
  double least = std::numeric_limits<double>::infinity();
  for (const double travel : random_travels(200, 50.0 * scale)) {
    move(walk, travel);
    Walk closing = walk;
    move(closing, -closing.z);
    least = std::min(least, closing.work / closing.turned);
  }
  return least;
}

/// True if a derivative agrees with one of some finite differences.
inline bool is_one_of(double derivative, std::initializer_list<double> differences) {
  const auto near = [=](double d) { return std::abs(derivative - d) <= 1e-4 * std::abs(derivative) + 1e-4; };
  return std::any_of(differences.begin(), differences.end(), near);
}
template <class... D>
bool is_one_of(double derivative, double first, D... rest) {
  return is_one_of(derivative, {first, rest...});
}
