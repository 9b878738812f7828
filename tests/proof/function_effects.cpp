// SPDX-License-Identifier: Apache-2.0
// What is called in the loop, declared nonblocking: the compiler follows every call and fails on one that may
// allocate, lock, throw or call what it cannot see. Functions of the mathematics library it knows by name.
#include "../../bindings/c/needleforce.cpp"
#include "../../bindings/c/needleforce_bend.cpp"
#include "../../bindings/c/needleforce_events.cpp"
#include "../../bindings/c/needleforce_guard.cpp"
#include "../../bindings/c/needleforce_online.cpp"
#include "../../bindings/c/needleforce_solid.cpp"
#include "needleforce/base_guard.hpp"
#include "needleforce/bending/flexible_insertion.hpp"
#include "needleforce/bending/tip_estimator.hpp"
#include "needleforce/events/event_detector.hpp"
#include "needleforce/flight_recorder.hpp"
#include "needleforce/gradient/gradient_insertion.hpp"
#include "needleforce/guard.hpp"
#include "needleforce/live.hpp"
#include "needleforce/online/online_identifier.hpp"
#include "needleforce/solid/bent_in_solid.hpp"

namespace {

using needleforce::Insertion;
using needleforce::Sample;

[[maybe_unused]] Sample step(Insertion& insertion, double depth, double velocity, double dt) noexcept
    [[clang::nonblocking]] {
  return insertion.step(depth, velocity, dt);
}
[[maybe_unused]] auto step(needleforce::GradientInsertion<4>& insertion, double depth) noexcept
    [[clang::nonblocking]] {
  return insertion.step(depth, needleforce::no_velocity, 1e-3);
}
[[maybe_unused]] void reset(Insertion& insertion) noexcept [[clang::nonblocking]] { insertion.reset(); }
[[maybe_unused]] Insertion snapshot(const Insertion& insertion) noexcept [[clang::nonblocking]] {
  return insertion.snapshot();
}
[[maybe_unused]] Insertion::Saved save(const Insertion& insertion) noexcept [[clang::nonblocking]] {
  return insertion.save();
}
[[maybe_unused]] bool restore(Insertion& insertion, const Insertion::Saved& saved) noexcept
    [[clang::nonblocking]] {
  return insertion.restore(saved);
}

[[maybe_unused]] void c_face(nf_insertion* insertion, nf_sample* sample, void* bytes, size_t size) noexcept
    [[clang::nonblocking]] {
  nf_step(insertion, 0.0, 0.0, 1e-3, sample);
  nf_reset(insertion);
  nf_snapshot(insertion, bytes, size);
  nf_restore(insertion, bytes, size);
}

[[maybe_unused]] void c_guard(nf_guard* guard, nf_output* output) noexcept [[clang::nonblocking]] {
  nf_guard_step(guard, 0.0, 0.0, 1e-3, output);
  nf_guard_miss(guard, 1e-3, output);
  nf_guard_reset(guard);
}

[[maybe_unused]] void c_base_guard(nf_base_guard* guard, const nf_base* base, nf_base_output* output) noexcept
    [[clang::nonblocking]] {
  nf_base_guard_step(guard, base, 1e-3, output);
  nf_base_guard_miss(guard, 1e-3, output);
  nf_base_guard_reset(guard);
}

[[maybe_unused]] size_t c_bend(nf_bend* needle, const nf_base* base, nf_bent* sample, double* points,
                               void* bytes, size_t size) noexcept [[clang::nonblocking]] {
  nf_bend_step(needle, base, 1e-3, sample);
  nf_bend_reset(needle);
  nf_bend_snapshot(needle, bytes, size);
  nf_bend_restore(needle, bytes, size);
  return nf_bend_shape(needle, points, 10);
}

[[maybe_unused]] void guarded(needleforce::Guard<Insertion>& guard,
                              needleforce::FlightRecorder<64>& recorder) noexcept [[clang::nonblocking]] {
  recorder.write(0.0, 0.0, 1e-3, guard.step(0.0, 0.0, 1e-3));
  guard.miss(1e-3);
  guard.reset();
}

[[maybe_unused]] double base_guarded(
    needleforce::Guard<needleforce::bending::SpatialInsertion>& guard,
    needleforce::FlightRecorder<8, needleforce::BaseCycle>& recorder) noexcept [[clang::nonblocking]] {
  recorder.write({}, 1e-3, guard.step({}, 1e-3));
  const double force = guard.miss(1e-3).force.lateral[0];
  guard.reset();
  return force;
}

// a needle that bends
template <class Needle>
double bend(Needle& needle) noexcept [[clang::nonblocking]] {
  const Needle copy = needle.snapshot();
  double sum = needle.step({}, 1e-3).force;
  copy.shape([&](const needleforce::bending::Vector& point) noexcept { sum += point[0]; });
  const auto saved = needle.save();
  needle.reset();
  return needle.restore(saved) ? sum : 0.0;
}
[[maybe_unused]] double bend_all(needleforce::bending::PlanarInsertion& plane,
                                 needleforce::bending::SpatialInsertion& space,
                                 needleforce::solid::BentInSolid<2>& in_solid) noexcept
    [[clang::nonblocking]] {
  return bend(plane) + bend(space) + bend(in_solid);
}

[[maybe_unused]] double c_solid(nf_solid* solid, nf_sample* sample, double* values, void* bytes,
                                size_t size) noexcept [[clang::nonblocking]] {
  nf_solid_step(solid, 0.0, 0.0, 1e-3, sample);
  nf_solid_forces(solid, values, 10);
  nf_solid_displacements(solid, values, 10);
  nf_solid_reset(solid);
  nf_solid_snapshot(solid, bytes, size);
  nf_solid_restore(solid, bytes, size);
  return nf_solid_tip(solid);
}

// a needle in a condensed solid
[[maybe_unused]] double in_solid(needleforce::solid::CondensedInsertion& insertion) noexcept
    [[clang::nonblocking]] {
  const auto saved = insertion.save();
  const double sum =
      insertion.step(0.0, 0.0, 1e-3).force + insertion.displacement(0) + insertion.shaft_force(0);
  insertion.reset();
  return insertion.restore(saved) ? sum : 0.0;
}

[[maybe_unused]] double estimated(needleforce::bending::TipEstimator& estimator) noexcept
    [[clang::nonblocking]] {
  double sum = estimator.step({}, 1e-3).tip[0];
  const std::array<double, 2> slopes{};
  sum += estimator.tip({0.0, 0.0}, 1e-2, &slopes) + estimator.wrench({}) + estimator.estimate().tip[0];
  estimator.shape([&](const needleforce::bending::Vector& point) noexcept { sum += point[0]; });
  estimator.reset();
  return sum;
}

// what looks for events
[[maybe_unused]] double watched(needleforce::events::EventDetector& watch) noexcept [[clang::nonblocking]] {
  const auto copy = watch.snapshot();
  const double probability = watch.step(0.0, 0.0, 1e-3).probability;
  if (watch.status() != needleforce::events::StreamStatus::ok) watch.reset();
  const auto saved = watch.save();
  return watch.restore(saved) ? probability + copy.noise() + copy.needed_fall() + copy.resistance() : 0.0;
}
[[maybe_unused]] double c_events(nf_events* watch, nf_event* event, void* bytes, size_t size) noexcept
    [[clang::nonblocking]] {
  nf_events_step(watch, 0.0, 0.0, 1e-3, event);
  if (nf_events_status(watch) == NF_STREAM_OK) nf_events_reset(watch);
  nf_events_snapshot(watch, bytes, size);
  nf_events_restore(watch, bytes, size);
  return nf_events_noise(watch) + nf_events_needed_fall(watch);
}

// what learns while a needle moves
[[maybe_unused]] double learn(needleforce::online::OnlineIdentifier& online) noexcept [[clang::nonblocking]] {
  const auto copy = online.snapshot();
  online.step(0.0, 0.0, 1e-3);
  if (online.changes() > 1000) online.reset();
  if (!online.restore(online.save())) return 0.0;
  return copy.ahead(1e-3).puncture_probability + online.layer(0).modulus.value + online.surface().value;
}

[[maybe_unused]] double c_online(nf_online* online, nf_event* event, void* bytes, size_t size) noexcept
    [[clang::nonblocking]] {
  nf_layer_learnt layer;
  nf_learnt surface;
  nf_ahead ahead;
  nf_online_step(online, 0.0, 0.0, 1e-3, event);
  if (nf_online_status(online) + nf_online_regime(online) == 0) nf_online_reset(online);
  nf_online_layer(online, nf_online_pierced(online), &layer);
  nf_online_surface(online, &surface);
  nf_online_ahead(online, 1e-3, &ahead);
  nf_online_snapshot(online, bytes, size);
  nf_online_restore(online, bytes, size);
  return nf_online_innovation(online) + layer.top + surface.value + ahead.earliest;
}

// what the loop calls while another thread replaces the model
[[maybe_unused]] Sample live(needleforce::LiveInsertion& live) noexcept [[clang::nonblocking]] {
  const bool blends = live.blending() || live.last_refused();
  if (blends && live.taken() + live.refused() > 1000) live.reset();
  return live.step(0.0, 0.0, 1e-3);
}

}  // namespace
