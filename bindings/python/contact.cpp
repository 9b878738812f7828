// SPDX-License-Identifier: Apache-2.0
#include "needleforce/contact.hpp"

#include <nanobind/stl/tuple.h>
#include <nanobind/stl/variant.h>

#include <tuple>

#include "module.hpp"
#include "needleforce/tip.hpp"
#include "parameters.hpp"

namespace needleforce::python {

namespace {

using Columns = std::tuple<Output, Output, Output, Output>;

/// depth, contact radius, force, energy of `evaluate` at each value.
template <class Evaluate>
Columns columns(const Values& values, const Evaluate& evaluate) {
  const std::size_t n = values.shape(0);
  double *depth, *radius, *force, *energy;
  Columns result{new_array(n, depth), new_array(n, radius), new_array(n, force), new_array(n, energy)};
  nb::gil_scoped_release release;
  for (std::size_t i = 0; i < n; ++i) {
    const Contact contact = evaluate(values.data()[i]);
    depth[i] = contact.depth;
    radius[i] = contact.contact_radius;
    force[i] = contact.force;
    energy[i] = contact.energy;
  }
  return result;
}

}  // namespace

void bind_contact(nb::module_& module) {
  module.def(
      "contact_at_depth",
      [](const Tip& tip, const Values& depth, double modulus, double shank) {
        return std::visit(
            [&](const auto& shape) {
              return columns(depth, [&](double h) { return contact_at_depth(shape, h, modulus, shank); });
            },
            tip);
      },
      nb::arg("tip"), nb::arg("depth"), nb::arg("reduced_modulus"), nb::arg("shank_radius") = no_shank);
  module.def(
      "contact_at_radius",
      [](const Tip& tip, const Values& radius, double modulus) {
        return std::visit(
            [&](const auto& shape) {
              return columns(radius, [&](double a) { return contact_at_radius(shape, a, modulus); });
            },
            tip);
      },
      nb::arg("tip"), nb::arg("contact_radius"), nb::arg("reduced_modulus"));
}

}  // namespace needleforce::python
