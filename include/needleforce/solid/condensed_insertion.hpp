// SPDX-License-Identifier: Apache-2.0
// A rigid needle in a solid: friction along the shaft and the force at the tip drag the tissue, whose mesh
// was condensed onto the path; step() under the real-time contract.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "../bevel.hpp"
#include "../fingerprint.hpp"
#include "../limits.hpp"
#include "../sample.hpp"
#include "../state_bytes.hpp"
#include "condensed_state.hpp"
#include "path_layers.hpp"
#include "shaft_balance.hpp"

namespace needleforce::solid {

/// A needle going in and out of a condensed solid of up to eight layers. Trivially copyable.
class CondensedInsertion {
 public:
  static constexpr std::size_t max_sweeps = 8;    ///< in one part of a step
  static constexpr std::size_t leap_sweeps = 24;  ///< where that part is longer than a leap
  static constexpr double leap = 30e-6;           ///< [m]
  static constexpr std::size_t max_turns = 4;     ///< of balance and motion of the tip
  static constexpr double tolerance = 1e-9;       ///< change of a displacement that ends the sweeps [m]

  CondensedInsertion(const CondensedTissue& tissue, std::span<const Layer> layers, const Limits& limits = {},
                     const Bevel& bevel = {}) noexcept
      : tissue_(tissue),
        limits_(limits),
        valid_(!fault(tissue, layers) && needleforce::valid(limits) && !first_invalid(bevel)) {
    if (!valid_) return;
    lateral_ratio_ = bevel.lateral_ratio();
    layers_ = PathLayers(layers, tissue);
    Fingerprint print;
    print.add(fingerprint(layers));
    print.add(tissue.spacing);
    for (std::size_t i = 0; i < tissue.nodes; ++i)
      for (std::size_t j = 0; j < tissue.nodes; ++j) print.add(tissue.at(i, j));
    model_ = print.value();
  }

  /// What is wrong with the tissue or a layer, nullptr if nothing is. Not for the loop.
  static const char* fault(const CondensedTissue& tissue, std::span<const Layer> layers) noexcept {
    if (const char* reason = solid::fault(tissue)) return reason;
    if (const char* reason = first_fault(layers).reason) return reason;
    for (const Layer& layer : layers)
      if (const char* reason = solid_fault(layer)) return reason;
    return nullptr;
  }

  /// One cycle: the tip would be at `depth` [m] from the undeformed surface, and moves at `velocity` [m/s],
  /// `dt` [s] after the last call. Wait-free; the cost is bounded, and does not depend on the mesh.
  Sample step(double depth, double velocity, double dt) noexcept {
    const Status status = check(depth, velocity, dt);
    if (status != Status::ok) return refuse(status, dt);
    const double travel = state_.started ? depth - state_.depth : 0.0, elapsed = state_.waited + dt;
    if (velocity == no_velocity) velocity = travel / elapsed;
    if (!state_.started) begin(depth);
    state_.waited = 0.0;
    return accept(depth, travel, velocity);
  }

  void reset() noexcept { state_ = CondensedState{}; }
  CondensedInsertion snapshot() const noexcept { return *this; }
  /// The memory without the model, as bytes that may leave the process. Wait-free.
  using Saved = StateBytes<CondensedState>;
  Saved save() const noexcept { return state_bytes(state_, model_); }
  /// Restores a memory; returns false and changes nothing for bytes of another version, tissue or model,
  /// altered bytes, or a state that no insertion can have. Wait-free.
  bool restore(const Saved& bytes) noexcept {
    if (!valid_ || !belongs(bytes, model_)) return false;
    const CondensedState state = bytes.state();
    if (!possible(state, tissue_, layers_.count())) return false;
    state_ = state;
    return true;
  }

