// SPDX-License-Identifier: Apache-2.0
// Between an engine and a haptic device: no invalid measurement in, no invalid force out.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <type_traits>
#include <utility>

#include "energy_controller.hpp"
#include "guard_settings.hpp"
#include "limits.hpp"
#include "sample.hpp"

namespace needleforce {

/// Anything that turns depth [m], velocity [m/s] and dt [s] into a sample, as `Insertion` does.
template <class Engine>
concept Steppable = requires(Engine& engine) {
  { engine.step(0.0, 0.0, 0.0) } noexcept -> std::same_as<Sample>;
};

/// What the guard did in a cycle.
struct Interventions {
  bool rejected = false;  ///< invalid measurement: not finite, a jump, or a clock that did not advance
  bool stale = false;     ///< without a measurement for longer than `stale_after`: falling to zero
  bool clamped = false;   ///< by `max_force`
  bool slewed = false;    ///< by `max_slew`
  bool limited_by_energy = false;  ///< by the energy that the user has put in
  bool outside_bounds = false;     ///< faster, or a longer cycle, than the energy controller counts on
};
inline constexpr const char* intervention_names[] = {
    "rejected", "stale", "clamped", "slewed", "limited_by_energy", "outside_bounds"};
/// The same in the same order, which is that of the bits in a record.
inline constexpr bool Interventions::* interventions[] = {
    &Interventions::rejected,          &Interventions::stale,
    &Interventions::clamped,           &Interventions::slewed,
    &Interventions::limited_by_energy, &Interventions::outside_bounds};

/// A cycle of the guard, in the device's newtons and metres but for the sample, which is the tissue's.
struct Output {
  double force = 0.0;    ///< [N] for the device, + opposes insertion
  double energy = 0.0;   ///< [J] put in by the user so far minus the energy taken out, as measured
  double reserve = 0.0;  ///< [J] that the user may still take out, for any motion since the last measurement
  Interventions did{};
  Sample sample{};  ///< of the engine; without a measurement the last one, without its events
};

/// An engine and a device's limits: scale, clamp, slew, watchdog, energy, in this order, so that the last
/// guarantee always holds; a fall to zero is never slowed. Trivially copyable where the engine is.
/// `Guard<Engine&>` leaves the engine with its owner. For one thread at a time.
template <class Engine>
  requires Steppable<std::remove_reference_t<Engine>>
class Guard {
 public:
  /// With invalid settings every cycle gives force 0 and `invalid_parameter`; `first_fault` returns the
  /// reason.
  explicit Guard(Engine engine, const GuardSettings& settings = {}) noexcept
      : engine_(std::forward<Engine>(engine)), settings_(settings), valid_(valid(settings)) {
    if (valid_) state_.energy = EnergyController(settings);
  }

  /// A cycle with a measurement: `depth` [m] of the device from where the tissue begins, `velocity` [m/s] or
  /// `no_velocity`, `dt` [s] since the last cycle of either kind. Wait-free if the engine's step is.
  Output step(double depth, double velocity, double dt) noexcept {
    if (!valid_) return refused();
    const bool timed = clocked(dt);
    const double scaled = velocity == no_velocity ? velocity : settings_.motion_scale * velocity;
    if (!timed || !ordinary(settings_.motion_scale * depth, scaled, dt) || leaps(depth))
      return without(timed ? dt : unknown, true);
    return with(depth, scaled, dt);
  }

  /// A cycle in which no measurement came. Wait-free.
  Output miss(double dt) noexcept {
    if (!valid_) return refused();
    return clocked(dt) ? without(dt, false) : without(unknown, true);
  }

  /// Back to before the first contact: zero force, the initial reserve, and the engine too.
  void reset() noexcept {
    if constexpr (requires { engine_.reset(); }) engine_.reset();
    state_ = State{};
    if (valid_) state_.energy = EnergyController(settings_);
  }

  const std::remove_reference_t<Engine>& engine() const noexcept { return engine_; }
  const GuardSettings& settings() const noexcept { return settings_; }

 private:
  struct State {
    EnergyController energy{};
    Sample sample{};
    double depth = 0.0;     // of the last measurement [m]
    double force = 0.0;     // of the last cycle [N]
    double measured = 0.0;  // of the last cycle with a measurement [N]
    double waited = 0.0;    // since then [s]
    double longest = 0.0;   // of all cycles whose clock ran
    int missed = 0;
    bool started = false;
  };

  static bool clocked(double dt) noexcept { return dt > 0.0 && dt <= longest; }
  static Output refused() noexcept { return {.sample = {.status = Status::invalid_parameter}}; }

  /// True for a jump: a depth too far from the last one; missed cycles widen the limit.
  bool leaps(double depth) const noexcept {
    return state_.started && std::abs(depth - state_.depth) > settings_.max_jump * (state_.missed + 1.0);
  }

  Output with(double depth, double velocity, double dt) noexcept {
    const double elapsed = std::min(state_.waited + dt, longest);
    // over a gap the engine receives what it can check: the travel, not the velocity at its end
    state_.sample =
        engine_.step(settings_.motion_scale * depth, state_.missed ? no_velocity : velocity, elapsed);
    Output output{.sample = state_.sample};
    const double wanted = within_range(settings_.force_scale * state_.sample.force, dt, output.did);
    state_.depth = depth;
    state_.longest = std::max(state_.longest, dt);
    state_.waited = 0.0;
    state_.missed = 0;
    state_.started = true;
    emit(output, wanted, depth, dt);
    state_.measured = output.force;
    return output;
  }

  /// Clamp and slew; a pause of the loop does not count as time in which the force could have moved.
  double within_range(double force, double dt, Interventions& did) const noexcept {
    if (!std::isfinite(force)) force = 0.0;
    const double clamped = std::clamp(force, -settings_.max_force, settings_.max_force);
    const double most = settings_.max_slew * std::min(dt, settings_.longest_cycle);
    const double slewed = std::clamp(clamped, state_.force - most, state_.force + most);
    did.clamped = clamped != force;
    did.slewed = slewed != clamped;
    return slewed;
  }

  /// The force of the last measurement, held and then falling; it never grows again by itself.
  Output without(double dt, bool rejected) noexcept {
    state_.longest = std::max(state_.longest, dt);
    // a cycle of unknown length may have been as long as any
    const double passed = dt == dt ? dt : std::min(settings_.longest_cycle, state_.longest);
    state_.waited = std::min(state_.waited + passed, longest);
    state_.missed = std::min(state_.missed + 1, 1 << 30);
    const double over = state_.waited - settings_.stale_after;
    // not divided by a time of 0, nor of -0: that would be a force that grows, or none
    const double left = settings_.fall_time - over;
    const double share = over <= 0.0 ? 1.0 : left > 0.0 ? left / settings_.fall_time : 0.0;
    const double most = std::abs(state_.force);
    Output output{.sample = state_.sample};
    output.sample.contact = output.sample.punctured = output.sample.exit = false;
    output.did.rejected = rejected;
    output.did.stale = over > 0.0;
    emit(output, std::clamp(share * state_.measured, -most, most), unknown, dt);
    return output;
  }

  void emit(Output& output, double wanted, double depth, double dt) noexcept {
    output.force = state_.force = state_.energy.limit(wanted, depth, dt);
    output.energy = state_.energy.energy();
    output.reserve = state_.energy.reserve();
    output.did.limited_by_energy = output.force != wanted;
    output.did.outside_bounds = state_.energy.outside_bounds();
  }

  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

  Engine engine_;
  GuardSettings settings_;
  bool valid_;
  State state_{};
};

}  // namespace needleforce
