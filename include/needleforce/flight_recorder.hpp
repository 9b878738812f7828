// SPDX-License-Identifier: Apache-2.0
// The last cycles of a loop, written in it and read outside it.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "guard.hpp"

namespace needleforce {

/// One cycle as it was: what was given, also where it was no number, and what came out.
struct Cycle {
  std::uint64_t number = 0;   ///< counts from 0
  double dt = 0.0;            ///< [s] as given
  double depth = 0.0;         ///< [m] as given; NaN where none was
  double velocity = 0.0;      ///< [m/s] as given
  double sample_force = 0.0;  ///< [N] of the tissue
  double force = 0.0;         ///< [N] for the device
  double energy = 0.0;        ///< [J]
  double reserve = 0.0;       ///< [J]
  Phase phase = Phase::free;
  Status status = Status::ok;
  Interventions did{};
};

/// A ring of the last n cycles. One thread writes, any number read meanwhile. Neither waits for the other:
/// a slot that is written while it is read is left out.
template <std::size_t n>
class FlightRecorder {
  static_assert(n > 0);

 public:
  /// Adds a cycle and forgets the oldest. Wait-free; for one thread.
  void write(double depth, double velocity, double dt, const Output& output) noexcept {
    const std::uint64_t number = written_.load(std::memory_order_relaxed);
    Slot& slot = slots_[number % n];
    // odd while the words change; every word is released, so that who sees one of them sees this too
    slot.sequence.store(2 * number + 1, std::memory_order_relaxed);
    const Words words = packed(depth, velocity, dt, output);
    for (std::size_t i = 0; i < words.size(); ++i) slot.words[i].store(words[i], std::memory_order_release);
    slot.sequence.store(2 * number + 2, std::memory_order_release);
    written_.store(number + 1, std::memory_order_release);
  }

  /// The last cycles without a gap, oldest first, as many as are there and fit; the part of `out` that is
  /// returned holds them. Those that the loop overtakes meanwhile are left out. Wait-free; for any thread.
  std::span<Cycle> read(std::span<Cycle> out) const noexcept {
    const std::uint64_t end = written_.load(std::memory_order_acquire);
    const std::uint64_t kept = std::min<std::uint64_t>({end, n, out.size()});
    std::size_t first = kept;
    // from the newest back: the loop overtakes the oldest first
    while (first > 0 && take(end - kept + first - 1, out[first - 1])) --first;
    return out.subspan(first, kept - first);
  }

  /// How many cycles were written in all. Wait-free.
  std::uint64_t written() const noexcept { return written_.load(std::memory_order_acquire); }
  static constexpr std::size_t capacity() noexcept { return n; }

 private:
  using Words = std::array<std::uint64_t, 8>;
  struct Slot {
    std::atomic<std::uint64_t> sequence{0};
    std::array<std::atomic<std::uint64_t>, std::tuple_size_v<Words>> words{};
  };

  static Words packed(double depth, double velocity, double dt, const Output& o) noexcept {
    std::uint64_t words =
        static_cast<std::uint64_t>(o.sample.phase) << 16 | static_cast<std::uint64_t>(o.sample.status) << 8;
    for (std::size_t i = 0; i < std::size(interventions); ++i)
      words |= std::uint64_t{o.did.*interventions[i]} << i;
    constexpr auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value); };
    return {bits(dt),      bits(depth),    bits(velocity),  bits(o.sample.force),
            bits(o.force), bits(o.energy), bits(o.reserve), words};
  }

  bool take(std::uint64_t number, Cycle& cycle) const noexcept {
    const Slot& slot = slots_[number % n];
    if (slot.sequence.load(std::memory_order_acquire) != 2 * number + 2) return false;
    Words words;
    for (std::size_t i = 0; i < words.size(); ++i) words[i] = slot.words[i].load(std::memory_order_acquire);
    if (slot.sequence.load(std::memory_order_relaxed) != 2 * number + 2) return false;
    cycle = unpacked(number, words);
    return true;
  }

  static Cycle unpacked(std::uint64_t number, const Words& words) noexcept {
    const auto value = [&](std::size_t i) { return std::bit_cast<double>(words[i]); };
    Interventions did;
    for (std::size_t i = 0; i < std::size(interventions); ++i) did.*interventions[i] = words[7] >> i & 1;
    return {number,
            value(0),
            value(1),
            value(2),
            value(3),
            value(4),
            value(5),
            value(6),
            static_cast<Phase>(words[7] >> 16 & 0xff),
            static_cast<Status>(words[7] >> 8 & 0xff),
            did};
  }

  std::array<Slot, n> slots_{};
  std::atomic<std::uint64_t> written_{0};
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
};

}  // namespace needleforce
