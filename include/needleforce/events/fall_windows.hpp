// SPDX-License-Identifier: Apache-2.0
// The mean force over windows of several lengths, next to the highest such mean of the time before.
#pragma once

#include <array>
#include <cstddef>
#include <limits>

namespace needleforce::events {

/// A fall of unknown start and unknown duration: for each length of 1, 2, 4 ... readings the mean now, and
/// the highest mean of as many readings that ended before those began and up to `within` ago. The largest of
/// these differences in standard deviations is the likelihood ratio over all windows. Work and memory are
/// constant.
class FallWindows {
 public:
  static constexpr std::size_t lengths = 6, slots = 10;
  struct Top {
    double level = -std::numeric_limits<double>::infinity();
    double time = 0.0, depth = 0.0;
  };

  static constexpr std::size_t readings(std::size_t length) noexcept { return std::size_t{1} << length; }

  /// Forgets what came before: no fall is measured across this moment. Wait-free.
  void restart() noexcept {
    count_ = 0;
    slot_age_ = 0.0;
    for (std::size_t k = 0; k < lengths; ++k) clear(k);
  }

  void add(double force, double time, double depth, double dt, double within) noexcept {
    if (count_ == most) rebase();
    sums_[(count_ + 1) % kept] = sums_[count_ % kept] + force;
    places_[count_ % kept] = {force, time, depth};
    ++count_;
    slot_age_ += dt;
    if (slot_age_ > 0.95 * within / slots) next_slot();
    for (std::size_t k = 0; available(k, dt, within); ++k) take_earlier(k);
  }

  /// Whether two windows of this length have been seen, and are short against `within`.
  bool available(std::size_t k, double dt, double within) const noexcept {
    if (k >= lengths || count_ < 2 * readings(k)) return false;
    return k == 0 || 3.0 * dt * static_cast<double>(readings(k)) <= within;
  }
  /// Mean of the newest readings.
  double now(std::size_t k) const noexcept { return mean(0, readings(k)); }
  /// The highest mean before.
  const Top& top(std::size_t k) const noexcept {
    return closed_[k].level > open(k).level ? closed_[k] : open(k);
  }
  /// The reading before the newest, if any.
  double before() const noexcept {
    return count_ > 1 ? places_[(count_ - 2) % kept].level : places_[0].level;
  }

 private:
  static constexpr std::size_t kept = 128, most = 1024;

  const Top& open(std::size_t k) const noexcept { return tops_[k][slot_]; }
  double mean(std::size_t skipped, std::size_t n) const noexcept {
    const std::size_t end = count_ - skipped;
    return (sums_[end % kept] - sums_[(end - n) % kept]) / static_cast<double>(n);
  }
  void clear(std::size_t k) noexcept {
    tops_[k].fill({});
    closed_[k] = {};
  }
  void take_earlier(std::size_t k) noexcept {
    const std::size_t n = readings(k);
    const double level = mean(n, n);
    const Top& place = places_[(count_ - 1 - n) % kept];
    if (level > tops_[k][slot_].level) tops_[k][slot_] = {level, place.time, place.depth};
  }
  void next_slot() noexcept {
    slot_age_ = 0.0;
    slot_ = (slot_ + 1) % slots;
    for (std::size_t k = 0; k < lengths; ++k) {
      tops_[k][slot_] = {};
      closed_[k] = {};
      for (const Top& top : tops_[k])
        if (top.level > closed_[k].level) closed_[k] = top;
    }
  }
  /// Sums of long streams would lose digits.
  void rebase() noexcept {
    const double base = sums_[count_ % kept];
    for (double& sum : sums_) sum -= base;
    count_ -= most - kept;  // a multiple of kept: places stay
  }

  std::array<double, kept> sums_{};
  std::array<Top, kept> places_{};
  std::array<std::array<Top, slots>, lengths> tops_{};
  std::array<Top, lengths> closed_{};
  std::size_t count_ = 0, slot_ = 0;
  double slot_age_ = 0.0;
};

}  // namespace needleforce::events
