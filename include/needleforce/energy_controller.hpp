// SPDX-License-Identifier: Apache-2.0
// The energy that a user has put into a force held over each cycle, and the force that this energy allows.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <utility>

#include "guard_settings.hpp"

namespace needleforce {

/// Energy observer and passivity controller for a force that is held over each cycle.
///
/// Cycle k emits f_k (+ opposes inward motion), held until cycle k+1; the device is then at x_k. The user
/// puts in
///
///     E = sum over j of f_j (x_{j+1} - x_j)
///
/// exactly, whatever happens between the samples. Cycle k measures x_{k-d}: intervals up to k-d-1 are
/// settled, the d after them pending, and k is to come. For an interval that is not settled, the travel
/// against f is at most w: v T, with |speed| <= v and cycles <= T; with |acceleration| <= a also
/// (a g - u) T, where u is the mean speed of the last settled interval along f and g the time between the two
/// centres, because mean speeds of intervals whose centres are g apart differ by at most a g. So
///
///     E >= L(f_k) = E_0 + settled - sum of |f_j| w_j over pending - |f_k| w_k.
///
/// f_k is bounded such that L >= 0, or has w_k = 0 and can only add, or is zero and changes nothing. By
/// induction the user never takes out more than was put in plus E_0. The bound holds between samples too: the
/// travel against f since the last sample is at most w too, as v T and the parabola of a bound it there.
///
/// Below that bound each force uses no more than its share; otherwise the force would alternate between full
/// and zero over d+1 cycles. A depth known to an error e changes the settled sum by at most e (|f_k| + sum of
/// |f_j - f_{j-1}|), which is set aside. Travel of several cycles without a measurement is settled at once:
/// however it was shared among them, forces about their middle cost no more than their spread over the
/// possible travel. Dissipation raises the reserve without bound, and with it what an active tissue could
/// return at once: `max_reserve` caps it. A first contact needs E_0, or a speed that `max_acceleration`
/// cannot reverse in time. Wait-free, trivially copyable.
class EnergyController {
 public:
  EnergyController() = default;
  explicit EnergyController(const GuardSettings& settings) noexcept
      : settings_(settings), delay_(static_cast<int>(settings.delay)), reserve_(settings.initial_reserve) {}

  /// The force [N] to hold until the next call, no further from zero than `wanted`. `depth` [m] of the device
  /// as measured now, NaN where it was not; `dt` [s] since the last call. Wait-free.
  double limit(double wanted, double depth, double dt) noexcept {
    outside_ = settings_.limits_energy() && dt > rounding * settings_.longest_cycle;
    at(1).length = dt;
    awaited_.add(at(delay_ + 1));
    if (depth == depth) measured(depth);
    const double before = at(1).force, force = bounded(wanted, std::abs(before));
    reserve_ -= settings_.position_error * std::abs(force - before);
    at(0) = {force, 0.0};
    ++cycle_;
    return force;
  }

  /// Energy [J] that the user has put in so far minus the energy taken out, as measured.
  double energy() const noexcept { return energy_; }
  /// Energy [J] that the user may still take out, for any motion since the last measurement: L of the last
  /// call.
  double reserve() const noexcept { return left_; }
  /// True if a cycle, speed or acceleration of the last call exceeded the bounds: the guarantee fails for it.
  bool outside_bounds() const noexcept { return outside_; }

 private:
  struct HeldForce {
    double force = 0.0, length = 0.0;
  };
  /// Intervals whose end should have been measured by now.
  struct Awaited {
    int count = 0;
    double low = 0.0, high = 0.0, sum = 0.0, length = 0.0;
    void add(const HeldForce& held) noexcept {
      low = count ? std::min(low, held.force) : held.force;
      high = count ? std::max(high, held.force) : held.force;
      sum += std::abs(held.force);
      length += held.length;
      count = std::min(count + 1, 1 << 30);
    }
  };

  /// The interval that began `ago` calls before the one now under way.
  HeldForce& at(int ago) noexcept { return held_[(cycle_ - static_cast<std::uint64_t>(ago)) % held_.size()]; }
  double farthest_of(int intervals) const noexcept {
    return settings_.max_speed * settings_.longest_cycle * intervals;
  }