  const CondensedTissue& tissue() const noexcept { return tissue_; }
  const PathLayer& surface_layer() const noexcept { return layers_[0]; }
  const CondensedState& state() const noexcept { return state_; }
  /// Force [N] of the shaft on the tissue at a node, without that of the tip. Wait-free.
  double shaft_force(std::size_t node) const noexcept {
    return node < state_.shaft.known ? state_.shaft.force[node] : 0.0;
  }
  /// The same with that of the tip, which is between two nodes. Wait-free.
  double node_force(std::size_t node) const noexcept {
    const auto at = BetweenNodes::at(state_.tip, tissue_);
    const double share = node == at.node ? 1.0 - at.share : node == at.node + 1 ? at.share : 0.0;
    return shaft_force(node) + share * state_.tip_force;
  }
  /// Displacement of the tissue at a node of the path [m]. Wait-free.
  double displacement(std::size_t node) const noexcept {
    const auto at = BetweenNodes::at(state_.tip, tissue_);
    const double by_tip =
        (1.0 - at.share) * tissue_.at(node, at.node) + at.share * tissue_.at(node, at.node + 1);
    return displaced(state_.shaft, tissue_, node) + state_.tip_force * by_tip;
  }
  bool accepted() const noexcept { return valid_; }
  const Limits& limits() const noexcept { return limits_; }
  std::size_t pierced_layers() const noexcept { return state_.pierced; }
  /// Deepest travel that a step takes [m].
  double reach() const noexcept { return tissue_.length(); }
  /// A number that distinguishes tissues and models, with the lateral force of the bevel.
  std::uint64_t model_fingerprint() const noexcept {
    Fingerprint print;
    print.add(model_);
    print.add(lateral_ratio_);
    return print.value();
  }
  /// Calls `visit(from, to, force)` from the surface down: the force [N] of the tissue on the shaft between
  /// two distances along the path; half of a node's is on either side of it. Wait-free.
  template <class Visit>
  void along_shaft(double, Visit visit) const noexcept {
    const double end = std::min(state_.tip, state_.depth), h = tissue_.spacing;
    if (!(end > 0.0)) return;
    const auto& force = state_.shaft.force;
    double left = state_.last.friction, half = 0.0;  // half: of the node above
    for (std::size_t k = 0; static_cast<double>(k) * h < end && k + 1 < state_.shaft.known; ++k) {
      const double from = h * static_cast<double>(k), to = std::min(from + h, end);
      const bool last = to == end || k + 2 == state_.shaft.known;
      const double above = k == 0 ? force[0] : half;
      half = 0.5 * force[k + 1];
      const double between = last ? left : above + half;
      left -= between;
      visit(from, to, between);
      if (last) return;
    }
  }

 private:
  /// Motion of the tip along the path in one turn, and how far it had to go [m].
  struct TipMove {
    double ahead = 0.0, by = 0.0;
  };
  static constexpr double max_parts = 4.0 * max_path_nodes;
  static constexpr double shortest = 1e-7;  ///< travel from which rates are taken [m]
  // by how much a motion of the tip along the path changes how far it has to go, in the secant
  static constexpr double min_yield = 1.0, max_yield = 3.0;

  Status check(double depth, double velocity, double dt) const noexcept {
    if (!valid_) return Status::invalid_parameter;
    if (!ordinary(depth, velocity, dt)) return refusal(depth, velocity, dt);
    if (depth > tissue_.length()) return Status::outside_range;
    const bool possible = state_.started
                              ? consistent(limits_, depth - state_.depth, velocity, state_.waited + dt)
                              : velocity == no_velocity || std::abs(velocity) <= limits_.max_speed;
    return possible ? Status::ok : Status::outside_range;
  }

  [[gnu::noinline]] Sample refuse(Status status, double dt) noexcept {
    const bool waits = dt > 0.0 && std::isfinite(dt);
    if (waits) state_.waited += dt;
    const bool holding = valid_ && waits && state_.waited <= limits_.hold_time;
    return refused(holding ? state_.last : Sample{}, state_.depth, status);
  }

