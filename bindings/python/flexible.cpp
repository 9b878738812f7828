// SPDX-License-Identifier: Apache-2.0
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "module.hpp"
#include "needleforce/solid/bent_in_solid.hpp"
#include "one_thread.hpp"
#include "parameters.hpp"
#include "saved_bytes.hpp"

namespace needleforce::python {

namespace {

using bending::Base;
using bending::BentSample;
using bending::Section;

using Rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

bending::FlexibleSettings settings_of(const std::vector<bending::LateralLayer>& layers,
                                      const std::vector<std::array<double, 3>>& sections,
                                      const bending::Support& support, const bending::Bending& lengths,
                                      std::size_t elements, bool small_slopes) {
  bending::FlexibleSettings settings;
  std::vector<Section> list;
  for (const auto& [end, stiffness, curvature] : sections) list.push_back({end, stiffness, curvature});
  if (list.size() > bending::max_sections)
    raise_input("number of sections", nb::int_(list.size()), "more than 4", "Join some of them.");
  if (layers.size() > bending::max_lateral_layers)
    raise_input("number of lateral layers", nb::int_(layers.size()), "more than 8", "Join some of them.");
  settings.beam.sections = bending::Sections(std::span<const Section>(list));
  settings.beam.support = support;
  std::copy(layers.begin(), layers.end(), settings.beam.layers.begin());
  settings.beam.layer_count = layers.size();
  settings.beam.elements = elements;
  settings.lengths = lengths;
  settings.small_slopes = small_slopes;
  if (const char* quantity = bending::fault(settings))
    raise_input(
        quantity, nb::str("refused"), "outside its range or out of order",
        "Tops of lateral layers start at 0 and increase; ends of sections increase from the tip, with "
        "bending stiffnesses of 1e-15 to 1e9 N m^2; elements are 1 to 100.");
  return settings;
}

template <std::size_t dimension, class Axial>
using Bent = bending::FlexibleInsertion<dimension, Axial>;

template <std::size_t dimension, class Axial>
nb::dict run(Bent<dimension, Axial>& self, const Values& depth, const Rows& lateral, const Rows& tilt,
             const Values& roll, const Values& dt) {
  const std::size_t n = depth.shape(0);
  for (std::size_t length : {lateral.shape(0), tilt.shape(0), roll.shape(0), dt.shape(0)})
    if (length != n)
      raise_input("the length of lateral, tilt, roll or dt", nb::int_(length),
                  "not that of depth, " + std::to_string(n), "Give arrays of equal length.");
  if (lateral.shape(1) != 2 || tilt.shape(1) != 2)
    raise_input("the columns of lateral or tilt", nb::int_(lateral.shape(1)), "not 2",
                "Give (n, 2): x and y.");
  double *tip, *tangent, *wrench, *force, *status, *buckled;
  nb::dict result;
  result["tip"] = new_rows(n, 3, tip);
  result["tangent"] = new_rows(n, 3, tangent);
  result["wrench"] = new_rows(n, 6, wrench);
  result["force"] = new_array(n, force);
  result["status"] = new_array(n, status);
  result["buckled"] = new_array(n, buckled);
  const Running running(&self);
  nb::gil_scoped_release release;
  for (std::size_t i = 0; i < n; ++i) {
    const double *x = lateral.data() + 2 * i, *t = tilt.data() + 2 * i;
    const BentSample sample =
        self.step(Base{depth.data()[i], {x[0], x[1]}, {t[0], t[1]}, roll.data()[i]}, dt.data()[i]);
    std::copy(sample.tip.begin(), sample.tip.end(), tip + 3 * i);
    std::copy(sample.tangent.begin(), sample.tangent.end(), tangent + 3 * i);
    std::copy(sample.wrench.begin(), sample.wrench.end(), wrench + 6 * i);
    force[i] = sample.force;
    status[i] = static_cast<double>(sample.status);
    buckled[i] = sample.buckled;
  }
  return result;
}

template <std::size_t dimension, class Axial>
Table shape(const Bent<dimension, Axial>& self) {
  double* points;
  auto array = new_rows(self.shape_points(), 3, points);
  self.shape([&](const bending::Vector& point) { points = std::copy(point.begin(), point.end(), points); });
  return array;
}

template <std::size_t dimension, class Axial>
Table path(const Bent<dimension, Axial>& self) {
  const auto& cut = self.path();
  const std::size_t n = cut.empty() ? 0 : cut.nodes();
  double* rows;
  auto array = new_rows(n, 3, rows);
  for (std::size_t k = 0; k < n; ++k) {
    rows[3 * k] = cut.node(k)[0];
    rows[3 * k + 1] = dimension > 1 ? cut.node(k)[dimension - 1] : 0.0;
    rows[3 * k + 2] = cut.spacing * static_cast<double>(k);
  }
  return array;
}

void bind_bent_sample(nb::module_& module) {
  nb::class_<BentSample>(module, "BentSample", "One row of the insertion of a needle that bends.")
      .def_prop_ro(
          "tip", [](const BentSample& self) { return as_array(self.tip); }, nb::rv_policy::move,
          "(x, y, z) [m] in the tissue, its surface at z = 0")
      .def_prop_ro(
          "tangent", [](const BentSample& self) { return as_array(self.tangent); }, nb::rv_policy::move,
          "of the tip, a unit vector")
      .def_prop_ro(
          "wrench", [](const BentSample& self) { return as_array(self.wrench); }, nb::rv_policy::move,
          "force [N] and moment [N m] of the tissue on the needle at the base, in its frame")
      .def_ro("force", &BentSample::force, "axial force [N], + opposes insertion")
      .def_ro("lateral", &BentSample::lateral, "lateral force on the tip [N]")
      .def_ro("unsupported_length", &BentSample::unsupported, "between base and surface [m]")
      .def_ro("axial", &BentSample::axial, "parts of the axial force, phase and events")
      .def_ro("buckled", &BentSample::buckled,
              "true from the step in which the needle lost its stability until it is out of the tissue")
      .def_prop_ro("status",
                   [](const BentSample& self) { return status_names[static_cast<int>(self.status)]; })
      .def("__repr__", [](const BentSample& self) {
        return nb::str("<BentSample: tip ({:.3f}, {:.3f}, {:.3f}) mm, force {:.4g} N, {}{}>")
            .format(1e3 * self.tip[0], 1e3 * self.tip[1], 1e3 * self.tip[2], self.force,
                    status_names[static_cast<int>(self.status)], self.buckled ? ", buckled" : "");
      });
}

template <std::size_t dimension, class Axial = Insertion>
void bind_flexible(nb::module_& module, const char* name, const char* doc) {
  using Self = Bent<dimension, Axial>;
  EngineClass<Self>(module, name, doc)
      .def(
          "__init__",
          [](Self* self, const Axial& axial, const std::vector<bending::LateralLayer>& lateral,
             const std::vector<std::array<double, 3>>& sections, const bending::Support& support,
             const bending::Bending& lengths, std::size_t elements, bool small_slopes) {
            new (self) Self(axial, settings_of(lateral, sections, support, lengths, elements, small_slopes));
          },
          nb::arg("axial"), nb::arg("lateral"), nb::arg("sections"), nb::arg("support"), nb::arg("lengths"),
          nb::arg("elements"), nb::arg("small_slopes"))
      .def(
          "step",
          [](Self& self, double depth, const std::array<double, 2>& lateral,
             const std::array<double, 2>& tilt, double roll,
             double dt) { return self.step(Base{depth, lateral, tilt, roll}, dt); },
          nb::arg("depth"), nb::arg("lateral"), nb::arg("tilt"), nb::arg("roll"), nb::arg("dt"))
      .def("run", &run<dimension, Axial>, nb::arg("depth"), nb::arg("lateral"), nb::arg("tilt"),
           nb::arg("roll"), nb::arg("dt"))
      .def("shape", &shape<dimension, Axial>, "(n, 3) points of the needle from the base to the tip [m]")
      .def("path", &path<dimension, Axial>, "(n, 3) the cut path, over the travel in tissue [m]")
      .def(
          "copy", [](const Self& self) { return Self(self); }, "A copy with its state.")
      .def_prop_ro("shortens", &Self::shortens,
                   "whether bending shortens the needle and its axial laws feel that")
      .def("reset", &Self::reset, "Back to before the first contact.")
      .def(
          "restore", [](Self& self, const Self& saved) { self = saved; }, nb::arg("snapshot"),
          "Back to a snapshot, state and model.")
      .def("save", &saved_bytes<Self>, "The memory alone, as bytes that any process may keep.")
      .def(
          "restore",
          [](Self& self, const nb::bytes& bytes) {
            restore_bytes(self, bytes, "not of this version, this model and these settings, or altered",
                          "Give what save() of a FlexibleInsertion with the same model and settings gave.");
          },
          nb::arg("snapshot"),
          "The memory from bytes of save(); raises InputError for those of another version, model or "
          "settings, or altered ones.");
}

}  // namespace

void bind_flexible(nb::module_& module) {
  bind_parameters<bending::LateralLayer>(module, "LateralLayer");
  bind_parameters<bending::Support>(module, "Support");
  bind_parameters<bending::Bending>(module, "Bending");
  bind_bent_sample(module);
  bind_flexible<1>(module, "PlanarInsertion", "A needle that bends in the plane of x and z.");
  bind_flexible<2>(module, "SpatialInsertion", "A needle that bends in space.");
  using Solid = solid::CondensedInsertion;
  bind_flexible<1, Solid>(module, "PlanarInSolid", "A needle that bends in a plane of a condensed solid.");
  bind_flexible<2, Solid>(module, "SpatialInSolid", "A needle that bends in a condensed solid.");
}

}  // namespace needleforce::python
