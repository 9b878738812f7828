// SPDX-License-Identifier: Apache-2.0
#include "module.hpp"
#include "needleforce/foundation.hpp"
#include "parameters.hpp"

namespace needleforce::python {

namespace {

void bind_needle(nb::module_& module) {
  bind_parameters<Needle>(module, "Needle")
      .def_prop_ro(
          "radius", [](const Needle& self) { return 0.5 * self.outer_diameter; }, "[m]")
      .def_prop_ro("second_moment", &Needle::second_moment, "Second moment of area [m^4].")
      .def_prop_ro("bending_stiffness", &Needle::bending_stiffness, "E I [N m^2].");
}

void bind_foundation(nb::module_& module) {
  nb::enum_<FrictionReading>(module, "FrictionReading", "Readings of the paper's eqs. (7)-(11).")
      .value("A", FrictionReading::paper_width)
      .value("B", FrictionReading::projected_width)
      .value("C", FrictionReading::beam_width)
      .value("lame", FrictionReading::lame)
      .value("literal_mm", FrictionReading::literal_mm);
  module.def("vesic_modulus", &vesic_modulus, nb::arg("needle"), nb::arg("tissue"), nb::arg("width"),
             nb::arg("embedment_factor") = 1.0);
  module.def("biot_modulus", &biot_modulus, nb::arg("needle"), nb::arg("tissue"), nb::arg("half_width"));
  module.def("friction_per_length", &friction_per_length, nb::arg("reading"), nb::arg("needle"),
             nb::arg("tissue"), nb::arg("embedment_factor") = 1.0);
  nb::enum_<FoundationForm>(module, "FoundationForm", "Forms of the pressure of a foundation.")
      .value("linear", FoundationForm::linear)
      .value("cubic", FoundationForm::cubic)
      .value("hyperbolic", FoundationForm::hyperbolic)
      .value("tanh", FoundationForm::tanh);
  module.def("foundation_pressure", &foundation_pressure, nb::arg("form"), nb::arg("settlement"),
             nb::arg("stiffness"), nb::arg("scale"));
  module.def("foundation_energy", &foundation_energy, nb::arg("form"), nb::arg("settlement"),
             nb::arg("stiffness"), nb::arg("scale"));
  module.def("deflection_length", &deflection_length, nb::arg("needle"), nb::arg("modulus"),
             nb::arg("lateral_force"));
  module.def("bending_length", &bending_length, nb::arg("needle"), nb::arg("modulus"));
  module.def("reduced_modulus", &reduced_modulus<Needle, Tissue>, nb::arg("needle"), nb::arg("tissue"),
             "Reduced modulus [Pa] of needle and tissue in contact, eq. (4).");
}

}  // namespace

void bind_mechanics(nb::module_& module) {
  bind_needle(module);
  bind_parameters<Tissue>(module, "Tissue")
      .def_prop_ro(
          "plane_strain_modulus", [](const Tissue& self) { return plane_strain_modulus(self); },
          "E / (1 - nu^2) [Pa].");
  bind_foundation(module);
}

}  // namespace needleforce::python
