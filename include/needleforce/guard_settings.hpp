// SPDX-License-Identifier: Apache-2.0
// Settings of a guard: the device's range, its clock, and the bounds of the user's motion.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "parameter.hpp"

namespace needleforce {

inline constexpr double unlimited = std::numeric_limits<double>::infinity();
/// No device gets further in a cycle [m]; beyond, energies would have no finite value.
inline constexpr double farthest_in_a_cycle = 1e6;
/// The longest delay that the energy controller follows, in cycles.
inline constexpr int max_delay = 16;

/// How a needle's base moves: along the depth alone, or also across (two), in tilt (two) and roll.
inline constexpr std::size_t axes_of_a_depth = 1, axes_of_a_base = 6, first_turning_axis = 3;

/// Limits between an engine and a device, in the device's own metres and newtons. Infinity switches a limit
/// off, but forces and moments, which are 1 MN and 1 MN m at most; without a measurement the force is zero
/// unless `stale_after` or `fall_time` give it time. The last eight are for a base that moves across and
/// turns; for it, `max_speed`, `max_acceleration`, `max_jump` and `position_error` hold across, too.
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
  double max_lateral_force = 1e6;
  double max_lateral_slew = unlimited;
  double max_moment = 1e6;
  double max_moment_slew = unlimited;
  double max_angular_jump = unlimited;
  double max_angular_speed = unlimited;
  double max_angular_acceleration = unlimited;
  double angle_error = 0.0;

  static constexpr const char* name = "guard";
  static constexpr const char* summary =
      "Limits between an engine and a device, in SI and the device's range; infinity switches one off.";
  static constexpr std::size_t settings_of_a_depth = 14;  // the first rows of the table
  static constexpr std::array<Parameter<GuardSettings>, 22> table{{
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
      {&GuardSettings::max_lateral_force, "max_lateral_force", "N", 0.0, 1e6, 1e6, "f_l",
       "largest force across", "free"},
      {&GuardSettings::max_lateral_slew, "max_lateral_slew", "N/s", 1e-6, unlimited, unlimited, "r_l",
       "fastest change of the force across", "free"},
      {&GuardSettings::max_moment, "max_moment", "N m", 0.0, 1e6, 1e6, "m_max",
       "largest moment of tilt and roll together", "free"},
      {&GuardSettings::max_moment_slew, "max_moment_slew", "N m/s", 1e-6, unlimited, unlimited, "r_m",
       "fastest change of the moment", "free"},
      {&GuardSettings::max_angular_jump, "max_angular_jump", "rad", 1e-9, unlimited, unlimited, "j_a",
       "longest leap of a tilt or the roll in a cycle", "free"},
      {&GuardSettings::max_angular_speed, "max_angular_speed", "rad/s", 1e-6, unlimited, unlimited, "w",
       "speed that no tilt and no roll exceeds; needed with max_speed", "free"},
      {&GuardSettings::max_angular_acceleration, "max_angular_acceleration", "rad/s^2", 1e-6, unlimited,
       unlimited, "w_a", "acceleration that none of them exceeds", "free"},
      {&GuardSettings::angle_error, "angle_error", "rad", 0.0, 1.0, 0.0, "e_a",
       "largest error of a measured tilt or roll", "free"},
  }};

  constexpr bool limits_energy() const noexcept { return max_speed < unlimited; }
  /// The bounds of one of the axes.
  constexpr double speed(std::size_t axis) const noexcept {
    return axis < first_turning_axis ? max_speed : max_angular_speed;
  }
  constexpr double acceleration(std::size_t axis) const noexcept {
    return axis < first_turning_axis ? max_acceleration : max_angular_acceleration;
  }
  constexpr double error(std::size_t axis) const noexcept {
    return axis < first_turning_axis ? position_error : angle_error;
  }
  constexpr double jump(std::size_t axis) const noexcept {
    return axis < first_turning_axis ? max_jump : max_angular_jump;
  }

  /// Which settings contradict each other, or nullptr.
  constexpr const char* contradiction() const noexcept {
    const bool turns = max_angular_speed < unlimited;
    if (delay != static_cast<int>(delay)) return "delay is no whole number of cycles";
    if (!turns && max_angular_acceleration < unlimited)
      return "max_angular_acceleration needs max_angular_speed";
    if (turns && !limits_energy()) return "max_angular_speed needs max_speed";
    if (!limits_energy()) return max_acceleration < unlimited ? "max_acceleration needs max_speed" : nullptr;
    if (!(longest_cycle < unlimited)) return "max_speed needs longest_cycle: how far can the device get?";
    if (max_speed * longest_cycle > farthest_in_a_cycle)
      return "max_speed times longest_cycle is further than any device gets";
    if (turns && max_angular_speed * longest_cycle > farthest_in_a_cycle)
      return "max_angular_speed times longest_cycle is further than any device gets";
    if (max_reserve < initial_reserve) return "max_reserve is below initial_reserve";
    if (initial_reserve == 0.0 && (max_acceleration == unlimited || position_error > 0.0))
      return "without initial_reserve no force could ever begin: give max_acceleration and no "
             "position_error";
    return nullptr;
  }

  /// Which settings do not go together with an engine that moves along so many axes, or nullptr.
  constexpr const char* misfit(std::size_t axes) const noexcept {
    if (axes > axes_of_a_depth)
      return limits_energy() && !(max_angular_speed < unlimited)
                 ? "max_speed needs max_angular_speed: how far can the base turn?"
                 : nullptr;
    for (std::size_t i = settings_of_a_depth; i < table.size(); ++i)
      if (this->*table[i].member != table[i].initial)
        return "a lateral or angular limit is for a needle that bends: along the depth nothing else moves";
    return nullptr;
  }
};

/// Forces that are limited together, by their magnitude.
struct ForceLimit {
  std::size_t from, to;  ///< axes, the last one not included
  double GuardSettings::* most;
  double GuardSettings::* slew;
};
inline constexpr ForceLimit force_limits[] = {
    {0, 1, &GuardSettings::max_force, &GuardSettings::max_slew},
    {1, first_turning_axis, &GuardSettings::max_lateral_force, &GuardSettings::max_lateral_slew},
    {first_turning_axis, axes_of_a_base, &GuardSettings::max_moment, &GuardSettings::max_moment_slew}};

/// What is wrong with settings: which quantity, and why; `reason` is nullptr if nothing is.
struct GuardFault {
  const char* quantity = nullptr;
  const char* reason = nullptr;
};

/// The first fault of the settings, for an engine that moves along so many axes. Wait-free.
constexpr GuardFault first_fault(const GuardSettings& settings, std::size_t axes = axes_of_a_depth) noexcept {
  if (const auto* parameter = first_invalid(settings)) return {parameter->name, "outside its range"};
  const char* contradiction = settings.contradiction();
  return {GuardSettings::name, contradiction ? contradiction : settings.misfit(axes)};
}
constexpr bool valid(const GuardSettings& settings, std::size_t axes = axes_of_a_depth) noexcept {
  return !first_fault(settings, axes).reason;
}

}  // namespace needleforce
