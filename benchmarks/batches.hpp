// SPDX-License-Identifier: Apache-2.0
// The time of small works, by batches: as the clock saw it, and of the work alone.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <vector>

namespace batches {

constexpr int batch = 256;
inline volatile double sink;

/// Depth [m] of the i-th step of endless insertions at 3 mm/s and 1 kHz: 12 mm in, one second of hold, out.
inline double depth_at(long i) {
  const long n = i % 9000;
  return 3e-6 * static_cast<double>(n < 4000 ? n : n < 5000 ? 4000 : 9000 - n);
}

/// Nanoseconds a call, of every batch of a trajectory.
struct Times {
  std::vector<double> seen;   ///< by the clock, of all passes: the machine's interrupts are in it
  std::vector<double> alone;  ///< the least of all passes through that very batch: the work
};

/// One batch of calls, each with the result of the last, as a control loop has it: nothing of one
/// call is done while the one before is under way.
template <class Body>
double timed(Body& body, const double* depths) {
  const auto start = std::chrono::steady_clock::now();
  double force = 0.0;
  for (int k = 0; k < batch; ++k) force = body(depths[k] + 0.0 * force);
  sink = force;
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count() / batch;
}

/// Passes of the same `body` along `count` batches, each from the same state.
template <class Body>
Times measure(const Body& body, int count, int passes = 15) {
  std::vector<double> depths(static_cast<std::size_t>(count) * batch);
  for (std::size_t i = 0; i < depths.size(); ++i) depths[i] = depth_at(static_cast<long>(i));
  Times times{{}, std::vector<double>(count, std::numeric_limits<double>::infinity())};
  for (int pass = 0; pass < passes; ++pass) {
    Body fresh = body;
    for (int b = 0; b < count; ++b) {
      const double time = timed(fresh, &depths[static_cast<std::size_t>(b) * batch]);
      times.seen.push_back(time);
      times.alone[b] = std::min(times.alone[b], time);
    }
  }
  std::sort(times.seen.begin(), times.seen.end());
  std::sort(times.alone.begin(), times.alone.end());
  return times;
}

inline double at(const std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

inline void print(const char* what, const std::vector<double>& sorted, double empty, const char* end) {
  std::printf("\"%s\": {\"p50\": %.3f, \"p99\": %.3f, \"p999\": %.3f, \"max\": %.3f}%s", what,
              at(sorted, 0.5) - empty, at(sorted, 0.99) - empty, at(sorted, 0.999) - empty,
              sorted.back() - empty, end);
}

/// One line of JSON, the empty loop subtracted.
inline void print(const char* name, const Times& times, double empty) {
  std::printf("\"%s\": {", name);
  print("alone", times.alone, empty, ", ");
  print("seen", times.seen, empty, "},\n");
}

}  // namespace batches
