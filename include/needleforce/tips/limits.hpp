// SPDX-License-Identifier: Apache-2.0
// What every tip shares: its words for angles, for a profile without end, and for numbers that do not fit
// together.
#pragma once

#include <array>
#include <limits>
#include <numbers>

namespace needleforce::tips {

inline constexpr double degree = std::numbers::pi / 180.0;

/// The end of a profile that goes on for ever.
inline constexpr double endless = std::numeric_limits<double>::infinity();

/// The radii where a profile's slope or curvature jumps; none.
inline constexpr std::array<double, 0> no_breaks{};

/// A number that lies in its own range and does not fit the others; `limit` nullptr is none.
struct Flaw {
  const char* quantity = "";
  int index = -1;  ///< of the entry, where the quantity is a column
  double value = 0.0;
  const char* limit = nullptr;
  const char* next_step = "";
};

}  // namespace needleforce::tips
