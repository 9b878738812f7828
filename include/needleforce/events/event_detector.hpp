// SPDX-License-Identifier: Apache-2.0
// Contact, puncture, sliding, stop, reversal and exit, from force, depth and time as they come.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "../state_bytes.hpp"
#include "detection.hpp"
#include "event_settings.hpp"
#include "fall_windows.hpp"
#include "followed_fall.hpp"
#include "needle_course.hpp"
#include "place_trail.hpp"
#include "running_noise.hpp"
#include "sensor_readings.hpp"

namespace needleforce::events {

/// Finds events while they happen: one sample in, at most one event out. A puncture is a fall of the mean
/// force over some window, in new tissue, that (1) noise makes at most `false_alarms` times a second in all
/// windows together and (2) is three quarters of `fall` and of `share` of the running peak: half way between
/// falls that count and falls of half their size. Trivially copyable, without heap; the work of a step is
/// bounded.
class EventDetector {
 public:
  explicit EventDetector(const EventSettings& settings = {}) noexcept
      : settings_(settings),
        course_(settings),
        trail_(1.2 * settings.force_delay),
        windows_(settings.within),
        readings_(settings.within) {}

  /// One sample: force [N], depth [m], time since the one before [s]. Wait-free, allocates nothing.
  Detection step(double force, double depth, double dt) noexcept {
    if (accepts(force, depth, dt)) read(force, depth);
    return queue_.next(time_);
  }
  void reset() noexcept { *this = EventDetector(settings_); }
  EventDetector snapshot() const noexcept { return *this; }

  /// What it has seen, as bytes that may leave the process. Wait-free.
  using Saved = StateBytes<EventDetector>;
  Saved save() const noexcept { return state_bytes(*this, settings_fingerprint()); }
  /// Takes it back; returns false and changes nothing for bytes of another version or other settings, altered
  /// bytes, or a state that no detector can have. Wait-free.
  bool restore(const Saved& bytes) noexcept {
    if (restore_fault(bytes)) return false;
    *this = bytes.state();
    return true;
  }
  /// Why `restore` refuses it, as the part that is at fault, or nullptr. Wait-free.
  const char* restore_fault(const Saved& bytes) const noexcept {
    if (const char* foreign = foreign_part(bytes, settings_fingerprint())) return foreign;
    StateCheck check;
    bytes.state().look_at(check, EventDetector(settings_));
    return check.fault();
  }

  StreamStatus status() const noexcept { return status_; }
  const EventSettings& settings() const noexcept { return settings_; }
  double time() const noexcept { return time_; }
  /// Standard deviation of a reading now [N].
  double noise() const noexcept { return noise_.sd(std::max(settings_.force_noise, free_noise_)); }
  /// What the sensor reads without a force, as far as that is known: its level in free travel [N].
  double zero() const noexcept { return zero_; }
  /// The fall that would be a puncture now, if it came between two readings [N].
  double needed_fall() const noexcept { return std::max(needed(), significant(0)); }
  /// Share of its recent force that the needle still meets: 1 while the force holds or grows, less within
  /// milliseconds where it falls in new tissue, as for a sound or a hand. It stays so for `within`
  /// and comes back in ten times that. Falls below half of what a puncture needs, and below what noise makes,
  /// do not count.
  double resistance() const noexcept { return 1.0 - lost_; }

 private:
  enum class Where { unknown, outside, inside };
  static constexpr double largest_force = 1e6, largest_depth = 1e3, longest = 1e9;
  static constexpr double leap = 5e-3, fastest = 1.0;  // no needle gets further [m] at such a speed [m/s]
  static constexpr double longest_gap = 5.0;           // in `within`, across which forces are compared
  static constexpr double part = 0.75;      // of a fall that counts: half way to one of half its size
  static constexpr double finest = 0.0075;  // of `within`: readings that are closer are one

  bool accepts(double force, double depth, double dt) noexcept {
    const bool first = !started_ && dt == 0.0;
    if (!first && !(dt > 0.0 && dt <= longest)) {
      status_ = StreamStatus::bad_time;
      return false;
    }
    time_ += dt;
    since_ += dt;
    if (!(std::abs(force) <= largest_force && std::abs(depth) <= largest_depth)) {
      status_ = StreamStatus::not_finite;
      return false;
    }
    return true;
  }

