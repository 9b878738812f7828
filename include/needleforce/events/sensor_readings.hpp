// SPDX-License-Identifier: Apache-2.0
// What the sensor does by itself: readings that repeat themselves, and a level that is another from one to
// the next.
#pragma once

#include <array>

#include "../state_check.hpp"

namespace needleforce::events {

class SensorReadings {
 public:
  explicit SensorReadings(double within) noexcept : within_(within) {}

  /// The next reading, as the sensor gives it. Wait-free.
  void add(double force, double time, bool moves) noexcept {
    const double fall = any_ ? last_ - force : 0.0;
    same_ = any_ && fall == 0.0;
    moves_ = moves;
    any_ = true;
    last_ = force;
    if (!same_ && stuck(time)) stuck_until_ = time;
    if (!same_) fresh_at_ = time;
    repeats_ = same_ ? repeats_ + 1.0 : 0.0;
    if (fall >= step_ || time - step_at_ > lately * within_) {
      step_ = fall;
      step_at_ = time;
    }
  }

  double last() const noexcept { return last_; }
  bool repeats() const noexcept { return same_; }
  /// Whether the force has been the same for `within` although the needle moves.
  bool stuck(double time) const noexcept { return time - fresh_at_ > within_ && repeats_ >= 10.0 && moves_; }
  /// Whether it was so a moment ago.
  bool was_stuck(double time) const noexcept { return time - stuck_until_ <= within_; }
  /// The largest fall between two readings, of five at least where they follow fast.
  double step() const noexcept { return step_; }

  /// Looks at readings from outside, next to some of the same settings. Wait-free.
  void check(StateCheck& check, const SensorReadings& fresh) const noexcept {
    check.require("readings.settings", within_ == fresh.within_);
    check.numbers("readings", std::array{last_, fresh_at_, repeats_, stuck_until_, step_, step_at_});
    for (const bool* flag : {&any_, &same_, &moves_}) check.flag("readings.flags", *flag);
  }

 private:
  static constexpr double lately = 0.125;  // of `within`

  double within_, last_ = 0.0, fresh_at_ = 0.0, repeats_ = 0.0, stuck_until_ = -1e9;
  double step_ = 0.0, step_at_ = -1e9;
  bool any_ = false, same_ = false, moves_ = false;
};

}  // namespace needleforce::events
