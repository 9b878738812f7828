// SPDX-License-Identifier: Apache-2.0
// The other thread of a test.
#pragma once

#include <atomic>
#include <thread>

/// Runs `write` again and again in another thread until the scope ends.
template <class Write>
class Writing {
 public:
  explicit Writing(Write write)
      : thread_([this, write]() mutable {
          while (!done_) write();
        }) {}
  ~Writing() {
    done_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> done_{false};
  std::thread thread_;
};