  void read(double force, double depth) noexcept {
    status_ = where_ == Where::unknown ? StreamStatus::learning : StreamStatus::ok;
    look_at_readings(force);
    sum_ += force;
    parts_ += 1.0;
    if (started_ && since_ < finest * settings_.within) return;
    const double mean = sum_ / parts_, dt = since_;
    sum_ = parts_ = since_ = 0.0;
    if (!started_) {
      where_since_ = time_;
    } else if (dt > settings_.within) {
      pass_gap(dt);
    } else {
      interval_ += (interval_ > 0.0 ? 0.05 : 1.0) * (dt - interval_);
      noise_.see_step(std::abs(mean - last_force_));
    }
    if (started_ && std::abs(depth - last_depth_) > leap + fastest * dt) begin_anew(depth);
    started_ = true;
    last_depth_ = depth;
    take(mean, depth, dt);
  }

  void take(double force, double depth, double dt) noexcept {
    course_.add(time_, depth, dt);
    lost_ = std::max(0.0, lost_ - dt / (10.0 * settings_.within));
    feel(depth);
    if (model_.known() && !fall_.follows())
      noise_.add(model_.innovation(force, felt_.depth, settings_.depth_noise), interval_);
    model_.add(force, felt_.depth, std::exp(-dt / settings_.within));
    windows_.add(force, felt_.time, felt_.depth, interval_);
    last_force_ = force;
    if (course_.turned())
      found(EventKind::reversal, course_.turning(), std::abs(depth - course_.turning().depth), 1.0);
    if (course_.stopped()) found(EventKind::stop, course_.since(), 0.0, 1.0);
    if (noise_.known()) look(force, depth);
  }

  /// When and where the force acted that is read now.
  void feel(double depth) noexcept {
    felt_ = {time_, depth};
    if (settings_.force_delay == 0.0) return;
    trail_.add(felt_);
    felt_ = trail_.at(time_ - settings_.force_delay, felt_);
  }

  void look(double force, double depth) noexcept {
    if (where_ == Where::unknown) return begin(force);
    if (where_ == Where::outside) return look_for_contact(force);
    if (windows_.available(0)) peak_ = std::max(peak_, windows_.calm_now(0) - zero_);
    if (fall_.follows())
      follow_fall(force);
    else if (course_.cuts(depth))
      look_for_puncture(force);
    look_for_exit(force);
  }

  /// Outside the tissue if there is hardly a force, else the zero is unknown. A stream that begins inside
  /// under less than that is taken for one outside: its contact is doubtful.
  void begin(double force) noexcept {
    zero_ += (force - zero_) / ++zero_count_;
    if (time_ - where_since_ < settings_.within) return;
    if (std::abs(zero_) <= 5.0 * settings_.contact_force) {
      enter(Where::outside);
    } else {
      zero_ = 0.0;
      enter(Where::inside);
      zero_known_ = false;
    }
  }
  void enter(Where where) noexcept {
    where_ = where;
    where_since_ = calm_ = time_;
    quiet_ = calm_at_ = felt_;
    peak_ = lost_ = 0.0;
    fall_.forget(felt_);
    pulled_ = false;
  }

  void look_for_contact(double force) noexcept {
    const double sd = noise();
    free_noise_ = std::max(settings_.force_noise, std::min(sd, free_noise_ > 0.0 ? free_noise_ : sd));
    if (force <= zero_ + 2.0 * sd) quiet_ = felt_;
    look_for_pull(force);
    if (force <= zero_ + 3.0 * sd && !pulled_) {
      const double gain = std::max(interval_ / RunningNoise::memory, 1.0 / (zero_count_ + 1.0));
      zero_ += gain * (force - zero_);
      zero_count_ += 1.0;
    }
    if (!course_.inwards() || course_.resting()) return;
    for (std::size_t k = 0; windows_.available(k); ++k) {
      const double rise = windows_.calm_now(k) - zero_;
      if (rise < settings_.contact_force || rise < significant(k)) continue;
      const bool long_outside = quiet_.time - where_since_ > 3.0 * settings_.within;
      const double backed = normal((rise - 0.5 * settings_.contact_force) / sd_of_fall(k));
      found(EventKind::contact, quiet_, rise, long_outside && !was_stuck_ ? backed : 0.5 * backed);
      contact_depth_ = quiet_.depth;
      course_.begin(quiet_);
      zero_known_ = true;
      return enter(Where::inside);
    }
  }

  /// Nothing pulls a needle inwards before tissue was pushed. Until the force is back its zero is not
  /// followed: it would follow the tissue.
  void look_for_pull(double force) noexcept {
    if (pulled_) {
      pulled_ = force < zero_ - 3.0 * free_noise_;
      return;
    }
    if (!course_.inwards() || course_.resting() || !windows_.available(0)) return;
    const double pull = zero_ - windows_.calm_now(0);
    pulled_ = pull > std::max(settings_.contact_force, significant(0));
  }

