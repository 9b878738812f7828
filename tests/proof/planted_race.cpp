// SPDX-License-Identifier: Apache-2.0
// One engine in two threads, which its header does not allow: the thread sanitizer must report it.
#include <gtest/gtest.h>

#include <thread>

#include "needleforce/insertion.hpp"
#include "paper.hpp"

TEST(PlantedRace, IsSeen) {
  needleforce::Insertion engine(paper::model());
  const auto run = [&] {
    for (int i = 0; i < 1000; ++i) engine.step(1e-6 * i, needleforce::no_velocity, 1e-3);
  };
  std::thread other(run);
  run();
  other.join();
}
