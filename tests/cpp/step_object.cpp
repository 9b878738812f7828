// SPDX-License-Identifier: Apache-2.0
// What a controller calls in its loop; the undefined symbols are checked against an allow-list.
#include "needleforce/bending/flexible_insertion.hpp"
#include "needleforce/events/event_detector.hpp"
#include "needleforce/online/online_identifier.hpp"
#include "needleforce/solid/condensed_insertion.hpp"

using needleforce::Insertion;
using needleforce::bending::Base;
using needleforce::bending::SpatialInsertion;
using needleforce::events::EventDetector;
using needleforce::online::OnlineIdentifier;
using needleforce::solid::CondensedInsertion;

extern "C" {

double needleforce_one_step(Insertion* insertion, double depth, double velocity, double dt) {
  return insertion->step(depth, velocity, dt).force;
}
void needleforce_reset(Insertion* insertion) { insertion->reset(); }
void needleforce_snapshot(const Insertion* insertion, Insertion* copy) { *copy = insertion->snapshot(); }
void needleforce_save(const Insertion* insertion, Insertion::Saved* saved) { *saved = insertion->save(); }
bool needleforce_restore(Insertion* insertion, const Insertion::Saved* saved) {
  return insertion->restore(*saved);
}

double needleforce_bend(SpatialInsertion* needle, const Base* base, double dt) {
  return needle->step(*base, dt).force;
}

double needleforce_solid(CondensedInsertion* insertion, double depth, double velocity, double dt) {
  return insertion->step(depth, velocity, dt).force;
}

double needleforce_watch(EventDetector* watch, double force, double depth, double dt) {
  return watch->step(force, depth, dt).probability;
}

double needleforce_learn(OnlineIdentifier* online, double force, double depth, double dt) {
  return online->step(force, depth, dt).probability + online->layer(0).modulus.value;
}
double needleforce_ahead(const OnlineIdentifier* online, double travel) {
  return online->ahead(travel).at[10].high;
}

}  // extern "C"
