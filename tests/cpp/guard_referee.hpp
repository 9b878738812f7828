// SPDX-License-Identifier: Apache-2.0
// The account of a guard's energy, kept by somebody who sees only what goes in and out of it: where the
// device was, what the clock reported, which measurements came, and the forces. docs/howto/guard.md has the
// promise.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "needleforce/guard_settings.hpp"
#include "needleforce/limits.hpp"

namespace guard_search {

using needleforce::GuardSettings;
using needleforce::unlimited;

/// Sum of force times travel over the cycles, and how far it is below what the guard promises.
class Referee {
 public:
  /// `within`: no cycle is beyond the bounds, and none may cost anything.
  Referee(const GuardSettings& settings, std::size_t cycles, bool within)
      : settings_(settings), within_(within) {
    cycles_.reserve(cycles);
    broken_.reserve(cycles);
    if (delay() > 0) length_ = settings.longest_cycle;  // the first measurements show it at rest
  }

  /// One call: the clock of the cycle before it, whether a measurement was accepted, and the force that is
  /// held from now on. The measurement shows the device `delay` calls ago; for `delay` calls after a cycle
  /// that was no regular one, any moment of it.
  void call(double dt, bool accepted, double force) {
    if (calls_ > 0) close(dt);
    if (calls_ > 0 && !within_a_cycle(dt)) irregular_ = calls_;
    if (accepted && calls_ - irregular_ >= delay()) {
      const long shown = calls_ - delay();
      // what happened within several cycles that were measured together, no measurement shows; the next mean
      // speed that is known contradicts it
      if (shown > measured_ + 1) {
        never_shown_ += relied_until(shown) + beyond_until(shown);
        if (shows_speed(time_until(shown))) hidden_ = measured_;
      } else if (shown <= 0 || shows_speed(cycles_[static_cast<std::size_t>(shown - 1)].believed)) {
        hidden_ = shown;
      }
      measured_ = shown;
    }
    look_at_range(dt, force);
    force_ = force;
    ++calls_;
  }
  /// Where the device goes [m] until the next call.
  void move(double travel) {
    travel_ = travel;
    energy_ += force_ * travel;
    turned_ += std::abs(force_ * travel);
  }
  /// After the last call: its cycle counts as one of the usual length.
  void finish() { close(settings_.longest_cycle); }

  /// How far [J] the least balance was below the promise; negative if it was kept.
  double missing() const { return missing_; }
  /// What sums in double precision may be wrong by, and bounds that are exceeded by a millionth.
  double rounding() const { return 1e-9 * turned_ + 1e-11; }
  bool kept() const { return missing_ <= rounding() && excess_ <= 1e-9 && finite_; }
  /// How far the largest force or its change was beyond its limit, as a ratio.
  double excess() const { return finite_ ? excess_ : unlimited; }
  double turned() const { return turned_; }

 private:
  static constexpr double tolerance = 1.0 + 1e-6;
  long delay() const { return static_cast<long>(settings_.delay); }
  double reach() const { return settings_.max_speed * settings_.longest_cycle; }
  bool within_a_cycle(double dt) const { return dt > 0.0 && dt <= tolerance * settings_.longest_cycle; }

  /// The cycle before this call is over: what it cost, and what of that was beyond the bounds.
  void close(double dt) {
    const bool timed = dt > 0.1 * settings_.longest_cycle && dt <= needleforce::longest;
    const bool believed =
        timed && std::abs(travel_) <= tolerance * settings_.max_speed * dt + 2.0 * settings_.position_error;
    const double way = std::abs(travel_), beyond = way > tolerance * reach() ? way - reach() : 0.0;
    const bool pause = dt > tolerance * settings_.longest_cycle;
    const bool link = follows(believed, dt) && !pause && beyond == 0.0 && timed == believed;
    broken_.push_back(!link);
    const bool relied = settings_.max_acceleration < unlimited && broken_since(hidden_);
    const long ended = static_cast<long>(cycles_.size()) + 1;
    cycles_.push_back({std::abs(force_), relied ? std::max(0.0, -force_ * travel_) : 0.0, beyond,
                       timed ? dt : 0.0, believed ? dt : 0.0});
    allowed_ = std::max(allowed_, relied_until(ended) + beyond_until(ended));
    const double excused = within_ ? 0.0 : allowed_ + never_shown_;
    missing_ = std::max(missing_, -energy_ - settings_.initial_reserve - excused);
  }

