// SPDX-License-Identifier: Apache-2.0
// A 1 kHz loop along an insertion: the work of a step and the lateness of the wake-up, separately. Twin of
// loop.py.
//   g++ -std=c++20 -O2 -Iinclude examples/loop.cpp -o loop && ./loop [seconds]
#include <sched.h>
#include <sys/mman.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <vector>

#include "histogram.hpp"
#include "outside/cpp/gel.hpp"  // preset `paper`, as `needleforce export` writes it

constexpr std::uint64_t period = 1'000'000, second = 1'000'000'000;

std::uint64_t now() {
  timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * second + t.tv_nsec;
}

/// 12 mm from rest to rest in 0.4 of the duration, at constant acceleration in its first and last tenth.
double stroke(double t, double duration) {
  const double all = 0.4 * duration, ramp = 0.1 * all, speed = 12e-3 / (all - ramp);
  if (t < ramp) return 0.5 * speed / ramp * t * t;
  if (t < all - ramp) return speed * (t - 0.5 * ramp);
  return 12e-3 - 0.5 * speed / ramp * std::pow(std::max(0.0, all - t), 2);
}

int main(int arguments, char** values) {
  const double duration = arguments > 1 ? std::atof(values[1]) : 10.0;
  if (!(duration >= 0.1 && duration <= 3600.0)) return std::fputs("give 0.1 to 3600 seconds\n", stderr), 2;
  needleforce::Insertion insertion(gel);
  std::vector<std::uint64_t> work(std::lround(duration * second / period)), late(work.size());
  std::vector<double> forces(work.size());
  const bool locked = mlockall(MCL_CURRENT) == 0;  // everything is allocated by now
  const sched_param priority{80};
  const bool first = sched_setscheduler(0, SCHED_FIFO, &priority) == 0;
  std::printf("memory locked: %s, real-time priority: %s\n", locked ? "yes" : "not permitted",
              first ? "yes" : "not permitted");
  auto due = now();
  for (std::size_t cycle = 0; cycle < work.size(); ++cycle) {
    const double t = 1e-9 * period * cycle;
    const double depth = -2e-3 + std::min(stroke(t, duration), stroke(duration - t, duration));
    due += period;
    const timespec wake{time_t(due / second), long(due % second)};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, nullptr) != 0) continue;
    const auto woken = now();
    forces[cycle] = insertion.step(depth, needleforce::no_velocity, 1e-9 * period).force;
    work[cycle] = now() - woken;
    late[cycle] = woken - due;
  }
  histogram("work of a step with two readings of the clock", work);
  histogram("lateness of the wake-up", late);
  std::printf("force: largest %.9f N, mean %.9f N\n", *std::max_element(forces.begin(), forces.end()),
              std::accumulate(forces.begin(), forces.end(), 0.0) / forces.size());
}
