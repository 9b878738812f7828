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
#include "flexible_state.hpp"

namespace needleforce::bending {

/// A needle that bends in layered tissue, in a plane (1) or in space (2), around an insertion that gives the
/// axial force: an `Insertion`, or a `solid::CondensedInsertion`. Trivially copyable: a snapshot is a copy.
/// For one thread at a time. docs/decisions/0023-bending.md
template <std::size_t dimension, class Axial = Insertion>
class FlexibleInsertion {
 public:
  using Place = std::array<double, dimension>;

  /// Around an insertion that gives the axial force and, with a bevel, the lateral force on the tip; its
  /// limits hold for the motion across, too. With invalid values every step gives no force and
  /// `invalid_parameter`.
  FlexibleInsertion(const Axial& axial, const FlexibleSettings& settings) noexcept
      : axial_(axial),
        settings_(settings),
        valid_(axial.accepted() && !fault(settings)),
        yields_(valid_ && settings.beam.yields()),
        model_(number_of(axial, settings)),
        state_(settings.lengths.path_spacing) {}

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
    follow(mesh(), visit);
  }
  /// Number of points of the shape. Wait-free.
  std::size_t shape_points() const noexcept { return curve_points(mesh()); }
  /// The path that the tip has cut.
  const TissuePath<dimension>& path() const noexcept { return state_.path; }
  const BeamMesh<dimension>& mesh() const noexcept { return state_.beam.mesh(); }
  const FlexibleSettings& settings() const noexcept { return settings_; }

