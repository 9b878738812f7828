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
#include "limits.hpp"

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
/// against f is at most w: v T, with |speed| <= v and cycles <= T, whatever a clock reports; with
/// |acceleration| <= a also (a g - u) T, where u is the mean speed of the last settled interval along f and g
/// the time between the two centres, because mean speeds of intervals whose centres are g apart differ by at
/// most a g. So
///
///     E >= L(f_k) = E_0 + settled - sum of |f_j| w_j over pending - |f_k| w_k.
///
/// f_k is bounded such that L >= 0, or has w_k = 0 and can only add, or is zero and changes nothing. By
/// induction the user never takes out more than was put in plus E_0. The bound holds between samples too: the
/// travel against f since the last sample is at most w too, as v T and the parabola of a bound it there.
///
/// The mean speed u needs a clock and a travel that can be believed: a time of no less than a tenth of T, a
/// speed of no more than v, and none that contradicts the one before. A cycle whose clock failed took any
/// time up to T, and so may each of those that were measured together; where nothing is known of their speed,
/// u stays that of the last interval that has one, and g grows. After a cycle longer than T, w is v times the
/// time that it took until it is settled. A delayed depth catches up in it by an unknown number of cycles, so
/// that none counts for d cycles, and their travel is settled together. Cycles beyond the bounds cost what
/// they cost; if that overdraws the account, a w of 0 is not relied upon again, and the force stays zero.
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
  /// as measured now, NaN where it was not; `dt` [s] since the last call, NaN if unknown. Wait-free.
  double limit(double wanted, double depth, double dt) noexcept {
    const double usual = settings_.longest_cycle;
    const bool timed = dt > 0.0 && dt <= longest, regular = timed && dt <= rounding * usual;
    outside_ = settings_.limits_energy() && timed && !regular;
    unpaired_ = regular || cycle_ == 0 ? std::max(0, unpaired_ - 1) : delay_;
    at(1).length = timed && dt > shortest * usual ? dt : 0.0;
    awaited_.add(at(delay_ + 1), time_at_most(at(delay_ + 1)));
    const bool settles = depth == depth && unpaired_ == 0;
    if (settles) measured(depth);
    if (outside_) exceeded_ = delay_ + 1;
    const double before = at(1).force, force = bounded(wanted, std::abs(before), settles);
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
    double force = 0.0;
    double length = 0.0;  // [s], 0 if unknown: at most that of the longest cycle
  };
  /// Intervals whose end should have been measured by now.
  struct Awaited {
    int count = 0;
    double low = 0.0, high = 0.0, impulse = 0.0, length = 0.0, time = 0.0;
    void add(const HeldForce& held, double time_at_most) noexcept {
      low = count ? std::min(low, held.force) : held.force;
      high = count ? std::max(high, held.force) : held.force;
      impulse += std::abs(held.force) * time_at_most;
      length += held.length;
      time += time_at_most;
      count = std::min(count + 1, 1 << 30);
    }
  };

  /// The interval that began `ago` calls before the one now under way.
  HeldForce& at(int ago) noexcept { return held_[(cycle_ - static_cast<std::uint64_t>(ago)) % held_.size()]; }
  double time_at_most(const HeldForce& held) const noexcept {
    return std::max(settings_.longest_cycle, held.length);
  }
  double farthest_of(int intervals) const noexcept {
    return settings_.max_speed * settings_.longest_cycle * intervals;
  }

  void measured(double depth) noexcept {
    if (seen_) settle(depth);
    depth_ = depth;
    seen_ = true;
    awaited_ = {};
  }

  void settle(double depth) noexcept {
    const double travel = depth - depth_, middle = 0.5 * (awaited_.low + awaited_.high);
    energy_ += middle * travel;
    if (!settings_.limits_energy()) return;
    const double way = settings_.max_speed * awaited_.time, spread = 0.5 * (awaited_.high - awaited_.low);
    outside_ |= std::abs(travel) > rounding * way + 2.0 * settings_.position_error;
    // a jump of the sensor must not add energy that no user can put in
    const double credible = farthest_of(awaited_.count);
    const double earned = std::min(middle * travel, middle * std::clamp(travel, -credible, credible));
    reserve_ = std::min(reserve_ + earned - spread * std::max(way, std::abs(travel)), settings_.max_reserve);
    // also where rounding is all that the depths differ by
    const double resolution = std::numeric_limits<double>::epsilon() * (std::abs(depth) + std::abs(depth_));
    look_at_speed(travel, 2.0 * settings_.position_error + resolution);
  }

  /// The mean speed over what was settled. Where several intervals were measured together, no travel of each
  /// contradicts a clock that reports too little: each may have taken as long as it can.
  void look_at_speed(double travel, double travel_error) noexcept {
    const double length = awaited_.length;
    const bool timed = length > 0.0;
    const double whole = timed && awaited_.count == 1 ? length : awaited_.time;
    const double any = travel == 0.0 ? 0.0 : std::copysign(unlimited, travel);
    const double least = travel / whole, most = timed ? travel / length : any;
    const double error = travel_error / (timed ? length : whole);
    const double low = std::min(least, most) - error, high = std::max(least, most) + error;
    const double apart = rounding * settings_.max_acceleration * (0.5 * (length_ + whole) + gap_);
    const bool possible = std::abs(least) <= rounding * settings_.max_speed + error;
    const bool follows = possible && !(length_ > 0.0 && (low > high_ + apart || high < low_ - apart));
    outside_ |= !follows;
    gap_ += awaited_.time;
    if (timed && possible && error <= settings_.max_speed)
      low_ = low, high_ = high, length_ = whole, gap_ = 0.0, agrees_ = follows;
    else if (!follows)
      length_ = 0.0;
  }

  /// True if the last mean speed that is known bounds those of all intervals that follow.
  bool bounded_by_acceleration() const noexcept {
    return settings_.max_acceleration < unlimited && length_ > 0.0 && agrees_ && unpaired_ == 0 &&
           awaited_.time <= rounding * settings_.longest_cycle * awaited_.count;
  }

  /// How far [m] the device can get against a force of this sign in the n-th interval after the last settled.
  double against(double force, int n, double time) const noexcept {
    double speed = settings_.max_speed;
    if (predictable_) {
      const double apart = 0.5 * length_ + gap_ + (n - 0.5) * settings_.longest_cycle;
      const double along = force < 0.0 ? -high_ : low_;
      speed = std::clamp(settings_.max_acceleration * apart - along, 0.0, speed);
    }
    return speed * time;
  }

  double pending() noexcept {
    double energy = settings_.max_speed * awaited_.impulse;
    for (int ago = delay_; ago > 0; --ago) {
      const HeldForce& held = at(ago);
      const int n = awaited_.count + delay_ - ago + 1;
      energy += std::abs(held.force) * against(held.force, n, time_at_most(held));
    }
    return energy;
  }

  double bounded(double wanted, double before, bool settled) noexcept {
    if (!settings_.limits_energy()) return wanted;
    left_ = reserve_;
    if (!seen_) return 0.0;  // from where nobody knows, no travel could be settled
    predictable_ = bounded_by_acceleration();
    const double error = settings_.position_error, there = reserve_ - error * before, open = pending();
    const double cost = against(wanted, awaited_.count + delay_ + 1, settings_.longest_cycle) + 2.0 * error;
    const bool overdrawn = there - open < -smallest;
    const double free = overdrawn && exceeded_ > 0 ? 0.0 : unlimited;
    const double most = cost > 0.0 ? std::min((there - open) / cost, shared(wanted, there, cost)) : free;
    const double force = std::clamp(wanted, -std::max(0.0, most), std::max(0.0, most));
    left_ = there - open - std::abs(force) * cost;
    if (settled && !overdrawn && !outside_) exceeded_ = std::max(0, exceeded_ - 1);
    return force;
  }

  /// The share [N] of one cycle in the reserve after all open cycles, if the device continues at its speed
  /// and they hold the same force. The guarantee does not depend on it.
  double shared(double wanted, double there, double cost) const noexcept {
    const double travel = 0.5 * (low_ + high_) * settings_.longest_cycle,
                 along = wanted < 0.0 ? -travel : travel;
    return there / std::max(cost, (delay_ + 1) * (caution * cost - foresight * along));
  }

  // More is allowed inwards than outwards; otherwise a user who moves back and forth would lose force at
  // every reversal until none is left. With these two values the force for random motion differs least from
  // the wanted one, over walls and tissues: docs/decisions/0008-guard.md.
  static constexpr double caution = 1.25, foresight = 4.0;
  static constexpr double rounding = 1.0 + 1e-6;  // of what counts as beyond a bound
  static constexpr double shortest = 0.1;         // of the longest cycle: below, a clock is not believed
  static constexpr double smallest = 1e-12;       // [J], rounding of a balance

  GuardSettings settings_{};
  int delay_ = 0;
  double reserve_ = 0.0;  // E_0 and what is settled, less what errors of depth may have cost
  double energy_ = 0.0, left_ = 0.0;
  double depth_ = 0.0;
  double low_ = 0.0, high_ = 0.0, length_ = 0.0;  // the last mean speed known, and its time; 0: none
  double gap_ = 0.0;                              // time at most that was settled since [s]
  Awaited awaited_{};
  std::array<HeldForce, 2 * max_delay> held_{};
  std::uint64_t cycle_ = 0;
  int unpaired_ = 0;  // calls for which a depth may show any moment of a cycle that was no regular one
  int exceeded_ = 0;  // settlements until forces that relied on a bound that was exceeded are all settled
  bool seen_ = false, outside_ = false, agrees_ = true, predictable_ = false;
};

static_assert(std::is_trivially_copyable_v<EnergyController>);
static_assert(noexcept(std::declval<EnergyController&>().limit(0.0, 0.0, 0.0)));

}  // namespace needleforce
