// SPDX-License-Identifier: Apache-2.0
// The energy that a user has put into forces held over each cycle, and the forces that this energy allows.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <utility>

#include "guard_settings.hpp"
#include "limits.hpp"

namespace needleforce {

/// Energy observer and passivity controller for forces that are held over each cycle, one for each axis along
/// which the device moves: depth, lateral position, tilt, roll. Of one axis:
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
/// Of several axes E and every sum above is that over the axes too, each with its own v, a, u and w: what was
/// put in along one may come back along another. What L leaves is divided among the axes by what each asks
/// for, |f_k| w_k, so that their forces keep their direction.
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
template <std::size_t axes = 1>
class EnergyController {
 public:
  using Values = std::array<double, axes>;

  EnergyController() = default;
  explicit EnergyController(const GuardSettings& settings) noexcept
      : settings_(settings), delay_(static_cast<int>(settings.delay)), reserve_(settings.initial_reserve) {}

  /// The forces [N, N m] to hold until the next call, no further from zero than `wanted`. `places` [m, rad]
  /// of the device as measured now, NaN where they were not; `dt` [s] since the last call, NaN if unknown.
  /// Wait-free.
  Values limit(const Values& wanted, const Values& places, double dt) noexcept {
    const double usual = settings_.longest_cycle;
    const bool timed = dt > 0.0 && dt <= longest, regular = timed && dt <= rounding * usual;
    outside_ = settings_.limits_energy() && timed && !regular;
    unpaired_ = regular || cycle_ == 0 ? std::max(0, unpaired_ - 1) : delay_;
    at(1).length = timed && dt > shortest * usual ? dt : 0.0;
    awaited_.add(at(delay_ + 1), time_at_most(at(delay_ + 1)));
    const bool settles = all_known(places) && unpaired_ == 0;
    if (settles) measured(places);
    if (outside_) exceeded_ = delay_ + 1;
    const Values before = at(1).force, force = bounded(wanted, before, settles);
    for (std::size_t i = 0; i < axes; ++i) reserve_ -= settings_.error(i) * std::abs(force[i] - before[i]);
    at(0) = {force, 0.0};
    ++cycle_;
    return force;
  }
  /// The same along one axis. Wait-free.
  double limit(double wanted, double depth, double dt) noexcept
    requires(axes == 1)
  {
    return limit(Values{wanted}, Values{depth}, dt)[0];
  }

  /// Energy [J] that the user has put in so far minus the energy taken out, as measured.
  double energy() const noexcept { return energy_; }
  /// Energy [J] that the user may still take out, for any motion since the last measurement: L of the last
  /// call.
  double reserve() const noexcept { return left_; }
  /// True if a cycle, speed or acceleration of the last call exceeded the bounds: the guarantee fails for it.
  bool outside_bounds() const noexcept { return outside_; }

 private:
  struct Held {
    Values force{};
    double length = 0.0;  // [s], 0 if unknown: at most that of the longest cycle
  };
  /// Intervals whose end should have been measured by now.
  struct Awaited {
    int count = 0;
    Values low{}, high{}, impulse{};
    double length = 0.0, time = 0.0;
    void add(const Held& held, double time_at_most) noexcept {
      for (std::size_t i = 0; i < axes; ++i) {
        low[i] = count ? std::min(low[i], held.force[i]) : held.force[i];
        high[i] = count ? std::max(high[i], held.force[i]) : held.force[i];
        impulse[i] += std::abs(held.force[i]) * time_at_most;
      }
      length += held.length;
      time += time_at_most;
      count = std::min(count + 1, 1 << 30);
    }
  };
  /// The last mean speed known along an axis.
  struct Speed {
    double low = 0.0, high = 0.0;
    double length = 0.0;  // the time [s] over which it is the mean; 0: none is known
    double gap = 0.0;     // time at most that was settled since [s]
    bool agrees = true;   // with the one before
    bool predicts = false;
  };

