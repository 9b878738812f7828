// SPDX-License-Identifier: Apache-2.0
#include <variant>

#include "module.hpp"
#include "needleforce/laws/all.hpp"
#include "parameters.hpp"

namespace needleforce::python {

namespace {

template <Law L>
void bind_law(nb::module_& laws) {
  auto bound = bind_parameters<L>(laws, class_name(L::name));
  if constexpr (L::family == Family::stiffness) {
    bound.def(
        "force", [](const L& self, double h) { return h > 0 ? self.prepare().force(h) : 0.0; },
        nb::arg("depth"), "Force [N] at a depth [m].");
    bound.def(
        "slope", [](const L& self, double h) { return h > 0 ? self.prepare().slope(h) : 0.0; },
        nb::arg("depth"), "dF/dh [N/m] at a depth [m].");
    bound.def(
        "energy", [](const L& self, double h) { return h > 0 ? self.prepare().energy(h) : 0.0; },
        nb::arg("depth"), "Stored energy [J] at a depth [m].");
    bound.def(
        "indentation",
        [](const L& self, double force) { return force > 0 ? self.prepare().indentation(force) : 0.0; },
        nb::arg("force"), "Depth [m] at which the force [N] is reached.");
  }
}

template <class... L>
void bind_family(nb::module_& laws, std::variant<L...>*) {
  (bind_law<L>(laws), ...);
}

}  // namespace

void bind_laws(nb::module_& module) {
  nb::module_ laws = module.def_submodule("laws", "Every law, one class each.");
  bind_family(laws, static_cast<Stiffness*>(nullptr));
  bind_family(laws, static_cast<Puncture*>(nullptr));
  bind_family(laws, static_cast<Friction*>(nullptr));
  bind_family(laws, static_cast<Cutting*>(nullptr));
}

}  // namespace needleforce::python