 private:
  struct Events {
    bool contact = false, punctured = false, exit = false, converged = true;
  };

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
    return state_.last;
  }

  /// The first step: a needle that is in the tissue already is straight, in its own hole.
  void start(const Base& base, double dt, Events& events) noexcept {
    state_.started = true;
    state_.base = base;
    press(base, dt, events);
    if (axial_.pierced_layers() > 0 && base.depth > 0.0) {
      const double above = settings_.beam.support.free_length(base.depth);
      state_.embedded = true;
      while (state_.path.empty() || state_.path.next_node() <= base.depth)
        state_.path.write(state_.path.next_node(), straight(base, above + state_.path.next_node()));
      state_.path.write(base.depth, straight(base, above + base.depth));
      state_.ahead = state_.path.front_place();
    }
    settle(base, events);
  }
  static Place straight(const Base& base, double distance) noexcept {
    Place place;
    for (std::size_t d = 0; d < dimension; ++d) place[d] = base.lateral[d] + base.tilt[d] * distance;
    return place;
  }

  /// Moves to each node of the path that the tip cuts on its way, and where tissue yields to each tenth of a
  /// millimetre across, then to the end: what the tissue remembers does not depend on the length of the
  /// steps.
  void advance(const Base& base, double dt, Events& events) noexcept {
    const Base from = state_.base;
    const double travel = base.depth - from.depth, across = yields_ ? across_of(from, base) : 0.0;
    double done = 0.0;
    while (done < 1.0) {
      const double next = travel > 0.0 ? next_node(state_.base.depth) : base.depth;
      const bool last_node = !(next < base.depth - 1e-9 * state_.path.spacing);
      const double by_node = last_node ? 1.0 : (next - from.depth) / travel;
      const double left = std::max(0.0, state_.path.spacing - state_.moved_across);
      const double by_motion = across * (1.0 - done) > left ? done + left / across : 1.0;
      const bool aside = by_motion < by_node;
      const double share = aside ? by_motion : by_node;
      const double depth = aside ? from.depth + share * travel : next;
      state_.moved_across += (share - done) * across;
      const bool on_node = travel > 0.0 && next < base.depth + 1e-9 * state_.path.spacing;
      const bool remembers = on_node || state_.moved_across >= (1.0 - 1e-9) * state_.path.spacing;
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
  /// Where the path takes its next node, or the surface [m].
  double next_node(double depth) const noexcept {
    if (depth < 0.0) return 0.0;
    const double front = state_.embedded ? std::max(state_.path.front(), depth) : depth;
    return state_.path.spacing * (std::floor(front / state_.path.spacing + 1e-6) + 1.0);
  }
  void move(const Base& to, double dt, Events& events, bool remembers) noexcept {
    press(to, dt, events);
    if (axial_.pierced_layers() > 0 && !state_.embedded && to.depth > 0.0) enter(state_.base.depth);
    if (state_.embedded && to.depth > 0.0) {
      turn_tip(to);
      rub(to.depth - state_.base.depth, dt);
    }
    settle(to, events);
    if (remembers && yields_ && state_.embedded && to.depth > 0.0)
      push_aside(settings_.beam, mesh(), state_.path);
    state_.base = to;
  }
  void press(const Base& to, double dt, Events& events) noexcept {
    state_.sample = axial_.step(to.depth, no_velocity, dt);
    events.contact |= state_.sample.contact;
    events.punctured |= state_.sample.punctured;
    events.exit |= state_.sample.exit;
  }
  /// The friction of the lateral pressure, which keeps its force at rest as the axial laws do.
  void rub(double travel, double dt) noexcept {
    const DepthNoise noise = noise_of(axial_.limits().depth_noise);
    const double full = settings_.lengths.pressure_friction * state_.beam.pressing();
    const double before = full * state_.rub;
    if (noise.range > 0.0) travel = state_.returnable.felt(travel, {.force = before}, dt, noise);
    const double wanted = state_.rub + travel / settings_.lengths.presliding;
    state_.rub = std::clamp(wanted, -1.0, 1.0);
    const double slipped = settings_.lengths.presliding * (wanted - state_.rub);
    if (noise.range > 0.0) state_.returnable.add(before, {slipped, full * state_.rub}, noise);
  }
  /// The surface is punctured: the tissue closes around the shaft, whose tip stood where it touched.
  void enter(double depth) noexcept {
    state_.embedded = true;
    const double reached = std::max(0.0, depth);
    while (state_.path.empty() || state_.path.next_node() <= reached)
      state_.path.write(state_.path.next_node(), state_.touch);
    state_.path.write(reached, state_.touch);
    state_.ahead = state_.touch;
  }
  /// The tip's lateral force follows the bevel while the tip cuts.
  void turn_tip(const Base& to) noexcept {
    const double cut = to.depth - std::max(state_.path.front(), state_.base.depth);
    if (!(cut > 0.0)) return;
    const double share = cut / (to.depth - state_.base.depth);
    const double left = 1.0 - std::exp(-cut / settings_.lengths.tip_memory);
    for (std::size_t d = 0; d < dimension; ++d)
      state_.ahead[d] += left * (state_.path.front_place()[d] - state_.ahead[d]);
    state_.tip_load.advance(cut, settings_.lengths.bevel_length,
                            to.roll - share * (to.roll - state_.base.roll), to.roll);
  }

  /// Solves for the shape; writes the path where the tip is new.
  void settle(const Base& base, Events& events) noexcept {
    const BeamLoad<dimension> load = load_of(base);
    if (!state_.buckled) {
      const auto outcome = state_.beam.solve(settings_.beam, state_.path, load);
      state_.buckled = !outcome.stable;
      events.converged &= outcome.converged;
    }
    if (!(base.depth > 0.0)) leave();
    if (load.cuts) state_.path.write(base.depth, mesh().tip().place);
    state_.tip_force = load.tip_force;
  }
  /// Out of the tissue: a needle that comes back elsewhere makes a hole of its own.
  void leave() noexcept {
    state_.touch = mesh().tip().place;
    state_.buckled = false;
    state_.rub = 0.0;
    if (!state_.embedded) return;
    double square = 0.0;
    for (std::size_t d = 0; d < dimension; ++d)
      square += (state_.touch[d] - state_.path.entry()[d]) * (state_.touch[d] - state_.path.entry()[d]);
    if (square <= settings_.lengths.hole_radius * settings_.lengths.hole_radius) return;
    forget();
    axial_.reset();
  }
  void forget() noexcept {
    state_.embedded = state_.buckled = false;
    state_.rub = 0.0;
    state_.path.clear();
    state_.tip_load.clear();
  }

  BeamLoad<dimension> load_of(const Base& base) const noexcept {
    BeamLoad<dimension> load;
    const bool in_tissue = state_.embedded && base.depth > 0.0;
    load.embedded = in_tissue ? base.depth : 0.0;
    load.free_length = settings_.beam.support.free_length(base.depth) + (in_tissue ? 0.0 : base.depth);
    const std::array<double, 2> bevel{std::cos(base.roll), std::sin(base.roll)};
    const double full = in_tissue ? full_tip_force(base.depth) : 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      load.lateral[d] = base.lateral[d];
      load.tilt[d] = base.tilt[d];
      load.bend[d] = bevel[d];
      load.tip_force[d] = full * state_.tip_load.share()[d];
    }
    load.axial.take(axial_, state_.sample);
    if (in_tissue) {
      load.cuts = base.depth >= state_.path.front();
      load.rub = settings_.lengths.pressure_friction * state_.rub;
      load.contact = behind(base.depth) == 0.0 ? layer_at(base.depth).tip_stiffness : 0.0;
      load.contact_place = state_.ahead;
    } else if (base.depth > 0.0) {
      // a tip that presses on a half space of nu = 1/2 is held across by 2/3 of the axial stiffness (Mindlin)
      load.contact = 2.0 / 3.0 * std::max(0.0, state_.sample.force_by_depth);
      load.contact_place = state_.touch;
    }
    return load;
  }
  /// The lateral force of the bevel's face, and of the layer that the tip cuts, which falls to zero on
  /// withdrawal.
  double full_tip_force(double depth) const noexcept {
    const double left = std::max(0.0, 1.0 - behind(depth) / settings_.lengths.unloading);
    return state_.sample.lateral + tip_force_at(depth) * left;
  }
  /// That of the layers within half a spacing of the path: so the path, straight between its nodes, turns
  /// where they meet.
  double tip_force_at(double depth) const noexcept {
    const BeamProperties& beam = settings_.beam;
    double force = beam.layers[0].tip_force;
    for (std::size_t i = 1; i < beam.layer_count; ++i)
      force += (beam.layers[i].tip_force - beam.layers[i - 1].tip_force) *
               std::clamp(0.5 + (depth - beam.layers[i].top) / state_.path.spacing, 0.0, 1.0);
    return force;
  }
  /// How far the tip is behind the front, apart from what the noise of the depth explains [m].
  double behind(double depth) const noexcept {
    const double explained = 2.0 * axial_.limits().depth_noise;
    return std::max(0.0, state_.path.front() - std::min(explained, state_.path.front()) - depth);
  }
  const LateralLayer& layer_at(double depth) const noexcept {
    const BeamProperties& beam = settings_.beam;
    std::size_t layer = 0;
    while (layer + 1 < beam.layer_count && beam.layers[layer + 1].top < depth) ++layer;
    return beam.layers[layer];
  }

  BentSample sample(const Events& events) const noexcept {
    BentSample result;
    result.axial = state_.sample;
    result.axial.contact = events.contact;
    result.axial.punctured = events.punctured;
    result.axial.exit = events.exit;
    result.force =
        state_.sample.force + settings_.lengths.pressure_friction * state_.rub * state_.beam.pressing();
    result.unsupported = -mesh().base().travel;
    result.buckled = state_.buckled;
    result.moved = true;
    for (double force : state_.tip_force) result.lateral += force * force;
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
      result.tip = {tip.place[0], second(tip.place), tip.travel};
      result.tangent = {tip.slope[0], second(tip.slope), 1.0};
    } else {
      Development<dimension> end = follow(mesh(), [](const Vector&) noexcept {});
      result.tip = end.position();
      result.tangent = end.tangent(mesh().tip().slope);
    }
  }
  /// Forces and moments in the frame of the tissue, turned by the slope at the base. Lateral forces have no
  /// moment about the axis: a round needle takes them by bending alone, x' S y = y' S x.
  void add_wrench(BentSample& result) const noexcept {
    const double fx = state_.beam.force()[0], fy = second(state_.beam.force()), fz = -result.force;
    const double mx = -second(state_.beam.moment()), my = state_.beam.moment()[0];
    const double tx = mesh().base().slope[0], ty = second(mesh().base().slope);
    result.wrench = {fx - tx * fz, fy - ty * fz, fz + tx * fx + ty * fy, mx, my, tx * mx + ty * my};
  }

  Axial axial_;
  FlexibleSettings settings_;
  bool valid_, yields_;
  std::uint64_t model_;  // the fingerprint of model and settings
  FlexibleState<dimension> state_;
};

using PlanarInsertion = FlexibleInsertion<1>;
using SpatialInsertion = FlexibleInsertion<2>;

static_assert(std::is_trivially_copyable_v<PlanarInsertion>);
static_assert(std::is_trivially_copyable_v<SpatialInsertion>);

}  // namespace needleforce::bending
