// SPDX-License-Identifier: Apache-2.0
// A saved memory whose bytes have changed is refused: any change of up to three bits, any burst of up to 64.
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <set>
#include <tuple>
#include <vector>

#include "needleforce/insertion.hpp"
#include "paper.hpp"

namespace {

using namespace needleforce;

struct Saved : ::testing::Test {
  Insertion insertion{paper::model()};
  Insertion::Saved whole{};
  std::mt19937_64 generator{1};
  static constexpr std::size_t bits = 8 * sizeof(Insertion::Saved);

  void SetUp() override {
    for (double depth = -1e-3; depth < 8e-3; depth += 2e-6) insertion.step(depth, no_velocity, 1e-3);
    whole = insertion.save();
    ASSERT_TRUE(insertion.restore(whole));
  }
  static void flip(Insertion::Saved& saved, std::size_t bit) {
    unsigned char byte = 0;
    char* at = reinterpret_cast<char*>(&saved) + bit / 8;
    std::memcpy(&byte, at, 1);
    byte ^= static_cast<unsigned char>(1u << bit % 8);
    std::memcpy(at, &byte, 1);
  }
  bool refused(std::initializer_list<std::size_t> flips) {
    Insertion::Saved altered = whole;
    for (const std::size_t bit : flips) flip(altered, bit);
    return !insertion.restore(altered);
  }
};

TEST_F(Saved, EverySingleBit) {
  for (std::size_t bit = 0; bit < bits; ++bit) ASSERT_TRUE(refused({bit})) << bit;
}

// the top bits of two words once passed, all 38 781 pairs
TEST_F(Saved, PairsInOneColumn) {
  for (const std::size_t column : {std::size_t{0}, std::size_t{31}, std::size_t{63}})
    for (std::size_t first = column; first < bits; first += 64)
      for (std::size_t second = first + 64; second < bits; second += 64)
        ASSERT_TRUE(refused({first, second})) << first << " " << second;
}

TEST_F(Saved, RandomTwoAndThreeBits) {
  for (int i = 0; i < 50000; ++i) {
    const std::size_t first = generator() % bits, second = generator() % bits, third = generator() % bits;
    if (first == second || second == third || first == third) continue;
    ASSERT_TRUE(refused({first, second})) << first << " " << second;
    ASSERT_TRUE(refused({first, second, third})) << first << " " << second << " " << third;
  }
}

TEST_F(Saved, BurstsOfUpTo64Bits) {
  for (std::size_t start = 0; start + 64 <= bits; ++start) {
    Insertion::Saved altered = whole;
    const std::uint64_t pattern = generator() | 1u;
    for (std::size_t i = 0; i < 64; ++i)
      if (pattern >> i & 1u) flip(altered, start + i);
    ASSERT_FALSE(insertion.restore(altered)) << start;
  }
}

// as a build wrote them whose members were others, of the same size: only the words of the head differ
TEST_F(Saved, OfAnotherLayout) {
  Insertion::Saved other = whole;
  Fingerprint without_layout;
  without_layout.add(needleforce::version);
  other.version = without_layout.value();
  other.checksum = other.sum();
  EXPECT_STREQ(insertion.restore_fault(other), "version");
  EXPECT_FALSE(insertion.restore(other));
}

// The sums are linear: what a flip changes in them does not depend on the words. No two flips change the
// same, so two are seen; each changes one bit of the first sum, so three cannot cancel in it.
TEST(Checksum, NoTwoFlipsChangeTheSame) {
  std::set<std::tuple<std::uint64_t, std::uint64_t, std::uint64_t>> seen;
  std::vector<std::uint64_t> words(Checksum::max_words);
  for (std::uint64_t& word : words)
    for (const int bit : {0, 1, 31, 63}) {
      word = 1ull << bit;
      Checksum with;
      with.add(words);
      const auto sums = with.value();
      word = 0;
      EXPECT_EQ(std::popcount(sums[0]), 1);
      EXPECT_TRUE(seen.insert({sums[0], sums[1], sums[2]}).second) << &word - words.data() << " " << bit;
    }
}

}  // namespace
