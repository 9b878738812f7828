// SPDX-License-Identifier: Apache-2.0
// The exchange of a value between two real threads: never torn, never older than the last.
#include "needleforce/exchange.hpp"

#include <gtest/gtest.h>

#include "writing.hpp"

using namespace needleforce;

namespace {

/// A value that shows if it was put together from two: all words follow from the first.
struct Checked {
  std::array<std::uint64_t, 512> words{};
  explicit Checked(std::uint64_t number = 0) {
    for (std::uint64_t& word : words) word = number++ * 0x9e3779b97f4a7c15u;
  }
  bool whole() const { return words == Checked(number()).words; }
  // the multiplier is odd: its inverse modulo 2^64 brings the number back
  std::uint64_t number() const { return words[0] * 0xf1de83e19937733du; }
};

template <std::size_t kept>
void expect_newest_and_whole() {
  Exchange<Checked, kept> exchange{Checked(0)};
  const Writing writing([&, n = std::uint64_t{0}]() mutable { exchange.publish(Checked(++n)); });
  std::uint64_t last = 0, taken = 0;
  for (long turn = 0; turn < 1000000 || taken < 1000; ++turn) {
    if (!exchange.take()) continue;
    ++taken;
    ASSERT_TRUE(exchange.taken().whole());
    ASSERT_GT(exchange.taken().number(), last) << "an older value after a newer one";
    if constexpr (kept > 1) {
      ASSERT_EQ(exchange.taken(1).number(), last) << "what is kept is not written";
      ASSERT_TRUE(exchange.taken(1).whole());
    }
    last = exchange.taken().number();
  }
}

TEST(Exchange, ReadsAreConsistentNewestAndInOrder) { expect_newest_and_whole<1>(); }

TEST(Exchange, KeepsTheStatedNumberOfValues) { expect_newest_and_whole<2>(); }

TEST(Exchange, TakesTheNewestValueOnce) {
  Exchange<int> exchange{7};
  EXPECT_FALSE(exchange.take());
  EXPECT_EQ(exchange.taken(), 7);
  exchange.publish(8);
  exchange.publish(9);
  EXPECT_TRUE(exchange.take());
  EXPECT_EQ(exchange.taken(), 9);
  EXPECT_FALSE(exchange.take());
  EXPECT_EQ(exchange.taken(), 9);
}

TEST(Exchange, TestDetectsATornValue) {
  Checked value(1);
  value.words[300] = Checked(2).words[300];
  EXPECT_FALSE(value.whole());
}

}  // namespace
