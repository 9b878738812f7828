// SPDX-License-Identifier: Apache-2.0
#include "module.hpp"
#include "needleforce/events/event_detector.hpp"
#include "one_thread.hpp"
#include "parameters.hpp"
#include "saved_bytes.hpp"

namespace needleforce::python {

namespace {

using events::Detection;
using events::EventDetector;
using events::EventKind;
using events::EventSettings;

const char* kind_of(const Detection& found) {
  return events::event_kind_names[static_cast<std::size_t>(found.kind)];
}
std::string described_event(const Detection& found) {
  return std::string("Detection(kind='") + kind_of(found) + "', time=" + number(found.time) +
         ", depth=" + number(found.depth) + ", size=" + number(found.size) +
         ", probability=" + number(found.probability) + ", delay=" + number(found.delay) + ")";
}

std::optional<Detection> step(EventDetector& self, double force, double depth, double dt) {
  const Detection found = self.step(force, depth, dt);
  if (found.kind == EventKind::none) return std::nullopt;
  return found;
}

}  // namespace

void bind_events(nb::module_& module) {
  bind_parameters<EventSettings>(module, "EventSettings");
  nb::class_<Detection>(module, "Detection", "An event found while it happens.")
      .def_prop_ro("kind", &kind_of, "contact, puncture, sliding, stop, reversal or exit")
      .def_ro("time", &Detection::time, "of the event [s]: of a puncture, of the peak before its fall")
      .def_ro("depth", &Detection::depth, "there [m]")
      .def_ro("size", &Detection::size,
              "fall or rise of the force so far [N]; of a reversal, the way back [m]")
      .def_ro("probability", &Detection::probability,
              "that it is real; 0.5 at most where the stream allows another cause")
      .def_ro("delay", &Detection::delay, "from the event to the sample at which it was found [s]")
      .def("__repr__", &described_event);
  EngineClass<EventDetector>(module, "EventDetector", "Events found while a needle moves.")
      .def(
          "__init__",
          [](EventDetector* self, const nb::args& args, const nb::kwargs& kwargs) {
            EventSettings settings{};
            fill(settings, args, kwargs);
            new (self) EventDetector(settings);
          },
          nb::sig(signature<EventSettings>().c_str()))
      .def("step", &step, nb::arg("force"), nb::arg("depth"), nb::arg("dt"),
           "One sample: force [N], depth [m], time since the one before [s].")
      .def("reset", &EventDetector::reset)
      .def("copy", &EventDetector::snapshot, "Another one that has seen the same.")
      .def("save", &saved_bytes<EventDetector>, "What it has seen, as bytes that any process may keep.")
      .def(
          "restore",
          [](EventDetector& self, const nb::bytes& bytes) {
            restore_bytes(self, bytes, "not of this version and these settings, or altered",
                          "Give what save() of a detector with the same settings gave.");
          },
          nb::arg("snapshot"),
          "What another one has seen, from bytes of save(); raises InputError for those of another version "
          "or "
          "other settings, or altered ones.")
      .def_prop_ro(
          "status",
          [](const EventDetector& self) {
            return events::stream_status_names[static_cast<std::size_t>(self.status())];
          },
          "what the last sample was worth")
      .def_prop_ro("settings", &EventDetector::settings)
      .def_prop_ro("noise", &EventDetector::noise, "standard deviation of a reading now [N]")
      .def_prop_ro("zero", &EventDetector::zero, "what the sensor reads without a force [N]")
      .def_prop_ro("needed_fall", &EventDetector::needed_fall, "fall that would be a puncture now [N]")
      .def_prop_ro("resistance", &EventDetector::resistance,
                   "share of its recent force that the needle still meets: 1, less where the force falls");
}

}  // namespace needleforce::python
