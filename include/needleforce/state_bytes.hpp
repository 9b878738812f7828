// SPDX-License-Identifier: Apache-2.0
// A memory as bytes that may leave the process, with the version and the model that they belong to.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "fingerprint.hpp"
#include "version.hpp"

namespace needleforce {

/// Four sums over 64-bit words. The first three find every change of up to three bits, of the words or of the
/// sums, and every burst of up to 64 bits: docs/evidence/proof.md. The last mixes the words, against other
/// changes.
class Checksum {
 public:
  static constexpr std::size_t block = 64, max_words = block * 64;  // beyond, two words are turned alike

  constexpr void add(std::span<const std::uint64_t> words) noexcept {
    for (std::size_t begin = 0; begin < words.size(); begin += block)
      add_block(words.subspan(begin, std::min(block, words.size() - begin)));
  }
  constexpr std::array<std::uint64_t, 4> value() const noexcept {
    Fingerprint all = lanes_[0].mixed;
    for (std::size_t i = 1; i < lanes_.size(); ++i) all.add(lanes_[i].mixed.value());
    return {columns_, near_, far_, all.value()};
  }

 private:
  /// Every fourth word: four at once, as each sum waits for itself.
  struct Lane {
    std::uint64_t columns = 0, near = 0;
    Fingerprint mixed{};
    constexpr void add(std::uint64_t word) noexcept {
      columns ^= word;
      near = std::rotl(near, 4) ^ word;
      mixed.add(word);
    }
  };
  constexpr void add_block(std::span<const std::uint64_t> words) noexcept {
    Lane a = lanes_[0], b = lanes_[1], c = lanes_[2], d = lanes_[3];
    std::size_t k = 0;
    for (; k + 4 <= words.size(); k += 4) {
      a.add(words[k]);
      b.add(words[k + 1]);
      c.add(words[k + 2]);
      d.add(words[k + 3]);
    }
    std::uint64_t columns = a.columns ^ b.columns ^ c.columns ^ d.columns, near = 0;
    for (Lane* lane : {&a, &b, &c, &d}) {
      near = std::rotl(near, 1) ^ lane->near;
      lane->near = lane->columns = 0;
    }
    for (; k < words.size(); ++k) {
      columns ^= words[k];
      near = std::rotl(near, 1) ^ words[k];
      a.mixed.add(words[k]);
    }
    lanes_ = {a, b, c, d};
    columns_ ^= columns;
    near_ ^= near;
    far_ = std::rotl(far_, 1) ^ columns;
  }
  std::uint64_t columns_ = 0;  // all words
  std::uint64_t near_ = 0;     // each turned by its place in the block
  std::uint64_t far_ = 0;      // each turned by its block
  std::array<Lane, 4> lanes_{};
};

/// Plain bytes of a state: version and size of the program that wrote it, its model, checksums. One of these
/// is of at most `stretch` words, so that what they find does not depend on the size of the state.
template <class State>
struct StateBytes {
  static_assert(std::is_trivially_copyable_v<State> && sizeof(State) % sizeof(std::uint64_t) == 0);
  static constexpr std::size_t count = sizeof(State) / sizeof(std::uint64_t);
  static constexpr std::size_t stretch = Checksum::max_words - Checksum::block;  // a block is the head's
  static constexpr std::size_t stretches = (count + stretch - 1) / stretch;
  using Sums = std::array<std::array<std::uint64_t, 4>, stretches>;

  std::uint64_t version, size, model;
  std::array<std::uint64_t, count> words;
  Sums checksum;

  State state() const noexcept { return std::bit_cast<State>(words); }
  /// Of everything before the checksums; the first includes the head.
  Sums sum() const noexcept {
    Sums sums;
    const std::span<const std::uint64_t> all(words);
    for (std::size_t i = 0; i < stretches; ++i) {
      Checksum sum;
      if (i == 0) sum.add(std::array{version, size, model});
      sum.add(all.subspan(i * stretch, std::min(stretch, count - i * stretch)));
      sums[i] = sum.value();
    }
    return sums;
  }
};

/// Which members all that is saved has, and where: tests/house/test_saved_layout.py computes it from them,
/// and fails where this is another.
inline constexpr std::uint64_t state_layout = 0x94c4b472bac2cc57u;

namespace detail {
/// The version that wrote the bytes, how it lays out what it saves, and the sizes of the machine's words.
constexpr std::uint64_t this_version() noexcept {
  Fingerprint print;
  print.add(needleforce::version);
  print.add(state_layout);
  print.add(std::uint64_t{sizeof(std::size_t)});
  return print.value();
}
}  // namespace detail

/// A state as bytes. Wait-free.
template <class State>
StateBytes<State> state_bytes(const State& state, std::uint64_t model) noexcept {
  using Bytes = StateBytes<State>;
  Bytes result{
      detail::this_version(), sizeof(Bytes), model, std::bit_cast<decltype(Bytes::words)>(state), {}};
  result.checksum = result.sum();
  return result;
}

/// True if both are the same. Word by word: `==` of an array may call a function of the C library.
template <std::size_t stretches>
constexpr bool same_sums(const std::array<std::array<std::uint64_t, 4>, stretches>& a,
                         const std::array<std::array<std::uint64_t, 4>, stretches>& b) noexcept {
  std::uint64_t different = 0;
  for (std::size_t i = 0; i < stretches; ++i)
    for (std::size_t k = 0; k < 4; ++k) different |= a[i][k] ^ b[i][k];
  return different == 0;
}

/// What is not that of bytes saved by this version for this model, or nullptr if all is. Wait-free.
template <class State>
const char* foreign_part(const StateBytes<State>& bytes, std::uint64_t model) noexcept {
  if (bytes.version != detail::this_version() || bytes.size != sizeof bytes) return "version";
  if (bytes.model != model) return "model";
  return same_sums(bytes.checksum, bytes.sum()) ? nullptr : "checksum";
}

}  // namespace needleforce
