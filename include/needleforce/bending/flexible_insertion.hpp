// SPDX-License-Identifier: Apache-2.0
// The insertion of a needle that bends: motion of the base in, tip, shape and base wrench out.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <type_traits>

#include "../insertion.hpp"
#include "../state_bytes.hpp"
#include "base_wrench.hpp"
#include "shape_in_tissue.hpp"

namespace needleforce::bending {

/// A needle that bends in layered tissue, in a plane (1) or in space (2), around an insertion that gives the
/// axial force: an `Insertion`, or a `solid::CondensedInsertion`. Trivially copyable: a snapshot is a copy.
/// For one thread at a time. docs/decisions/0023-bending.md
template <std::size_t dimension, class Axial = Insertion>
class FlexibleInsertion : private ShapeInTissue<dimension, Axial> {
  using Shape = ShapeInTissue<dimension, Axial>;
  using Shape::axial_;
  using Shape::coupled;
  using Shape::in_tissue;
  using Shape::settings_;
  using Shape::settle;
  using Shape::share_left;
  using Shape::shortens_;
  using Shape::state_;
  using typename Shape::Events;

 public:
  using Shape::mesh;
  using typename Shape::Place;

  /// Around an insertion that gives the axial force and, with a bevel, the lateral force on the tip; its
  /// limits hold for the motion across, too. With invalid values every step gives no force and
  /// `invalid_parameter`.
  FlexibleInsertion(const Axial& axial, const FlexibleSettings& settings) noexcept
      : Shape(axial, settings),
        valid_(axial.accepted() && !fault(settings)),
        yields_(valid_ && settings.beam.yields()),
        model_(number_of(axial, settings)) {}

  /// One cycle: the base is at `base`, `dt` [s] after the last call. Wait-free; the cost is bounded by
  /// `max_travel` over `path_spacing` solutions.
  BentSample step(const Base& base, double dt) noexcept {
    const Status status = check(base, dt);
    return status == Status::ok ? accept(base, dt) : refuse(status, dt);
  }

  /// Back to before the first contact. Wait-free.
  void reset() noexcept {
    axial_.reset();
    std::construct_at(&state_, settings_.lengths.path_spacing);  // in place: it is large for a stack
  }
  /// The whole object; assign it back to restore. Wait-free.
  FlexibleInsertion snapshot() const noexcept { return *this; }

  /// The memory without model and settings, as bytes that may leave the process: most of it the path.
  struct Saved {
    typename Axial::Saved axial;
    StateBytes<FlexibleState<dimension>> bending;
  };
  /// Wait-free.
  Saved save() const noexcept { return {axial_.save(), state_bytes(state_, model_)}; }
  /// Restores a memory; returns false and changes nothing for bytes of another version, model or settings,
  /// altered bytes, or a state that no needle can have. Wait-free.
  bool restore(const Saved& bytes) noexcept {
    if (restore_fault(bytes)) return false;
    axial_.restore(bytes.axial);
    state_ = bytes.bending.state();
    return true;
  }
  /// Why `restore` refuses a memory, as the part of it that is at fault, or nullptr. Wait-free.
  const char* restore_fault(const Saved& bytes) const noexcept {
    if (!valid_) return "model of this insertion";
    if (const char* part = foreign_part(bytes.bending, model_)) return part;
    StateCheck check;
    bending::check(check, bytes.bending.state(), settings_);
    return check.fault() ? check.fault() : axial_.restore_fault(bytes.axial);
  }

  /// Calls `visit` with the points of the needle from the base to the tip [m], none before the first step.
  /// Wait-free.
  template <class Visit>
  void shape(Visit visit) const noexcept {
    follow(mesh(), base_depth(), settings_.beam.support.needle_length, visit);
  }
  /// Number of points of the shape. Wait-free.
  std::size_t shape_points() const noexcept { return curve_points(mesh()); }
  /// The path that the tip has cut.
  const TissuePath<dimension>& path() const noexcept { return state_.path; }
  const FlexibleSettings& settings() const noexcept { return settings_; }
  /// True where bending shortens the needle and its axial laws feel that. Wait-free.
  bool shortens() const noexcept { return shortens_; }

 private:
  static std::uint64_t number_of(const Axial& axial, const FlexibleSettings& settings) noexcept {
    if (!axial.accepted() || fault(settings)) return 0;
    Fingerprint print;
    print.add(axial.model_fingerprint());
    print.add(fingerprint(settings));
    print.add(std::uint64_t{dimension});
    return print.value();
  }

