// SPDX-License-Identifier: Apache-2.0
// The account of a guard's energy, kept by somebody who sees only what goes in and out of it: where the
// device was, what the clock reported, which measurements came, and the forces. docs/howto/guard.md has the
// promise.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "needleforce/guard_settings.hpp"
#include "needleforce/limits.hpp"

namespace guard_search {

using needleforce::GuardSettings;
using needleforce::unlimited;

inline constexpr double tolerance = 1.0 + 1e-6;

/// What went on along one axis of the device.
class Axis {
 public:
  Axis(const GuardSettings& settings, std::size_t axis, std::size_t cycles)
      : v_(settings.speed(axis)),
        a_(settings.acceleration(axis)),
        error_(settings.error(axis)),
        usual_(settings.longest_cycle) {
    cycles_.reserve(cycles);
    broken_.reserve(cycles);
    if (settings.delay > 0.0) length_ = usual_;  // the first measurements show it at rest
  }

  /// A cycle is over: what it cost, and what of that was beyond the bounds.
  void close(double dt, bool timed, double force, double travel) {
    const bool believed = timed && std::abs(travel) <= tolerance * v_ * dt + 2.0 * error_;
    const double way = std::abs(travel), reach = v_ * usual_;
    const double beyond = way > tolerance * reach ? way - reach : 0.0;
    const bool pause = dt > tolerance * usual_;
    const bool link = follows(believed, dt, travel) && !pause && beyond == 0.0 && timed == believed;
    broken_.push_back(!link);
    const bool relied = a_ < unlimited && broken_since(hidden_);
    cycles_.push_back(
        {std::abs(force), relied ? std::max(0.0, -force * travel) : 0.0, beyond, believed ? dt : 0.0});
  }
  /// A measurement shows where the device was at the end of the cycles until `shown`, after those until
  /// `measured`, in this time.
  void show(long measured, long shown, double time) {
    if (shown > measured + 1) {
      if (shows_speed(time)) hidden_ = measured;
    } else if (shown <= 0 || shows_speed(cycles_[static_cast<std::size_t>(shown - 1)].believed)) {
      hidden_ = shown;
    }
  }
  /// What cycles may have cost: by relying on a bound that was exceeded, and by travel beyond the bounds,
  /// which may have been at any of their forces.
  double excused(long from, long end) const {
    double strongest = 0.0, beyond = 0.0, relied = 0.0;
    for (long i = std::max(0L, from); i < end; ++i) {
      const Cycle& cycle = cycles_[static_cast<std::size_t>(i)];
      strongest = std::max(strongest, cycle.force);
      beyond += cycle.beyond;
      relied += cycle.relied;
    }
    return relied + strongest * beyond;
  }

 private:
  /// Over a shorter time the depths may err by more than the device gets.
  bool shows_speed(double time) const { return time > 0.0 && 2.0 * error_ <= v_ * time; }

  /// True if the travel is one that the bounds permit after the last cycle whose clock could be believed, and
  /// after the one before, which was no slower than over the longest time it can have taken.
  bool follows(bool believed, double dt, double travel) {
    const double before = slowest_;
    if (!(a_ < unlimited)) return true;
    const double time = believed ? dt : usual_, speed = travel / time, from = 0.5 * length_ + gap_;
    const double far = tolerance * a_ * (from + 0.5 * time) + 1e-12 / time,
                 step = tolerance * a_ * usual_ + 1e-12 / time;
    slowest_ = believed ? 0.0 : speed;
    const bool slow = (before > 0.0 && speed < before - step) || (before < 0.0 && speed > before + step);
    // a cycle of unknown length may have been as much faster as it was shorter
    const bool faster = !believed && speed * speed_ > 0.0 && std::abs(speed) < std::abs(speed_);
    const bool none = length_ == 0.0, near = none || faster || std::abs(speed - speed_) <= far;
    if (believed)
      speed_ = speed, length_ = dt, gap_ = 0.0;
    else if (!none)
      gap_ += usual_;
    return near && (!slow || (!believed && speed * before > 0.0));
  }
  bool broken_since(long first) const {
    for (long i = std::max(0L, first); i < static_cast<long>(broken_.size()); ++i)
      if (broken_[static_cast<std::size_t>(i)]) return true;
    return false;
  }

  struct Cycle {
    double force, relied, beyond;  ///< [N]; [J] lost by relying on a bound that was exceeded; [m] too far
    double believed;               ///< [s] by its clock if the travel goes together with it, or 0
  };

  double v_, a_, error_, usual_;
  double speed_ = 0.0, length_ = 0.0, gap_ = 0.0, slowest_ = 0.0;
  long hidden_ = 0;
  std::vector<Cycle> cycles_;
  std::vector<bool> broken_;
};

/// Sum of force times travel over the cycles and axes, and how far it is below what the guard promises.
template <std::size_t axes = 1>
class Referee {
 public:
  using Values = std::array<double, axes>;

