// SPDX-License-Identifier: Apache-2.0
// Layers from Python: depths of their tops with their laws, from the surface down.
#pragma once

#include <nanobind/stl/pair.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <utility>
#include <vector>

#include "needleforce/model.hpp"
#include "parameters.hpp"

namespace needleforce::python {

using Stack = std::vector<std::pair<double, Model>>;

/// Layers as the core takes them; the first fault is raised with its layer.
inline std::vector<Layer> stacked(const Stack& stack) {
  std::vector<Layer> layers;
  for (const auto& [top, laws] : stack) layers.push_back({top, laws});
  const Fault fault = first_fault(layers);
  if (fault.reason)
    raise_input("layer " + std::to_string(fault.layer + 1) + ", " + fault.quantity, nb::str("refused"),
                fault.reason,
                fault.layer > 0 ? "Change it or the layer above; depths count from the undeformed surface."
                                : "Choose other laws or numbers.");
  return layers;
}

}  // namespace needleforce::python
