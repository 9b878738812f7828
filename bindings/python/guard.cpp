// SPDX-License-Identifier: Apache-2.0
#include "needleforce/guard.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "live.hpp"
#include "module.hpp"
#include "needleforce/flight_recorder.hpp"
#include "needleforce/insertion.hpp"
#include "one_thread.hpp"
#include "parameters.hpp"

namespace needleforce::python {

namespace {

/// An engine that Python owns, whatever its type.
struct AnyEngine {
  void* engine;
  Sample (*stepped)(void*, double, double, double) noexcept;
  void (*back)(void*) noexcept;
  Sample step(double depth, double velocity, double dt) noexcept {
    return stepped(engine, depth, velocity, dt);
  }
  void reset() noexcept { back(engine); }
};

template <class Engine>
AnyEngine any(Engine& engine) {
  return {&engine,
          [](void* self, double depth, double velocity, double dt) noexcept {
            return static_cast<Engine*>(self)->step(depth, velocity, dt);
          },
          [](void* self) noexcept { static_cast<Engine*>(self)->reset(); }};
}

constexpr double none = std::numeric_limits<double>::quiet_NaN();

/// What a guard in Python is: it always records.
struct Recorded {
  Guard<AnyEngine> guard;
  FlightRecorder<4096> recorder{};

  /// The guard, unless its engine runs in another thread.
  Guard<AnyEngine>& alone() {
    Running::refuse(guard.engine().engine);
    return guard;
  }

  needleforce::Output keep(double depth, double velocity, double dt,
                           const needleforce::Output& output) noexcept {
    recorder.write(depth, velocity, dt, output);
    return output;
  }
};

/// A column of the record as an array of doubles.
template <class Value>
python::Output column_of(std::span<const Cycle> cycles, Value value) {
  double* data;
  python::Output array = new_array(cycles.size(), data);
  for (const Cycle& cycle : cycles) *data++ = static_cast<double>(value(cycle));
  return array;
}

nb::dict columns_of(const Recorded& self) {
  std::vector<Cycle> room(self.recorder.capacity());
  const std::span<const Cycle> cycles = self.recorder.read(room);
  constexpr std::pair<const char*, double Cycle::*> numbers[] = {{"dt", &Cycle::dt},
                                                                 {"depth", &Cycle::depth},
                                                                 {"velocity", &Cycle::velocity},
                                                                 {"force", &Cycle::force},
                                                                 {"energy", &Cycle::energy},
                                                                 {"reserve", &Cycle::reserve},
                                                                 {"sample_force", &Cycle::sample_force}};
  nb::dict columns;
  columns["number"] = column_of(cycles, [](const Cycle& cycle) { return cycle.number; });
  for (const auto& [name, member] : numbers)
    columns[name] = column_of(cycles, [member](const Cycle& cycle) { return cycle.*member; });
  columns["phase"] = column_of(cycles, [](const Cycle& cycle) { return static_cast<int>(cycle.phase); });
  columns["status"] = column_of(cycles, [](const Cycle& cycle) { return static_cast<int>(cycle.status); });
  for (std::size_t i = 0; i < std::size(interventions); ++i)
    columns[intervention_names[i]] =
        column_of(cycles, [i](const Cycle& cycle) { return cycle.did.*interventions[i]; });
  return columns;
}

/// Lets a guard be made around an engine of this type, which stays with its owner.
template <class Engine>
void takes(nb::class_<Recorded>& bound) {
  bound.def(
      "__init__",
      [](Recorded* self, Engine& engine, const GuardSettings& settings) {
        new (self) Recorded{Guard<AnyEngine>(any(engine), settings)};
      },
      nb::arg("engine"), nb::arg("settings"), nb::keep_alive<1, 2>());
}

void bind_output(nb::module_& module) {
  constexpr const char* meaning[] = {
      "True if the measurement was none: not finite, a leap, a clock that stood.",
      "True if none came for longer than stale_after: the force falls to zero.",
      "True if max_force held the force back.",
      "True if max_slew held it back.",
      "True if the energy that the hand had put in did not allow it.",
      "True if the cycle was longer or the device faster than the energy controller counts on."};
  nb::class_<needleforce::Output> bound(module, "GuardOutput",
                                        "A cycle of a guard: the force for the device [N], and what it did.");
  bound.def_ro("force", &needleforce::Output::force, "[N] for the device, + opposes insertion")
      .def_ro("energy", &needleforce::Output::energy,
              "[J] that the hand has put in so far, less what it took out")
      .def_ro("reserve", &needleforce::Output::reserve, "[J] that it may still take out")
      .def_ro("sample", &needleforce::Output::sample, "of the engine, in the tissue's newtons and metres");
  for (std::size_t i = 0; i < std::size(interventions); ++i)
    bound.def_prop_ro(
        intervention_names[i], [i](const needleforce::Output& self) { return self.did.*interventions[i]; },
        meaning[i]);
}

}  // namespace

void bind_guard(nb::module_& module) {
  module.attr("interventions") = nb::tuple(
      nb::cast(std::vector<std::string>(std::begin(intervention_names), std::end(intervention_names))));
  bind_parameters<GuardSettings>(module, "GuardSettings");
  bind_output(module);
  nb::class_<Recorded> bound(module, "Guard",
                             "Limits between an engine and a device, and the last 4096 cycles.");
  takes<Insertion>(bound);
  takes<Live>(bound);
  bound
      .def(
          "step",
          [](Recorded& self, double depth, std::optional<double> velocity, double dt) {
            const needleforce::Output output = self.alone().step(depth, velocity.value_or(no_velocity), dt);
            return self.keep(depth, velocity.value_or(none), dt, output);
          },
          nb::arg("depth"), nb::arg("velocity").none(), nb::arg("dt"),
          "A cycle with a measurement of the device: depth [m], velocity [m/s] or None, dt [s] since the "
          "last cycle. Never raises.")
      .def(
          "miss", [](Recorded& self, double dt) { return self.keep(none, none, dt, self.alone().miss(dt)); },
          nb::arg("dt"), "A cycle in which no measurement came. Never raises.")
      .def(
          "reset", [](Recorded& self) { self.alone().reset(); },
          "Back to before the first contact, the engine too; the record stays.")
      .def("columns", &columns_of, "The last cycles as columns of float64, oldest first.")
      .def_prop_ro("settings", [](const Recorded& self) { return self.guard.settings(); }, "As given.");
}

}  // namespace needleforce::python