  /// `within`: no cycle is beyond the bounds, and none may cost anything.
  Referee(const GuardSettings& settings, std::size_t cycles, bool within)
      : settings_(settings), within_(within) {
    for (std::size_t i = 0; i < axes; ++i) along_.emplace_back(settings, i, cycles);
    times_.reserve(cycles);
  }

  /// One call: the clock of the cycle before it, whether a measurement was accepted, and the forces that are
  /// held from now on. The measurement shows the device `delay` calls ago; for `delay` calls after a cycle
  /// that was no regular one, any moment of it.
  void call(double dt, bool accepted, const Values& force) {
    if (calls_ > 0) close(dt);
    if (calls_ > 0 && !within_a_cycle(dt)) irregular_ = calls_;
    if (accepted && calls_ - irregular_ >= delay()) {
      const long shown = calls_ - delay();
      // what happened within several cycles that were measured together, no measurement shows; the next mean
      // speed that is known contradicts it
      if (shown > measured_ + 1) never_shown_ += excused_until(shown);
      for (Axis& axis : along_) axis.show(measured_, shown, time_until(shown));
      measured_ = shown;
    }
    look_at_range(dt, force);
    force_ = force;
    ++calls_;
  }
  /// Where the device goes [m, rad] until the next call.
  void move(const Values& travel) {
    travel_ = travel;
    for (std::size_t i = 0; i < axes; ++i) {
      energy_ += force_[i] * travel[i];
      turned_ += std::abs(force_[i] * travel[i]);
    }
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
  long delay() const { return static_cast<long>(settings_.delay); }
  bool within_a_cycle(double dt) const { return dt > 0.0 && dt <= tolerance * settings_.longest_cycle; }

  void close(double dt) {
    const bool timed = dt > 0.1 * settings_.longest_cycle && dt <= needleforce::longest;
    for (std::size_t i = 0; i < axes; ++i) along_[i].close(dt, timed, force_[i], travel_[i]);
    times_.push_back(timed ? dt : 0.0);
    allowed_ = std::max(allowed_, excused_until(static_cast<long>(times_.size())));
    const double excused = within_ ? 0.0 : allowed_ + never_shown_;
    missing_ = std::max(missing_, -energy_ - settings_.initial_reserve - excused);
  }

  /// What the cycles from the last measurement to this one may have cost.
  double excused_until(long end) const {
    double sum = 0.0;
    for (const Axis& axis : along_) sum += axis.excused(measured_, end);
    return sum;
  }
  double time_until(long end) const {
    double sum = 0.0;
    for (long i = std::max(0L, measured_); i < end; ++i) sum += times_[static_cast<std::size_t>(i)];
    return sum;
  }

  static double magnitude(const Values& values, const needleforce::ForceLimit& limit) {
    double squares = 0.0;
    for (std::size_t i = limit.from; i < limit.to; ++i) squares += values[i] * values[i];
    return std::sqrt(squares);
  }

  /// No force above the clamp, and none that moves away from zero faster than it may.
  void look_at_range(double dt, const Values& force) {
    const double time = dt > 0.0 && dt < unlimited ? std::min(dt, settings_.longest_cycle) : 0.0;
    Values change{};
    for (std::size_t i = 0; i < axes; ++i) {
      finite_ = finite_ && std::isfinite(force[i]);
      // what falls to zero may do so at once
      const bool falls = force[i] * force_[i] >= 0.0 && std::abs(force[i]) <= std::abs(force_[i]);
      change[i] = falls ? 0.0 : force[i] - force_[i];
    }
    for (const needleforce::ForceLimit& limit : needleforce::force_limits) {
      if (limit.from >= axes) break;
      const double largest = settings_.*limit.most, most = settings_.*limit.slew * time;
      excess_ = std::max(excess_, magnitude(force, limit) / largest - 1.0);
      if (most < unlimited) excess_ = std::max(excess_, (magnitude(change, limit) - most) / largest);
    }
  }

  GuardSettings settings_;
  bool within_;
  long calls_ = 0, measured_ = 0, irregular_ = std::numeric_limits<long>::min() / 2;
  Values force_{}, travel_{};
  double energy_ = 0.0, turned_ = 0.0;
  double allowed_ = 0.0, never_shown_ = 0.0, missing_ = -unlimited, excess_ = -1.0;
  std::vector<Axis> along_;
  std::vector<double> times_;  ///< [s] of each cycle by its clock, 0 where it cannot be believed
  bool finite_ = true;
};

}  // namespace guard_search