  /// What the cycles from the last measurement to this one may have cost: by relying on a bound that was
  /// exceeded, and by travel beyond the bounds, which may have been at any of their forces.
  double relied_until(long end) const {
    double sum = 0.0;
    for (long i = std::max(0L, measured_); i < end; ++i) sum += cycles_[static_cast<std::size_t>(i)].relied;
    return sum;
  }
  double beyond_until(long end) const {
    double strongest = 0.0, sum = 0.0;
    for (long i = std::max(0L, measured_); i < end; ++i) {
      strongest = std::max(strongest, cycles_[static_cast<std::size_t>(i)].force);
      sum += cycles_[static_cast<std::size_t>(i)].beyond;
    }
    return strongest * sum;
  }

  double time_until(long end) const {
    double sum = 0.0;
    for (long i = std::max(0L, measured_); i < end; ++i) sum += cycles_[static_cast<std::size_t>(i)].time;
    return sum;
  }
  /// Over a shorter time the depths may err by more than the device gets.
  bool shows_speed(double time) const {
    return time > 0.0 && 2.0 * settings_.position_error <= settings_.max_speed * time;
  }

  /// True if the travel is one that the bounds permit after the last cycle whose clock could be believed, and
  /// after the one before, which was no slower than over the longest time it can have taken.
  bool follows(bool believed, double dt) {
    const double a = settings_.max_acceleration, usual = settings_.longest_cycle, before = slowest_;
    if (!(a < unlimited)) return true;
    const double time = believed ? dt : usual, speed = travel_ / time, from = 0.5 * length_ + gap_;
    const double far = tolerance * a * (from + 0.5 * time) + 1e-12 / time,
                 step = tolerance * a * usual + 1e-12 / time;
    slowest_ = believed ? 0.0 : speed;
    const bool slow = (before > 0.0 && speed < before - step) || (before < 0.0 && speed > before + step);
    // a cycle of unknown length may have been as much faster as it was shorter
    const bool faster = !believed && speed * speed_ > 0.0 && std::abs(speed) < std::abs(speed_);
    const bool none = length_ == 0.0, near = none || faster || std::abs(speed - speed_) <= far;
    if (believed)
      speed_ = speed, length_ = dt, gap_ = 0.0;
    else if (!none)
      gap_ += usual;
    return near && (!slow || (!believed && speed * before > 0.0));
  }
  bool broken_since(long first) const {
    for (long i = std::max(0L, first); i < static_cast<long>(broken_.size()); ++i)
      if (broken_[static_cast<std::size_t>(i)]) return true;
    return false;
  }

  /// No force above the clamp, and none that moves away from zero faster than it may.
  void look_at_range(double dt, double force) {
    finite_ = finite_ && std::isfinite(force);
    excess_ = std::max(excess_, std::abs(force) / settings_.max_force - 1.0);
    const double time = dt > 0.0 && dt < unlimited ? std::min(dt, settings_.longest_cycle) : 0.0;
    const double most = settings_.max_slew * time;
    const bool falls = force * force_ >= 0.0 && std::abs(force) <= std::abs(force_);
    if (most < unlimited && !falls)
      excess_ = std::max(excess_, (std::abs(force - force_) - most) / settings_.max_force);
  }

  struct Cycle {
    double force, relied, beyond;  ///< [N]; [J] lost by relying on a bound that was exceeded; [m] too far
    double time, believed;         ///< [s] by its clock; the same if the travel goes together with it, or 0
  };

  GuardSettings settings_;
  bool within_;
  long calls_ = 0, measured_ = 0, hidden_ = 0, irregular_ = std::numeric_limits<long>::min() / 2;
  double force_ = 0.0, travel_ = 0.0, energy_ = 0.0, turned_ = 0.0;
  double speed_ = 0.0, length_ = 0.0, gap_ = 0.0, slowest_ = 0.0;
  double allowed_ = 0.0, never_shown_ = 0.0, missing_ = -unlimited, excess_ = -1.0;
  std::vector<Cycle> cycles_;
  std::vector<bool> broken_;
  bool finite_ = true;
};

}  // namespace guard_search
