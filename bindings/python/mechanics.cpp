// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/optional.h>
#include <nanobind/stl/variant.h>

#include "module.hpp"
#include "needleforce/foundation.hpp"
#include "parameters.hpp"

namespace needleforce::python {

namespace {

void bind_tips(nb::module_& module) {
  nb::module_ tips = module.def_submodule("tips", "Tips of needles: axisymmetric profiles.");
  bind_parameters<tips::Cone>(tips, "Cone")
      .def("length", &tips::Cone::length, nb::arg("radius"),
           "Length [m] from the apex to the section of a given radius [m].")
      .def_prop_ro(
          "representative_strain", [](const tips::Cone& tip) { return 0.2 * tip.cotangent(); },
          "Johnson's 0.2 cot(half_angle): far above 0.1 the linear theory is a scaling law.")
      .def(
          "mean_pressure",
          [](const tips::Cone& tip, double modulus) { return 0.5 * modulus * tip.cotangent(); },
          nb::arg("reduced_modulus"), "Mean contact pressure [Pa], the same at every depth.");
}

Needle make_needle(const nb::tuple& args, const nb::dict& kwargs) {
  Needle needle{};
  nb::dict numbers;
  std::size_t position = 0;
  for (const Parameter<Needle>& parameter : Needle::table)
    if (position < args.size()) numbers[parameter.name] = args[position++];
  numbers.update(kwargs);
  if (position < args.size()) numbers["tip"] = args[position];
  if (numbers.contains("tip")) {
    needle.tip = nb::cast<std::optional<Tip>>(numbers["tip"]);
    nb::del(numbers["tip"]);
  }
  fill(needle, nb::tuple(), numbers);
  if (needle.inner_diameter >= needle.outer_diameter)
    raise_input("needle.inner_diameter", nb::float_(needle.inner_diameter),
                "not below the outer diameter " + number(needle.outer_diameter) + " m",
                "Give the lumen's diameter, 0 for a solid needle.");
  return needle;
}

nb::dict needle_dict(const Needle& needle) {
  nb::dict result = as_dict(needle);
  result["tip"] = nb::cast(needle.tip);
  return result;
}

void bind_needle(nb::module_& module) {
  bind_values<Needle>(module, "Needle")
      .def(
          "__init__",
          [](Needle* self, const nb::args& args, const nb::kwargs& kwargs) {
            new (self) Needle(make_needle(args, kwargs));
          },
          nb::sig(signature<Needle>(", tip: tips.Cone | None = None").c_str()))
      .def(
          "replace",
          [](const Needle& self, const nb::kwargs& changes) {
            nb::dict merged = needle_dict(self);
            merged.update(changes);
            return make_needle(nb::tuple(), merged);
          },
          "A copy with the given numbers or tip changed.")
      .def("__eq__",
           [](const Needle& self, const Needle& other) {
             return equal(self, other) && nb::cast(self.tip).equal(nb::cast(other.tip));
           })
      .def("__getstate__", &needle_dict)
      .def("__setstate__",
           [](Needle& self, const nb::dict& state) { new (&self) Needle(make_needle(nb::tuple(), state)); })
      .def_prop_ro("tip", [](const Needle& self) { return self.tip; })
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
  module.def("reduced_modulus", &reduced_modulus<Needle, Tissue>, nb::arg("needle"), nb::arg("tissue"),
             "Reduced modulus [Pa] of needle and tissue in contact, eq. (4).");
}

}  // namespace

void bind_mechanics(nb::module_& module) {
  bind_tips(module);
  bind_needle(module);
  bind_parameters<Tissue>(module, "Tissue")
      .def_prop_ro(
          "plane_strain_modulus", [](const Tissue& self) { return plane_strain_modulus(self); },
          "E / (1 - nu^2) [Pa].");
  bind_foundation(module);
}

}  // namespace needleforce::python
