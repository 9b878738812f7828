// SPDX-License-Identifier: Apache-2.0
// The contract of step(): nothing allocates, nothing throws, nothing that is not finite comes out.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <random>

#include "paper.hpp"

namespace {
std::atomic<bool> armed{false};
std::atomic<long> allocations{0};

void* allocate(std::size_t size) {
  if (armed) ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
}  // namespace

void* operator new(std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size) { return allocate(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

using namespace needleforce;

namespace {

static_assert(std::is_trivially_copyable_v<Insertion>);
static_assert(std::is_trivially_copyable_v<Sample>);
static_assert(noexcept(std::declval<Insertion&>().step(0.0, 0.0, 0.0)));
static_assert(noexcept(std::declval<Insertion&>().reset()));
static_assert(std::is_nothrow_constructible_v<Insertion, const Model&>);

/// Mostly a plausible random walk, now and then a value that no sensor should give.
class RandomInput {
 public:
  double depth() { return spoiled(depth_ += 1e-5 * unit_(generator_)); }
  double velocity() { return coin() ? no_velocity : spoiled(1e-2 * unit_(generator_)); }
  double dt() { return spoiled(1e-3); }

 private:
  bool coin() { return generator_() % 2 == 0; }
  double spoiled(double value) {
    constexpr double bad[] = {std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity(),
                              -std::numeric_limits<double>::infinity(),
                              std::numeric_limits<double>::denorm_min(),
                              1e300,
                              -1e300,
                              0.0,
                              -1.0,
                              1e-300};
    return generator_() % 50 == 0 ? bad[generator_() % std::size(bad)] : value;
  }
  std::mt19937_64 generator_{1};
  std::uniform_real_distribution<double> unit_{-1.0, 1.0};
  double depth_ = 2e-3;
};

TEST(RealTime, MillionStepsAllocateNothingAndStayFinite) {
  Insertion insertion(paper::model(), Limits{.hold_time = 5e-3});
  RandomInput input;
  bool finite = true;
  double largest = 0.0;
  armed = true;
  for (int i = 0; i < 1000000; ++i) {
    const Sample sample = insertion.step(input.depth(), input.velocity(), input.dt());
    finite = finite && std::isfinite(sample.force) && std::isfinite(sample.force_by_depth);
    largest = std::fmax(largest, std::abs(sample.force));
  }
  armed = false;
  EXPECT_EQ(allocations, 0);
  EXPECT_TRUE(finite);
  EXPECT_GT(largest, 0.05);
}

TEST(RealTime, TheArmedAllocatorSeesAnAllocation) {
  allocations = 0;
  armed = true;
  delete new int(1);
  armed = false;
  EXPECT_EQ(allocations, 1);
}

}  // namespace
