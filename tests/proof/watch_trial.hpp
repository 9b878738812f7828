// SPDX-License-Identifier: Apache-2.0
// The same bytes as a stream for the event detector: runs of samples, single odd ones, and what it has seen
// kept, taken back, and planted. An event lies in what was seen, is no later than now, and is given out again
// to the bit.
#pragma once

#include <algorithm>
#include <bit>

#include "needleforce/events/event_detector.hpp"
#include "planted.hpp"

namespace needleforce::proof {

class WatchTrial {
 public:
  using EventDetector = events::EventDetector;
  using Detection = events::Detection;

  explicit WatchTrial(const events::EventSettings& settings)
      : watch_(settings), twin_(settings), shadow_(settings), kept_(watch_.save()) {}

  void keep() { kept_ = watch_.save(); }
  void restore(std::size_t where, std::uint64_t change) {
    require(watch_.restore(kept_) && twin_.restore(kept_), "what was kept is taken back");
    shadow_ = watch_.snapshot();
    planted_.restore(watch_, [&](auto& saved) { plant(saved, where, change); });
  }
  void reset() { watch_.reset(), twin_.reset(), shadow_.reset(); }

  void step(double force, double depth, double dt) {
    if (std::abs(depth) <= 1e3) low_ = std::min(low_, depth), high_ = std::max(high_, depth);
    const Detection event = watch_.step(force, depth, dt);
    require(same(event, twin_.step(force, depth, dt)), "the same stream gives the same events");
    require(same(event, shadow_.step(force, depth, dt)), "what was taken back continues as before");
    check(event);
    const auto status = watch_.status();
    const bool refused =
        status == events::StreamStatus::bad_time || status == events::StreamStatus::not_finite;
    const bool bad = !(std::abs(force) <= 1e6) || !(std::abs(depth) <= 1e3) || !(dt >= 0.0 && dt <= 1e9);
    require(!bad || refused, "bad input is reported");
    late_ = refused && event.kind != events::EventKind::none ? late_ + 1 : refused ? late_ : 0;
    require(late_ < 4, "while samples are refused only what was found before is given out");
    planted_.step([](const Detection& made) { return numbers(made); }, force, depth, dt);
  }

 private:
  static std::array<double, 6> numbers(const Detection& e) {
    return {e.time, e.depth, e.size, e.probability, e.delay, double(e.kind)};
  }
  static bool same(const Detection& a, const Detection& b) {
    using Bits = std::array<std::uint64_t, 6>;
    return std::bit_cast<Bits>(numbers(a)) == std::bit_cast<Bits>(numbers(b));
  }
  void check(const Detection& event) const {
    for (const double number : numbers(event)) require(std::isfinite(number), "every number is finite");
    require(std::isfinite(watch_.noise()) && watch_.noise() > 0.0, "the noise is finite");
    require(watch_.needed_fall() >= 0.0, "a fall is needed, infinite until the noise is known");
    if (event.kind == events::EventKind::none) return;
    require(event.probability >= 0.0 && event.probability <= 1.0, "a probability is one");
    require(event.size >= 0.0, "a size is none below zero");
    require(event.time >= 0.0 && event.delay >= 0.0 && event.time <= watch_.time(), "no event is ahead");
    const double rounding = 1e-12 * std::max(std::abs(low_), std::abs(high_));
    require(event.depth >= low_ - rounding && event.depth <= high_ + rounding, "the needle was there");
  }

  EventDetector watch_, twin_, shadow_;
  EventDetector::Saved kept_;
  Planted<EventDetector> planted_;
  double low_ = std::numeric_limits<double>::infinity(), high_ = -low_;
  int late_ = 0;
};

inline events::EventSettings event_settings(from_bytes::Bytes& bytes) {
  if (bytes.below(2) == 0) return {};
  const auto settings = from_bytes::numbers_of<events::EventSettings>(bytes);
  return first_invalid(settings) ? events::EventSettings{} : settings;
}

/// Runs at one speed and one rate of the force, with a noise of a few millinewtons.
inline void watch(from_bytes::Bytes bytes) {
  WatchTrial trial(event_settings(bytes));
  double force = 0.0, depth = 0.0, dt = 1e-2;
  while (!bytes.empty()) {
    const std::size_t kind = bytes.below(16);
    if (kind == 0) trial.keep();
    if (kind == 1) trial.restore(bytes.take<std::uint16_t>(), bytes.take<std::uint32_t>());
    if (kind == 2) trial.reset();
    if (kind == 3) trial.step(bytes.number(-2.0, 2.0), depth, dt);
    if (kind == 4) trial.step(force, bytes.number(-1e-2, 1e-2), dt);
    if (kind == 5) trial.step(force, depth, bytes.number(0.0, 1.0));
    if (kind == 6) dt = 1e-4 * std::exp2(double(bytes.below(12)));
    if (kind == 7) force += 0.05 * double(std::int8_t(bytes.take<std::uint8_t>()));
    if (kind < 8) continue;
    const double speed = 1e-3 * (double(bytes.below(16)) - 5.0), rise = bytes.number(-5.0, 5.0);
    for (std::size_t i = 0, n = 1 + bytes.below(64); i < n; ++i) {
      force += rise * dt;
      depth += speed * dt;
      trial.step(force + 1e-3 * double(i * 7 % 11), depth, dt);
    }
  }
}

}  // namespace needleforce::proof
