// SPDX-License-Identifier: Apache-2.0
// Events found while a needle moves: planted ruptures, the stated rate of false alarms, and streams that lie.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "needleforce/events/event_detector.hpp"

namespace {

using namespace needleforce::events;

constexpr double speed = 2e-3, surface = 2e-3;
constexpr double rupture = 8e-3;  // depth at which half of the force is lost

struct Reading {
  double force, depth;
};

/// A power law from the surface that loses half of 2 N within 10 ms, then slides.
Reading insertion(double time) {
  const double depth = speed * time, past = (depth - surface) / (rupture - surface);
  if (past <= 0.0) return {0.0, depth};
  if (past <= 1.0) return {2.0 * past * std::sqrt(past), depth};
  const double fallen = std::min(1.0, (depth - rupture) / (speed * 10e-3));
  return {2.0 - fallen, depth};
}

std::vector<Detection> replay(EventDetector& watch, double rate, double until, double noise, auto change) {
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  std::vector<Detection> found;
  for (int i = 0; i < until * rate; ++i) {
    Reading reading = insertion(i / rate);
    reading.force += noise * normal(generator);
    change(i / rate, reading);
    const Detection event = watch.step(reading.force, reading.depth, 1.0 / rate);
    if (event.kind != EventKind::none) found.push_back(event);
  }
  return found;
}
constexpr auto as_it_is = [](double, Reading&) {};

TEST(Events, RuptureIsFoundAtAnyRateWithTheSameSettings) {
  for (const double rate : {50.0, 100.0, 1000.0, 5000.0}) {
    EventDetector watch;
    const auto found = replay(watch, rate, 5.0, 5e-3, as_it_is);
    ASSERT_EQ(found.size(), 3U) << rate;
    EXPECT_EQ(found[0].kind, EventKind::contact);
    EXPECT_NEAR(found[0].depth, surface, 0.3e-3) << rate;
    EXPECT_EQ(found[1].kind, EventKind::puncture);
    EXPECT_NEAR(found[1].depth, rupture, 0.1e-3) << rate;
    EXPECT_LE(found[1].delay, 10e-3 + 2.0 / rate) << rate;
    EXPECT_GE(found[1].probability, 0.89) << rate;
    EXPECT_EQ(found[2].kind, EventKind::sliding);
    EXPECT_NEAR(found[2].size, 1.0, 0.05) << rate;
  }
}

TEST(Events, ForceThatComesLateIsPutWhereItActed) {
  for (const double rate : {100.0, 1000.0}) {
    EventDetector prompt, late({.force_delay = 0.05});
    const auto before = replay(prompt, rate, 5.0, 1e-6, as_it_is);
    const auto after = replay(late, rate, 5.0, 1e-6, [](double t, Reading& r) {
      r.force += insertion(t - 0.05).force - insertion(t).force;
    });
    ASSERT_EQ(before.size(), 3U);
    ASSERT_EQ(after.size(), 3U);
    for (std::size_t i = 0; i < 2;
         ++i) {  // contact and puncture; where it slides, noise decides what is lowest
      EXPECT_NEAR(after[i].time, before[i].time, 1.1 / rate) << rate;
      EXPECT_NEAR(after[i].depth, before[i].depth, 1.1 * speed / rate) << rate;
      EXPECT_NEAR(after[i].delay, before[i].delay + 0.05, 2.1 / rate) << rate;
    }
  }
}

/// Punctures a second under nothing but noise, of which each reading keeps a part of the one before, with
/// settings for which every fall is large enough.
double false_alarms(double stated, double rate, double seconds, double kept = 0.0) {
  EventDetector watch({.fall = 0.0, .share = 0.0, .false_alarms = stated});
  std::mt19937_64 generator(2);
  std::normal_distribution<double> normal;
  long alarms = 0;
  double noise = 0.0;
  for (long i = 0; i < rate * seconds; ++i) {
    noise = kept * noise + 0.01 * std::sqrt(1.0 - kept * kept) * normal(generator);
    alarms += watch.step(1.0 + noise, speed * i / rate, 1.0 / rate).kind == EventKind::puncture;
  }
  return alarms / seconds;
}

TEST(Events, NoiseAloneMakesNoMoreFalseAlarmsThanStated) {
  EXPECT_LE(false_alarms(0.1, 100.0, 3000.0), 0.1);
  EXPECT_LE(false_alarms(0.01, 100.0, 10000.0), 0.01);
  EXPECT_LE(false_alarms(0.1, 1000.0, 500.0), 0.1);
  EXPECT_LE(false_alarms(0.01, 100.0, 5000.0, 0.9), 0.01);
  EXPECT_LE(false_alarms(0.01, 100.0, 5000.0, 0.99), 0.01);
  EXPECT_GT(false_alarms(1.0, 100.0, 3000.0), 0.01);  // it does look
}

long punctures(const std::vector<Detection>& found, double least_probability) {
  long count = 0;
  for (const Detection& each : found)
    count += each.kind == EventKind::puncture && each.probability > least_probability;
  return count;
}

/// How many falls there were, one after the other, each at a constant or a decreasing speed, then a pause.
double falls(double since, double lasts, bool slower_and_slower, double pause) {
  if (since <= 0.0) return 0.0;
  const double part = std::min(1.0, std::fmod(since, lasts + pause) / lasts);
  const double before = std::floor(since / (lasts + pause));
  return before + (slower_and_slower ? 1.0 - std::exp(-3.0 * part) : part);
}

TEST(Events, OneFallIsOnePunctureHoweverLongItTakes) {
  for (const double rate : {100.0, 1000.0, 5000.0})
    for (const double noise : {1e-3, 20e-3})
      for (const double lasts : {20e-3, 0.1, 0.2, 0.5, 0.8})
        for (const bool slows : {false, true}) {
          EventDetector watch;
          const auto fall = [&](double t, Reading& r) {
            if (t > 4.0) r.force = 2.0 - 1.5 * falls(t - 4.0, lasts, slows, 9.0);
          };
          EXPECT_EQ(punctures(replay(watch, rate, 5.5, noise, fall), 0.0), 1)
              << rate << " " << noise << " " << lasts;
        }
}

TEST(Events, DepthThatShakesLeavesAPunctureItsProbability) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal(0.0, 10e-6);
  for (const double rate : {100.0, 1000.0})
    for (const double shakes : {0.0, 5.0, 15.0, 40.0})  // times a second by 30 um; 0: by chance
      for (int phase = 0; phase < 12; ++phase) {
        EventDetector watch;
        const auto shaken = [&](double t, Reading& r) {
          r.depth +=
              shakes > 0.0 ? 30e-6 * std::sin(6.2832 * shakes * t + 0.5236 * phase) : normal(generator);
        };
        const auto found = replay(watch, rate, 4.5, 5e-3, shaken);
        EXPECT_EQ(punctures(found, 0.0), 1) << rate << " " << shakes;
        EXPECT_EQ(punctures(found, 0.89), 1) << rate << " " << shakes;
      }
}

