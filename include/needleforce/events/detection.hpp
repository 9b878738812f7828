// SPDX-License-Identifier: Apache-2.0
// What is found while a needle moves, and what is known of the stream in which it was looked for.
#pragma once

#include <array>
#include <cstddef>

#include "../state_check.hpp"

namespace needleforce::events {

enum class EventKind { none, contact, puncture, sliding, stop, reversal, exit };
inline constexpr std::array<const char*, 7> event_kind_names{"none", "contact",  "puncture", "sliding",
                                                             "stop", "reversal", "exit"};

/// What the last sample was worth. `learning`: the noise is not known yet. `unknown_zero`: the stream began
/// with a force, and where the tissue begins is not known. `stuck`: the force repeats itself while the needle
/// moves. `wrong_sign`: a needle on its way inwards is pulled before it was ever pushed: tension is positive
/// in this stream, or its zero has moved.
enum class StreamStatus { ok, learning, not_finite, bad_time, gap, stuck, unknown_zero, wrong_sign };
inline constexpr std::array<const char*, 8> stream_status_names{
    "ok", "learning", "not_finite", "bad_time", "gap", "stuck", "unknown_zero", "wrong_sign"};

/// An event found while it happens, in the zero of the stream's own depth and in the time since its start.
struct Detection {
  EventKind kind = EventKind::none;
  double time = 0.0;   ///< of the event [s]: of a puncture, of the peak before its fall
  double depth = 0.0;  ///< there [m]
  double size = 0.0;   ///< fall or rise of the force so far [N]; of a reversal, the way back [m]
  double probability =
      0.0;  ///< that it is real: 0.5 at most where the stream allows another cause, 0.9 by one reading
  double delay = 0.0;  ///< from the event to this sample [s]
};

/// What was found and not handed out: one event a sample leaves it.
class DetectionQueue {
 public:
  /// Wait-free; one more than fits is left out.
  void add(const Detection& event) noexcept {
    if (waiting_ < events_.size()) events_[waiting_++] = event;
  }
  /// The oldest, with its delay until now. Wait-free.
  Detection next(double now) noexcept {
    if (waiting_ == 0) return {};
    Detection first = events_[0];
    first.delay = now - first.time;
    for (std::size_t i = 1; i < waiting_; ++i) events_[i - 1] = events_[i];
    --waiting_;
    return first;
  }

  /// Looks at a queue from outside. Wait-free.
  void check(StateCheck& check) const noexcept {
    check.require("events", waiting_ <= events_.size());
    for (const Detection& each : events_) {
      check.word("events", each.kind, EventKind::exit);
      check.number("events", each.probability, 0.0, 1.0);
      check.numbers("events", std::array{each.time, each.depth, each.size, each.delay});
    }
  }

 private:
  std::array<Detection, 4> events_{};
  std::size_t waiting_ = 0;
};

}  // namespace needleforce::events
