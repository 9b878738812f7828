// SPDX-License-Identifier: Apache-2.0
// Between an engine and a haptic device: no invalid measurement in, no invalid force out.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
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
  bool clamped = false;   ///< by `max_force`, `max_lateral_force`, `max_moment`
  bool slewed = false;    ///< by `max_slew`, `max_lateral_slew`, `max_moment_slew`
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
template <class Force, class Row>
struct OutputOf {
  Force force{};         ///< [N] for the device, + opposes insertion
  double energy = 0.0;   ///< [J] put in by the user so far minus the energy taken out, as measured
  double reserve = 0.0;  ///< [J] that the user may still take out, for any motion since the last measurement
  Interventions did{};
  Row sample{};  ///< of the engine; without a measurement the last one, without its events
};
using Output = OutputOf<double, Sample>;

/// How a guard moves an engine of a kind, and what the device gets of it: a specialisation for each kind.
template <class Engine>
struct Guarded;

/// Where a device is along the depth [m], and its velocity [m/s] or `no_velocity`.
struct DepthMotion {
  double depth = 0.0, velocity = no_velocity;
};

/// Along the depth.
template <Steppable Engine>
struct Guarded<Engine> {
  static constexpr std::size_t axes = axes_of_a_depth;
  using Values = std::array<double, axes>;
  using Output = needleforce::Output;
  using Motion = DepthMotion;

  static Motion scaled(const Motion& motion, const GuardSettings& settings) noexcept {
    const double velocity = motion.velocity;
    return {settings.motion_scale * motion.depth,
            velocity == no_velocity ? velocity : settings.motion_scale * velocity};
  }
  static bool possible(const Motion& scaled, double dt) noexcept {
    return ordinary(scaled.depth, scaled.velocity, dt);
  }
  static Values places(const Motion& motion) noexcept { return {motion.depth}; }
  /// Over a gap the engine receives what it can check: the travel, not the velocity at its end.
  static Sample step(Engine& engine, const Motion& scaled, double dt, bool gap) noexcept {
    return engine.step(scaled.depth, gap ? no_velocity : scaled.velocity, dt);
  }
  static Values forces(const Sample& sample, const Motion&, const GuardSettings& settings) noexcept {
    return {settings.force_scale * sample.force};
  }
  static double force(const Values& values) noexcept { return values[0]; }
  static Sample& events(Sample& sample) noexcept { return sample; }
};

/// An engine and a device's limits: scale, clamp, slew, watchdog, energy, in this order, so that the last
/// guarantee always holds; a fall to zero is never slowed. Trivially copyable where the engine is.
/// `Guard<Engine&>` leaves the engine with its owner. For one thread at a time. base_guard.hpp has the
/// needles that bend.
template <class Engine>
class Guard {
  using Kind = Guarded<std::remove_reference_t<Engine>>;
  using Values = typename Kind::Values;
  static constexpr std::size_t axes = Kind::axes;

 public:
  using Motion = typename Kind::Motion;
  using Output = typename Kind::Output;

  /// With invalid settings every cycle gives force 0 and `invalid_parameter`; `first_fault` returns the
  /// reason.
  explicit Guard(Engine engine, const GuardSettings& settings = {}) noexcept
      : engine_(std::forward<Engine>(engine)), settings_(settings), valid_(valid(settings, axes)) {
    if (valid_) state_.energy = EnergyController<axes>(settings);
  }

  /// A cycle with a measurement: where the device is from where the tissue begins, `dt` [s] since the last
  /// cycle of either kind. Wait-free if the engine's step is.
  Output step(const Motion& motion, double dt) noexcept {
    if (!valid_) return refused();
    const bool timed = clocked(dt);
    const Motion scaled = Kind::scaled(motion, settings_);
    const Values places = Kind::places(motion);
    if (!timed || !Kind::possible(scaled, dt) || leaps(places)) return without(timed ? dt : unknown, true);
    return with(scaled, places, dt);
  }
  /// The same along the depth: `depth` [m] of the device, `velocity` [m/s] or `no_velocity`.
  Output step(double depth, double velocity, double dt) noexcept
    requires(axes == axes_of_a_depth)
  {
    return step(Motion{depth, velocity}, dt);
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
    if (valid_) state_.energy = EnergyController<axes>(settings_);
  }

  const std::remove_reference_t<Engine>& engine() const noexcept { return engine_; }
  const GuardSettings& settings() const noexcept { return settings_; }