TEST(Events, FallAfterAPauseIsAPunctureOfItsOwn) {
  for (const double rate : {100.0, 1000.0}) {
    EventDetector watch;
    const auto two = [](double t, Reading& r) {
      r.force = t < 4.0 ? r.force : 2.0 - 0.6 * falls(t - 4.0, 20e-3, false, 0.25);
    };
    EXPECT_EQ(punctures(replay(watch, rate, 4.5, 5e-3, two), 0.0), 2) << rate;
  }
}

TEST(Events, WhatTheSensorDoesIsNoConfidentPuncture) {
  const auto without_rupture = [](double rate, auto change) {
    EventDetector watch;
    return replay(watch, rate, 3.9, 5e-3, change);  // the rupture is at 4 s
  };
  for (const double rate : {100.0, 1000.0}) {
    const double dt = 1.0 / rate;
    const auto up = [&](double t, Reading& r) { r.force += std::abs(t - 3.0) < 0.5 * dt ? 2.0 : 0.0; };
    const auto zeroed = [](double t, Reading& r) { r.force -= t > 3.0 ? insertion(3.0).force : 0.0; };
    const auto absent = [](double t, Reading& r) { r.force = t > 3.0 && t < 3.3 ? NAN : r.force; };
    EXPECT_EQ(punctures(without_rupture(rate, up), 0.0), 0) << rate;
    EXPECT_EQ(punctures(without_rupture(rate, zeroed), 0.5), 0) << rate;
    EXPECT_EQ(punctures(without_rupture(rate, absent), 0.0), 0) << rate;
    const auto down = [&](double t, Reading& r) { r.force -= std::abs(t - 3.0) < 0.5 * dt ? 0.3 : 0.0; };
    EXPECT_EQ(punctures(without_rupture(rate, down), 0.9), 0) << rate;  // one reading, then never a sliding
  }
}