  bool in_tissue() const noexcept {
    const bool below = state_.pierced > 0 && state_.started && state_.depth > state_.shaft.displacement[0];
    return state_.tip_force > 0.0 || state_.tip > 0.0 || below;
  }

  /// A first step below the puncture of a layer finds the needle there, in a path that it cut, without any
  /// force on the shaft.
  void begin(double depth) noexcept {
    state_.depth = depth;
    state_.started = true;
    const auto pierces = [depth](const PathLayer& layer) noexcept {
      return depth > layer.top + layer.puncture;
    };
    while (state_.pierced < layers_.count() && pierces(layers_[state_.pierced])) ++state_.pierced;
    if (state_.pierced == 0) return;
    const bool all = state_.pierced == layers_.count();
    state_.tip = state_.cut = all ? depth : std::min(depth, layers_[state_.pierced].top);
    know(state_.tip);
  }

  /// In parts of at most half a spacing, so that bounds and tip follow; in the air at once.
  Sample accept(double depth, double travel, double velocity) noexcept {
    if (!in_tissue()) state_.depth = std::max(state_.depth, std::min(depth, 0.0));
    const double before = state_.depth, way = depth - before, force_before = state_.last.force;
    // as many as twice the path has, also where tissue that is pulled up goes along for longer
    const auto parts =
        1 + static_cast<std::size_t>(std::min(std::abs(way) / (0.5 * tissue_.spacing), max_parts));
    const std::size_t pierced = state_.pierced;
    layers_.at_speed(std::abs(velocity));
    refresh();
    for (std::size_t k = 1; k < parts && (in_tissue() || way > 0.0); ++k)
      move(before + way * static_cast<double>(k) / static_cast<double>(parts), std::abs(velocity));
    move(depth, std::abs(velocity));
    return sampled(depth, travel, velocity, force_before, state_.pierced > pierced);
  }

  /// One row of displacements from the forces, so that rounding does not add up.
  void refresh() noexcept {
    state_.row = state_.row + 1 < state_.shaft.known ? state_.row + 1 : 0;
    state_.shaft.displacement[state_.row] = displacement(state_.row);
  }
  /// Displacements are kept up to two nodes behind a distance along the path [m], in eights.
  void know(double distance) noexcept {
    const auto nodes = static_cast<std::size_t>(distance / tissue_.spacing) + 3;
    const std::size_t wanted = std::min((nodes + 7) / 8 * 8, tissue_.nodes), before = state_.shaft.known;
    if (wanted + 8 <= before) state_.shaft.known = wanted;  // what is beyond bears no force
    if (wanted <= before) return;
    for (std::size_t i = before; i < wanted; ++i) state_.shaft.force[i] = 0.0;
    state_.shaft.known = wanted;
    for (std::size_t i = before; i < wanted; ++i) {
      state_.shaft.displacement[i] = displacement(i);
      state_.shaft.anchor[i] = state_.depth - state_.shaft.displacement[i];
      state_.by_travel.force[i] = state_.by_travel.displacement[i] = 0.0;
    }
    state_.steady = false;
  }

  /// Balance with the tip where it is in the tissue, then the tip moves on, in turns: the balance is a convex
  /// problem, and where the shaft sticks next to the tip, tissue follows the tip by more than it moves.
  void move(double depth, double speed) noexcept {
    const ShaftState before = state_.shaft;
    const double travel = depth - state_.depth, tip = state_.tip, tip_force = state_.tip_force;
    TipMove last{};
    state_.depth = depth;
    know(state_.tip);
    expect(travel);
    std::array<FrictionBounds, max_path_nodes> all;
    const std::span<FrictionBounds> bounds(all.data(), tissue_.nodes);
    const std::size_t allowed = std::abs(travel) > leap ? leap_sweeps : max_sweeps;
    std::size_t sweeps = 0;
    bool moved = false;
    for (std::size_t turn = 0; turn < max_turns; ++turn) {
      layers_.bounds(bounds, state_.tip);
      do {
        const double change = balance_tip(depth, speed);
        if (std::max(change, sweep(state_.shaft, tissue_, bounds, depth, sweeps % 2 == 1)) < tolerance) break;
      } while (++sweeps < allowed);
      moved = moved_tip(depth, speed, last);
      if (sweeps >= allowed || !moved) break;
    }
    if (moved) clamp_forces(bounds, speed);
    slide(state_.shaft, bounds, depth);
    remember(before, tip_force, travel, state_.tip == tip);
  }