  static bool all_known(const Values& places) noexcept {
    for (const double place : places)
      if (!(place == place)) return false;
    return true;
  }

  /// The interval that began `ago` calls before the one now under way.
  Held& at(int ago) noexcept { return held_[(cycle_ - static_cast<std::uint64_t>(ago)) % held_.size()]; }
  double time_at_most(const Held& held) const noexcept {
    return std::max(settings_.longest_cycle, held.length);
  }

  void measured(const Values& places) noexcept {
    if (seen_) settle(places);
    places_ = places;
    seen_ = true;
    awaited_ = {};
  }

  void settle(const Values& places) noexcept {
    double reserve = reserve_;
    for (std::size_t i = 0; i < axes; ++i) reserve = settled(i, places[i], reserve);
    if (settings_.limits_energy()) reserve_ = std::min(reserve, settings_.max_reserve);
  }

  /// The reserve with what came in along an axis.
  double settled(std::size_t i, double place, double reserve) noexcept {
    const double travel = place - places_[i], middle = 0.5 * (awaited_.low[i] + awaited_.high[i]);
    energy_ += middle * travel;
    if (!settings_.limits_energy()) return reserve;
    const double way = settings_.speed(i) * awaited_.time,
                 spread = 0.5 * (awaited_.high[i] - awaited_.low[i]);
    outside_ |= std::abs(travel) > rounding * way + 2.0 * settings_.error(i);
    // a jump of the sensor must not add energy that no user can put in
    const double credible = settings_.speed(i) * settings_.longest_cycle * awaited_.count;
    const double earned = std::min(middle * travel, middle * std::clamp(travel, -credible, credible));
    // also where rounding is all that the places differ by
    const double resolution =
        std::numeric_limits<double>::epsilon() * (std::abs(place) + std::abs(places_[i]));
    look_at_speed(i, travel, 2.0 * settings_.error(i) + resolution);
    return reserve + earned - spread * std::max(way, std::abs(travel));
  }

  /// The mean speed over what was settled. Where several intervals were measured together, no travel of each
  /// contradicts a clock that reports too little: each may have taken as long as it can.
  void look_at_speed(std::size_t i, double travel, double travel_error) noexcept {
    Speed& known = speeds_[i];
    const double length = awaited_.length;
    const bool timed = length > 0.0;
    const double whole = timed && awaited_.count == 1 ? length : awaited_.time;
    const double any = travel == 0.0 ? 0.0 : std::copysign(unlimited, travel);
    const double least = travel / whole, most = timed ? travel / length : any;
    const double error = travel_error / (timed ? length : whole);
    const double low = std::min(least, most) - error, high = std::max(least, most) + error;
    const double apart = rounding * settings_.acceleration(i) * (0.5 * (known.length + whole) + known.gap);
    const bool possible = std::abs(least) <= rounding * settings_.speed(i) + error;
    const bool contradicts = known.length > 0.0 && (low > known.high + apart || high < known.low - apart);
    const bool follows = possible && !contradicts;
    outside_ |= !follows;
    known.gap += awaited_.time;
    if (timed && possible && error <= settings_.speed(i))
      known = {low, high, whole, 0.0, follows, known.predicts};
    else if (!follows)
      known.length = 0.0;
  }

  /// True if the last mean speed that is known bounds those of all intervals that follow.
  bool bounded_by_acceleration(std::size_t i) const noexcept {
    return settings_.acceleration(i) < unlimited && speeds_[i].length > 0.0 && speeds_[i].agrees &&
           unpaired_ == 0 && awaited_.time <= rounding * settings_.longest_cycle * awaited_.count;
  }

  /// How far [m, rad] the device can get against a force of this sign in the n-th interval after the last
  /// settled.
  double against(std::size_t i, double force, int n, double time) const noexcept {
    double speed = settings_.speed(i);
    if (const Speed& known = speeds_[i]; known.predicts) {
      const double apart = 0.5 * known.length + known.gap + (n - 0.5) * settings_.longest_cycle;
      const double along = force < 0.0 ? -known.high : known.low;
      speed = std::clamp(settings_.acceleration(i) * apart - along, 0.0, speed);
    }
    return speed * time;
  }

