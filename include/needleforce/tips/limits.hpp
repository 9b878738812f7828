// SPDX-License-Identifier: Apache-2.0
// What all tips share: degrees, the end of an infinite profile, and parameters that contradict each other.
#pragma once

#include <array>
#include <limits>
#include <numbers>

namespace needleforce::tips {

inline constexpr double degree = std::numbers::pi / 180.0;

/// The end of an infinite profile.
inline constexpr double endless = std::numeric_limits<double>::infinity();

/// The radii where a profile's slope or curvature jumps; none.
inline constexpr std::array<double, 0> no_breaks{};

/// A parameter that is in its range and contradicts another; none if `limit` is nullptr.
struct Flaw {
  const char* quantity = "";
  int index = -1;  ///< of the entry, where the quantity is a column
  double value = 0.0;
  const char* limit = nullptr;
  const char* next_step = "";
};

}  // namespace needleforce::tips
