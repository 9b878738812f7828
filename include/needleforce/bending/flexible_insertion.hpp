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
#include "axial_drive.hpp"
#include "base_wrench.hpp"
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
        yields_(settings.beam.yields()),
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
    if (!valid_ || !belongs(bytes.bending, model_)) return false;
    const FlexibleState<dimension> state = bytes.bending.state();
    if (!possible(state, settings_) || !axial_.restore(bytes.axial)) return false;
    state_ = state;
    return true;
  }

  /// Calls `visit` with the points of the needle from the base to the tip [m], none before the first step.
  /// Wait-free.
  template <class Visit>
  void shape(Visit visit) const noexcept {
    follow(mesh(), base_depth(), visit);
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
    if (waits) state_.waited += dt;
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
  /// True where bending shortens the needle, by no more than what its slopes may be.
  bool coupled() const noexcept {
    const double length = mesh().count() > 0 ? mesh().tip().travel - mesh().base().travel : 0.0;
    return !settings_.small_slopes && std::abs(state_.beam.shortening().whole()) <= length / 3.0;
  }
  bool in_tissue() const noexcept { return state_.embedded && state_.reached > 0.0; }
  bool guided() const noexcept { return settings_.beam.support.guide_distance != Support::no_guide; }
  double base_depth() const noexcept { return -settings_.beam.support.free_length(state_.base.depth); }

  /// The shape, the travel of the tip and the axial force at a place of the base, which are one: a needle
  /// that bends is shorter, its shaft slides less, and its axial force bends it. Writes the path where the
  /// tip is new.
  void settle(const Base& to, double dt, Events& events) noexcept {
    AxialDrive<Axial> drive(axial_, state_.slide, settings_.lengths, state_.beam.pressing(), dt);
    const Began began{shortening(), state_.reached, state_.slid, tip_place()};
    const double reached = state_.reached;
    bool inside = in_tissue();
    Shortening shape = began.shape;
    state_.reached = to.depth - shape.whole();
    drive.to(slid(began, shape, to.depth), in_tissue());
    if (axial_.pierced_layers() > 0 && !state_.embedded && state_.reached > 0.0) enter(reached);
    press(drive.sample());
    turn_tip(to, reached, drive.sample());
    ForceSearch search;
    ShapeSearch shapes;
    double force = drive.force() + (coupled() ? state_.tip_pull : 0.0);
    BeamLoad<dimension> load = load_of(to, shape, force, drive.force());
    bool holds = true;  // the last of the tissue may push a tip out
    for (std::size_t tries = 1; solve(load, events) && coupled(); ++tries) {
      inside |= in_tissue();
      const Shortening now = shortening();
      const double pull = load.compression.free - load.compression.surface;
      drive.to(slid(began, now, to.depth), in_tissue());
      state_.tip_pull = tip_pull(load, drive.force());
      const double missing = drive.force() + state_.tip_pull - force;
      const double change = now.whole() - began.shape.whole();
      const double unbalanced = std::abs(missing) + std::abs(free_pull() - pull);
      holds = tries < max_tries || load.cuts || mesh().embedded() > 0;
      if (tries == max_tries || (unbalanced * std::abs(change) <= smallest_work &&
                                 std::abs(missing) <= small_force * (1.0 + std::abs(force)) &&
                                 std::abs(now.whole() - shape.whole()) <= smallest_length))
        break;
      force = search.next(force, missing, state_.slide.travel, drive.by_travel(), state_.give);
      shape = shapes.next(shape, now);
      state_.reached = to.depth - shape.whole();
      load = load_of(to, shape, force, drive.force());
    }
    if (inside && !(in_tissue() && holds)) load = spring_out(to, drive.force(), events);
    take(drive, load, events, began);
  }
  static constexpr std::size_t max_tries = 12;
  static constexpr double smallest_work = 1e-13;  // [J]
  static constexpr double small_force = 1e-3, smallest_length = 1e-7;

  Shortening shortening() const noexcept { return coupled() ? state_.beam.shortening() : Shortening{}; }
  /// Where a part of a step began.
  struct Began {
    Shortening shape;
    double reached, slid;
    Place tip;
  };
  Place tip_place() const noexcept { return mesh().count() > 0 ? mesh().tip().place : Place{}; }
  /// Travel of the shaft [m]: that of its friction, which is the mean along it, and of what cuts, at the tip,
  /// by their shares of the axial force.
  double slid(const Began& began, const Shortening& now, double depth) noexcept {
    const double reached = depth - now.whole(), tip = reached - began.reached;
    double& wanted = state_.slid;
    wanted = began.slid + tip;
    if (coupled() && !state_.buckled && in_tissue() && mesh().embedded() > 0) {
      const auto per_length = [](double of, double length) { return length > 0.0 ? of / length : 0.0; };
      const Shortening& was = began.shape;
      const double grows = 0.5 * (per_length(was.weighted, began.reached) + per_length(now.weighted, reached));
      const double shaft = now.weighted - was.weighted + now.aside - was.aside +
                           (grows - 0.5 * (now.passing + was.passing)) * tip;
      double aside = 0.0;
      const auto& node = mesh().tip();
      for (std::size_t d = 0; d < dimension; ++d)
        aside += 0.5 * (node.drag[d] + node.drag_before[d]) *
                 (node.place[d] - began.tip[d] - node.along[d] * tip);
      wanted += state_.slide.share * shaft + (1.0 - state_.slide.share) * aside;
    }
    return std::min(wanted, std::min(state_.path.longest(), axial_.reach()));
  }
  /// What the part above the surface is compressed by more than the rest: the needle at the surface bears the
  /// axial part of the lateral forces of the tissue [N].
  double free_pull() const noexcept { return mesh().embedded() > 0 ? state_.beam.pull() : 0.0; }

  bool solve(const BeamLoad<dimension>& load, Events& events) noexcept {
    if (state_.buckled) return false;
    const auto outcome = state_.beam.solve(settings_.beam, state_.path, load);
    state_.buckled = !outcome.stable;
    events.converged &= outcome.converged;
    return outcome.stable;
  }
  /// The tip has left the tissue, which held it aside up to then.
  BeamLoad<dimension> spring_out(const Base& to, double force, Events& events) noexcept {
    state_.buckled = false;
    state_.tip_pull = 0.0;
    const BeamLoad<dimension> load = load_of(to, {}, force, force);
    solve(load, events);
    state_.reached = to.depth - shortening().whole();
    if (!(state_.reached > 0.0)) return load;
    state_.reached = 0.0;  // it lies on the surface: where it goes in again is another hole
    forget();
    axial_.reset();
    return load;
  }
  /// What remains of the step. A needle that has buckled gives nothing back of what bent it.
  void take(const AxialDrive<Axial>& drive, const BeamLoad<dimension>& load, Events& events,
            const Began& began) noexcept {
    state_.sample = drive.sample();
    events.contact |= state_.sample.contact;
    events.punctured |= state_.sample.punctured;
    events.exit |= state_.sample.exit;
    const bool bends = coupled() && !state_.buckled;
    state_.along = drive.force() + (bends ? state_.tip_pull + free_pull() : 0.0);
    state_.force = state_.along - (bends && guided() ? state_.beam.pull() : 0.0);
    if (mesh().embedded() > 0)
      state_.beam.turn_friction(
          1.0 - std::exp(-std::abs(state_.slid - began.slid) / state_.path.spacing));
    if (!(state_.reached > 0.0)) leave();
    if (load.cuts) {
      const std::size_t nodes = state_.path.nodes();
      share_friction();
      const double piece = std::max(0.0, state_.reached - state_.path.last_node());
      for (std::size_t d = 0; d < dimension; ++d)
        state_.owed += load.tip_force[d] * (mesh().tip().place[d] - state_.path.front_place()[d]);
      state_.path.write(state_.reached, mesh().tip().place);
      if (state_.path.nodes() > nodes) lean(piece);
    }
  }

  /// The surface is punctured: the tissue closes around the shaft, whose tip stood where it touched. It holds
  /// no more energy than the contact did.
  void enter(double depth) noexcept {
    state_.embedded = true;
    const double reached = std::max(0.0, depth);
    const double grips = layer_at(0.0).modulus * reached;
    const double share = grips > state_.grip ? std::sqrt(state_.grip / grips) : 1.0;
    Place place = state_.touch;
    for (std::size_t d = 0; d < dimension && mesh().count() > 0; ++d)
      place[d] = mesh().tip().place[d] - share * (mesh().tip().place[d] - state_.touch[d]);
    while (state_.path.empty() || state_.path.next_node() <= reached)
      state_.path.write(state_.path.next_node(), place, mesh().tip().slope);
    state_.path.write(reached, place);
    state_.ahead = place;
    state_.push = state_.lean = {};
  }
  /// A tip that presses on a half space of nu = 1/2 is held across by 2/3 of the axial stiffness (Mindlin).
  /// What more of it touches is unloaded there; what loses touch has no force.
  void press(const Sample& sample) noexcept {
    const double before = state_.grip;
    state_.grip =
        state_.embedded || !(state_.reached > 0.0) ? 0.0 : 2.0 / 3.0 * std::max(0.0, sample.force_by_depth);
    if (!(state_.grip > before) || mesh().count() == 0) return;
    for (std::size_t d = 0; d < dimension; ++d) {
      const double place = mesh().tip().place[d];
      state_.touch[d] = place - before / state_.grip * (place - state_.touch[d]);
    }
  }
  /// The tip's lateral force follows the bevel while the tip cuts. The axial force pays
  /// for what the lateral force does on the tip: the bevel is a wedge.
  void turn_tip(const Base& to, double before, const Sample& sample) noexcept {
    state_.charge = 0.0;
    if (!in_tissue()) return;
    const double cut = state_.reached - std::max(state_.path.front(), before);
    if (!(cut > 0.0)) return;
    const double share = std::min(1.0, cut / (state_.reached - before));
    state_.tip_load.advance(cut, settings_.lengths.bevel_length,
                            to.roll - share * (to.roll - state_.base.roll), to.roll);
    const double left = 1.0 - std::exp(-cut / settings_.lengths.tip_memory);
    const double pays = 1.0 - std::exp(-cut / state_.path.spacing);
    const double full = sample.lateral + layer_at(state_.reached).tip_force;
    for (std::size_t d = 0; d < dimension; ++d) {
      state_.ahead[d] += left * (state_.path.front_place()[d] - state_.ahead[d]);
      state_.push[d] = full * state_.tip_load.share()[d];
    }
    state_.charge = state_.owed * pays / cut;
    state_.owed -= state_.owed * pays;
  }
  /// The newest `piece` [m] of the path does not pull a tip back that cuts. From node to node, whatever the
  /// steps.
  void lean(double piece) noexcept {
    if (mesh().embedded() == 0) return;
    const double spacing = state_.path.spacing;
    const double left = 1.0 - std::exp(-spacing / settings_.lengths.tip_memory);
    const LateralLayer& layer = layer_at(state_.reached);
    const double drags = !coupled() ? 0.0
                                    : (layer.modulus + layer.yielding_modulus) * piece * piece *
                                          (piece / 12.0 + spacing / 6.0) / (piece + spacing);
    for (std::size_t d = 0; d < dimension; ++d) {
      const double lag = mesh().tip().along[d] - mesh().tip().slope[d];
      state_.lean[d] -= left * (drags * lag + state_.lean[d]);
    }
  }
  /// The share of friction in the axial force, as of a needle that goes in; where the shaft is, stays.
  void share_friction() noexcept {
    const double whole = state_.sample.friction + state_.sample.cutting;
    if (!(whole > 0.0)) return;
    state_.slide.share = std::clamp(state_.sample.friction / whole, 0.0, 1.0);
  }
  /// Out of the tissue: a needle that comes back elsewhere makes a hole of its own.
  void leave() noexcept {
    state_.touch = mesh().tip().place;
    state_.buckled = false;
    state_.slide.rub = state_.slide.most = 0.0;
    state_.slid = state_.reached;
    state_.beam.forget_friction();
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
    state_.slide = {};
    state_.path.clear();
    state_.tip_load.clear();
  }

  BeamLoad<dimension> load_of(const Base& base, const Shortening& shape, double force,
                              double axial) const noexcept {
    BeamLoad<dimension> load;
    const bool inside = in_tissue();
    load.embedded = inside ? state_.reached : 0.0;
    load.free_length =
        std::max(0.0, settings_.beam.support.free_length(base.depth) + (inside ? shape.free : base.depth));
    load.compression = {force + (coupled() && inside ? free_pull() : 0.0), force,
                        force - state_.slide.share * axial, (1.0 - state_.slide.share) * axial};
    const std::array<double, 2> bevel{std::cos(base.roll), std::sin(base.roll)};
    const std::array<double, 2> turns{-bevel[1], bevel[0]};
    const double left = inside ? share_left(state_.reached) : 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      load.lateral[d] = base.lateral[d];
      load.tilt[d] = base.tilt[d];
      load.bend[d] = bevel[d];
      load.bend_turns[d] = turns[d];
      load.tip_force[d] = left * (state_.push[d] + state_.lean[d]);
    }
    if (inside) {
      load.cuts = state_.reached >= state_.path.front();
      load.pulls_back = coupled();
      load.rubs = settings_.lengths.pressure_friction > 0.0;
      load.contact = left * layer_at(state_.reached).tip_stiffness;
      load.contact_place = state_.ahead;
      load.pivot = coupled() ? std::min(1.0, state_.reached / settings_.lengths.tip_memory) : 1.0;
    } else {
      load.contact = state_.grip;
      load.contact_place = state_.touch;
    }
    return load;
  }
  /// How far the tip is behind the front, apart from what the noise of the depth explains [m].
  double behind(double depth) const noexcept {
    const double explained = 2.0 * axial_.limits().depth_noise;
    return std::max(0.0, state_.path.front() - std::min(explained, state_.path.front()) - depth);
  }
  /// What is left of the lateral forces on the tip as it withdraws.
  double share_left(double depth) const noexcept {
    return std::max(0.0, 1.0 - behind(depth) / settings_.lengths.unloading);
  }
  /// What the lateral energy gains per travel of the tip along its path, at the shape of the last solution
  /// [N].
  double tip_pull(const BeamLoad<dimension>& load, double axial) const noexcept {
    if (!in_tissue()) return 0.0;
    const LateralLayer& layer = layer_at(state_.reached);
    const auto& tip = mesh().tip();
    const std::size_t n = mesh().embedded(), last = mesh().count() - 1;
    const double h = mesh().h(), left = share_left(state_.reached);
    const bool newest = !(state_.reached < state_.path.last_node());
    const Place place = load.cuts || n == 0 ? tip.place : state_.path.at(state_.reached);
    double sum = state_.beam.advancing() + (load.cuts ? state_.charge : 0.0), square = 0.0, pivot = 0.0, held = 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      const double surface = mesh()[mesh().surface()].place[d] - state_.path.entry()[d];
      const double off = tip.place[d] - state_.ahead[d];
      pivot += surface * surface;
      held += 0.5 * layer.tip_stiffness * off * off -
              (state_.push[d] + state_.lean[d]) * (tip.place[d] - state_.path.front_place()[d]);
      const double away = n > 0 ? tip.place[d] - place[d] : surface;
      square += away * away;
      if (n == 0) continue;
      const double slope = tip.slope[d] - tip.along[d];
      const double turn = newest ? 0.0 : (tip.along[d] - mesh()[last - 1].along[d]) / h;
      sum += load.compression.tip * ((tip.place[d] - tip.path[d]) * turn - 0.5 * slope * slope) +
             (1.0 - state_.slide.share) * axial * tip.drag[d] * slope +
             tip.slope[d] * (load.contact * off - load.tip_force[d]);
    }
    if (left > 0.0 && left < 1.0) sum += held / settings_.lengths.unloading;
    if (load.pivot < 1.0)
      sum += 0.5 * settings_.beam.support.pivot_stiffness * pivot / settings_.lengths.tip_memory;
    if (n == 0) return sum + (load.cuts ? 1.0 / 3.0 : 1.0) * short_energy(layer, std::sqrt(square));
    return load.cuts ? sum : sum + energy_per_length(layer, std::sqrt(square));
  }
  static double short_energy(const LateralLayer& layer, double offset) noexcept {
    return foundation_energy(layer.form, offset, layer.modulus, layer.scale);
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
    result.force = state_.force;
    result.unsupported = -mesh().base().travel;
    result.buckled = state_.buckled;
    result.moved = true;
    const double left = share_left(state_.reached);
    for (const double push : state_.push) result.lateral += push * push;
    result.lateral = left * std::sqrt(result.lateral);
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
      Development<dimension> end = follow(mesh(), base_depth(), [](const Vector&) noexcept {});
      result.tip = end.position();
      result.tangent = end.tangent(mesh().tip().slope);
    }
  }
  /// On the base as it is held, whatever its compliance. A round straight needle has no moment about its axis.
  void add_wrench(BentSample& result) const noexcept {
    const bool holds = !state_.buckled;
    const Place force = holds ? state_.beam.force() : Place{}, moment = holds ? state_.beam.moment() : Place{};
    const BaseAxes axes(state_.base.tilt);
    const Vector f = axes.force({force[0], second(force), -state_.along});
    const Vector m = axes.moment({moment[0], second(moment)}, holds ? state_.beam.turning() : 0.0);
    result.wrench = {f[0], f[1], f[2], m[0], m[1], m[2]};
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
