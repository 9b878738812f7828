// SPDX-License-Identifier: Apache-2.0
// What the contract tests of the laws share. A law on a list in laws/all.hpp earns them by standing there.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "needleforce/model.hpp"

using namespace needleforce;

// Dimensions: with lengths times s and stresses times m, forces are times m s^2, energies m s^3, masses m s;
// times stay. The units of the table say how each parameter follows, so a formula that disagrees with a unit
// fails, whatever the law. Powers of two, which round nothing away, and so far apart that no two units agree.
constexpr double s = 2.0, m = 128.0;

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

/// A number `place` of the way, 0 to 1, through a range: along its logarithm where the range spans decades,
/// along its nine greatest decades where it ends at zero, and with zero half way where it has both signs.
inline double along(double low, double high, double place) {
  if (low < 0.0 && high > 0.0) return place < 0.5 ? low * (1.0 - 2.0 * place) : high * (2.0 * place - 1.0);
  if (high == 0.0) return -along(0.0, -low, place);
  if (low == 0.0 && high > 100.0) return high * std::pow(10.0, 9.0 * (place - 1.0));
  if (low > 0.0 && high > 100.0 * low) return low * std::pow(high / low, place);
  return low + place * (high - low);
}

/// Moves the numbers of a law, but not `fixed`, about the middle of their ranges, a little further each time,
/// until they do not contradict each other; false if none were found.
template <Parameterised L>
bool agree(L& law, const Parameter<L>* fixed = nullptr) {
  constexpr int tries = 20000;
  std::mt19937_64 generator{1};
  for (int i = 0; i < tries; ++i) {
    for (const auto& parameter : L::table) {
      const double aside = static_cast<double>(generator() >> 11) * 0x1p-53 - 0.5;
      if (&parameter != fixed)
        law.*parameter.member = along(parameter.low, parameter.high, 0.5 + aside * i / tries);
    }
    if (!contradiction(law)) return true;
  }
  return false;
}

/// Tips that a needle of the middle radius, 0.3 mm, may carry: each shape once or more.
inline std::vector<Tip> every_tip() {
  const double angle = 15.0 * tips::degree, radius = 3.1622776601683795e-4;
  const tips::Profile profile{{0.0, 5e-5, 1.2e-4, 2e-4, radius}, {0.0, 2e-5, 1e-4, 3e-4, 1e-3}, 5};
  return {tips::Cone{angle},
          tips::Paraboloid{radius},
          tips::Sphere{radius},
          tips::Flat{radius},
          tips::PowerProfile{1.5, 1e-3, 4e-3},
          tips::TruncatedCone{angle, 5e-5},
          tips::BluntedCone{angle, 2e-5, 0.0},
          tips::BluntedCone{angle, 2e-5, 1.9e-5},
          tips::TangentOgive{radius, 1.3e-3},
          tips::TangentOgive{2.0 * radius, 1.3e-3},
          tips::LancetBevel{angle, tips::BevelEquivalence::equal_length},
          profile};
}

/// A law with every number in the middle of its range, or as near as they do not contradict each other.
template <Parameterised L>
L middle() {
  L law{};
  if constexpr (requires { law.tip; }) law.tip = every_tip().front();
  EXPECT_TRUE(agree(law)) << L::name;
  return law;
}

/// The middle, and laws with one number at either end of its range, where others go with it.
template <Parameterised L>
std::vector<L> across() {
  std::vector<L> laws{middle<L>()};
  for (const auto& parameter : L::table)
    for (const double end : {parameter.low, parameter.high}) {
      L law{};
      law.*parameter.member = end;
      if (agree(law, &parameter)) laws.push_back(law);
    }
  return laws;
}

/// Laws with one number next to none, where none is allowed; its inverse is not finite.
template <Parameterised L>
std::vector<L> next_to_none() {
  std::vector<L> laws;
  for (const auto& parameter : L::table) {
    L law{};
    law.*parameter.member = 1e-310;
    if (parameter.low == 0.0 && agree(law, &parameter)) laws.push_back(law);
  }
  return laws;
}

/// Those across their ranges and those next to none.
template <Parameterised L>
std::vector<L> everywhere() {
  std::vector<L> laws = across<L>();
  for (const L& law : next_to_none<L>()) laws.push_back(law);
  return laws;
}

/// The middle of a law; of one with a tip, one with each.
template <Parameterised L>
std::vector<L> middles() {
  std::vector<L> laws{middle<L>()};
  if constexpr (requires(L law) { law.tip; }) {
    laws.clear();
    for (const Tip& tip : every_tip()) {
      laws.push_back(middle<L>());
      laws.back().tip = tip;
    }
  }
  return laws;
}

/// Laws from all over their ranges; of one with a tip, one with each.
template <Parameterised L>
std::vector<L> cases() {
  if constexpr (requires(L law) { law.tip; })
    return middles<L>();
  else
    return across<L>();
}

/// What a law says its numbers keep of the force it states, relative to the largest.
template <class L>
consteval double accuracy_of() {
  if constexpr (requires { L::accuracy; })
    return L::accuracy;
  else
    return 1e-12;
}

/// Calls `visit` with the middle of every law on a list.
template <class Laws, class Visit>
void with_each(Visit visit) {
  [&]<class... L>(std::variant<L...>*) {
    (
        [&] {
          for (const L& law : middles<L>()) visit(law);
        }(),
        ...);
  }(static_cast<Laws*>(nullptr));
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
                        : name == "kg" ? m * s
                        : name == "1" || name == "rad" || name == "s"
                            ? 1.0
                            : std::numeric_limits<double>::quiet_NaN();  // unknown: every comparison fails
    factor *= std::pow(base, power);
    if (end < unit.size() && unit[end] == '/') sign = -1.0;
    at = end + 1;
  }
  return factor;
}

template <Parameterised L>
L scaled(L law, double s, double m);

inline tips::Profile scaled(tips::Profile profile, double s, double) {
  for (double& r : profile.radius) r *= s;
  for (double& f : profile.rise) f *= s;
  return profile;
}

/// The law in a world with lengths times s and stresses times m, its tip too.
template <Parameterised L>
L scaled(L law, double s, double m) {
  for (const auto& parameter : L::table) law.*parameter.member *= unit_factor(parameter.unit, s, m);
  if constexpr (requires { law.tip; }) std::visit([&](auto& tip) { tip = scaled(tip, s, m); }, law.tip);
  return law;
}