/// A needle that slides at 1.5 N, friction growing by 0.06 N/s, whose sensor is zeroed again by half of that
/// at 3.5 s, or that falls by as much in `lasts`.
std::vector<Detection> slides(double rate, double noise, double lasts) {
  EventDetector watch;
  return replay(watch, rate, 4.5, noise, [&](double t, Reading& r) {
    r.force = std::min(750.0 * std::max(0.0, r.depth - surface), 1.5) + 0.06 * std::max(0.0, t - 2.0);
    r.force -= 0.75 * (lasts > 0.0 ? std::clamp((t - 3.5) / lasts, 0.0, 1.0) : double(t > 3.5));
  });
}

TEST(Events, LevelThatIsAnotherBetweenTwoReadingsIsTheSensorsWhereReadingsFollowFast) {
  const auto of = [](const std::vector<Detection>& found, EventKind kind) {
    double most = 0.0;
    for (const Detection& each : found) most = std::max(most, each.kind == kind ? each.probability : 0.0);
    return most;
  };
  for (const double noise : {1e-3, 10e-3})
    for (const double rate : {100.0, 500.0, 1000.0, 5000.0}) {
      const auto zeroed = slides(rate, noise, 0.0), fell = slides(rate, noise, 6.0 / std::min(rate, 1000.0));
      const double most = rate < 400.0 ? 0.9 : 0.5;  // they look alike where a fall lasts a reading
      EXPECT_LE(of(zeroed, EventKind::puncture), most) << rate << " " << noise;
      EXPECT_LE(of(zeroed, EventKind::sliding), most) << rate << " " << noise;
      EXPECT_GE(of(fell, EventKind::puncture), 0.89) << rate << " " << noise;
      EXPECT_EQ(of(fell, EventKind::sliding), 1.0) << rate << " " << noise;
    }
}

TEST(Events, GlitchOfTwoReadingsThatFollowFastIsNoPuncture) {
  for (const double rate : {500.0, 1000.0, 5000.0})
    for (const double size : {-0.3, -0.6, 0.3, 1.0})
      for (const int first : {0, 1}) {
        EventDetector watch;
        const auto glitch = [&](double t, Reading& r) {
          const double reading = std::round((t - 3.0) * rate) - first;
          if (reading == 0.0 || reading == 1.0) r.force += size;
        };
        EXPECT_EQ(punctures(replay(watch, rate, 3.9, 5e-3, glitch), 0.0), 0) << rate << " " << size;
      }
}

TEST(Events, StopOfARelaxingTissueIsNoPuncture) {
  EventDetector watch;
  const auto stops = [](double t, Reading& reading) {
    if (t < 3.5) return;
    reading = {insertion(3.5).force * (0.5 + 0.5 * std::exp(-(t - 3.5) / 0.3)), speed * 3.5};
  };
  const auto found = replay(watch, 1000.0, 6.0, 5e-3, stops);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[1].kind, EventKind::stop);
  EXPECT_NEAR(found[1].time, 3.5, 0.05);
}

TEST(Events, WithdrawalTurnsAndLeaves) {
  EventDetector watch;
  const auto back = [](double t, Reading& reading) {
    if (t <= 5.0) return;
    const double depth = speed * (10.0 - t);
    reading = {depth > surface ? -0.5 * std::min(1.0, (t - 5.0) / 0.1) : 0.0, depth};
  };
  const auto found = replay(watch, 100.0, 9.9, 5e-3, back);
  ASSERT_EQ(found.size(), 5U);
  EXPECT_EQ(found[3].kind, EventKind::reversal);
  EXPECT_NEAR(found[3].depth, speed * 5.0, 0.05e-3);
  EXPECT_EQ(found[4].kind, EventKind::exit);
  EXPECT_NEAR(found[4].depth, surface, 0.4e-3);
}

