// SPDX-License-Identifier: Apache-2.0
// An engine and settings for the tests of a guard around a needle that bends.
#pragma once

#include <array>

#include "bending.hpp"
#include "needleforce/base_guard.hpp"

namespace guarded_bases {

using namespace bending_tests;

inline constexpr double ms = 1e-3, mm = 1e-3, reserve = 1e-5;

/// Asks for the same at every place.
struct Constant {
  double force = 0.0;
  std::array<double, 6> wrench{};
  BentSample step(const Base&, double) noexcept { return {.wrench = wrench, .force = force}; }
};

inline GuardSettings bounds(double speed, double angular_speed) {
  return {.longest_cycle = ms,
          .max_speed = speed,
          .initial_reserve = reserve,
          .max_angular_speed = angular_speed};
}

}  // namespace guarded_bases
