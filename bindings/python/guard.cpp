// SPDX-License-Identifier: Apache-2.0
#include "needleforce/guard.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "live.hpp"
#include "module.hpp"
#include "needleforce/base_guard.hpp"
#include "needleforce/insertion.hpp"
#include "needleforce/solid/bent_in_solid.hpp"
#include "one_thread.hpp"
#include "parameters.hpp"

namespace needleforce::python {

namespace {

/// An engine that Python owns, whatever its type.
template <class Row, class... Motion>
struct AnyEngine {
  void* engine;
  Row (*stepped)(void*, Motion..., double) noexcept;
  void (*back)(void*) noexcept;
  Row step(Motion... motion, double dt) noexcept { return stepped(engine, motion..., dt); }
  void reset() noexcept { back(engine); }

  template <class Engine>
  static AnyEngine of(Engine& engine) {
    return {&engine,
            [](void* self, Motion... motion, double dt) noexcept {
              return static_cast<Engine*>(self)->step(motion..., dt);
            },
            [](void* self) noexcept { static_cast<Engine*>(self)->reset(); }};
  }
};
using AlongDepth = AnyEngine<Sample, double, double>;
using ByItsBase = AnyEngine<bending::BentSample, const bending::Base&>;

constexpr double none = std::numeric_limits<double>::quiet_NaN();

/// What a guard in Python is: it always records.
template <class Engine, class Row>
struct Recorded {
  Guard<Engine> guard;
  FlightRecorder<4096, Row> recorder{};