  /// After the tip moved without a balance: no force beyond what shaft and tip can bear where they are now.
  void clamp_forces(std::span<FrictionBounds> bounds, double speed) noexcept {
    layers_.bounds(bounds, state_.tip);
    for (std::size_t i = 0; i < state_.shaft.known; ++i) {
      const double force = std::clamp(state_.shaft.force[i], bounds[i].low, bounds[i].high);
      if (force == state_.shaft.force[i]) continue;
      push(state_.shaft, tissue_, i, force - state_.shaft.force[i]);
      state_.shaft.force[i] = force;
    }
    const double contact = pressing() ? layers_[state_.pierced].puncture_force() : 0.0;
    const double limit = state_.tip >= state_.cut ? std::max(contact, cutting(speed)) : 0.0;
    if (state_.tip_force <= limit) return;
    push(state_.shaft, tissue_, BetweenNodes::at(state_.tip, tissue_), limit - state_.tip_force);
    state_.tip_force = limit;
    state_.on_contact = state_.on_contact && pressing();
  }

  /// What the last motion did while the tip stuck, again: most steps are like the one before.
  void expect(double travel) noexcept {
    if (!state_.steady) return;
    for (std::size_t i = 0; i < state_.shaft.known; ++i) {
      state_.shaft.force[i] += travel * state_.by_travel.force[i];
      state_.shaft.displacement[i] += travel * state_.by_travel.displacement[i];
    }
    state_.tip_force += travel * state_.tip_by_travel;
  }

  /// Of the layer that the tip is in, the last that is pierced [N].
  double cutting(double speed) const noexcept {
    return state_.pierced > 0 ? layers_[state_.pierced - 1].cutting(speed) : 0.0;
  }
  /// True where the tip presses on a layer that it has not broken through.
  bool pressing() const noexcept {
    return state_.pierced < layers_.count() && state_.cut >= layers_[state_.pierced].top;
  }

  /// Force at the tip; returns the change, as a displacement [m].
  double balance_tip(double depth, double speed) noexcept {
    const auto at = BetweenNodes::at(state_.tip, tissue_);
    const double gap = depth - state_.tip - by_shaft(at);  // to be taken up by the tip's own compliance
    const double own = at.compliance(tissue_);
    double force = 0.0;
    state_.on_contact = false;
    if (state_.tip >= state_.cut) {
      // on an interface the tissue above still bears the cutting force, until the contact is stronger
      force = std::clamp(gap / own, 0.0, cutting(speed));
      const double contact = pressing() ? layers_[state_.pierced].contact_force(gap) : 0.0;
      state_.on_contact = contact > force;
      force = std::max(force, contact);
    }
    const double by = force - state_.tip_force;
    if (by == 0.0) return 0.0;
    state_.tip_force = force;
    push(state_.shaft, tissue_, at, by);
    return std::abs(by) * own;
  }

  /// The tip breaks through, cuts on, or recedes in its own path; false if it stays.
  bool moved_tip(double depth, double speed, TipMove& last) noexcept {
    const auto at = BetweenNodes::at(state_.tip, tissue_);
    const double gap = depth - state_.tip - by_shaft(at);
    if (state_.tip >= state_.cut && pressing() && breaks(gap)) {
      ++state_.pierced;
      return true;
    }
    const double ahead = to_go(gap, at, speed);
    if (std::abs(ahead) < tolerance) return false;
    if (std::abs(last.by) > tolerance)  // secant
      state_.yield = std::clamp((last.ahead - ahead) / last.by, min_yield, max_yield);
    const double from = state_.tip;
    place_tip(std::clamp(from + ahead / state_.yield, 0.0, farthest_tip()));
    state_.cut = std::max(state_.cut, state_.tip);
    last = {ahead, state_.tip - from};
    return last.by != 0.0;
  }

