// SPDX-License-Identifier: Apache-2.0
// Binds a family of laws: each class with its table, what its family can be asked, and what it alone can
// answer.
#include <variant>

#include "module.hpp"
#include "needleforce/laws/all.hpp"
#include "parameters.hpp"

namespace needleforce::python {

namespace {

// functions of single laws, in addition to those of their family
template <class L>
void bind_answers(nb::class_<L>& bound) {
  if constexpr (requires(const L& law) { law.min_passive_viscous(); })
    bound.def_prop_ro("min_passive_viscous", &L::min_passive_viscous,
                      "Least viscous [N s/m^2] with which velocity to force is passive (unconfirmed).");
  if constexpr (requires(const L& law) { law.deflected(1.0, 1.0, 1.0); }) {
    bound.def("deflected", &L::deflected, nb::arg("deflection"), nb::arg("velocity"), nb::arg("dt"),
              "Deflection [m] of the bristles after dt [s] at a velocity [m/s].");
    bound.def("traction", &L::traction, nb::arg("deflection"), nb::arg("velocity"),
              "Friction per length [N/m] at a deflection [m] of the bristles and a velocity [m/s].");
  }
  if constexpr (requires(const L& law) { law.slip_time(1.0); })
    bound
        .def("stick_time", &L::stick_time, nb::arg("speed"),
             "Time [s] the crack sticks in a cycle, at a speed [m/s] below the arrest speed.")
        .def_prop_ro("still_force", &L::still_force, "Force [N] of a running crack at no speed.")
        .def("slip_time", &L::slip_time, nb::arg("speed"), "Time [s] the crack runs in a cycle.");
  if constexpr (requires(const L& law) { law.mean_force(1.0); })
    bound.def("mean_force", &L::mean_force, nb::arg("speed"),
              "Mean force [N] at a speed [m/s], over a cycle where it sticks and slips.");
  if constexpr (requires(const L& law) { law.critical_speed(); })
    bound.def_prop_ro("critical_speed", &L::critical_speed,
                      "Speed [m/s] below which steady cutting is unstable.");
  if constexpr (requires(const L& law) { law.steady_force(1.0); })
    bound.def("steady_force", &L::steady_force, nb::arg("speed"),
              "Force [N] of a crack that runs steadily at a speed [m/s].");
  if constexpr (requires(const L& law) { law.spreading(); })
    bound.def_prop_ro("spreading", &L::spreading, "Work of spreading over advance [N].");
}

template <Law L>
void bind_law(nb::module_& laws) {
  auto bound = bind_parameters<L>(laws, class_name(L::name));
  bind_answers(bound);
  if constexpr (L::family == Family::cutting)
    bound.def_prop_ro(
        "slow_force", [](const L& self) { return self.prepare().steady(0.0); },
        "Mean force [N] of slow cutting.");
  if constexpr (L::family == Family::stiffness) {
    bound.def(
        "force", [](const L& self, double h) { return h > 0 ? self.prepare().force(h) : 0.0; },
        nb::arg("depth"), "Force [N] at a depth [m].");
    bound.def(
        "slope", [](const L& self, double h) { return h >= 0 ? self.prepare().slope(h) : 0.0; },
        nb::arg("depth"), "dF/dh [N/m] at a depth [m].");
    bound.def(
        "energy", [](const L& self, double h) { return h > 0 ? self.prepare().energy(h) : 0.0; },
        nb::arg("depth"), "Stored energy [J] at a depth [m].");
    bound.def(
        "indentation",
        [](const L& self, double force) { return force > 0 ? self.prepare().indentation(force) : 0.0; },
        nb::arg("force"), "Depth [m] at which the force [N] is reached.");
    bound.def_prop_ro(
        "reach", [](const L& self) { return self.prepare().reach(); },
        "Depth [m] to which the formula holds; beyond it continues as a straight line.");
  }
  if constexpr (L::family == Family::friction) {
    if constexpr (SlidesSteadily<typename L::Prepared>)
      bound.def(
          "sliding",
          [](const L& self, double embedded, double v) { return self.prepare().sliding(embedded, v); },
          nb::arg("embedded"), nb::arg("velocity") = 0.0,
          "Force [N] of long sliding over an embedded length [m] at a velocity [m/s].");
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
  bind_family(laws, static_cast<Relaxation*>(nullptr));
}

}  // namespace needleforce::python
