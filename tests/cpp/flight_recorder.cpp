// SPDX-License-Identifier: Apache-2.0
// The flight recorder: what went in comes out, in order, also while the loop goes on.
#include "needleforce/flight_recorder.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <thread>
#include <vector>

using namespace needleforce;

namespace {

template <std::size_t n>
std::vector<Cycle> all_of(const FlightRecorder<n>& recorder) {
  std::vector<Cycle> cycles(n);
  const auto seen = recorder.read(cycles);
  return {seen.begin(), seen.end()};
}

static_assert(noexcept(std::declval<FlightRecorder<4>&>().write(0.0, 0.0, 0.0, Output{})));
static_assert(noexcept(std::declval<const FlightRecorder<4>&>().read({})));

TEST(FlightRecorder, KeepsTheLastCyclesInOrder) {
  FlightRecorder<4> recorder;
  EXPECT_TRUE(all_of(recorder).empty());
  for (int i = 0; i < 3; ++i) recorder.write(i, 0.0, 1e-3, Output{});
  ASSERT_EQ(all_of(recorder).size(), 3u);
  for (int i = 3; i < 11; ++i) recorder.write(i, 0.0, 1e-3, Output{});
  const auto cycles = all_of(recorder);
  ASSERT_EQ(cycles.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(cycles[i].number, 7 + i);
    EXPECT_EQ(cycles[i].depth, 7.0 + static_cast<double>(i));
  }
  std::vector<Cycle> fewer(2);
  const auto last = recorder.read(fewer);
  ASSERT_EQ(last.size(), 2u);
  EXPECT_EQ(last[0].number, 9u);
  EXPECT_EQ(recorder.written(), 11u);
}

TEST(FlightRecorder, KeepsEveryFieldIncludingNotANumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  FlightRecorder<2> recorder;
  Output output{.force = -2.0, .energy = 3.0, .reserve = 4.0};
  output.sample.force = 5.0;
  output.sample.phase = Phase::extraction;
  output.sample.status = Status::not_finite;
  bool Interventions::* const each[] = {&Interventions::rejected,          &Interventions::stale,
                                        &Interventions::clamped,           &Interventions::slewed,
                                        &Interventions::limited_by_energy, &Interventions::outside_bounds};
  for (const auto member : each) {
    output.did = {};
    output.did.*member = true;
    recorder.write(nan, -0.0, std::numeric_limits<double>::infinity(), output);
    const Cycle cycle = all_of(recorder).back();
    EXPECT_TRUE(std::isnan(cycle.depth));
    EXPECT_TRUE(std::signbit(cycle.velocity));
    EXPECT_TRUE(std::isinf(cycle.dt));
    EXPECT_EQ(cycle.force, -2.0);
    EXPECT_EQ(cycle.energy, 3.0);
    EXPECT_EQ(cycle.reserve, 4.0);
    EXPECT_EQ(cycle.sample_force, 5.0);
    EXPECT_EQ(cycle.phase, Phase::extraction);
    EXPECT_EQ(cycle.status, Status::not_finite);
    for (const auto other : each) EXPECT_EQ(cycle.did.*other, other == member);
  }
}

TEST(FlightRecorder, ReadsAreConsistentWhileTheLoopWrites) {
  constexpr std::uint64_t cycles = 300000;
  static FlightRecorder<64> recorder;
  std::atomic<bool> ended{false};
  std::thread loop([&] {
    // every field of a cycle says which it is, so that a torn one shows
    for (std::uint64_t i = 0; i < cycles; ++i) {
      const double x = static_cast<double>(i);
      recorder.write(x, x, x, {.force = x, .energy = x, .reserve = x, .sample = {.force = x}});
    }
    ended = true;
  });
  std::vector<Cycle> room(64);
  std::uint64_t newest = 0;
  long torn = 0, gaps = 0, backwards = 0;
  do {
    const auto seen = recorder.read(room);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const Cycle& c = seen[i];
      const double x = static_cast<double>(c.number);
      torn += c.depth != x || c.velocity != x || c.dt != x || c.force != x || c.energy != x ||
              c.reserve != x || c.sample_force != x;
      gaps += i > 0 && seen[i].number != seen[i - 1].number + 1;
    }
    if (!seen.empty()) {
      backwards += seen.back().number < newest;
      newest = seen.back().number;
    }
  } while (!ended);
  loop.join();
  EXPECT_EQ(torn, 0);
  EXPECT_EQ(gaps, 0);
  EXPECT_EQ(backwards, 0);
  ASSERT_EQ(recorder.read(room).size(), 64u);
  EXPECT_EQ(recorder.read(room).back().number, cycles - 1);
}

}  // namespace
