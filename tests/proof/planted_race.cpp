// SPDX-License-Identifier: Apache-2.0
// Two threads and one number without an order between them: the thread sanitizer must report it.
#include <gtest/gtest.h>

#include <thread>

TEST(PlantedRace, IsSeen) {
  int number = 0;
  std::thread other([&] { number = 1; });
  number = 2;
  other.join();
  EXPECT_GT(number, 0);
}
