// SPDX-License-Identifier: Apache-2.0
// Events through the C face and from saved bytes: the same bits, and what is refused.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include "../../bindings/c/needleforce_events.h"
#include "needleforce/events/event_detector.hpp"
#include "timed_readings.hpp"

namespace {

using namespace needleforce::events;

/// In, through two layers, a hold, out again.
std::vector<TimedReading> stream() {
  return timed_readings(1500, 1.3e-5, [](int i, double depth) {
    return 400.0 * (i < 1500 ? std::fmod(std::max(depth - 2e-3, 0.0), 4e-3) : -1e-3 * (depth > 2e-3));
  });
}

struct C {
  std::vector<double> memory = std::vector<double>(nf_events_size() / sizeof(double) + 1);
  nf_fault why{};
  nf_events* made(std::vector<nf_parameter> settings = {}) {
    return nf_events_init(memory.data(), nf_events_size(), settings.data(), settings.size(), &why);
  }
};

TEST(EventsInC, StepToTheBitAsInCpp) {
  EventDetector same({.fall = 0.2});
  C given;
  nf_events* events = given.made({{"fall", 0.2}});
  ASSERT_NE(events, nullptr);
  int found = 0;
  for (const auto& [force, depth, dt] : stream()) {
    nf_event event;
    found += nf_events_step(events, force, depth, dt, &event) != NF_NO_EVENT;
    const Detection other = same.step(force, depth, dt);
    ASSERT_EQ(event.kind, int(other.kind));
    ASSERT_EQ(event.time, other.time);
    ASSERT_EQ(event.depth, other.depth);
    ASSERT_EQ(event.size, other.size);
    ASSERT_EQ(event.probability, other.probability);
    ASSERT_EQ(event.delay, other.delay);
    ASSERT_EQ(nf_events_status(events), int(same.status()));
    ASSERT_EQ(nf_events_noise(events), same.noise());
    ASSERT_EQ(nf_events_needed_fall(events), same.needed_fall());
  }
  EXPECT_GE(found, 5);
  EXPECT_STREQ(nf_event_name(NF_PUNCTURE), "puncture");
  EXPECT_STREQ(nf_stream_status_name(NF_STREAM_GAP), "gap");
  EXPECT_STREQ(nf_event_name(99), "unknown");
}

TEST(EventsInC, RefusedSettingsHaveAReason) {
  C given;
  EXPECT_EQ(given.made({{"within", 0.0}}), nullptr);
  EXPECT_STREQ(given.why.quantity, "within");
  EXPECT_EQ(given.made({{"drop", 1.0}}), nullptr);
  EXPECT_STREQ(given.why.reason, "is no parameter of it");
  EXPECT_EQ(nf_events_init(given.memory.data(), 8, nullptr, 0, &given.why), nullptr);
  EXPECT_STREQ(given.why.law, "memory");
  EXPECT_EQ(nf_events_init(given.memory.data(), nf_events_size(), nullptr, 1, nullptr), nullptr);
}

TEST(EventsInC, SnapshotIsTakenBackAndOneOfOtherSettingsIsNot) {
  C one, other;
  nf_events *events = one.made(), *strict = other.made({{"fall", 0.3}});
  std::vector<unsigned char> bytes(nf_events_snapshot_size());
  nf_event event;
  const std::vector<TimedReading> readings = stream();
  for (std::size_t i = 0; i < 1000; ++i)
    nf_events_step(events, readings[i].force, readings[i].depth, readings[i].dt, &event);
  const double noise = nf_events_noise(events);
  ASSERT_EQ(nf_events_snapshot(events, bytes.data(), bytes.size()), 1);
  EXPECT_EQ(nf_events_snapshot(events, bytes.data(), bytes.size() - 1), 0);
  nf_events_reset(events);
  EXPECT_NE(nf_events_noise(events), noise);
  EXPECT_EQ(nf_events_restore(events, bytes.data(), bytes.size() - 1), 0);
  EXPECT_EQ(nf_events_restore(events, bytes.data(), bytes.size()), 1);
  EXPECT_EQ(nf_events_noise(events), noise);
  EXPECT_EQ(nf_events_restore(strict, bytes.data(), bytes.size()), 0);
  bytes[100] ^= 1;
  EXPECT_EQ(nf_events_restore(events, bytes.data(), bytes.size()), 0);
}

/// Numbers, counts and flags that no detector has.
std::vector<std::uint64_t> planted_words() {
  std::vector<std::uint64_t> words{~0ull, 2, 65, 3001, 1ull << 40, 0x0202020202020202ull};
  constexpr double infinite = std::numeric_limits<double>::infinity();
  for (const double number :
       {infinite - infinite, infinite, -infinite, 1e300, -1e300, 1e30, -1e30, 1e9, -1.0, 1e-310})
    words.push_back(std::bit_cast<std::uint64_t>(number));
  return words;
}

void expect_finite(EventDetector& watch, std::size_t i, std::uint64_t word) {
  for (int step = 0; step < 12; ++step) {
    const double away = step % 5;
    const Detection event = watch.step(0.5 - 0.1 * away, 9e-3 + 1e-4 * step, 3e-3);
    ASSERT_TRUE(std::isfinite(event.time + event.depth + event.size + event.probability + event.delay +
                              watch.noise() + watch.needed_fall()))
        << i << " " << std::bit_cast<double>(word);
    ASSERT_TRUE(event.probability >= 0.0 && event.probability <= 1.0) << i;
  }
}

TEST(EventsSaved, PlantedBytesAreRefusedOrGiveFiniteNumbers) {
  const std::vector<TimedReading> readings = stream();
  for (const std::size_t until : {150u, 1000u, 1800u}) {
    EventDetector watch;
    for (std::size_t i = 0; i < until; ++i) watch.step(readings[i].force, readings[i].depth, readings[i].dt);
    EventDetector::Saved saved = watch.save();
    std::size_t refused = 0;
    for (std::size_t i = 0; i < saved.words.size(); ++i)
      for (const std::uint64_t word : planted_words()) {
        const std::uint64_t before = std::exchange(saved.words[i], word);
        saved.checksum = saved.sum();
        EventDetector made;
        const bool taken = made.restore(saved);
        ASSERT_EQ(taken, made.restore_fault(saved) == nullptr);
        taken ? expect_finite(made, i, word) : void(++refused);
        saved.words[i] = before;
        if (::testing::Test::HasFatalFailure()) return;
      }
    EXPECT_GT(refused, saved.words.size());
  }
}

}  // namespace
