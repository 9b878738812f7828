// SPDX-License-Identifier: Apache-2.0
// The time of a reading that is watched for events, as JSON for run.py.
#include <cmath>
#include <random>

#include "batches.hpp"
#include "needleforce/events/event_detector.hpp"

namespace {

using needleforce::events::EventDetector;

/// Force along a path that ruptures at 6 mm, with a noise of 5 mN that repeats after 4096 readings.
struct Watched {
  EventDetector watch;
  std::vector<double> noise = std::vector<double>(4096);
  std::size_t reading = 0;

  Watched() {
    std::mt19937_64 generator(1);
    std::normal_distribution<double> normal(0.0, 5e-3);
    for (double& each : noise) each = normal(generator);
  }
  double operator()(double depth) {
    const double past = depth - 2e-3, force = past <= 0.0 ? 0.0 : past < 4e-3 ? 500.0 * past : 1.0;
    return watch.step(force + noise[reading++ % noise.size()], depth, 1e-3).probability;
  }
};

}  // namespace

int main() {
  const batches::Times times = batches::measure(Watched{}, 500);
  std::printf("{\"p50\": %.1f, \"p99\": %.1f, \"p999\": %.1f, \"max\": %.1f}\n",
              batches::at(times.alone, 0.5), batches::at(times.alone, 0.99), batches::at(times.alone, 0.999),
              times.alone.back());
}
