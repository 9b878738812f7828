// SPDX-License-Identifier: Apache-2.0
// A memory as bytes that may leave the process, with the version and the model that they belong to.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "fingerprint.hpp"
#include "version.hpp"

namespace needleforce {

/// Plain bytes of a state: version and size of the program that wrote it, its model, a checksum.
template <class State>
struct StateBytes {
  static_assert(std::is_trivially_copyable_v<State> && sizeof(State) % sizeof(std::uint64_t) == 0);
  std::uint64_t version, size, model;
  std::array<std::uint64_t, sizeof(State) / sizeof(std::uint64_t)> words;
  std::uint64_t checksum;

  State state() const noexcept { return std::bit_cast<State>(words); }
  /// Of everything before the checksum. Four chains at once, as each waits for its own multiplications.
  std::uint64_t sum() const noexcept {
    Fingerprint a, b, c, d;
    std::size_t k = 0;
    for (; k + 4 <= words.size(); k += 4) {
      a.add(words[k]);
      b.add(words[k + 1]);
      c.add(words[k + 2]);
      d.add(words[k + 3]);
    }
    for (; k < words.size(); ++k) a.add(words[k]);
    for (const std::uint64_t word : {version, size, model, b.value(), c.value(), d.value()}) a.add(word);
    return a.value();
  }
};

namespace detail {
constexpr std::uint64_t this_version() noexcept {
  Fingerprint print;
  print.add(needleforce::version);
  return print.value();
}
}  // namespace detail

/// A state as bytes. Wait-free.
template <class State>
StateBytes<State> state_bytes(const State& state, std::uint64_t model) noexcept {
  using Bytes = StateBytes<State>;
  Bytes result{detail::this_version(), sizeof(Bytes), model, std::bit_cast<decltype(Bytes::words)>(state), 0};
  result.checksum = result.sum();
  return result;
}

/// True if these bytes were saved by this version, for this model, and are intact. Wait-free.
template <class State>
bool belongs(const StateBytes<State>& bytes, std::uint64_t model) noexcept {
  return bytes.version == detail::this_version() && bytes.size == sizeof bytes && bytes.model == model &&
         bytes.checksum == bytes.sum();
}

}  // namespace needleforce
