// SPDX-License-Identifier: Apache-2.0
// The fall of a force from when it was found to when it ends: one fall is one puncture, however long it
// takes.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "../state_check.hpp"
#include "detection.hpp"
#include "fall_windows.hpp"
#include "place_trail.hpp"

namespace needleforce::events {

class FollowedFall {
 public:
  /// Found over windows of number `window`, at `time` [s], by its levels and the largest step of a reading
  /// [N].
  void begin(std::size_t window, double time, double from, double to, double step, double most,
             bool sure) noexcept {
    follows_ = true;
    window_ = window;
    at_ = time;
    from_ = from;
    to_ = to;
    step_ = step;
    sure_ = sure;
    least_certain_ = std::min(most, 0.9);
  }
  /// The lowest level so far, and where.
  void lower(double level, Place at) noexcept {
    low_ = level;
    low_at_ = at;
  }
  void end() noexcept { follows_ = false; }
  void forget(Place now) noexcept {
    end();
    low_at_ = now;
  }

  /// True while `within` [s] brings half of what was `needed` to find it, and the level is within noise of
  /// the lowest.
  bool lasts(double time, double level, double noisy, double needed, double within) noexcept {
    if (low_ <= to_ - 0.5 * needed) {
      to_ = low_;
      at_ = time;
    }
    return time - at_ < within && level < low_ + noisy;
  }
  /// Whether the force is nearer to where the fall ended than to where it began.
  bool stays(double force) const noexcept { return from_ - force > 0.5 * size(); }
  /// How certain its end is.
  double certain() const noexcept { return sure_ && spread(step_, size()) ? 1.0 : least_certain_; }
  /// Whether a fall took more than one reading: its largest step is less than one of two and half of the
  /// other.
  static bool spread(double step, double fall) noexcept { return step < 0.75 * fall; }

  bool follows() const noexcept { return follows_; }
  std::size_t window() const noexcept { return window_; }
  double from() const noexcept { return from_; }
  double low() const noexcept { return low_; }
  Place low_at() const noexcept { return low_at_; }
  double size() const noexcept { return from_ - low_; }

  void check(StateCheck& check) const noexcept {
    for (const bool* flag : {&follows_, &sure_}) check.flag("flags", *flag);
    check.require("falling", window_ < FallWindows::lengths);
    check.number("certainty", least_certain_, 0.0, 0.9);
    check.numbers("numbers", std::array{at_, from_, to_, low_, step_});
    check.numbers("places", low_at_);
  }

 private:
  std::size_t window_ = 0;
  bool follows_ = false, sure_ = false;
  double at_ = 0.0, from_ = 0.0, to_ = 0.0, low_ = 0.0, step_ = 0.0, least_certain_ = 0.0;
  Place low_at_{};
};

}  // namespace needleforce::events
