// SPDX-License-Identifier: Apache-2.0
// A slow planner in a thread of its own gives at 30 Hz the depth and stiffness of a deeper layer, as the
// tissue moves; the loop at 1 kHz takes it over, smooth in force. Twin of planner.py.
//   g++ -std=c++20 -O2 -Iinclude examples/planner.cpp -o planner -pthread && ./planner
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <thread>

#include "needleforce/live.hpp"

using namespace needleforce;

constexpr double dt = 1e-3, frame = 1.0 / 30.0, seconds = 4.0;

/// What the planner sees at a time: the deeper layer breathes by 0.5 mm, and is stiffer the further out it
/// is.
std::array<Layer, 2> seen(double time) {
  const double breath = std::sin(2.0 * std::numbers::pi * 0.25 * time);
  const Model above{laws::Cone{120e3, 15.0 * tips::degree}, laws::PunctureDepth{3e-3},
                    laws::Coulomb{18.6, 20e-6, 0.0}, laws::ConstantCutting{0.08, 20e-6}};
  Model below = above;
  below.stiffness = laws::Cone{300e3 * (1.0 - 0.2 * breath), 15.0 * tips::degree};
  return {Layer{0.0, above}, Layer{6e-3 + 0.5e-3 * breath, below}};
}

int main() {
  LiveInsertion live(seen(0.0));
  std::atomic<int> due{0}, sent{0};
  std::thread planner([&] {
    for (int n = 0; n * frame < seconds; sent = ++n) {
      while (due <= n) std::this_thread::yield();  // by the loop's time, which here runs as fast as it can
      live.replace(seen(n * frame));
    }
  });
  double force = 0.0, largest = 0.0;
  for (int cycle = 1; cycle * dt < seconds; ++cycle) {
    const double time = cycle * dt, depth = std::min(4e-3 * time, 8e-3);
    const int frames = static_cast<int>(time / frame) + 1;
    // so that both twins print the same, the loop waits for each frame; a loop on a clock takes what is there
    for (due = frames; sent < frames;) std::this_thread::yield();
    const Sample sample = live.step(depth, no_velocity, dt);
    if (sample.punctured) std::printf("puncture at %.2f mm\n", 1e3 * depth);
    if (!sample.punctured) largest = std::max(largest, std::abs(sample.force - force));
    force = sample.force;
  }
  planner.join();
  std::printf("%u models taken over, %u kept out\n", live.taken(), live.refused());
  std::printf("largest change of force %.2f mN in 1 ms, of %.3f N\n", 1e3 * largest, force);
}
