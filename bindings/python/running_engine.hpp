// SPDX-License-Identifier: Apache-2.0
// Which engines run at this moment: a list that is read and changed under one lock, the interpreter's.
#pragma once

namespace needleforce::python {

/// An engine while it runs without that lock. Made and destroyed with the lock held: declare it before the
/// lock is released.
class RunningEngine {
 public:
  explicit RunningEngine(const void* engine) noexcept : engine_(engine), next_(first) { first = this; }
  RunningEngine(const RunningEngine&) = delete;
  RunningEngine& operator=(const RunningEngine&) = delete;
  ~RunningEngine() {
    RunningEngine** place = &first;
    while (*place != this) place = &(*place)->next_;
    *place = next_;
  }

  static bool any() noexcept { return first != nullptr; }
  /// True if the engine runs. The lock must be held.
  static bool runs(const void* engine) noexcept {
    for (const RunningEngine* one = first; one; one = one->next_)
      if (one->engine_ == engine) return true;
    return false;
  }

 private:
  inline static RunningEngine* first = nullptr;
  const void* engine_;
  RunningEngine* next_;
};

}  // namespace needleforce::python