  Status check(const Base& base, double dt) const noexcept {
    if (!valid_) return Status::invalid_parameter;
    double sum = base.roll;
    for (std::size_t d = 0; d < 2; ++d) sum += base.lateral[d] + base.tilt[d];
    if (!std::isfinite(sum)) return Status::not_finite;
    if (!ordinary(base.depth, no_velocity, dt)) return refusal(base.depth, 0.0, dt);
    return in_range(base) && (!state_.started || can_move(base, state_.waited + dt)) ? Status::ok
                                                                                     : Status::outside_range;
  }
  bool in_range(const Base& base) const noexcept {
    const Support& support = settings_.beam.support;
    for (std::size_t d = 0; d < 2; ++d) {
      if (std::abs(base.lateral[d]) > farthest || std::abs(base.tilt[d]) > 1.0) return false;
      if (d >= dimension && (base.lateral[d] != 0.0 || base.tilt[d] != 0.0)) return false;
    }
    return support.reaches(base.depth) && base.depth <= std::min(state_.path.longest(), axial_.reach()) &&
           support.free_length(base.depth) + std::min(0.0, base.depth) >= 0.0;
  }
  bool can_move(const Base& base, double elapsed) const noexcept {
    const double travel = base.depth - state_.base.depth;
    bool possible = std::abs(travel) <= settings_.lengths.max_travel &&
                    std::abs(base.roll - state_.base.roll) <= std::numbers::pi * (1.0 + 1e-9) &&
                    consistent(axial_.limits(), travel, no_velocity, elapsed);
    const double above = settings_.beam.support.free_length(base.depth);
    for (std::size_t d = 0; d < dimension; ++d)
      possible &= std::abs(base.lateral[d] - state_.base.lateral[d]) <= settings_.lengths.max_travel &&
                  above * std::abs(base.tilt[d] - state_.base.tilt[d]) <= settings_.lengths.max_travel &&
                  consistent(axial_.limits(), base.lateral[d] - state_.base.lateral[d], no_velocity, elapsed);
    return possible;
  }

  /// The last force for a bounded time, then none; the needle stays where it was.
  BentSample refuse(Status status, double dt) noexcept {
    const bool waits = dt > 0.0 && std::isfinite(dt);
    if (waits) state_.waited = std::min(state_.waited + dt, longest);
    BentSample sample = state_.last;
    if (!(valid_ && waits && state_.waited <= axial_.limits().hold_time)) {
      sample.force = sample.lateral = 0.0;
      sample.wrench = {};
      sample.axial = Sample{};
    }
    sample.axial.contact = sample.axial.punctured = sample.axial.exit = false;
    sample.status = status;
    sample.moved = false;
    return sample;
  }

  BentSample accept(const Base& base, double dt) noexcept {
    const double elapsed = state_.waited + dt;
    state_.waited = 0.0;
    Events events{};
    state_.started ? advance(base, elapsed, events) : start(base, elapsed, events);
    state_.base = base;
    state_.last = sample(events);
    if (!finite(state_.last)) lose();
    return state_.last;
  }
  /// A state from outside can hold what no needle meets: once its numbers are beyond all bounds, it is gone.
  void lose() noexcept {
    reset();
    state_.last.status = Status::not_finite;
  }

  /// The first step: a needle that is in the tissue already is straight, in its own hole.
  void start(const Base& base, double dt, Events& events) noexcept {
    state_.started = true;
    state_.base = base;
    state_.reached = base.depth;
    const auto memory = axial_.state();
    axial_.step(base.depth, no_velocity, dt);  // what a first step there has pierced
    if (axial_.pierced_layers() > 0 && base.depth > 0.0) {
      const double above = settings_.beam.support.free_length(base.depth);
      state_.embedded = true;
      while (state_.path.empty() || state_.path.next_node() <= base.depth)
        state_.path.write(state_.path.next_node(), straight(base, above + state_.path.next_node()),
                          straight(base, 1.0, 0.0));
      state_.path.write(base.depth, straight(base, above + base.depth));
      state_.ahead = state_.path.front_place();
    }
    axial_.return_to(memory);
    settle(base, dt, events);
  }
  static Place straight(const Base& base, double distance, double aside = 1.0) noexcept {
    Place place;
    for (std::size_t d = 0; d < dimension; ++d) place[d] = aside * base.lateral[d] + base.tilt[d] * distance;
    return place;
  }

