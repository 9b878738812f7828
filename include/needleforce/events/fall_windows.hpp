// SPDX-License-Identifier: Apache-2.0
// The mean force over windows of several lengths, next to the highest such mean of the time before.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "../state_check.hpp"

namespace needleforce::events {

/// A fall of unknown start and unknown duration: for each length of 1, 2, 4 ... readings the mean now, and
/// the highest mean of as many readings that ended before those began and up to `within` ago. The largest of
/// these differences in standard deviations is the likelihood ratio over all windows. What came before counts
/// as the median of each reading and its neighbours, so that a glitch of one reading is no height to fall
/// from. Where readings follow fast (fortieths of `within`), so does what is now. Work and memory are
/// constant.
class FallWindows {
 public:
  static constexpr std::size_t lengths = 6, slots = 10;
  struct Top {
    double level = -std::numeric_limits<double>::infinity();
    double time = 0.0, depth = 0.0;
  };

  static constexpr std::size_t readings(std::size_t length) noexcept { return std::size_t{1} << length; }

  explicit FallWindows(double within) noexcept : within_(within) {}

  /// No fall is measured across this moment; means of now may still have readings from before it. Wait-free.
  void restart() noexcept {
    first_ = count_;
    slot_age_ = 0.0;
    highest_ = {};
    tops_ = {};
  }

  /// A reading, and how far apart readings are. Wait-free.
  void add(double force, double time, double depth, double interval) noexcept {
    if (count_ == most) rebase();
    interval_ = interval;
    readings_[count_ % kept] = {force, time, depth};
    sums_[(count_ + 1) % kept] = sums_[count_ % kept] + force;
    if (count_ > 0) calm_sums_[count_ % kept] = calm_sums_[(count_ - 1) % kept] + calm();
    ++count_;
    slot_age_ += interval;
    if (slot_age_ > 0.95 * within_ / slots) next_slot();
    for (std::size_t k = 0; available(k); ++k) take_earlier(k);
  }

  /// Whether two windows of this length have been seen, and are short against `within`.
  bool available(std::size_t k) const noexcept {
    if (k >= lengths || since() < 2 * readings(k) + 1) return false;
    return k == 0 || 3.0 * interval_ * static_cast<double>(readings(k)) <= within_;
  }
  /// Whether readings follow so fast that the newest can be left out.
  bool fast() const noexcept { return 40.0 * interval_ <= within_; }
  /// Mean of the newest readings.
  double now(std::size_t k) const noexcept { return fast() ? calm_now(k) : mean(sums_, count_, k); }
  /// The same of medians, without the newest reading.
  double calm_now(std::size_t k) const noexcept { return mean(calm_sums_, count_ - 1, k); }
  /// The highest mean before.
  const Top& top(std::size_t k) const noexcept {
    const Top &open = tops_[k][slot_], &closed = tops_[k][highest_[k]];
    return closed.level > open.level ? closed : open;
  }

  /// Looks at windows from outside, next to some of the same settings. Wait-free.
  void check(StateCheck& check, const FallWindows& fresh) const noexcept {
    check.require("windows.settings", within_ == fresh.within_);
    check.require("windows.count", count_ <= most && first_ <= count_ && slot_ < slots);
    for (const std::size_t slot : highest_) check.require("windows.count", slot < slots);
    check.number("windows.time", interval_, 0.0, 1e9);
    check.number("windows.time", slot_age_, 0.0, 2e9);
    check.numbers("windows.sums", std::array{sums_, calm_sums_});
    check.numbers("windows.readings", readings_);
    for (const auto& length : tops_)
      for (const Top& top : length) {
        check.require("windows.tops", top.level == Top{}.level || std::abs(top.level) <= largest_in_a_state);
        check.numbers("windows.tops", std::array{top.time, top.depth});
      }
  }

 private:
  static constexpr std::size_t kept = 128, most = 1024;
  using Sums = std::array<double, kept>;
  struct Reading {
    double force = 0.0, time = 0.0, depth = 0.0;
  };

  std::size_t since() const noexcept { return count_ - first_; }
  double mean(const Sums& sums, std::size_t end, std::size_t k) const noexcept {
    constexpr std::array<double, lengths> shares{1.0, 1.0 / 2, 1.0 / 4, 1.0 / 8, 1.0 / 16, 1.0 / 32};
    return (sums[end % kept] - sums[(end - readings(k)) % kept]) * shares[k];
  }
  /// The reading before the newest, or the median of it and its neighbours.
  double calm() const noexcept {
    const double newest = readings_[count_ % kept].force, middle = readings_[(count_ - 1) % kept].force;
    if (since() < 2) return std::min(newest, middle);
    const double oldest = readings_[(count_ - 2) % kept].force;
    return std::max(std::min(newest, middle), std::min(std::max(newest, middle), oldest));
  }
  void take_earlier(std::size_t k) noexcept {
    const std::size_t n = readings(k);
    const double level = mean(calm_sums_, count_ - n, k);
    const Reading& place = readings_[(count_ - 1 - n) % kept];
    if (level > tops_[k][slot_].level) tops_[k][slot_] = {level, place.time, place.depth};
  }
  /// The oldest slot is emptied. Its window is searched again only where it had the highest mean.
  void next_slot() noexcept {
    slot_age_ = 0.0;
    const std::size_t closed = slot_;
    slot_ = (slot_ + 1) % slots;
    for (std::size_t k = 0; k < lengths; ++k) {
      tops_[k][slot_] = {};
      if (highest_[k] == slot_)
        search(k);
      else if (tops_[k][closed].level > tops_[k][highest_[k]].level)
        highest_[k] = closed;
    }
  }
  void search(std::size_t k) noexcept {
    std::size_t highest = 0;
    for (std::size_t i = 1; i < slots; ++i)
      if (tops_[k][i].level > tops_[k][highest].level) highest = i;
    highest_[k] = highest;
  }
  /// Sums of long streams would lose digits.
  void rebase() noexcept {
    const double base = sums_[count_ % kept], calm_base = calm_sums_[(count_ - 1) % kept];
    for (double& sum : sums_) sum -= base;
    for (double& sum : calm_sums_) sum -= calm_base;
    count_ -= most - kept;  // a multiple of kept: readings stay
    first_ -= std::min(first_, most - kept);
  }

  double within_, interval_ = 0.0;
  Sums sums_{}, calm_sums_{};
  std::array<Reading, kept> readings_{};
  std::array<std::array<Top, slots>, lengths> tops_{};
  std::array<std::size_t, lengths> highest_{};  // slot with the highest mean
  std::size_t count_ = 0, first_ = 0, slot_ = 0;
  double slot_age_ = 0.0;
};

}  // namespace needleforce::events
