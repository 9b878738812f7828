// SPDX-License-Identifier: Apache-2.0
// Threads and engines, for the thread sanitizer: an engine of the Python module that runs is refused to other
// threads, by the module's own list of running ones; and engines of C++ share nothing, so that each thread
// may have its own of one model.
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

#include "../../bindings/python/running_engine.hpp"
#include "bending.hpp"
#include "needleforce/guard.hpp"
#include "solid.hpp"

namespace {

using namespace needleforce;
using python::RunningEngine;

void together(int threads, auto work) {
  std::vector<std::thread> all;
  for (int i = 0; i < threads; ++i) all.emplace_back([&work, i] { work(i); });
  for (std::thread& each : all) each.join();
}

// the mutex has the part of the interpreter's lock, which the module gives up while an engine runs
TEST(OneThread, AnEngineThatRunsIsRefusedToOthers) {
  Insertion engine(paper::model());
  std::mutex interpreter;
  std::atomic<int> ran{0}, refused{0};
  long steps = 0;  // counted by whoever runs, without a lock: the sanitizer sees a second one
  together(3, [&](int) {
    for (int call = 0; call < 200 || (refused == 0 && call < 100000); ++call) {
      std::unique_lock lock(interpreter);
      if (RunningEngine::any() && RunningEngine::runs(&engine)) {
        ++refused;
        lock.unlock();
        std::this_thread::yield();
        continue;
      }
      const RunningEngine running(&engine);
      lock.unlock();
      for (int i = 0; i < 50; ++i, ++steps) engine.step(1e-5 * i, no_velocity, 1e-3);
      if (ran++ % 16 == 0) std::this_thread::yield();
      lock.lock();
    }
  });
  EXPECT_EQ(steps, 50L * ran);
  EXPECT_GT(refused, 0);
  EXPECT_FALSE(RunningEngine::any());
}

/// The last force of a stroke, by an engine that is a copy of one that all threads read.
template <class Engine>
void expect_alike(const Engine& common, auto step) {
  const auto force = [&] {
    auto own = std::make_unique<Engine>(common);
    double last = 0.0;
    for (int i = -10; i < 60; ++i) last = step(*own, 2e-4 * i);
    return last;
  };
  const double alone = force();
  std::vector<double> found(3, 0.0);
  together(3, [&](int i) { found[static_cast<std::size_t>(i)] = force(); });
  for (const double each : found) EXPECT_EQ(each, alone);
}

TEST(OneThread, EnginesOfOneModelShareNothing) {
  const auto rigid = [](auto& engine, double depth) { return engine.step(depth, no_velocity, 1.0).force; };
  const Insertion insertion(paper::model());
  expect_alike(insertion, rigid);
  expect_alike(Guard<Insertion>(insertion, {.max_force = 1.0}), rigid);
  expect_alike(solid_tests::insertion(2e-3, solid_tests::laws_of(20.0, 0.1, 0.2)), rigid);
  expect_alike(bending::PlanarInsertion(insertion, bending_tests::guided()), [](auto& needle, double depth) {
    return needle.step({.depth = depth, .lateral = {1e-4, 0.0}}, 1.0).wrench[0];
  });
}

}  // namespace
