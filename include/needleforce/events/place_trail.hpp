// SPDX-License-Identifier: Apache-2.0
// Where the needle was lately.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "../state_check.hpp"

namespace needleforce::events {

struct Place {
  double time = 0.0, depth = 0.0;
};

/// Eleven places over a period, which may be as far apart as readings are.
class PlaceTrail {
 public:
  explicit PlaceTrail(double period) noexcept : period_(period) {}

  /// Wait-free.
  void add(Place place) noexcept {
    if (count_ > 0 && place.time - newest().time < apart()) return;
    places_[count_ % size] = place;
    if (++count_ == 2 * size) count_ = size;
  }
  /// As if the first place were the last. Wait-free.
  void forget() noexcept { count_ = std::min<std::size_t>(count_, 1); }
  void restart() noexcept { count_ = 0; }

  bool empty() const noexcept { return count_ == 0; }
  const Place& oldest() const noexcept { return places_[count_ < size ? 0 : count_ % size]; }
  const Place& newest() const noexcept { return before(0); }
  /// The one so many places before the newest, or the oldest.
  const Place& before(std::size_t places) const noexcept {
    return places_[(count_ - 1 - std::min(places, std::min(count_, size) - 1)) % size];
  }

  /// Where it was at a time until `now`: on a line between two places; the oldest for a time before.
  /// Wait-free.
  Place at(double time, Place now) const noexcept {
    Place later = now;
    for (std::size_t i = 0; i < std::min(count_, size); ++i) {
      const Place& earlier = before(i);
      if (earlier.time <= time) {
        const double apart = later.time - earlier.time;
        const double share = apart > 0.0 ? (time - earlier.time) / apart : 0.0;
        return {time, earlier.depth + share * (later.depth - earlier.depth)};
      }
      later = earlier;
    }
    return later;
  }

  /// Looks at a trail from outside until `now`, next to one of the same period. Wait-free.
  void check(StateCheck& check, const PlaceTrail& fresh, double now) const noexcept {
    check.require("trail.period", period_ == fresh.period_);
    check.require("trail.count", count_ < 2 * size);
    check.numbers("trail.places", places_);
    if (check.fault() || count_ == 0) return;
    check.require("trail.time", newest().time <= now);
    for (std::size_t i = 1; i < std::min(count_, size); ++i)  // speeds are taken between them
      check.require("trail.time", before(i - 1).time - before(i).time >= apart());
  }

 private:
  static constexpr std::size_t size = 11;
  double apart() const noexcept { return 0.95 * period_ / static_cast<double>(size - 1); }

  double period_;
  std::array<Place, size> places_{};
  std::size_t count_ = 0;
};

}  // namespace needleforce::events
