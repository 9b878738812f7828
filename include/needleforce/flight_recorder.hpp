// SPDX-License-Identifier: Apache-2.0
// The last cycles of a loop, written in it and read outside it.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <concepts>
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

  using Motion = DepthMotion;
  using Output = needleforce::Output;
  using Words = std::array<std::uint64_t, 8>;
  static Words packed(const Motion& motion, double dt, const Output& o) noexcept {
    return {to_word(dt),
            to_word(motion.depth),
            to_word(motion.velocity),
            to_word(o.sample.force),
            to_word(o.force),
            to_word(o.energy),
            to_word(o.reserve),
            to_word(o.sample.phase, o.sample.status, o.did)};
  }
  static Cycle unpacked(std::uint64_t number, const Words& words) noexcept {
    const auto value = [&](std::size_t i) { return std::bit_cast<double>(words[i]); };
    Cycle cycle{number, value(0), value(1), value(2), value(3), value(4), value(5), value(6)};
    read_word(words[7], cycle);
    return cycle;
  }

  static std::uint64_t to_word(double value) noexcept { return std::bit_cast<std::uint64_t>(value); }
  static std::uint64_t to_word(Phase phase, Status status, const Interventions& did) noexcept {
    std::uint64_t word = static_cast<std::uint64_t>(phase) << 16 | static_cast<std::uint64_t>(status) << 8;
    for (std::size_t i = 0; i < std::size(interventions); ++i)
      word |= std::uint64_t{did.*interventions[i]} << i;
    return word;
  }
  static void read_word(std::uint64_t word, auto& cycle) noexcept {
    cycle.phase = static_cast<Phase>(word >> 16 & 0xff);
    cycle.status = static_cast<Status>(word >> 8 & 0xff);
    for (std::size_t i = 0; i < std::size(interventions); ++i) cycle.did.*interventions[i] = word >> i & 1;
  }
};

/// A ring of the last n cycles. One thread writes, any number read meanwhile. Neither waits for the other:
/// a slot that is written while it is read is left out.
template <std::size_t n, class Row = Cycle>
class FlightRecorder {
  static_assert(n > 0);

 public:
  /// Adds a cycle, of what was given and came out, and forgets the oldest. Wait-free; for one thread.
  void write(const typename Row::Motion& motion, double dt, const typename Row::Output& output) noexcept {
    const std::uint64_t number = written_.load(std::memory_order_relaxed);
    Slot& slot = slots_[number % n];
    // odd while the words change; every word is released, so that who sees one of them sees this too
    slot.sequence.store(2 * number + 1, std::memory_order_relaxed);
    const Words words = Row::packed(motion, dt, output);
    for (std::size_t i = 0; i < words.size(); ++i) slot.words[i].store(words[i], std::memory_order_release);
    slot.sequence.store(2 * number + 2, std::memory_order_release);
    written_.store(number + 1, std::memory_order_release);
  }

  /// The same along the depth. Wait-free; for one thread.
  void write(double depth, double velocity, double dt, const Output& output) noexcept
    requires std::same_as<Row, Cycle>
  {
    write({depth, velocity}, dt, output);
  }

  /// The last cycles without a gap, oldest first, as many as are there and fit; the part of `out` that is
  /// returned holds them. Those that the loop overtakes meanwhile are left out. Wait-free; for any thread.
  std::span<Row> read(std::span<Row> out) const noexcept {
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
  using Words = typename Row::Words;
  struct Slot {
    std::atomic<std::uint64_t> sequence{0};
    std::array<std::atomic<std::uint64_t>, std::tuple_size_v<Words>> words{};
  };

  bool take(std::uint64_t number, Row& row) const noexcept {
    const Slot& slot = slots_[number % n];
    if (slot.sequence.load(std::memory_order_acquire) != 2 * number + 2) return false;
    Words words;
    for (std::size_t i = 0; i < words.size(); ++i) words[i] = slot.words[i].load(std::memory_order_acquire);
    if (slot.sequence.load(std::memory_order_relaxed) != 2 * number + 2) return false;
    row = Row::unpacked(number, words);
    return true;
  }

  std::array<Slot, n> slots_{};
  std::atomic<std::uint64_t> written_{0};
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
};

}  // namespace needleforce
