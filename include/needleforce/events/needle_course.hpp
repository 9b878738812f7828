// SPDX-License-Identifier: Apache-2.0
// How the needle moves: how fast, in which direction, whether through new tissue.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "../state_check.hpp"
#include "event_settings.hpp"
#include "place_trail.hpp"

namespace needleforce::events {

class NeedleCourse {
 public:
  using Place = events::Place;

  explicit NeedleCourse(const EventSettings& settings) noexcept
      : turn_(4.0 * settings.depth_noise),
        rest_speed_(settings.rest_speed),
        within_(settings.within),
        trail_(settings.within) {}

  /// `turned` and `stopped` are about this reading alone. Wait-free.
  void add(double time, double depth, double dt) noexcept {
    turned_ = stopped_ = false;
    if (trail_.empty()) turning_ = deepest_ = {time, depth};
    follow_direction(time, depth);
    if (depth > deepest_.depth) deepest_ = {time, depth};
    trail_.add({time, depth});
    const double elapsed = time - trail_.oldest().time;
    if (elapsed < 0.9 * within_) return;
    speed_ = (depth - trail_.oldest().depth) / elapsed;
    const Place& lately = trail_.before(places);
    recent_ = (depth - lately.depth) / (time - lately.time);
    follow_rest();
    if (!resting_) follow_unevenness(dt);
    if (!resting_) usual_ += std::min(1.0, dt / (3.0 * within_)) * (speed_ - usual_);
  }

  /// After a gap: no speed is known across it.
  void forget_speed() noexcept {
    trail_.forget();
    resting_ = true;
    usual_ = speed_ = recent_ = 0.0;
  }
  /// Another insertion begins here: its tissue is new.
  void begin(Place place) noexcept { deepest_ = place; }

  bool turned() const noexcept { return turned_; }
  bool stopped() const noexcept { return stopped_; }
  const Place& turning() const noexcept { return turning_before_; }
  bool inwards() const noexcept { return direction_ > 0; }
  bool outwards() const noexcept { return direction_ < 0; }
  bool resting() const noexcept { return resting_; }
  /// Where it stood when it had already stopped.
  const Place& since() const noexcept { return trail_.oldest(); }
  /// Whether it goes deeper than ever, as far as the depth is known.
  bool cuts(double depth) const noexcept { return inwards() && !resting_ && depth > deepest_.depth - turn_; }
  /// Share of its speed that it has lost, beyond a fifth, which readings of a steady motion may.
  double slowing() const noexcept {
    if (!(usual_ > rest_speed_)) return 0.0;
    return std::clamp((0.8 - speed_ / usual_) / 0.8, 0.0, 1.0);
  }
  /// Whether the newest readings of the depth continue those before: not where it stops, or is read seldom.
  /// Newest readings that are no slower than shaking makes them show no stop; those of all of `within` must.
  bool steady() const noexcept {
    const double least = 0.7 * usual_;
    return recent_ > least || (recent_ > least - uneven_ && speed_ > least);
  }

  /// Looks at a course from outside until `time`, next to one of the same settings. Wait-free.
  void check(StateCheck& check, const NeedleCourse& fresh, double time) const noexcept {
    const bool same = turn_ == fresh.turn_ && rest_speed_ == fresh.rest_speed_ && within_ == fresh.within_;
    check.require("course.settings", same);
    check.require("course.direction", direction_ >= -1 && direction_ <= 1);
    for (const bool* flag : {&turned_, &stopped_, &resting_}) check.flag("course.flags", *flag);
    check.numbers("course.places", std::array{turning_, turning_before_, deepest_});
    check.numbers("course.speeds", std::array{speed_, recent_, usual_});
    check.number("course.speeds", uneven_, 0.0, 1e9);
    trail_.check(check, fresh.trail_, time);
  }

 private:
  static constexpr std::size_t places = 3;  // over which the speed is recent

  void follow_direction(double time, double depth) noexcept {
    if (direction_ == 0 && std::abs(depth - turning_.depth) > turn_) {
      direction_ = depth > turning_.depth ? 1 : -1;
      turning_ = {time, depth};
    }
    const double onwards = direction_ * (depth - turning_.depth);
    if (onwards > 0.0) turning_.depth = depth;
    if (onwards > -0.5 * turn_) turning_.time = time;  // a hold ends when the needle leaves, not when it came
    turned_ = direction_ != 0 && onwards < -turn_;
    if (!turned_) return;
    turning_before_ = turning_;
    turning_ = {time, depth};
    direction_ = -direction_;
  }
  /// Median of the differences between the recent speed and the one before: a change of speed counts little
  /// in it, depths that shake or are coarse count fully.
  void follow_unevenness(double dt) noexcept {
    const Place &newer = trail_.before(places), &older = trail_.before(2 * places);
    if (!(newer.time > older.time)) return;
    const double before = (newer.depth - older.depth) / (newer.time - older.time);
    const double change = std::abs(recent_ - before), step = 1.0 + std::min(1.0, 0.2 * dt / within_);
    uneven_ = uneven_ == 0.0 ? change : uneven_ * (change > uneven_ ? step : 1.0 / step);
    uneven_ = std::clamp(uneven_, 1e-12, 1e6);
  }
  void follow_rest() noexcept {
    if (resting_) {
      if (std::abs(speed_) < 2.0 * rest_speed_) return;
      resting_ = false;
      usual_ = speed_;
    }
    stopped_ = resting_ = std::abs(speed_) < rest_speed_ && std::abs(recent_) < rest_speed_;
  }

  double turn_, rest_speed_, within_;
  PlaceTrail trail_;
  Place turning_{}, turning_before_{}, deepest_{};
  double speed_ = 0.0, recent_ = 0.0, usual_ = 0.0, uneven_ = 0.0;
  int direction_ = 0;
  bool turned_ = false, stopped_ = false, resting_ = true;
};

}  // namespace needleforce::events
