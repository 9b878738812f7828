// SPDX-License-Identifier: Apache-2.0
// What the tests of the real-time contract share: an armed allocator, and input that no sensor should give.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <type_traits>

#include "needleforce/insertion.hpp"

namespace real_time {

using namespace needleforce;

inline std::atomic<bool> armed{false};  ///< while true every allocation counts
inline std::atomic<long> allocations{0};

template <class... T>
constexpr bool all_trivially_copyable = (std::is_trivially_copyable_v<T> && ...);
template <class... T>
constexpr bool all_plain = ((std::is_standard_layout_v<T> && std::is_trivial_v<T>) && ...);

/// Mostly a plausible random walk, now and then a value that no sensor should give, or a leap.
class RandomInput {
 public:
  explicit RandomInput(double size = 1e-5) : size_(size) {}
  double depth() {
    if (generator_() % 200 == 0) depth_ = 20e-3 * unit_(generator_);
    return spoiled(depth_ += size_ * unit_(generator_));
  }
  double velocity() { return coin() ? no_velocity : spoiled(1e-2 * unit_(generator_)); }
  double dt() {
    constexpr double lengths[] = {1e-9, 1e-6, 1.0, 1e6};
    return spoiled(generator_() % 10 == 0 ? lengths[generator_() % std::size(lengths)] : 1e-3);
  }

 private:
  bool coin() { return generator_() % 2 == 0; }
  double spoiled(double value) {
    constexpr double bad[] = {std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity(),
                              -std::numeric_limits<double>::infinity(),
                              std::numeric_limits<double>::denorm_min(),
                              std::numeric_limits<double>::max(),
                              1e300,
                              -1e300,
                              0.0,
                              -1.0,
                              1e-300};
    return generator_() % 50 == 0 ? bad[generator_() % std::size(bad)] : value;
  }
  std::mt19937_64 generator_{1};
  std::uniform_real_distribution<double> unit_{-1.0, 1.0};
  double size_, depth_ = 2e-3;
};

struct Seen {
  bool finite = true, faults_say_so = true;
  double largest = 0.0;
  long refused = 0, steps = 0;

  /// One step: whether its numbers are finite, whether its input was bad, and what came out.
  void add(bool numbers_finite, bool bad, Status status, double force) {
    ++steps;
    finite = finite && numbers_finite;
    faults_say_so = faults_say_so && (!bad || status != Status::ok);
    refused += status != Status::ok;
    largest = std::fmax(largest, std::abs(force));
  }
};

inline void expect_sound(const Seen& seen, const std::string& name) {
  EXPECT_EQ(allocations, 0) << name;
  EXPECT_TRUE(seen.finite) << name;
  EXPECT_TRUE(seen.faults_say_so) << name;
  EXPECT_GT(seen.largest, 0.05) << name;
  EXPECT_GT(seen.refused, 0) << name;
  EXPECT_LT(seen.refused, seen.steps) << name;
  allocations = 0;
}

}  // namespace real_time
