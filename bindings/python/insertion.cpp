// SPDX-License-Identifier: Apache-2.0
#include "needleforce/insertion.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <vector>

#include "layer_stack.hpp"
#include "module.hpp"
#include "needleforce/sliding.hpp"
#include "one_thread.hpp"
#include "parameters.hpp"
#include "saved_bytes.hpp"
#include "sliding_force.hpp"

namespace needleforce::python {

namespace {

template <std::size_t n>
std::vector<std::string> names(const char* const (&words)[n]) {
  return {words, words + n};
}

void require_length(const Values& values, std::size_t n, const char* quantity) {
  if (values.shape(0) != n)
    raise_input(std::string("the length of ") + quantity, nb::int_(values.shape(0)),
                "not that of depth, " + std::to_string(n), "Give arrays of equal length.");
}

/// Runs the insertion over whole arrays; the columns of the samples by name.
nb::dict run(Insertion& insertion, const Values& depth, const std::optional<Values>& velocity,
             const Values& dt) {
  const std::size_t n = depth.shape(0);
  if (velocity) require_length(*velocity, n, "velocity");
  require_length(dt, n, "dt");
  double *force, *stiffness, *friction, *cutting, *phase, *status;
  nb::dict result;
  result["force"] = new_array(n, force);
  result["stiffness"] = new_array(n, stiffness);
  result["friction"] = new_array(n, friction);
  result["cutting"] = new_array(n, cutting);
  result["phase"] = new_array(n, phase);
  result["status"] = new_array(n, status);
  const Running running(&insertion);
  nb::gil_scoped_release release;
  for (std::size_t i = 0; i < n; ++i) {
    const Sample sample =
        insertion.step(depth.data()[i], velocity ? velocity->data()[i] : no_velocity, dt.data()[i]);
    force[i] = sample.force;
    stiffness[i] = sample.stiffness;
    friction[i] = sample.friction;
    cutting[i] = sample.cutting;
    phase[i] = static_cast<double>(sample.phase);
    status[i] = static_cast<double>(sample.status);
  }
  return result;
}

/// The force alone over whole arrays, the velocity being the change of depth.
Output forces(Insertion& insertion, const Values& depth, const Values& dt) {
  const std::size_t n = depth.shape(0);
  require_length(dt, n, "dt");
  double* force;
  Output array = new_array(n, force);
  const Running running(&insertion);
  nb::gil_scoped_release release;
  for (std::size_t i = 0; i < n; ++i)
    force[i] = insertion.step(depth.data()[i], no_velocity, dt.data()[i]).force;
  return array;
}

void bind_sample(nb::module_& module) {
  nb::class_<Sample>(module, "Sample",
                     "One row of an insertion: force [N], + opposes insertion, and its parts.")
      .def_ro("depth", &Sample::depth, "[m] past the undeformed surface")
      .def_ro("velocity", &Sample::velocity, "[m/s]")
      .def_ro("force", &Sample::force, "[N], the sum of the parts")
      .def_ro("stiffness", &Sample::stiffness, "[N]")
      .def_ro("friction", &Sample::friction, "[N]")
      .def_ro("cutting", &Sample::cutting, "[N]")
      .def_ro("lateral", &Sample::lateral, "[N] across the axis, estimated from the bevel; 0 without one")
      .def_ro("force_by_depth", &Sample::force_by_depth, "[N/m]")
      .def_ro("force_by_velocity", &Sample::force_by_velocity, "[N s/m]")
      .def_ro("contact", &Sample::contact, "true in the one step that touches the tissue")
      .def_ro("punctured", &Sample::punctured, "true in the one step that breaks through a layer")
      .def_ro("exit", &Sample::exit, "true in the one step that leaves the tissue")
      .def_prop_ro("phase", [](const Sample& self) { return phase_names[static_cast<int>(self.phase)]; })
      .def_prop_ro("status", [](const Sample& self) { return status_names[static_cast<int>(self.status)]; })
      .def("__repr__", [](const Sample& self) {
        return nb::str("<Sample: depth {:.3f} mm, force {:.4g} N, {}, {}>")
            .format(1e3 * self.depth, self.force, phase_names[static_cast<int>(self.phase)],
                    status_names[static_cast<int>(self.status)]);
      });
}

void sliding_force_of(const Model& self, const Values& depth, const std::optional<Values>& velocity,
                      nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu> out) {
  if (velocity) require_length(*velocity, depth.shape(0), "velocity");
  if (out.shape(0) != depth.shape(0))
    raise_input("the length of out", nb::int_(out.shape(0)), "not that of depth", "");
  if (!slides_steadily(self))
    raise_input("the model's friction or relaxation", nb::str("a law with memory"),
                "without a force while sliding that depends on depth alone", "Run an Insertion.");
  nb::gil_scoped_release release;
  sliding_force_long(self, depth.data(), velocity ? velocity->data() : nullptr, out.data(), depth.shape(0));
}

void bind_model(nb::module_& module) {
  nb::class_<Model>(module, "Laws", "One law for each part of the force, in one layer.")
      .def(
          "__init__",
          [](Model* self, Stiffness stiffness, Puncture puncture, Friction friction, Cutting cutting,
             Relaxation relaxation) {
            new (self) Model{stiffness, puncture, friction, cutting, relaxation};
            stacked({{0.0, *self}});
          },
          nb::arg("stiffness"), nb::arg("puncture"), nb::arg("friction"), nb::arg("cutting"),
          nb::arg("relaxation") = Relaxation{})
      .def_prop_ro(
          "puncture_depth",
          [](const Model& self) { return puncture_depth(self.puncture, prepare(self.stiffness)); },
          "Depth [m] of the tip at puncture, whatever the criterion; where the contact relaxes, the least.")
      .def("sliding_force", &sliding_force_of, nb::arg("depth"), nb::arg("velocity").none(),
           nb::arg("out").noconvert());
  module.def(
      "check_layers", [](const Stack& layers) { stacked(layers); }, nb::arg("layers"),
      "Raises InputError for the first fault in layers (top [m], laws) from the surface down.");
}

}  // namespace

void bind_insertion(nb::module_& module) {
  module.def("phase_names", [] { return names(phase_names); });
  module.def("status_names", [] { return names(status_names); });
  bind_sample(module);
  bind_model(module);
  bind_parameters<Bevel>(module, "Bevel");
  bind_parameters<Limits>(module, "Limits");
  EngineClass<Insertion>(module, "Insertion", "The simulated insertion, one cycle at a time.")
      .def(
          "__init__",
          [](Insertion* self, const Stack& layers, const Limits& limits, const Bevel& bevel) {
            new (self) Insertion(std::span<const Layer>(stacked(layers)), limits, bevel);
          },
          nb::arg("layers"), nb::arg("limits") = Limits{}, nb::arg("bevel") = Bevel{})
      .def(
          "step",
          [](Insertion& self, double depth, std::optional<double> velocity, double dt) {
            return self.step(depth, velocity.value_or(no_velocity), dt);
          },
          nb::arg("depth"), nb::arg("velocity").none(), nb::arg("dt"),
          "One cycle: depth [m], velocity [m/s] or None for the change of depth, dt [s]. Never raises.")
      .def("run", &run, nb::arg("depth"), nb::arg("velocity").none(), nb::arg("dt"),
           "A whole series, (n,) each, as the columns of its samples: force, stiffness, friction, cutting "
           "[N]; phase and status "
           "as float64 indices into Phase and Status.")
      .def("forces", &forces, nb::arg("depth"), nb::arg("dt"),
           "The forces [N] of a whole series, (n,) each, the velocity being the change of depth.")
      .def("reset", &Insertion::reset, "Back to before the first contact.")
      .def(
          "restore", [](Insertion& self, const Insertion& saved) { self = saved; }, nb::arg("snapshot"),
          "Back to a snapshot, state and model.")
      .def("save", &saved_bytes<Insertion>, "The memory alone, as bytes that any process may keep.")
      .def(
          "restore",
          [](Insertion& self, const nb::bytes& bytes) {
            restore_bytes(self, bytes, "not of this version and this model, or altered",
                          "Give what save() of an insertion of the same model gave.");
          },
          nb::arg("snapshot"),
          "The memory from bytes of save(); raises InputError for those of another version or model, or "
          "altered ones.")
      .def_prop_ro("deepest_cut", &Insertion::deepest_cut, "[m], 0 before the puncture")
      .def_prop_ro("pierced_layers", &Insertion::pierced_layers, "how many, from the surface down");
}

}  // namespace needleforce::python
