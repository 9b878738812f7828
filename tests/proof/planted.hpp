// SPDX-License-Identifier: Apache-2.0
// Saved bytes that somebody made on purpose: a word is another, and the sums are right.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "bytes.hpp"

namespace needleforce::proof {

/// Makes one word a number, count or flag that no state has, or changes some of its bits.
template <class Bytes>
void plant(Bytes& bytes, std::size_t where, std::uint64_t change) {
  using number = std::numeric_limits<double>;
  constexpr double numbers[] = {number::quiet_NaN(),
                                number::infinity(),
                                -number::infinity(),
                                1e300,
                                -1e300,
                                1e39,
                                -1e39,
                                1e12,
                                -1e12,
                                1e3,
                                -1e3,
                                1.0,
                                -1.0,
                                -0.0,
                                number::denorm_min()};
  constexpr std::uint64_t words[] = {~0ull, 2, 65, 101, 3001, 1ull << 40, 0x0202020202020202ull};
  constexpr std::size_t n = std::size(numbers), all = n + std::size(words);
  std::uint64_t& word = bytes.words[where % bytes.words.size()];
  const std::size_t which = change % all;
  if (change >= 2 * all)
    word ^= change * 0x9e3779b97f4a7c15ull;  // few bits of a short number become bits all over the word
  else
    word = which < n ? std::bit_cast<std::uint64_t>(numbers[which]) : words[which - n];
  bytes.checksum = bytes.sum();
}

/// An engine that was given such bytes again and again, each time its own with one more word changed.
template <class Engine>
class Planted {
 public:
  using Saved = typename Engine::Saved;

  /// `change_saved` plants in the bytes.
  void restore(const Engine& engine, auto change_saved) {
    if (!engine_) engine_ = std::make_unique<Engine>(engine);
    auto saved = std::make_unique<Saved>(engine_->save());
    change_saved(*saved);
    const bool taken = engine_->restore(*saved);
    require(taken == !engine_->restore_fault(*saved), "what is refused has a name");
  }
  /// Whatever it was given: numbers that are finite, or it was refused.
  void step(auto numbers_of, auto... motion) {
    if (!engine_) return;
    for (const double number : numbers_of(engine_->step(motion...)))
      require(std::isfinite(number), "every number from planted bytes is finite");
  }
  const Engine* engine() const { return engine_.get(); }

 private:
  std::unique_ptr<Engine> engine_;
};

}  // namespace needleforce::proof