  double pending() noexcept {
    double energy = 0.0;
    for (std::size_t i = 0; i < axes; ++i) energy += settings_.speed(i) * awaited_.impulse[i];
    for (int ago = delay_; ago > 0; --ago) {
      const Held& held = at(ago);
      const int n = awaited_.count + delay_ - ago + 1;
      const double time = time_at_most(held);
      for (std::size_t i = 0; i < axes; ++i)
        energy += std::abs(held.force[i]) * against(i, held.force[i], n, time);
    }
    return energy;
  }

  Values bounded(const Values& wanted, const Values& before, bool settled) noexcept {
    if (!settings_.limits_energy()) return wanted;
    left_ = reserve_;
    if (!seen_) return {};  // from where nobody knows, no travel could be settled
    double there = reserve_;
    for (std::size_t i = 0; i < axes; ++i) {
      speeds_[i].predicts = bounded_by_acceleration(i);
      there -= settings_.error(i) * std::abs(before[i]);
    }
    const double left = there - pending();
    const bool overdrawn = left < -smallest;
    const Values force = divided(wanted, there, left, overdrawn && exceeded_ > 0 ? 0.0 : unlimited);
    if (settled && !overdrawn && !outside_) exceeded_ = std::max(0, exceeded_ - 1);
    return force;
  }

  /// Forces [N, N m] that cost no more than what is left, and than one cycle's share in what is there; `free`
  /// for what costs nothing.
  Values divided(const Values& wanted, double there, double left, double free) noexcept {
    Values costs, shares, force;
    double cost = 0.0, share = 0.0;
    for (std::size_t i = 0; i < axes; ++i) {
      costs[i] = against(i, wanted[i], awaited_.count + delay_ + 1, settings_.longest_cycle) +
                 2.0 * settings_.error(i);
      shares[i] = share_of(i, wanted[i], costs[i]);
      cost += std::abs(wanted[i]) * costs[i];
      share += std::abs(wanted[i]) * shares[i];
    }
    left_ = left;
    for (std::size_t i = 0; i < axes; ++i) {
      const double asked = std::abs(wanted[i]);
      const double most = costs[i] > 0.0 ? std::min(part(asked * costs[i], cost) * left / costs[i],
                                                    part(asked * shares[i], share) * there / shares[i])
                                         : free;
      force[i] = std::clamp(wanted[i], -std::max(0.0, most), std::max(0.0, most));
      left_ -= std::abs(force[i]) * costs[i];
    }
    return force;
  }
  static double part(double one, double all) noexcept {
    return axes > 1 && all > 0.0 ? one / all : 1.0;  // without rounding where it is the only one
  }

  /// The energy [J] per force of all open cycles, if the device continues at its speed and they hold the same
  /// force. The guarantee does not depend on it.
  double share_of(std::size_t i, double wanted, double cost) const noexcept {
    const double travel = 0.5 * (speeds_[i].low + speeds_[i].high) * settings_.longest_cycle,
                 along = wanted < 0.0 ? -travel : travel;
    return std::max(cost, (delay_ + 1) * (caution * cost - foresight * along));
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
  Values places_{};
  std::array<Speed, axes> speeds_{};
  Awaited awaited_{};
  std::array<Held, 2 * max_delay> held_{};
  std::uint64_t cycle_ = 0;
  int unpaired_ = 0;  // calls for which a depth may show any moment of a cycle that was no regular one
  int exceeded_ = 0;  // settlements until forces that relied on a bound that was exceeded are all settled
  bool seen_ = false, outside_ = false;
};

static_assert(std::is_trivially_copyable_v<EnergyController<>>);
static_assert(noexcept(std::declval<EnergyController<>&>().limit(0.0, 0.0, 0.0)));

}  // namespace needleforce