  /// Moves to each node of the path that the tip cuts on its way, and where tissue yields to each tenth of a
  /// millimetre across, then to the end: what the tissue remembers does not depend on the length of the
  /// steps.
  void advance(const Base& base, double dt, Events& events) noexcept {
    const Base from = state_.base;
    const double travel = base.depth - from.depth;
    const double across = yields_ || coupled() ? across_of(from, base) : 0.0;
    const double stride = (yields_ ? 1.0 : 10.0) * state_.path.spacing;
    double done = 0.0;
    while (done < 1.0) {
      const double next = travel > 0.0 ? next_depth() : base.depth;
      const bool last_node = !(next < base.depth - 1e-9 * state_.path.spacing);
      const double by_node = last_node ? 1.0 : (next - from.depth) / travel;
      const double left = std::max(0.0, stride - state_.moved_across);
      const double by_motion = across * (1.0 - done) > left ? done + left / across : 1.0;
      const bool aside = by_motion < by_node;
      const double share = aside ? by_motion : by_node;
      const double depth = aside ? from.depth + share * travel : next;
      state_.moved_across += (share - done) * across;
      const bool on_node = travel > 0.0 && next < base.depth + 1e-9 * state_.path.spacing;
      const bool remembers = on_node || state_.moved_across >= (1.0 - 1e-9) * stride;
      if (remembers) state_.moved_across = 0.0;
      move(share == 1.0 ? base : between(from, base, share, depth), dt * (share - done), events, remembers);
      done = share;
    }
  }
  /// Motion of the base across [m], at the surface.
  double across_of(const Base& from, const Base& to) const noexcept {
    const double above = settings_.beam.support.free_length(to.depth);
    double square = 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      const double moved = to.lateral[d] - from.lateral[d] + above * (to.tilt[d] - from.tilt[d]);
      square += moved * moved;
    }
    return std::sqrt(square);
  }
  /// At which depth the path takes its next node, or the tip comes to the surface [m].
  double next_depth() const noexcept {
    const double lag = state_.base.depth - state_.reached;
    if (state_.reached < 0.0) return lag;
    const double front = state_.embedded ? std::max(state_.path.front(), state_.reached) : state_.reached;
    const double spacing = state_.path.spacing;
    return lag + spacing * (std::floor(front / spacing + state_.path.close) + 1.0);
  }
  void move(const Base& to, double dt, Events& events, bool remembers) noexcept {
    settle(to, dt, events);
    if (remembers && yields_ && in_tissue()) push_aside(settings_.beam, mesh(), state_.path);
    state_.base = to;
  }
  double base_depth() const noexcept { return -settings_.beam.support.free_length(state_.base.depth); }

  BentSample sample(const Events& events) const noexcept {
    BentSample result;
    result.axial = state_.sample;
    result.axial.contact = events.contact;
    result.axial.punctured = events.punctured;
    result.axial.exit = events.exit;
    result.force = state_.force;
    result.unsupported = -mesh().base().travel;
    result.buckled = state_.buckled;
    result.moved = true;
    const double left = share_left(state_.reached);
    for (std::size_t d = 0; d < dimension; ++d) {
      const double push = left * state_.push[d] + state_.wedged[d] * state_.sample.cutting;
      result.lateral += push * push;
    }
    result.lateral = std::sqrt(result.lateral);
    result.status = state_.sample.status;
    if (result.status == Status::ok && (state_.buckled || !events.converged || too_steep()))
      result.status = Status::outside_range;
    place_tip(result);
    add_wrench(result);
    return result;
  }
  bool too_steep() const noexcept {
    double largest = 0.0;
    for (const auto& node : mesh().nodes())
      for (std::size_t d = 0; d < dimension; ++d)
        largest = std::max(largest, std::abs(node.slope[d] - mesh().base().slope[d]));
    return largest > settings_.lengths.max_slope;
  }
  /// The second component of a value, 0 in a plane.
  static double second(const Place& value) noexcept {
    if constexpr (dimension > 1)
      return value[1];
    else
      return 0.0;
  }
  void place_tip(BentSample& result) const noexcept {
    if (settings_.small_slopes) {
      const auto& tip = mesh().tip();
      result.tip = {tip.place[0], second(tip.place), state_.reached};
      result.tangent = {tip.slope[0], second(tip.slope), 1.0};
    } else {
      Development<dimension> end =
          follow(mesh(), base_depth(), settings_.beam.support.needle_length, [](const Vector&) noexcept {});
      result.tip = end.position();
      result.tangent = end.tangent(mesh().tip().slope);
    }
  }
  /// On the base as it is held, whatever its compliance. A round straight needle has no moment about its
  /// axis.
  void add_wrench(BentSample& result) const noexcept {
    const bool holds = !state_.buckled;
    const Place force = holds ? state_.beam.force() : Place{},
                moment = holds ? state_.beam.moment() : Place{};
    const BaseAxes axes(state_.base.tilt);
    const Vector f = axes.force({force[0], second(force), -state_.along});
    const Vector m = axes.moment({moment[0], second(moment)}, holds ? state_.beam.turning() : 0.0);
    result.wrench = {f[0], f[1], f[2], m[0], m[1], m[2]};
  }

  bool valid_, yields_;
  std::uint64_t model_;  // the fingerprint of model and settings
};

using PlanarInsertion = FlexibleInsertion<1>;
using SpatialInsertion = FlexibleInsertion<2>;

static_assert(std::is_trivially_copyable_v<PlanarInsertion>);
static_assert(std::is_trivially_copyable_v<SpatialInsertion>);

}  // namespace needleforce::bending
