// SPDX-License-Identifier: Apache-2.0
// Models replaced while the loop runs, by two real threads: nothing torn, nothing allocated, every force one
// of a valid model. Built alone for the thread sanitizer.
#include <gtest/gtest.h>

#include <atomic>
#include <numbers>
#include <random>

#include "needleforce/live.hpp"
#include "paper.hpp"
#include "writing.hpp"

using namespace needleforce;

namespace {

/// Between the softest and the stiffest: share 0..1 of each number.
Model between(double share) {
  Model model = paper::model(90e3 + 60e3 * share);
  model.friction = laws::Coulomb{14.0 + 8.0 * share, 20e-6, 0.0};
  model.cutting = laws::ConstantCutting{0.05 + 0.05 * share, 20e-6};
  return model;
}

/// Depth [m] of a cycle in, hold, out, that lasts 12 s at 1 kHz.
double depth_of(long step) {
  const double t = static_cast<double>(step % 12000) * 1e-3;
  return t < 4.0 ? -1e-3 + 3e-3 * t : t < 6.0 ? 11e-3 : 11e-3 - 3e-3 * (t - 6.0);
}

/// What the softest and the stiffest give in closed form [N]; sliding, or turning from the one way to the
/// other.
bool within(const Sample& sample) {
  const double z = sample.depth, push = 14.0 * z + 0.05, most = 22.0 * z + 0.1, rounding = 1e-12;
  const double pressed = 2.0 / std::numbers::pi * std::tan(paper::half_angle) * z * z;
  const double f = sample.force;
  if (!(z > 0.0)) return f == 0.0;
  if (sample.phase == Phase::deformation)
    return f >= 90e3 * pressed - rounding && f <= 150e3 * pressed + rounding;
  if (sample.phase == Phase::insertion && z > paper::puncture + 0.1e-3) return f >= push && f <= most;
  return std::isfinite(f) && f <= most + 150e3 * pressed && f >= -22.0 * z;
}

struct SwapsSeen {
  bool within = true;
  double largest_change = 0.0;
  long steps = 0;
};

/// 1e6 steps, and as many as it takes for `swaps` models.
SwapsSeen run(LiveInsertion& live, std::atomic<long>& at, std::uint32_t swaps) {
  SwapsSeen seen;
  double force = 0.0;
  for (long i = 0; i < 1000000 || live.taken() < swaps; ++i) {
    if (i % 12000 == 0) live.reset();
    const Sample sample = live.step(depth_of(i), no_velocity, 1e-3);
    seen.within &= within(sample) && sample.status == Status::ok;
    const bool jumps = sample.punctured || i % 12000 == 0;
    if (!jumps) seen.largest_change = std::max(seen.largest_change, std::abs(sample.force - force));
    force = sample.force;
    at.store(i, std::memory_order_relaxed);
    ++seen.steps;
  }
  return seen;
}

// the models are apart by 8 N/m over 11 mm and 0.05 N, or less where they press: over 10 ms; beside it the
// friction turns by 22 N/m over 11 mm, and the cut lets go of 0.1 N, in 20 um, of which 3 um are a step
constexpr double largest_blended = 0.138 * 0.1 + (22.0 * 11e-3 + 0.1) * 3.0 / 20.0;

void expect_sound(const SwapsSeen& seen) {
  EXPECT_TRUE(seen.within);
  EXPECT_LT(seen.largest_change, largest_blended);
  EXPECT_GE(seen.steps, 1000000);
}

TEST(Swap, EveryForceIsThatOfAValidModelAtPlannerRateWithJitter) {
  LiveInsertion live(paper::one(between(0.5)));
  std::atomic<long> at{0};
  std::mt19937_64 generator{1};
  std::uniform_real_distribution<double> share{0.0, 1.0}, period{1000.0 / 60.0, 1000.0 / 20.0};
  const Writing writing([&, due = 0.0]() mutable {
    // by the time of the loop, which runs as fast as it can
    if (static_cast<double>(at.load(std::memory_order_relaxed)) < due) return std::this_thread::yield();
    due += period(generator);
    EXPECT_EQ(live.replace(paper::one(between(share(generator)))).reason, nullptr);
  });
  expect_sound(run(live, at, 200));
  EXPECT_EQ(live.refused(), 0u);
}

TEST(Swap, EveryForceIsThatOfAValidModelAtFullRateWithInvalidModels) {
  LiveInsertion live(paper::one(between(0.5)), 50e-3);
  std::atomic<long> at{0};
  std::atomic<std::uint32_t> kept_out{0};
  {
    const Writing writing([&, n = 0]() mutable {
      const double share = n++ % 3 == 2 ? -10.0 : 0.5 * (n % 3);  // of it, every number is negative
      kept_out += live.replace(paper::one(between(share))).reason != nullptr;
    });
    expect_sound(run(live, at, 200));
  }
  EXPECT_GT(kept_out, 0u);
  EXPECT_EQ(live.refused(), kept_out);
}

TEST(Swap, ForceJumpsWithoutABlend) {
  // the measure of the tests above is one that can fail
  LiveInsertion live(paper::one(between(1.0)), 0.0);
  SwapsSeen seen;
  double force = 0.0;
  for (long i = 0; i < 6000; ++i) {
    if (i == 4500) live.replace(paper::one(between(0.0)));
    const Sample sample = live.step(depth_of(i), no_velocity, 1e-3);
    if (!sample.punctured)
      seen.largest_change = std::max(seen.largest_change, std::abs(sample.force - force));
    force = sample.force;
  }
  EXPECT_GT(seen.largest_change, largest_blended);
}

}  // namespace