 private:
  struct State {
    EnergyController<axes> energy{};
    decltype(Output::sample) sample{};
    Values places{};       // of the last measurement [m, rad]
    Values force{};        // of the last cycle [N, N m]
    Values measured{};     // of the last cycle with a measurement
    double waited = 0.0;   // since then [s]
    double longest = 0.0;  // of all cycles whose clock ran
    int missed = 0;
    bool started = false;
  };

  static bool clocked(double dt) noexcept { return dt > 0.0 && dt <= longest; }
  static Output refused() noexcept { return {.sample = {.status = Status::invalid_parameter}}; }

  /// True for a jump: a place too far from the last one; missed cycles widen the limit.
  bool leaps(const Values& places) const noexcept {
    bool leap = false;
    for (std::size_t i = 0; i < axes; ++i)
      leap |= std::abs(places[i] - state_.places[i]) > settings_.jump(i) * (state_.missed + 1.0);
    return state_.started && leap;
  }

  Output with(const Motion& scaled, const Values& places, double dt) noexcept {
    const double elapsed = std::min(state_.waited + dt, longest);
    state_.sample = Kind::step(engine_, scaled, elapsed, state_.missed > 0);
    Output output{.sample = state_.sample};
    const Values wanted = within_range(Kind::forces(state_.sample, scaled, settings_), dt, output.did);
    state_.places = places;
    state_.longest = std::max(state_.longest, dt);
    state_.waited = 0.0;
    state_.missed = 0;
    state_.started = true;
    emit(output, wanted, places, dt);
    state_.measured = state_.force;
    return output;
  }

  /// Clamp and slew; a pause of the loop does not count as time in which the force could have moved.
  Values within_range(Values force, double dt, Interventions& did) const noexcept {
    for (double& each : force)
      if (!std::isfinite(each)) each = 0.0;
    const double time = std::min(dt, settings_.longest_cycle);
    for (const ForceLimit& limit : force_limits) {
      if (limit.from >= axes) break;
      did.clamped |= bring_near(force, Values{}, limit, settings_.*limit.most);
      did.slewed |= bring_near(force, state_.force, limit, settings_.*limit.slew * time);
    }
    return force;
  }
  /// What lies farther from `centre` than `most` is moved to there; returns whether it did.
  static bool bring_near(Values& force, const Values& centre, const ForceLimit& limit, double most) noexcept {
    if (limit.to == limit.from + 1) {
      double& one = force[limit.from];
      const double before = one, middle = centre[limit.from];
      one = std::clamp(one, middle - most, middle + most);
      return one != before;
    }
    double largest = 0.0, squares = 0.0;
    for (std::size_t i = limit.from; i < limit.to; ++i)
      largest = std::max(largest, std::abs(force[i] - centre[i]));
    if (!(largest > 0.0)) return false;
    // scaled, for the square of a large force is infinite
    for (std::size_t i = limit.from; i < limit.to; ++i) {
      const double share = (force[i] - centre[i]) / largest;
      squares += share * share;
    }
    const double distance = largest * std::sqrt(squares);
    if (!(distance > most)) return false;
    for (std::size_t i = limit.from; i < limit.to; ++i)
      force[i] = centre[i] + (force[i] - centre[i]) / distance * most;
    return true;
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
    Values wanted, nowhere;
    for (std::size_t i = 0; i < axes; ++i) {
      const double most = std::abs(state_.force[i]);
      wanted[i] = std::clamp(share * state_.measured[i], -most, most);
      nowhere[i] = unknown;
    }
    Output output{.sample = state_.sample};
    Sample& events = Kind::events(output.sample);
    events.contact = events.punctured = events.exit = false;
    output.did.rejected = rejected;
    output.did.stale = over > 0.0;
    emit(output, wanted, nowhere, dt);
    return output;
  }

  void emit(Output& output, const Values& wanted, const Values& places, double dt) noexcept {
    state_.force = state_.energy.limit(wanted, places, dt);
    output.force = Kind::force(state_.force);
    output.energy = state_.energy.energy();
    output.reserve = state_.energy.reserve();
    output.did.limited_by_energy = state_.force != wanted;
    output.did.outside_bounds = state_.energy.outside_bounds();
  }

  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

  Engine engine_;
  GuardSettings settings_;
  bool valid_;
  State state_{};
};

}  // namespace needleforce