  void measured(double depth) noexcept {
    if (seen_) settle(depth - depth_);
    depth_ = depth;
    seen_ = true;
    awaited_ = {};
  }

  void settle(double travel) noexcept {
    const double middle = 0.5 * (awaited_.low + awaited_.high);
    energy_ += middle * travel;
    if (!settings_.limits_energy()) return;
    const double way = farthest_of(awaited_.count), spread = 0.5 * (awaited_.high - awaited_.low);
    outside_ |= std::abs(travel) > rounding * way + 2.0 * settings_.position_error;
    // a jump of the sensor must not add energy that no user can put in
    const double earned = std::min(middle * travel, middle * std::clamp(travel, -way, way));
    reserve_ = std::min(reserve_ + earned - spread * std::max(way, std::abs(travel)), settings_.max_reserve);
    look_at_speed(travel);
  }

  void look_at_speed(double travel) noexcept {
    const double speed = travel / awaited_.length, between = 0.5 * (length_ + awaited_.length);
    const double error = 2.0 * settings_.position_error / awaited_.length;
    const double most = rounding * settings_.max_acceleration * between + error + error_;
    outside_ |= length_ > 0.0 && std::abs(speed - speed_) > most;
    const bool usable = std::isfinite(speed) && awaited_.length > 0.0;
    speed_ = usable ? speed : 0.0;
    error_ = usable ? error : 0.0;
    length_ = usable ? awaited_.length : 0.0;
  }

  /// How far [m] the device can get against a force of this sign in the n-th interval after the last settled.
  double against(double force, int n) const noexcept {
    double speed = settings_.max_speed;
    if (settings_.max_acceleration < unlimited && length_ > 0.0) {
      const double apart = 0.5 * length_ + (n - 0.5) * settings_.longest_cycle;
      const double along = force < 0.0 ? -speed_ : speed_;
      speed = std::clamp(settings_.max_acceleration * apart + error_ - along, 0.0, speed);
    }
    return speed * settings_.longest_cycle;
  }

  double pending() noexcept {
    double energy = awaited_.sum * farthest_of(1);
    for (int ago = delay_; ago > 0; --ago)
      energy += std::abs(at(ago).force) * against(at(ago).force, awaited_.count + delay_ - ago + 1);
    return energy;
  }

  double bounded(double wanted, double before) noexcept {
    if (!settings_.limits_energy()) return wanted;
    const double error = settings_.position_error, there = reserve_ - error * before, open = pending();
    const double cost = against(wanted, awaited_.count + delay_ + 1) + 2.0 * error;
    const double most = cost > 0.0 ? std::min((there - open) / cost, shared(wanted, there, cost)) : unlimited;
    const double force = std::clamp(wanted, -std::max(0.0, most), std::max(0.0, most));
    left_ = there - open - std::abs(force) * cost;
    return force;
  }

  /// The share [N] of one cycle in the reserve after all open cycles, if the device continues at its speed
  /// and they hold the same force. The guarantee does not depend on it.
  double shared(double wanted, double there, double cost) const noexcept {
    const double travel = speed_ * settings_.longest_cycle, along = wanted < 0.0 ? -travel : travel;
    return there / std::max(cost, (delay_ + 1) * (caution * cost - foresight * along));
  }

  // More is allowed inwards than outwards; otherwise a user who moves back and forth would lose force at
  // every reversal until none is left. With these two values the force for random motion differs least from
  // the wanted one, over walls and tissues: docs/decisions/0008-guard.md.
  static constexpr double caution = 1.25, foresight = 4.0;
  static constexpr double rounding = 1.0 + 1e-6;  // of what counts as beyond a bound

  GuardSettings settings_{};
  int delay_ = 0;
  double reserve_ = 0.0;  // E_0 and what is settled, less what errors of depth may have cost
  double energy_ = 0.0, left_ = 0.0;
  double depth_ = 0.0;
  double speed_ = 0.0, error_ = 0.0, length_ = 0.0;  // of what was settled last
  Awaited awaited_{};
  std::array<HeldForce, 2 * max_delay> held_{};
  std::uint64_t cycle_ = 0;
  bool seen_ = false, outside_ = false;
};

static_assert(std::is_trivially_copyable_v<EnergyController>);
static_assert(noexcept(std::declval<EnergyController&>().limit(0.0, 0.0, 0.0)));

}  // namespace needleforce