  /// Standard deviations that noise hardly exceeds, of a difference between two means and its own.
  double threshold() const noexcept {
    return noise_.threshold(settings_.false_alarms, interval_, settings_.within);
  }
  double sd_of_fall(std::size_t k) const noexcept {
    constexpr double of_a_difference = 1.4142135623730951;
    return noise() * of_a_difference * noise_.of_mean(static_cast<double>(FallWindows::readings(k)));
  }
  /// A fall that noise does not explain, over windows of this length.
  double significant(std::size_t k) const noexcept { return threshold() * sd_of_fall(k); }
  /// What a puncture needs, above what a force in proportion to the speed loses where the needle slows down.
  double needed() const noexcept {
    return part * std::max(settings_.fall, settings_.share * peak_) +
           course_.slowing() * std::max(last_force_ - zero_, 0.0);
  }

  void look_for_puncture(double force) noexcept {
    const double least = needed(), unheeded = std::max(0.5 * least, 6.0 * noise());
    for (std::size_t k = 0; windows_.available(k); ++k) {
      const FallWindows::Top& top = windows_.top(k);
      const double fall = top.level - windows_.now(k);
      if (k == 0 && fall < unheeded) before_fall_ = model_;
      if (k == 0) lose(fall - unheeded, top.level - zero_ - unheeded);
      if (!(fall >= least) || fall < significant(k)) continue;
      const double backed = normal((fall - 0.5 / part * least) / sd_of_fall(k));
      const double most = std::min(certainty(top, fall, least, k), sure(force) ? 1.0 : 0.5);
      found(EventKind::puncture, {top.time, top.depth}, fall, most * backed);
      fall_.begin(k, time_, top.level, windows_.now(k), readings_.step(), most, sure(force));
      return restart(windows_.now(k));
    }
  }
  /// A force that comes back from having been stuck, or that leaves for zero or below, may be the sensor's
  /// doing, and one that falls where the needle slows down may relax.
  bool sure(double force) const noexcept {
    return zero_known_ && !was_stuck_ && course_.steady() &&
           force - zero_ > 3.0 * std::max(free_noise_, noise_.quantum());
  }
  void lose(double fall, double of) noexcept {
    if (of > 0.0) lost_ = std::max(lost_, std::clamp(fall / of, 0.0, 1.0));
  }
  void restart(double level) noexcept {
    fall_.lower(level, felt_);
    windows_.restart();
    model_.restart();
  }

  /// Where the fall ends, the needle slides on.
  void follow_fall(double force) noexcept {
    const double level = windows_.now(fall_.window()), noisy = significant(fall_.window());
    if (level < fall_.low()) restart(level);
    lose(fall_.size(), fall_.from() - zero_);
    if (fall_.lasts(time_, level, noisy, std::max(needed(), noisy), settings_.within)) return;
    fall_.end();
    if (fall_.stays(force) && course_.inwards() && !course_.resting())
      found(EventKind::sliding, fall_.low_at(), fall_.size(), fall_.certain());
  }

  /// Back at the depth of the contact, and no force for `within`.
  void look_for_exit(double force) noexcept {
    const double nothing = std::max(settings_.contact_force, 3.0 * free_noise_);
    const bool out = course_.outwards() && (!zero_known_ || felt_.depth <= contact_depth_);
    if (!out || std::abs(force - zero_) > nothing) {
      calm_ = time_;
      calm_at_ = felt_;
    }
    if (time_ - calm_ < settings_.within) return;
    found(EventKind::exit, calm_at_, 0.0, zero_known_ ? 1.0 : 0.5);
    zero_count_ = 10.0;
    course_.begin(felt_);
    enter(Where::outside);
  }

