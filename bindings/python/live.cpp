// SPDX-License-Identifier: Apache-2.0
#include "live.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "layer_stack.hpp"
#include "module.hpp"
#include "parameters.hpp"

namespace needleforce::python {

namespace {

std::vector<Layer> layers_of(const Stack& stack) {
  std::vector<Layer> layers;
  for (const auto& [top, laws] : stack) layers.push_back({top, laws});
  return layers;
}

void raise_if(const Fault& fault) {
  if (fault.reason)
    raise_input("layer " + std::to_string(fault.layer + 1) + ", " + fault.quantity, nb::str("refused"),
                fault.reason, "The previous model continues.");
}

void replace(Live& self, const Stack& stack) {
  const std::vector<Layer> layers = layers_of(stack);
  Fault fault;
  {
    nb::gil_scoped_release release;
    fault = self.replace(layers);
  }
  raise_if(fault);
}

}  // namespace

void bind_live(nb::module_& module) {
  nb::class_<Live>(module, "LiveInsertion", "An insertion whose model another thread may replace.")
      .def(
          "__init__",
          [](Live* self, const Stack& layers, double blend_time, const Limits& limits, const Bevel& bevel) {
            new (self) Live(layers_of(layers), blend_time, limits, bevel);
          },
          nb::arg("layers"), nb::arg("blend_time") = LiveInsertion::usual_blend, nb::arg("limits") = Limits{},
          nb::arg("bevel") = Bevel{})
      .def(
          "step",
          [](Live& self, double depth, std::optional<double> velocity, double dt) {
            return self.step(depth, velocity.value_or(no_velocity), dt);
          },
          nb::arg("depth"), nb::arg("velocity").none(), nb::arg("dt"),
          "One cycle: depth [m], velocity [m/s] or None for the change of depth, dt [s]. Never raises.")
      .def("replace_layers", &replace, nb::arg("layers"),
           "Offers other layers (top [m], laws) to the loop, from any thread; raises InputError for the "
           "first fault, and the old ones stay.")
      .def(
          "reset", [](Live& self) { self.reset(); }, "Back to before the first contact.")
      .def_prop_ro(
          "deepest_cut", [](const Live& self) { return self.deepest_cut(); }, "[m], 0 before the puncture")
      .def_prop_ro(
          "pierced_layers", [](const Live& self) { return self.pierced_layers(); },
          "how many, from the surface down")
      .def_prop_ro(
          "blending", [](const Live& self) { return self.blending(); },
          "True while the force goes from an old model's to a new one's")
      .def_prop_ro(
          "taken", [](const Live& self) { return self.taken(); }, "how many models the loop took over")
      .def_prop_ro(
          "refused", [](const Live& self) { return self.refused(); },
          "how many models were kept out as invalid")
      .def_prop_ro(
          "last_refused", [](const Live& self) { return self.last_refused(); },
          "True if the last model offered was kept out, so that an older one stays");
  module.attr("longest_blend") = LiveInsertion::longest_blend;
}

}  // namespace needleforce::python
