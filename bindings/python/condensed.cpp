// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/optional.h>

#include <optional>
#include <string>
#include <vector>

#include "layer_stack.hpp"
#include "module.hpp"
#include "needleforce/solid/condensed_insertion.hpp"
#include "one_thread.hpp"
#include "saved_bytes.hpp"

namespace needleforce::python {

namespace {

using solid::CondensedInsertion;
using solid::CondensedTissue;
using Rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

CondensedTissue table(double spacing, const Rows& compliance) {
  CondensedTissue tissue;
  const std::size_t n = compliance.shape(0);
  if (n != compliance.shape(1) || n < 2 || n > solid::max_path_nodes)
    raise_input("compliance", nb::str((std::to_string(n) + " rows").c_str()), "must be square, 2 to 64 rows",
                "Give a path with fewer nodes.");
  tissue.nodes = n;
  tissue.spacing = spacing;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      tissue.compliance[i * solid::max_path_nodes + j] = compliance.data()[i * n + j];
  if (const char* reason = solid::fault(tissue))
    raise_input("condensed tissue", nb::str("refused"), reason, "Give what Tissue.condense returned.");
  return tissue;
}

nb::dict run(CondensedInsertion& self, const Values& depth, const Values& dt) {
  const std::size_t n = depth.shape(0);
  if (dt.shape(0) != n)
    raise_input("the length of dt", nb::int_(dt.shape(0)), "not that of depth, " + std::to_string(n),
                "Give arrays of equal length.");
  double *force, *stiffness, *friction, *cutting, *tip, *surface, *phase, *status;
  nb::dict result;
  result["force"] = new_array(n, force);
  result["stiffness"] = new_array(n, stiffness);
  result["friction"] = new_array(n, friction);
  result["cutting"] = new_array(n, cutting);
  result["tip"] = new_array(n, tip);
  result["surface"] = new_array(n, surface);
  result["phase"] = new_array(n, phase);
  result["status"] = new_array(n, status);
  const Running running(&self);
  nb::gil_scoped_release release;
  for (std::size_t i = 0; i < n; ++i) {
    const Sample sample = self.step(depth.data()[i], no_velocity, dt.data()[i]);
    force[i] = sample.force;
    stiffness[i] = sample.stiffness;
    friction[i] = sample.friction;
    cutting[i] = sample.cutting;
    tip[i] = self.state().tip;
    surface[i] = self.displacement(0);
    phase[i] = static_cast<double>(sample.phase);
    status[i] = static_cast<double>(sample.status);
  }
  return result;
}

/// A value for each node of the path.
template <class Value>
Output at_nodes(const CondensedInsertion& self, Value value) {
  double* values;
  Output array = new_array(self.tissue().nodes, values);
  for (std::size_t i = 0; i < self.tissue().nodes; ++i) values[i] = (self.*value)(i);
  return array;
}

}  // namespace

void bind_condensed(nb::module_& module) {
  module.def(
      "check_condensed", [](double spacing, const Rows& compliance) { table(spacing, compliance); },
      nb::arg("spacing"), nb::arg("compliance"),
      "Raises InputError for the first fault in a compliance [m/N].");
  EngineClass<CondensedInsertion>(module, "CondensedInsertion",
                                  "A rigid needle in a solid that was condensed onto its path.")
      .def(
          "__init__",
          [](CondensedInsertion* self, double spacing, const Rows& compliance, const Stack& layers,
             const Limits& limits, const Bevel& bevel) {
            const auto tissue = table(spacing, compliance);
            const auto list = stacked(layers);
            if (const char* reason = CondensedInsertion::fault(tissue, list))
              raise_input("model", nb::str("refused"), reason,
                          "Use coulomb, karnopp or lugre friction, and no relaxation but prony, the same in "
                          "each layer.");
            new (self) CondensedInsertion(tissue, list, limits, bevel);
          },
          nb::arg("spacing"), nb::arg("compliance"), nb::arg("layers"), nb::arg("limits") = Limits{},
          nb::arg("bevel") = Bevel{})
      .def(
          "step",
          [](CondensedInsertion& self, double depth, std::optional<double> velocity, double dt) {
            return self.step(depth, velocity.value_or(no_velocity), dt);
          },
          nb::arg("depth"), nb::arg("velocity").none(), nb::arg("dt"),
          "One cycle: depth [m], velocity [m/s] or None for the change of depth, dt [s]. Never raises.")
      .def("run", &run, nb::arg("depth"), nb::arg("dt"),
           "A whole series, (n,) each: force and its parts [N], tip along the path and displacement of the "
           "surface [m]; phase and status as float64 indices into Phase and Status.")
      .def("reset", &CondensedInsertion::reset, "Back to before the first contact.")
      .def(
          "restore", [](CondensedInsertion& self, const CondensedInsertion& saved) { self = saved; },
          nb::arg("snapshot"), "Back to a snapshot, state and model.")
      .def("save", &saved_bytes<CondensedInsertion>, "The memory alone, as bytes that any process may keep.")
      .def(
          "restore",
          [](CondensedInsertion& self, const nb::bytes& bytes) {
            restore_bytes(self, bytes, "not of this version, tissue and model, or altered",
                          "Give what save() of an insertion into the same tissue gave.");
          },
          nb::arg("snapshot"),
          "The memory from bytes of save(); raises InputError for those of another version, tissue or model, "
          "or altered ones.")
      .def_prop_ro(
          "shaft_force",
          [](const CondensedInsertion& self) { return at_nodes(self, &CondensedInsertion::shaft_force); },
          nb::rv_policy::move, "[N] of the shaft on the tissue at each node of the path, (n,)")
      .def_prop_ro(
          "node_force",
          [](const CondensedInsertion& self) { return at_nodes(self, &CondensedInsertion::node_force); },
          nb::rv_policy::move, "[N] of shaft and tip on the tissue at each node of the path, (n,)")
      .def_prop_ro(
          "displacement",
          [](const CondensedInsertion& self) { return at_nodes(self, &CondensedInsertion::displacement); },
          nb::rv_policy::move, "[m] of the tissue at each node of the path, (n,)")
      .def_prop_ro(
          "tip", [](const CondensedInsertion& self) { return self.state().tip; },
          "where the tip is along the path, in the undeformed tissue [m]")
      .def_prop_ro(
          "deepest_cut", [](const CondensedInsertion& self) { return self.state().cut; },
          "along the path, in the undeformed tissue [m]")
      .def_prop_ro(
          "puncture",
          [](const CondensedInsertion& self) {
            return nb::make_tuple(self.surface_layer().puncture, self.surface_layer().puncture_force());
          },
          "indentation [m] and force [N] at which the contact law breaks through the surface")
      .def_prop_ro("displaced_by_cutting", &CondensedInsertion::displaced_by_cutting,
                   "by how much cutting displaces the tissue around the tip [m], half way down a layer")
      .def_prop_ro(
          "spacing", [](const CondensedInsertion& self) { return self.tissue().spacing; },
          "of the nodes of the path [m]")
      .def_prop_ro(
          "surface_compliance", [](const CondensedInsertion& self) { return self.tissue().at(0, 0); },
          "displacement of the surface for a force at its node [m/N]")
      .def_prop_ro(
          "pierced_layers", [](const CondensedInsertion& self) { return self.state().pierced; },
          "how many, from the surface down");
}

}  // namespace needleforce::python