  void look_at_readings(double force) noexcept {
    readings_.add(force, time_, !course_.resting());
    const bool fine = noise_.quantum() < 2.0 * noise();
    was_stuck_ = fine && readings_.was_stuck(time_);
    if (fine && readings_.repeats() && readings_.stuck(time_))
      status_ = StreamStatus::stuck;
    else if (where_ == Where::inside && !zero_known_)
      status_ = StreamStatus::unknown_zero;
    else if (pulled_)
      status_ = StreamStatus::wrong_sign;
  }
  /// No innovation across a gap; the noise is known less well. A fall and a speed across it are means over
  /// it, unless it is long.
  void pass_gap(double lasts) noexcept {
    status_ = StreamStatus::gap;
    model_.restart();
    noise_.doubt();
    gap_ = lasts;
    before_gap_ = felt_.time;
    if (lasts > longest_gap * settings_.within) forget_the_moment();
  }
  void forget_the_moment() noexcept {
    windows_.restart();
    course_.forget_speed();
    fall_.end();
  }
  /// The most that a fall can be certain of. Less by one reading that may be a glitch, or by a step between
  /// two, which may be a new zero of the sensor; the zero is all that is left where readings follow fast and
  /// no load grew before that could have been lost. Across a gap less by the probability that so much of it
  /// came within `within`, if it took any part of the gap as likely as another.
  double certainty(const FallWindows::Top& top, double fall, double least, std::size_t k) noexcept {
    if (top.time <= before_gap_) {
      status_ = StreamStatus::gap;
      return 0.9 * std::min(1.0, settings_.within * fall / (least * gap_));
    }
    if (!windows_.fast()) return k == 0 ? 0.9 : 1.0;
    if (FollowedFall::spread(readings_.step(), std::max(fall, top.level - readings_.last())))
      return k == 0 ? 1.0 : 0.9;
    const double grew =
        before_fall_.growth(settings_.depth_noise, noise()) * (top.depth - fall_.low_at().depth);
    return grew < 0.5 * fall ? 0.5 : 0.9;
  }

  /// Another needle, or another zero of the depth: what was known of the tissue is of no use.
  void begin_anew(double depth) noexcept {
    pass_gap(longest);
    course_ = NeedleCourse(settings_);
    trail_.restart();
    course_.begin({time_, depth});
    enter(Where::unknown);
    zero_ = zero_count_ = 0.0;
  }

  void found(EventKind kind, Place at, double size, double probability) noexcept {
    queue_.add({kind, at.time, at.depth, size, probability, 0.0});
  }

  std::uint64_t settings_fingerprint() const noexcept {
    Fingerprint print;
    for (const auto& parameter : EventSettings::table) print.add(settings_.*parameter.member);
    return print.value();
  }

 public:
  /// Looks at a detector from outside, next to one of the same settings.
  void look_at(StateCheck& check, const EventDetector& fresh) const noexcept {
    check.require("settings", settings_fingerprint() == fresh.settings_fingerprint());
    course_.check(check, fresh.course_, time_);
    trail_.check(check, fresh.trail_, time_);
    windows_.check(check, fresh.windows_);
    model_.check(check);
    before_fall_.check(check);
    noise_.check(check);
    queue_.check(check);
    readings_.check(check, fresh.readings_);
    check.word("status", status_, StreamStatus::wrong_sign);
    check.word("where", where_, Where::inside);
    fall_.check(check);
    for (const bool* flag : {&started_, &was_stuck_, &zero_known_, &pulled_}) check.flag("flags", *flag);
    check.number("parts", parts_, 0.0, largest_in_a_state);
    check.number("zero", zero_count_, 0.0, largest_in_a_state);
    check.number("resistance", lost_, 0.0, 1.0);
    check.numbers("numbers", std::array{time_, since_, interval_, sum_, last_force_, last_depth_, zero_,
                                        free_noise_, peak_, where_since_, contact_depth_, calm_});
    check.numbers("places", std::array{felt_, quiet_, calm_at_});
  }

 private:
  EventSettings settings_;
  NeedleCourse course_;
  PlaceTrail trail_;
  LocalForce model_{}, before_fall_{};
  RunningNoise noise_{};
  FallWindows windows_;
  SensorReadings readings_;
  DetectionQueue queue_{};
  FollowedFall fall_{};
  StreamStatus status_ = StreamStatus::learning;
  Where where_ = Where::unknown;
  bool started_ = false, was_stuck_ = false, zero_known_ = false, pulled_ = false;
  double time_ = 0.0, since_ = 0.0, interval_ = 0.0;
  double sum_ = 0.0, parts_ = 0.0, last_force_ = 0.0, last_depth_ = 0.0;
  double zero_ = 0.0, zero_count_ = 0.0, free_noise_ = 0.0, peak_ = 0.0, where_since_ = 0.0;
  double contact_depth_ = 0.0, calm_ = 0.0, lost_ = 0.0;
  double gap_ = 0.0, before_gap_ = -longest;  // how long the last one was, and the reading before it
  Place felt_{}, quiet_{}, calm_at_{};
};

}  // namespace needleforce::events
