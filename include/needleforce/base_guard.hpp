// SPDX-License-Identifier: Apache-2.0
// A guard around a needle that bends: forces and moments of all axes along which its base moves.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>

#include "bending/bent_sample.hpp"
#include "flight_recorder.hpp"
#include "guard.hpp"

namespace needleforce {

/// Anything that turns a base and dt [s] into a row, as `bending::FlexibleInsertion` does.
template <class Engine>
concept MovedByItsBase = requires(Engine& engine, const bending::Base& base) {
  { engine.step(base, 0.0) } noexcept -> std::same_as<bending::BentSample>;
};

/// What a device gives along each coordinate of a base, + where it opposes that coordinate: the work of the
/// hand is the sum of each times its motion.
struct BaseForce {
  double depth = 0.0;               ///< [N], + opposes insertion
  std::array<double, 2> lateral{};  ///< [N] across, along the axes of the tissue
  std::array<double, 2> tilt{};     ///< [N m] by the slopes towards x and y
  double roll = 0.0;                ///< [N m] about the needle
};
using BaseOutput = OutputOf<BaseForce, bending::BentSample>;

/// The force that opposes each motion of a base, of a wrench in the axes of the base: t along the slopes
/// (s_x, s_y, 1), x along e_x - t_x t, y = t x x. A slope turns t and, a little, the axes about it. The
/// needle is moved along against the axial force, also where a guide feeds it. Wait-free.
inline BaseForce opposing(const bending::BentSample& sample, const std::array<double, 2>& slope) noexcept {
  const auto& w = sample.wrench;
  const double length = std::sqrt(1.0 + slope[0] * slope[0] + slope[1] * slope[1]);
  const double t[] = {slope[0] / length, slope[1] / length, 1.0 / length};
  const double across = std::sqrt(1.0 - t[0] * t[0]);
  const double about_x = w[3] + w[5] * t[0] / across;
  const double by_y = (about_x * t[2] + w[4] * t[0] * t[1]) / (length * across);
  const double fx = w[0] * across + w[2] * t[0];
  const double fy = -w[0] * t[0] * t[1] / across + w[1] * t[2] / across + w[2] * t[1];
  return {sample.force, {-fx, -fy}, {-w[4] * across / length, by_y}, -w[5]};
}

/// Along all axes of a base.
template <MovedByItsBase Engine>
struct Guarded<Engine> {
  static constexpr std::size_t axes = axes_of_a_base;
  using Values = std::array<double, axes>;
  using Output = BaseOutput;
  using Motion = bending::Base;

  static Motion scaled(Motion base, const GuardSettings& settings) noexcept {
    base.depth *= settings.motion_scale;
    for (double& each : base.lateral) each *= settings.motion_scale;
    return base;
  }
  /// Angles as far as their energies have finite values.
  static bool possible(const Motion& scaled, double dt) noexcept {
    bool result = ordinary(scaled.depth, no_velocity, dt) && std::abs(scaled.roll) <= farthest_in_a_cycle;
    for (std::size_t d = 0; d < 2; ++d)
      result = result && std::abs(scaled.lateral[d]) <= farthest && std::abs(scaled.tilt[d]) <= 1.0;
    return result;
  }
  static Values places(const Motion& base) noexcept {
    return {base.depth, base.lateral[0], base.lateral[1], base.tilt[0], base.tilt[1], base.roll};
  }
  static bending::BentSample step(Engine& engine, const Motion& scaled, double dt, bool) noexcept {
    return engine.step(scaled, dt);
  }
  /// Moments are scaled such that the work of all has one ratio.
  static Values forces(const bending::BentSample& sample, const Motion& scaled,
                       const GuardSettings& settings) noexcept {
    const BaseForce f = opposing(sample, scaled.tilt);
    const double force = settings.force_scale, moment = settings.force_scale / settings.motion_scale;
    return {force * f.depth,    force * f.lateral[0], force * f.lateral[1],
            moment * f.tilt[0], moment * f.tilt[1],   moment * f.roll};
  }
  static BaseForce force(const Values& v) noexcept { return {v[0], {v[1], v[2]}, {v[3], v[4]}, v[5]}; }
  static Sample& events(bending::BentSample& sample) noexcept { return sample.axial; }
};

/// One cycle of a guard around a needle that bends, for a `FlightRecorder<n, BaseCycle>`.
struct BaseCycle {
  std::uint64_t number = 0;   ///< counts from 0
  double dt = 0.0;            ///< [s] as given
  bending::Base base{};       ///< [m, rad] as given; NaN where none was
  double sample_force = 0.0;  ///< [N] of the tissue along the depth
  BaseForce force{};          ///< [N, N m] for the device
  double energy = 0.0;        ///< [J]
  double reserve = 0.0;       ///< [J]
  Phase phase = Phase::free;
  Status status = Status::ok;
  Interventions did{};

  using Motion = bending::Base;
  using Output = BaseOutput;
  using Words = std::array<std::uint64_t, 17>;
  static Words packed(const Motion& b, double dt, const Output& o) noexcept {
    const double numbers[] = {dt,
                              b.depth,
                              b.lateral[0],
                              b.lateral[1],
                              b.tilt[0],
                              b.tilt[1],
                              b.roll,
                              o.sample.force,
                              o.force.depth,
                              o.force.lateral[0],
                              o.force.lateral[1],
                              o.force.tilt[0],
                              o.force.tilt[1],
                              o.force.roll,
                              o.energy,
                              o.reserve};
    Words words;
    for (std::size_t i = 0; i < std::size(numbers); ++i) words[i] = Cycle::to_word(numbers[i]);
    words[16] = Cycle::to_word(o.sample.axial.phase, o.sample.status, o.did);
    return words;
  }
  static BaseCycle unpacked(std::uint64_t number, const Words& words) noexcept {
    const auto v = [&](std::size_t i) { return std::bit_cast<double>(words[i]); };
    BaseCycle cycle{number,
                    v(0),
                    {v(1), {v(2), v(3)}, {v(4), v(5)}, v(6)},
                    v(7),
                    {v(8), {v(9), v(10)}, {v(11), v(12)}, v(13)},
                    v(14),
                    v(15)};
    Cycle::read_word(words[16], cycle);
    return cycle;
  }
};

}  // namespace needleforce
