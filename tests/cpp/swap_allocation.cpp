// SPDX-License-Identifier: Apache-2.0
// The loop allocates nothing while another thread replaces its model. Apart, as it replaces the global
// operator new.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdlib>
#include <new>

#include "needleforce/live.hpp"
#include "paper.hpp"
#include "writing.hpp"

namespace {
thread_local bool armed = false;
thread_local long allocations = 0;

void* allocate(std::size_t size, std::size_t alignment) {
  if (armed) ++allocations;
  const std::size_t whole = (size + alignment - 1) / alignment * alignment;
  if (void* memory = std::aligned_alloc(alignment, whole)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void release(void* memory) { std::free(memory); }
}  // namespace

void* operator new(std::size_t size) { return allocate(size, alignof(std::max_align_t)); }
void* operator new[](std::size_t size) { return allocate(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t to) {
  return allocate(size, static_cast<std::size_t>(to));
}
void operator delete(void* memory) noexcept { release(memory); }
void operator delete[](void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t) noexcept { release(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }

using namespace needleforce;

namespace {

TEST(SwapAllocation, LoopDoesNotAllocate) {
  LiveInsertion live(paper::one(paper::model(100e3)));
  const Writing writing([&, n = 0]() mutable {
    live.replace(paper::one(paper::model(++n % 3 ? 90e3 + 10e3 * (n % 3) : -1.0)));
  });
  double sum = 0.0;
  allocations = 0;
  armed = true;
  for (long i = 0; i < 1000000 || live.taken() < 200; ++i)
    sum += live.step(4e-3 * std::sin(1e-3 * static_cast<double>(i)), no_velocity, 1e-3).force;
  armed = false;
  EXPECT_EQ(allocations, 0);
  EXPECT_GT(sum, 0.0);
  EXPECT_GT(live.refused(), 0u);
}

TEST(SwapAllocation, AllocationCounterDetectsAnAllocation) {
  allocations = 0;
  armed = true;
  ::operator delete(::operator new(8));  // called, as a new expression may be left out
  armed = false;
  EXPECT_EQ(allocations, 1);
}

}  // namespace