TEST(Events, BadTimesAndGapsHaveAStatusAndMakeNoEvent) {
  EventDetector watch;
  replay(watch, 1000.0, 3.0, 5e-3, as_it_is);
  const auto status = [&](double force, double depth, double dt) {
    EXPECT_EQ(watch.step(force, depth, dt).kind, EventKind::none);
    return watch.status();
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                   inf = std::numeric_limits<double>::infinity();
  const double depth = speed * 3.0;
  for (const double dt : {0.0, -1.0, nan, inf, 1e300})
    EXPECT_EQ(status(0.0, depth, dt), StreamStatus::bad_time) << dt;
  for (const double bad : {nan, inf, 1e300}) {
    EXPECT_EQ(status(bad, depth, 1e-3), StreamStatus::not_finite) << bad;
    EXPECT_EQ(status(0.5, bad, 1e-3), StreamStatus::not_finite) << bad;
  }
  EXPECT_EQ(status(0.1, depth, 10.0), StreamStatus::gap);
  EXPECT_EQ(status(0.1, depth + 0.1, 1e-3), StreamStatus::gap);  // another needle
}

/// What is found where no reading comes for so long from 3.9 s on, of a force that falls by `fall` at 4 s,
/// and the status with the last puncture.
std::pair<std::vector<Detection>, StreamStatus> across_gap(double rate, double lasts, double fall) {
  EventDetector watch;
  std::vector<Detection> found;
  StreamStatus status{};
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal(0.0, 5e-3);
  double before = 0.0;
  for (int i = 0; i < 5.0 * rate; ++i) {
    const double time = i / rate;
    if (time > 3.9 && time < 3.9 + lasts) continue;
    const double force = time > 4.0 ? 2.0 - fall : insertion(time).force;
    const Detection event = watch.step(force + normal(generator), speed * time, time - before);
    before = time;
    if (event.kind == EventKind::puncture) status = watch.status();
    if (event.kind == EventKind::puncture) found.push_back(event);
  }
  return {found, status};
}

TEST(Events, PunctureInAGapIsFoundAfterItAndIsTheLessCertainTheLongerItMayHaveTaken) {
  for (const double rate : {100.0, 1000.0})
    for (const double lasts : {0.14, 0.3, 0.45}) {
      const auto [found, status] = across_gap(rate, lasts, 0.6);
      ASSERT_EQ(found.size(), 1U) << rate << " " << lasts;
      EXPECT_NEAR(found[0].time, 3.9, 1.5 / rate);
      EXPECT_GE(found[0].delay, lasts - 1e-9);
      EXPECT_LE(found[0].delay, lasts + 0.05);
      EXPECT_EQ(status, StreamStatus::gap);
      // at a constant speed it falls in 0.1 s by that share of the fall; three quarters of a tenth are needed
      const double peak = insertion(3.9).force, share = std::min(1.0, 0.1 / lasts);
      const double expected = 0.9 * std::min(1.0, share * (peak - 1.4) / (0.75 * 0.1 * peak));
      EXPECT_NEAR(found[0].probability, expected, 0.05) << rate << " " << lasts;
      EXPECT_TRUE(across_gap(rate, lasts, 0.0).first.empty());
    }
  EXPECT_TRUE(across_gap(100.0, 0.6, 0.6).first.empty());  // nothing is compared over five times `within`
}

TEST(Events, StreamThatBeginsInTissueIsDoubted) {
  EventDetector watch;
  const auto found = replay(watch, 1000.0, 5.0, 5e-3, [](double, Reading& r) { r.force += 1.0; });
  EXPECT_EQ(watch.status(), StreamStatus::unknown_zero);
  EXPECT_EQ(punctures(found, 0.0), 1);
  EXPECT_EQ(punctures(found, 0.5), 0);
}

TEST(Events, ResistanceFallsWithinMillisecondsOfARuptureAndComesBack) {
  for (const double rate : {100.0, 1000.0, 5000.0}) {
    EventDetector watch;
    double before = 1.0, fallen = 1.0, later = 0.0, back = 0.0;
    replay(watch, rate, 5.5, 5e-3, [&](double time, Reading&) {
      const double since = time - rupture / speed;  // of the reading after the one that was taken
      if (since <= 0.0) before = std::min(before, watch.resistance());
      if (since <= 10e-3 + 2.0 / rate + 1e-3) fallen = watch.resistance();
      if (since <= 0.2) later = watch.resistance();
      back = watch.resistance();
    });
    EXPECT_EQ(before, 1.0) << rate;
    EXPECT_NEAR(fallen, 0.5, 0.08) << rate;  // 1 N of 2 N
    EXPECT_NEAR(later, 0.6, 0.08) << rate;   // held for 100 ms, then a tenth in 100 ms
    EXPECT_EQ(back, 1.0) << rate;
  }
}

TEST(Events, ResistanceIsWholeInNoiseAtRestAndWhereTheNeedleLeaves) {
  EventDetector watch;
  double least = 1.0;
  std::mt19937_64 generator(2);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 12'000; ++i) {  // in for 3 s to 6 mm, at rest for 4 s, out
    const double time = 1e-3 * i;
    const double depth = time < 3.0 ? speed * time : time < 7.0 ? 6e-3 : 6e-3 - speed * (time - 7.0);
    const double rest = std::clamp(time - 3.0, 0.0, 4.0), push = 0.5e3 * std::max(0.0, depth - surface);
    const double force = push * (0.6 + 0.4 * std::exp(-rest / 0.8)) + 20e-3 * normal(generator);
    watch.step(force, depth, 1e-3);
    least = std::min(least, watch.resistance());
  }
  EXPECT_EQ(least, 1.0);
}

}  // namespace