  /// The guard, unless its engine runs in another thread.
  Guard<Engine>& alone() {
    Running::refuse(guard.engine().engine);
    return guard;
  }
  /// A cycle with a measurement, recorded as it was given.
  auto step(const typename Row::Motion& motion, const typename Row::Motion& given, double dt) {
    const auto output = alone().step(motion, dt);
    recorder.write(given, dt, output);
    return output;
  }
  auto miss(const typename Row::Motion& nothing, double dt) {
    const auto output = alone().miss(dt);
    recorder.write(nothing, dt, output);
    return output;
  }
};
using DepthGuard = Recorded<AlongDepth, Cycle>;
using BaseGuard = Recorded<ByItsBase, BaseCycle>;

/// Columns of a record by name.
template <class Row>
struct Columns {
  std::span<const Row> cycles;
  nb::dict dict{};
  void add(const char* name, auto value) {
    double* data;
    python::Output array = new_array(cycles.size(), data);
    for (const Row& cycle : cycles) *data++ = static_cast<double>(value(cycle));
    dict[name] = array;
  }
};

void add_motion(Columns<Cycle>& columns) {
  columns.add("depth", [](const Cycle& cycle) { return cycle.depth; });
  columns.add("velocity", [](const Cycle& cycle) { return cycle.velocity; });
  columns.add("force", [](const Cycle& cycle) { return cycle.force; });
}
void add_motion(Columns<BaseCycle>& columns) {
  constexpr const char* bases[] = {"lateral_x", "lateral_y", "tilt_x", "tilt_y"};
  constexpr const char* forces[] = {"lateral_force_x", "lateral_force_y", "tilt_moment_x", "tilt_moment_y"};
  columns.add("depth", [](const BaseCycle& cycle) { return cycle.base.depth; });
  columns.add("roll", [](const BaseCycle& cycle) { return cycle.base.roll; });
  columns.add("force", [](const BaseCycle& cycle) { return cycle.force.depth; });
  columns.add("roll_moment", [](const BaseCycle& cycle) { return cycle.force.roll; });
  for (std::size_t d = 0; d < 2; ++d) {
    columns.add(bases[d], [d](const BaseCycle& cycle) { return cycle.base.lateral[d]; });
    columns.add(bases[2 + d], [d](const BaseCycle& cycle) { return cycle.base.tilt[d]; });
    columns.add(forces[d], [d](const BaseCycle& cycle) { return cycle.force.lateral[d]; });
    columns.add(forces[2 + d], [d](const BaseCycle& cycle) { return cycle.force.tilt[d]; });
  }
}

template <class Engine, class Row>
nb::dict columns_of(const Recorded<Engine, Row>& self) {
  std::vector<Row> room(self.recorder.capacity());
  Columns<Row> columns{self.recorder.read(room)};
  columns.add("number", [](const Row& cycle) { return cycle.number; });
  columns.add("dt", [](const Row& cycle) { return cycle.dt; });
  add_motion(columns);
  columns.add("energy", [](const Row& cycle) { return cycle.energy; });
  columns.add("reserve", [](const Row& cycle) { return cycle.reserve; });
  columns.add("sample_force", [](const Row& cycle) { return cycle.sample_force; });
  columns.add("phase", [](const Row& cycle) { return static_cast<int>(cycle.phase); });
  columns.add("status", [](const Row& cycle) { return static_cast<int>(cycle.status); });
  for (std::size_t i = 0; i < std::size(interventions); ++i)
    columns.add(intervention_names[i], [i](const Row& cycle) { return cycle.did.*interventions[i]; });
  return columns.dict;
}

/// Lets a guard be made around an engine of this type, which stays with its owner.
template <class Engine, class Any, class Row>
void takes(nb::class_<Recorded<Any, Row>>& bound) {
  bound.def(
      "__init__",
      [](Recorded<Any, Row>* self, Engine& engine, const GuardSettings& settings) {
        if (const char* reason = settings.misfit(Guarded<Any>::axes))
          raise_input("guard", nb::str("refused"), reason, "Leave it out, or give what it needs.");
        new (self) Recorded<Any, Row>{Guard<Any>(Any::of(engine), settings)};
      },
      nb::arg("engine"), nb::arg("settings"), nb::keep_alive<1, 2>());
}

template <class Given>
nb::class_<Given> bind_output(nb::module_& module, const char* name, const char* doc) {
  constexpr const char* meaning[] = {
      "True if the measurement was none: not finite, a leap, a clock that stood.",
      "True if none came for longer than stale_after: the force falls to zero.",
      "True if a largest force or moment held it back.",
      "True if a fastest change held it back.",
      "True if the energy that the hand had put in did not allow it.",
      "True if the cycle was longer or the device faster than the energy controller counts on."};
  nb::class_<Given> bound(module, name, doc);
  bound.def_ro("energy", &Given::energy, "[J] that the hand has put in so far, less what it took out")
      .def_ro("reserve", &Given::reserve, "[J] that it may still take out")
      .def_ro("sample", &Given::sample, "of the engine, in the tissue's newtons and metres");
  for (std::size_t i = 0; i < std::size(interventions); ++i)
    bound.def_prop_ro(
        intervention_names[i], [i](const Given& self) { return self.did.*interventions[i]; }, meaning[i]);
  return bound;
}

void bind_outputs(nb::module_& module) {
  using needleforce::Output;
  bind_output<Output>(module, "GuardOutput",
                      "A cycle of a guard: the force for the device [N], and what it did.")
      .def_ro("force", &Output::force, "[N] for the device, + opposes insertion");
  bind_output<BaseOutput>(module, "BaseGuardOutput",
                          "A cycle of a guard of a needle that bends: what the device gives along each "
                          "coordinate of the base, + where it opposes that coordinate, and what it did.")
      .def_prop_ro(
          "force", [](const BaseOutput& self) { return self.force.depth; },
          "[N] along the needle, + opposes insertion")
      .def_prop_ro(
          "lateral_force", [](const BaseOutput& self) { return self.force.lateral; },
          "(x, y) [N] across, along the axes of the tissue")
      .def_prop_ro(
          "tilt_moment", [](const BaseOutput& self) { return self.force.tilt; }, "(x, y) [N m] by the slopes")
      .def_prop_ro(
          "roll_moment", [](const BaseOutput& self) { return self.force.roll; }, "[N m] about the needle");
}

/// What both kinds have.
template <class Bound>
void bind_rest(Bound& bound) {
  using Self = typename Bound::Type;
  bound
      .def(
          "reset", [](Self& self) { self.alone().reset(); },
          "Back to before the first contact, the engine too; the record stays.")
      .def(
          "columns", [](const Self& self) { return columns_of(self); },
          "The last cycles as columns of float64, oldest first.")
      .def_prop_ro("settings", [](const Self& self) { return self.guard.settings(); }, "As given.");
}

void bind_depth_guard(nb::module_& module) {
  nb::class_<DepthGuard> bound(module, "Guard",
                               "Limits between an engine and a device, and the last 4096 cycles.");
  takes<Insertion>(bound);
  takes<Live>(bound);
  takes<solid::CondensedInsertion>(bound);
  bound
      .def(
          "step",
          [](DepthGuard& self, double depth, std::optional<double> velocity, double dt) {
            return self.step({depth, velocity.value_or(no_velocity)}, {depth, velocity.value_or(none)}, dt);
          },
          nb::arg("depth"), nb::arg("velocity").none(), nb::arg("dt"),
          "A cycle with a measurement of the device: depth [m], velocity [m/s] or None, dt [s] since the "
          "last cycle. Never raises.")
      .def(
          "miss", [](DepthGuard& self, double dt) { return self.miss({none, none}, dt); }, nb::arg("dt"),
          "A cycle in which no measurement came. Never raises.");
  bind_rest(bound);
}

void bind_base_guard(nb::module_& module) {
  nb::class_<BaseGuard> bound(module, "BaseGuard",
                              "Limits between a needle that bends and a device, and the last 4096 cycles.");
  takes<bending::PlanarInsertion>(bound);
  takes<bending::SpatialInsertion>(bound);
  takes<solid::BentInSolid<1>>(bound);
  takes<solid::BentInSolid<2>>(bound);
  using Pair = std::array<double, 2>;
  bound
      .def(
          "step",
          [](BaseGuard& self, double depth, const Pair& lateral, const Pair& tilt, double roll, double dt) {
            const bending::Base base{depth, lateral, tilt, roll};
            return self.step(base, base, dt);
          },
          nb::arg("depth"), nb::arg("lateral"), nb::arg("tilt"), nb::arg("roll"), nb::arg("dt"))
      .def(
          "miss",
          [](BaseGuard& self, double dt) { return self.miss({none, {none, none}, {none, none}, none}, dt); },
          nb::arg("dt"), "A cycle in which no measurement came. Never raises.");
  bind_rest(bound);
}

}  // namespace

void bind_guard(nb::module_& module) {
  module.attr("interventions") = nb::tuple(
      nb::cast(std::vector<std::string>(std::begin(intervention_names), std::end(intervention_names))));
  bind_parameters<GuardSettings>(module, "GuardSettings");
  bind_outputs(module);
  bind_depth_guard(module);
  bind_base_guard(module);
}

}  // namespace needleforce::python
