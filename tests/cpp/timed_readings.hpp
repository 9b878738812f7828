// SPDX-License-Identifier: Apache-2.0
// A stream by formula: in, a hold, out; with noise, a reading that is none, and a gap.
#pragma once

#include <cmath>
#include <vector>

struct TimedReading {
  double force, depth, dt;
};

/// 2400 readings that turn outwards after `turn` of them; `force_of(i, depth)` without noise.
template <class ForceOf>
std::vector<TimedReading> timed_readings(int turn, double outwards, const ForceOf& force_of) {
  std::vector<TimedReading> readings;
  double depth = 0.0, noise = 0.0;
  for (int i = 0; i < 2400; ++i) {
    depth += i < 1200 ? 1e-5 : i < turn ? 0.0 : -outwards;
    noise = std::fmod(noise * 16807.0 + 12345.0, 2147483647.0);
    readings.push_back({force_of(i, depth) + 4e-3 * (noise / 2147483647.0 - 0.5), depth, 2.5e-3});
  }
  readings[700].force = NAN;
  readings[900].dt = 0.4;
  return readings;
}
