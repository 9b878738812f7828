// SPDX-License-Identifier: Apache-2.0
#include "needleforce_events.h"

#include <cstring>
#include <new>
#include <span>
#include <type_traits>

#include "by_name.hpp"
#include "needleforce/events/event_detector.hpp"

using namespace needleforce;
using events::EventDetector;

struct nf_events {
  EventDetector watch;
};

static_assert(NF_EXIT == int(events::EventKind::exit) && events::event_kind_names.size() == NF_EXIT + 1);
static_assert(NF_STREAM_WRONG_SIGN == int(events::StreamStatus::wrong_sign) &&
              events::stream_status_names.size() == NF_STREAM_WRONG_SIGN + 1);
static_assert(std::is_standard_layout_v<nf_event> && std::is_trivially_copyable_v<nf_event>);

extern "C" {

const char* nf_event_name(int kind) {
  return kind >= 0 && kind <= NF_EXIT ? events::event_kind_names[std::size_t(kind)] : "unknown";
}
const char* nf_stream_status_name(int status) {
  const bool known = status >= 0 && status <= NF_STREAM_WRONG_SIGN;
  return known ? events::stream_status_names[std::size_t(status)] : "unknown";
}

size_t nf_events_size(void) { return sizeof(nf_events); }

nf_events* nf_events_init(void* memory, size_t size, const nf_parameter* parameters, size_t count,
                          nf_fault* why) {
  nf_fault ignored{};
  nf_fault& fault = why ? *why : ignored;
  fault = nf_fault{};
  events::EventSettings settings;
  if (!c::holds<nf_events>(memory, size, fault)) return nullptr;
  if (!parameters && count && !c::refuse(fault, "events", "settings", "are missing")) return nullptr;
  if (!c::fill(settings, std::span(parameters, count), fault)) return nullptr;
  return new (memory) nf_events{EventDetector(settings)};
}

int nf_events_step(nf_events* self, double force, double depth, double dt, nf_event* out) {
  const events::Detection found = self->watch.step(force, depth, dt);
  *out = {found.time, found.depth, found.size, found.probability, found.delay, int(found.kind)};
  return out->kind;
}
int nf_events_status(const nf_events* self) { return int(self->watch.status()); }
double nf_events_noise(const nf_events* self) { return self->watch.noise(); }
double nf_events_needed_fall(const nf_events* self) { return self->watch.needed_fall(); }
void nf_events_reset(nf_events* self) { self->watch.reset(); }

size_t nf_events_snapshot_size(void) { return sizeof(EventDetector::Saved); }

int nf_events_snapshot(const nf_events* self, void* bytes, size_t size) {
  if (!bytes || size < sizeof(EventDetector::Saved)) return 0;
  const EventDetector::Saved saved = self->watch.save();
  std::memcpy(bytes, &saved, sizeof saved);
  return 1;
}
int nf_events_restore(nf_events* self, const void* bytes, size_t size) {
  if (!bytes || size < sizeof(EventDetector::Saved)) return 0;
  EventDetector::Saved saved;
  std::memcpy(&saved, bytes, sizeof saved);
  return self->watch.restore(saved);
}

}  // extern "C"
