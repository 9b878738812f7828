// SPDX-License-Identifier: Apache-2.0
// A value from one thread to another, newest first, without a lock: neither thread waits for the other.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace needleforce {

/// One thread writes values, one other reads the newest. The writer owns one slot, the reader the last `kept`
/// that it took, and one slot is between them; a single atomic exchange swaps it with either side, so that
/// no value is ever read while it is written. With `kept` 1 this is a triple buffer.
template <class T, std::size_t kept = 1>
class Exchange {
  static_assert(std::is_trivially_copyable_v<T>);
  static_assert(std::atomic<std::uint32_t>::is_always_lock_free);
  static_assert(kept >= 1);

 public:
  /// Every slot starts as `first`, which counts as taken. For use before the loop.
  explicit Exchange(const T& first) noexcept : Exchange(first, std::make_index_sequence<kept + 2>{}) {}
  Exchange(const Exchange&) = delete;
  Exchange& operator=(const Exchange&) = delete;

  /// Writer: the slot to write, which no other thread reads; it contains an earlier value. Wait-free.
  T& draft() noexcept { return slots_[draft_].value; }
  /// Writer: publishes the draft, in place of one that was not taken yet. Wait-free.
  void publish() noexcept { draft_ = between_.exchange(draft_ | fresh, std::memory_order_acq_rel) & slot; }
  /// Writer: the same for a copy of `value`. Wait-free.
  void publish(const T& value) noexcept {
    draft() = value;
    publish();
  }

  /// Reader: takes the newest value, if there is one that was not taken yet. The oldest one kept goes back.
  /// Wait-free.
  bool take() noexcept {
    if (!(between_.load(std::memory_order_relaxed) & fresh)) return false;
    const std::uint32_t oldest = kept_[kept - 1];
    for (std::size_t i = kept - 1; i > 0; --i) kept_[i] = kept_[i - 1];
    kept_[0] = between_.exchange(oldest, std::memory_order_acq_rel) & slot;
    return true;
  }
  /// Reader: the value taken last, or the `back`-th before it, below `kept`; the reader's own, to change as
  /// it likes. Wait-free.
  T& taken(std::size_t back = 0) noexcept { return slots_[kept_[back]].value; }
  const T& taken(std::size_t back = 0) const noexcept { return slots_[kept_[back]].value; }

 private:
  static constexpr std::uint32_t fresh = 0x100, slot = 0xff;
  static constexpr std::size_t line = 64;  // bytes of a cache line, which two cores must not share

  struct alignas(line) Slot {
    T value;
  };
  template <std::size_t... i>
  Exchange(const T& first, std::index_sequence<i...>) noexcept
      : slots_{(static_cast<void>(i), Slot{first})...} {
    for (std::size_t k = 0; k < kept; ++k) kept_[k] = static_cast<std::uint32_t>(k + 2);
  }

  std::array<Slot, kept + 2> slots_;
  alignas(line) std::atomic<std::uint32_t> between_{0};
  alignas(line) std::uint32_t draft_ = 1;
  alignas(line) std::array<std::uint32_t, kept> kept_{};
};

}  // namespace needleforce
