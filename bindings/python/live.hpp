// SPDX-License-Identifier: Apache-2.0
// The live insertion as Python has it, for its own class and for guards around it.
#pragma once

#include <nanobind/stl/pair.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "needleforce/live.hpp"
#include "parameters.hpp"

namespace needleforce::python {

using Stack = std::vector<std::pair<double, Model>>;

inline std::vector<Layer> layers_of(const Stack& stack) {
  std::vector<Layer> layers;
  for (const auto& [top, laws] : stack) layers.push_back({top, laws});
  return layers;
}

inline void raise_if(const Fault& fault) {
  if (fault.reason)
    raise_input("layer " + std::to_string(fault.layer + 1) + ", " + fault.quantity, nb::str("refused"),
                fault.reason, "The model before it goes on.");
}

/// The core's, which takes one writer, for as many as Python has threads: they queue, the loop does not.
class Live {
 public:
  Live(const Stack& stack, double blend_time, const Limits& limits, const Bevel& bevel)
      : live_(layers_of(stack), blend_time, limits, bevel) {}

  void replace(const Stack& stack) {
    const std::vector<Layer> layers = layers_of(stack);
    Fault fault;
    {
      nb::gil_scoped_release release;
      const std::lock_guard one_at_a_time(writers_);
      fault = live_.replace(layers);
    }
    raise_if(fault);
  }
  Sample step(double depth, double velocity, double dt) noexcept { return live_.step(depth, velocity, dt); }
  void reset() noexcept { live_.reset(); }
  LiveInsertion& operator*() { return live_; }
  const LiveInsertion& operator*() const { return live_; }

 private:
  LiveInsertion live_;
  std::mutex writers_;
};

}  // namespace needleforce::python