  /// Moves the tip with its force.
  void place_tip(double to) noexcept {
    const double force = std::exchange(state_.tip_force, 0.0);
    push(state_.shaft, tissue_, BetweenNodes::at(state_.tip, tissue_), -force);
    state_.tip = to;
    know(to);
    state_.tip_force = force;
    push(state_.shaft, tissue_, BetweenNodes::at(to, tissue_), force);
  }

  /// True for a contact that is pressed to the force at which the layer breaks; without one any contact
  /// breaks it.
  bool breaks(double gap) const noexcept {
    const PathLayer& layer = layers_[state_.pierced];
    return gap > 0.0 && layer.contact_force(gap) >= layer.puncture_force();
  }
  /// How far the tip has still to go along the path if the tissue did not follow [m].
  double to_go(double gap, const BetweenNodes& at, double speed) const noexcept {
    if (state_.tip < state_.cut || gap < 0.0) return gap;
    if (pressing()) return 0.0;
    return std::max(0.0, gap - at.compliance(tissue_) * cutting(speed));
  }
  /// The deepest cut, or where cutting comes to an interface that resists, or to the end of the path [m].
  double farthest_tip() const noexcept {
    if (state_.tip < state_.cut || pressing()) return state_.cut;
    return state_.pierced < layers_.count() ? layers_[state_.pierced].top : tissue_.length();
  }

  /// Displacement by the shaft alone where the tip is [m].
  double by_shaft(const BetweenNodes& at) const noexcept {
    return at.of(state_.shaft.displacement) - state_.tip_force * at.spread(tissue_);
  }
  void remember(const ShaftState& before, double tip_force, double travel, bool stuck) noexcept {
    if (std::abs(travel) < shortest) return;
    state_.steady = stuck;
    for (std::size_t i = 0; i < state_.shaft.known; ++i) {
      state_.by_travel.force[i] = (state_.shaft.force[i] - before.force[i]) / travel;
      state_.by_travel.displacement[i] = (state_.shaft.displacement[i] - before.displacement[i]) / travel;
    }
    state_.tip_by_travel = (state_.tip_force - tip_force) / travel;
  }

  Sample sampled(double depth, double travel, double velocity, double force_before, bool punctured) noexcept {
    Sample sample;
    sample.depth = depth;
    sample.velocity = velocity;
    for (std::size_t i = 0; i < state_.shaft.known; ++i) sample.friction += state_.shaft.force[i];
    (state_.on_contact ? sample.stiffness : sample.cutting) = state_.tip_force;
    sample.force = sample.friction + state_.tip_force;
    sample.lateral = lateral_ratio_ * sample.cutting;
    sample.punctured = punctured;
    const bool was_in = state_.phase != Phase::free;
    const bool in = in_tissue();
    sample.contact = in && !was_in;
    sample.exit = was_in && !in;
    state_.phase = sample.phase = !in                   ? Phase::free
                                  : state_.pierced == 0 ? Phase::deformation
                                  : travel > 0.0        ? Phase::insertion
                                  : travel < 0.0        ? Phase::extraction
                                                        : Phase::hold;
    sample.force_by_depth = state_.pierced == 0            ? layers_[0].contact_slope(depth)
                            : std::abs(travel) >= shortest ? (sample.force - force_before) / travel
                                                           : state_.last.force_by_depth;
    state_.last = sample;
    return sample;
  }

  CondensedTissue tissue_{};
  PathLayers layers_{};
  CondensedState state_{};
  Limits limits_{};
  double lateral_ratio_ = 0.0;
  std::uint64_t model_ = 0;
  bool valid_ = false;
};

}  // namespace needleforce::solid
