// SPDX-License-Identifier: Apache-2.0
// Which input a step accepts, and the status of a refused one.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "parameter.hpp"
#include "sample.hpp"

namespace needleforce {

/// Chosen before the loop; the defaults hold for any hand-held or robotic needle.
struct Limits {
  double max_speed = 1.0;
  double velocity_slack = 2e-3;
  double velocity_slack_ratio = 0.5;
  double hold_time = 0.0;
  double depth_noise = 0.0;

  static constexpr const char* name = "limits";
  static constexpr const char* summary = "What a step accepts.";
  static constexpr double endless = std::numeric_limits<double>::infinity();
  static constexpr std::array<Parameter<Limits>, 5> table{{
      {&Limits::max_speed, "max_speed", "m/s", 1e-9, endless, 1.0, "v",
       "speed above which a change of depth is refused; infinity accepts every leap", "free"},
      {&Limits::velocity_slack, "velocity_slack", "m/s", 0.0, endless, 2e-3, "dv",
       "difference allowed between velocity and change of depth", "free"},
      {&Limits::velocity_slack_ratio, "velocity_slack_ratio", "1", 0.0, endless, 0.5, "r",
       "the same difference as a share of the larger of the two", "free"},
      {&Limits::hold_time, "hold_time", "s", 0.0, 1.0, 0.0, "t_h",
       "time for which a refused step keeps the last force; after it the force is 0", "free"},
      {&Limits::depth_noise, "depth_noise", "m", 0.0, 1e-3, 0.0, "w",
       "half the range of the measured depth at rest; a reversal is felt twice as much later", "free"},
  }};
};

/// True if every limit is in its range.
inline bool valid(const Limits& limits) noexcept { return !first_invalid(limits); }

/// Pass as velocity where none is measured: the step takes the change of depth over dt.
inline constexpr double no_velocity = std::numeric_limits<double>::max();

/// Largest depth, and largest distance above the tissue [m].
inline constexpr double farthest = 1.0;
/// No cycle is longer [s].
inline constexpr double longest = 1e9;
/// No needle is faster [m/s], even where every jump is accepted: rates beyond have no finite force.
inline constexpr double fastest = 1e9;

/// True for input in the valid ranges: four comparisons, which NaN and infinity fail too.
/// Wait-free.
inline bool ordinary(double depth, double velocity, double dt) noexcept {
  return std::abs(depth) <= farthest && dt > 0.0 && dt <= longest &&
         (velocity == no_velocity || std::abs(velocity) <= fastest);
}

/// The status of input that is not ordinary. Wait-free.
inline Status refusal(double depth, double velocity, double dt) noexcept {
  const bool finite = std::isfinite(depth) && std::isfinite(dt) && std::isfinite(velocity);
  return finite ? Status::outside_range : Status::not_finite;
}

/// True if a travel [m] within a time [s] is one that the needle can have made, and the velocity, where one
/// is given, is that of the travel. Wait-free.
inline bool consistent(const Limits& limits, double travel, double velocity, double elapsed) noexcept {
  const double noise = 2.0 * limits.depth_noise;
  constexpr double rounding = 1.0 + 1e-9;  // of a part of a step at the limit
  if (std::abs(travel) > rounding * std::min(limits.max_speed, fastest) * elapsed + noise) return false;
  if (velocity == no_velocity) return true;
  const double measured = travel / elapsed, larger = std::max(std::abs(velocity), std::abs(measured));
  const double slack = limits.velocity_slack, apart = std::abs(velocity - measured) - noise / elapsed;
  // noise allows a depth to leap, but no velocity beyond those that are accepted without
  const double own = (1.0 - limits.velocity_slack_ratio) * std::abs(velocity);
  return apart <= slack + limits.velocity_slack_ratio * larger &&
         (noise == 0.0 || own <= limits.max_speed + slack);
}

}  // namespace needleforce
