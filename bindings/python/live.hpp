// SPDX-License-Identifier: Apache-2.0
// A LiveInsertion as Python has it, which a guard may stand around.
#pragma once

#include <mutex>
#include <span>

#include "needleforce/live.hpp"

namespace needleforce::python {

/// The core's, which takes one writer, for as many as Python has threads: they queue, the loop does not.
class Live : public LiveInsertion {
 public:
  using LiveInsertion::LiveInsertion;

  Fault replace(std::span<const Layer> layers) {
    const std::lock_guard one_at_a_time(writers_);
    return LiveInsertion::replace(layers);
  }

 private:
  std::mutex writers_;
};

}  // namespace needleforce::python
