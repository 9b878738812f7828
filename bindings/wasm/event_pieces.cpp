// SPDX-License-Identifier: Apache-2.0
// The C face of what looks for events for JavaScript: its settings are given by name, before the loop.
#include <cstddef>

#include "../c/needleforce_events.h"
#include "pieces.hpp"

namespace {

nf_parameter parameters[16];  // more than there are, to be refused
nf_events* events;
nf_event event;
unsigned char* snapshot;

}  // namespace

// needleforce.mjs reads five doubles, then the kind
static_assert(offsetof(nf_event, kind) == 5 * sizeof(double));

extern "C" {

/// The settings follow, by give().
void EXPORT(open_events)() { pieces::open(parameters); }
/// 1, or 0 and a fault with the reason.
int EXPORT(make_events)() {
  void* memory = room(nf_events_size());
  snapshot = static_cast<unsigned char*>(room(nf_events_snapshot_size()));
  std::size_t count = 0;
  while (parameters[count].name) ++count;
  events = nf_events_init(memory, nf_events_size(), parameters, count, &pieces::fault);
  return events != nullptr;
}

const nf_event* EXPORT(event_at)() { return &event; }
int EXPORT(events_step)(double force, double depth, double dt) {
  return nf_events_step(events, force, depth, dt, &event);
}
int EXPORT(events_status)() { return nf_events_status(events); }
double EXPORT(events_noise)() { return nf_events_noise(events); }
double EXPORT(events_needed_fall)() { return nf_events_needed_fall(events); }
void EXPORT(events_reset)() { nf_events_reset(events); }
unsigned char* EXPORT(events_snapshot_at)() { return snapshot; }
std::size_t EXPORT(events_snapshot_size)() { return nf_events_snapshot_size(); }
void EXPORT(events_save)() { nf_events_snapshot(events, snapshot, nf_events_snapshot_size()); }
int EXPORT(events_restore)(std::size_t size) { return nf_events_restore(events, snapshot, size); }
const char* EXPORT(event_name)(int kind) { return nf_event_name(kind); }
const char* EXPORT(stream_status_name)(int status) { return nf_stream_status_name(status); }

}  // extern "C"
