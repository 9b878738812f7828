// SPDX-License-Identifier: Apache-2.0
// Settings of a guard: the device's range, its clock, and the bounds of the user's motion.
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "parameter.hpp"

namespace needleforce {

inline constexpr double unlimited = std::numeric_limits<double>::infinity();
/// No device gets further in a cycle [m]; beyond, energies would have no finite value.
inline constexpr double farthest_in_a_cycle = 1e6;
/// The longest delay that the energy controller follows, in cycles.
inline constexpr int max_delay = 16;

/// Limits between an engine and a device, in the device's own metres and newtons. Infinity switches a limit
/// off, but the force, which is 1 MN at most; without a measurement the force is zero unless `stale_after` or
/// `fall_time` give it time.
struct GuardSettings {
  double force_scale = 1.0;
  double motion_scale = 1.0;
  double max_force = 1e6;
  double max_slew = unlimited;
  double stale_after = 0.0;
  double fall_time = 0.0;
  double max_jump = unlimited;
  double longest_cycle = unlimited;
  double max_speed = unlimited;
  double max_acceleration = unlimited;
  double delay = 0.0;
  double initial_reserve = 1e-5;
  double max_reserve = unlimited;
  double position_error = 0.0;

  static constexpr const char* name = "guard";
  static constexpr const char* summary =
      "Limits between an engine and a device, in SI and the device's range; infinity switches one off.";
  static constexpr std::array<Parameter<GuardSettings>, 14> table{{
      {&GuardSettings::force_scale, "force_scale", "1", 1e-6, 1e6, 1.0, "s_f",
       "force of the device over force of the tissue", "free"},
      {&GuardSettings::motion_scale, "motion_scale", "1", 1e-6, 1e6, 1.0, "s_x",
       "travel in the tissue over travel of the device", "free"},
      {&GuardSettings::max_force, "max_force", "N", 0.0, 1e6, 1e6, "f_max",
       "largest force of the device, either way", "free"},
      {&GuardSettings::max_slew, "max_slew", "N/s", 1e-6, unlimited, unlimited, "r",
       "fastest change of the force, but for a fall to zero", "free"},
      {&GuardSettings::stale_after, "stale_after", "s", 0.0, 1.0, 0.0, "t_s",
       "time for which the force is held without a measurement", "free"},
      {&GuardSettings::fall_time, "fall_time", "s", 0.0, 1.0, 0.0, "t_f",
       "time over which it then falls to zero", "free"},
      {&GuardSettings::max_jump, "max_jump", "m", 1e-9, unlimited, unlimited, "j",
       "longest leap of the depth in a cycle; a longer one is no measurement", "free"},
      {&GuardSettings::longest_cycle, "longest_cycle", "s", 1e-6, unlimited, unlimited, "T",
       "longest cycle that is no pause of the loop", "free"},
      {&GuardSettings::max_speed, "max_speed", "m/s", 1e-6, unlimited, unlimited, "v",
       "speed that the device does not exceed; switches the energy controller on", "free"},
      {&GuardSettings::max_acceleration, "max_acceleration", "m/s^2", 1e-6, unlimited, unlimited, "a",
       "acceleration that it does not exceed; a finite one makes the controller less cautious", "free"},
      {&GuardSettings::delay, "delay", "1", 0.0, max_delay, 0.0, "d",
       "whole cycles by which the measured depth lags behind the device, those of the force included",
       "free"},
      {&GuardSettings::initial_reserve, "initial_reserve", "J", 0.0, 1.0, 1e-5, "E_0",
       "energy lent once, so that a contact can begin", "free"},
      {&GuardSettings::max_reserve, "max_reserve", "J", 0.0, unlimited, unlimited, "E_max",
       "largest energy kept for giving back", "free"},
      {&GuardSettings::position_error, "position_error", "m", 0.0, 1e-3, 0.0, "e",
       "largest error of the measured depth, as half a count of an encoder", "free"},
  }};

  constexpr bool limits_energy() const noexcept { return max_speed < unlimited; }

  /// Which settings contradict each other, or nullptr.
  constexpr const char* contradiction() const noexcept {
    if (delay != static_cast<int>(delay)) return "delay is no whole number of cycles";
    if (!limits_energy()) return max_acceleration < unlimited ? "max_acceleration needs max_speed" : nullptr;
    if (!(longest_cycle < unlimited)) return "max_speed needs longest_cycle: how far can the device get?";
    if (max_speed * longest_cycle > farthest_in_a_cycle)
      return "max_speed times longest_cycle is further than any device gets";
    if (max_reserve < initial_reserve) return "max_reserve is below initial_reserve";
    if (initial_reserve == 0.0 && (max_acceleration == unlimited || position_error > 0.0))
      return "without initial_reserve no force could ever begin: give max_acceleration and no "
             "position_error";
    return nullptr;
  }
};

/// What is wrong with settings: which quantity, and why; `reason` is nullptr if nothing is.
struct GuardFault {
  const char* quantity = nullptr;
  const char* reason = nullptr;
};

/// The first fault of the settings. Wait-free.
constexpr GuardFault first_fault(const GuardSettings& settings) noexcept {
  if (const auto* parameter = first_invalid(settings)) return {parameter->name, "outside its range"};
  return {GuardSettings::name, settings.contradiction()};
}
constexpr bool valid(const GuardSettings& settings) noexcept { return !first_fault(settings).reason; }

}  // namespace needleforce
