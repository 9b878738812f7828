// SPDX-License-Identifier: Apache-2.0
// Samples averaged to readings, which wait until no event can date from before them.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "tissue_estimate.hpp"

namespace needleforce::online {

/// Samples are added until they are one reading; a few of these wait. Wait-free, bounded.
class WaitingReadings {
 public:
  static constexpr std::size_t most = 16;

  void forget() noexcept { count_ = 0; }
  /// What comes does not continue what came.
  void interrupt() noexcept {
    open_ = {};
    broken_ = true;
  }
  bool full() const noexcept { return count_ == most; }
  bool any() const noexcept { return count_ > 0; }
  double time_of_first() const noexcept { return queue_[0].time; }
  const Reading& first() const noexcept { return queue_[0].reading; }
  void drop_first() noexcept {
    for (std::size_t i = 1; i < count_; ++i) queue_[i - 1] = queue_[i];
    --count_;
  }

  /// What comes first does not continue what came.
  void part() noexcept { (any() ? queue_[0].reading.continues : broken_) = !any(); }

  void add(double force, double depth) noexcept {
    if (open_.count == 0.0) open_.from = depth;
    open_.count += 1.0;
    open_.force += force;
    open_.depth += depth;
  }
  /// Whether the samples since the last reading are enough for one.
  bool complete(double depth, double spacing) const noexcept {
    const double travel = std::abs(depth - open_.from);
    return !(travel + 0.5 * travel / open_.count < spacing);
  }
  double mean_depth() const noexcept { return open_.depth / open_.count; }
  /// Mean force since the last reading, or this one if there was no other.
  double mean_force(double force) const noexcept {
    return open_.count > 0.0 ? open_.force / open_.count : force;
  }
  /// The samples since the last reading are this one.
  void close(double time, const Reading& reading) noexcept {
    Waiting& last = queue_[count_++];
    last = {time, reading};
    last.reading.continues = !broken_;
    broken_ = false;
    open_ = {};
  }
  /// Looks at them from outside.
  void check(StateCheck& check) const noexcept {
    check.require("readings", count_ <= most);
    check.flag("readings", broken_);
    check.number("readings", open_.count, 0.0, largest_in_a_state);
    check.numbers("readings", open_);
    for (const Waiting& each : queue_) {
      check.number("readings", each.time, -1e15, 1e15);
      each.reading.check(check);
    }
  }

 private:
  struct Open {
    double count = 0.0, force = 0.0, depth = 0.0, from = 0.0;
  };
  struct Waiting {
    double time = 0.0;
    Reading reading{};
  };
  std::array<Waiting, most> queue_{};
  Open open_{};
  std::size_t count_ = 0;
  bool broken_ = true;
};

}  // namespace needleforce::online
