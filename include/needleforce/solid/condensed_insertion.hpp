// SPDX-License-Identifier: Apache-2.0
// A rigid needle in a solid: friction along the shaft and the force at the tip drag the tissue, whose mesh
// was condensed onto the path; step() under the real-time contract. shaft_and_tip.hpp moves both.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "../bevel.hpp"
#include "../limits.hpp"
#include "../model_fingerprint.hpp"
#include "../sample.hpp"
#include "../state_bytes.hpp"
#include "condensed_state.hpp"
#include "path_layers.hpp"
#include "shaft_and_tip.hpp"

namespace needleforce::solid {

/// A needle going in and out of a condensed solid of up to eight layers. Trivially copyable. For one thread
/// at a time.
class CondensedInsertion {
 public:
  CondensedInsertion(const CondensedTissue& tissue, std::span<const Layer> layers, const Limits& limits = {},
                     const Bevel& bevel = {}) noexcept
      : tissue_(tissue),
        limits_(limits),
        valid_(!fault(tissue, layers) && needleforce::valid(limits) && !first_invalid(bevel)) {
    if (!valid_) return;
    lateral_ratio_ = bevel.lateral_ratio();
    noise_ = noise_of(limits.depth_noise);
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
    return solid_fault(layers);
  }

  /// One cycle: the tip would be at `depth` [m] from the undeformed surface, and moves at `velocity` [m/s],
  /// `dt` [s] after the last call. Wait-free; the cost is bounded, and does not depend on the mesh.
  Sample step(double depth, double velocity, double dt) noexcept { return step(depth, velocity, dt, 0.0); }
  /// The same for a tip that moved by `aside` [m] where its face pushes it, by which the cut has moved less.
  /// Wait-free.
  Sample step_aside(double depth, double aside, double dt) noexcept {
    return step(depth, no_velocity, dt, aside);
  }

  void reset() noexcept { state_ = CondensedState{}; }
  CondensedInsertion snapshot() const noexcept { return *this; }
  /// The memory without the model, as bytes that may leave the process. Wait-free.
  using Saved = StateBytes<CondensedState>;
  Saved save() const noexcept { return state_bytes(state_, model_); }
  /// Restores a memory; returns false and changes nothing for bytes of another version, tissue or model,
  /// altered bytes, or a state that no insertion can have. Wait-free.
  bool restore(const Saved& bytes) noexcept {
    if (restore_fault(bytes)) return false;
    state_ = bytes.state();
    return true;
  }
  /// Why `restore` refuses a memory, as the part of it that is at fault, or nullptr. Wait-free.
  const char* restore_fault(const Saved& bytes) const noexcept {
    if (!valid_) return "model of this insertion";
    if (const char* part = foreign_part(bytes, model_)) return part;
    StateCheck check;
    double most = 0.0;
    for (std::size_t i = 0; i < layers_.count(); ++i)
      most = std::max(most, 1e3 + 3.0 * layers_[i].contact_force(farthest));
    solid::check(check, bytes.state(), tissue_, layers_.count(), most);
    return check.fault();
  }

  const CondensedTissue& tissue() const noexcept { return tissue_; }
  const PathLayer& surface_layer() const noexcept { return layers_[0]; }
  /// The memory in this process, and back to it. Wait-free.
  using State = CondensedState;
  const State& state() const noexcept { return state_; }
  void return_to(const State& state) noexcept { state_ = state; }
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
    if (layers_.relaxing(1.0).relaxes)
      return node < state_.shaft.known ? state_.shaft.displacement[node] : 0.0;
    return solid::displacement(tissue_, state_, node);
  }
  bool accepted() const noexcept { return valid_; }
  const Limits& limits() const noexcept { return limits_; }
  std::size_t pierced_layers() const noexcept { return state_.pierced; }
  /// By how much the force of slow cutting displaces the tissue around the tip, half way down the layer where
  /// that is most [m].
  double displaced_by_cutting() const noexcept {
    double most = 0.0;
    for (std::size_t i = 0; i < layers_.count(); ++i) {
      const double end = i + 1 < layers_.count() ? layers_[i + 1].top : tissue_.length();
      const auto middle = BetweenNodes::at(0.5 * (layers_[i].top + end), tissue_);
      most = std::max(most, layers_[i].cutting(0.0) * middle.compliance(tissue_));
    }
    return most;
  }
  /// Deepest travel that a step takes [m].
  double reach() const noexcept { return tissue_.length(); }
  /// Lateral force of the bevel as a share of the cutting force. Wait-free.
  double lateral_ratio() const noexcept { return lateral_ratio_; }
  /// Force of slow cutting in the layer that the tip is in [N]. Wait-free.
  double steady_cutting() const noexcept {
    return state_.pierced > 0 ? layers_[state_.pierced - 1].cutting(0.0) : 0.0;
  }
  /// True where cutting pays for the lateral force of the bevel, which is a share of its own, and in each
  /// layer for one of another cause, if there is.
  bool pays(bool other) const noexcept {
    for (std::size_t i = 0; i < layers_.count(); ++i)
      if (other && !(layers_[i].cutting(0.0) > 0.0)) return false;
    return true;
  }
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
  static constexpr double max_parts = 4.0 * max_path_nodes;

  Status check(double depth, double velocity, double dt) const noexcept {
    if (!valid_) return Status::invalid_parameter;
    if (!ordinary(depth, velocity, dt)) return refusal(depth, velocity, dt);
    if (depth > tissue_.length()) return Status::outside_range;
    const bool possible = state_.started
                              ? consistent(limits_, depth - state_.noisy.shown, velocity, state_.waited + dt)
                              : velocity == no_velocity || std::abs(velocity) <= limits_.max_speed;
    return possible ? Status::ok : Status::outside_range;
  }

  Sample step(double depth, double velocity, double dt, double aside) noexcept {
    const Status status = check(depth, velocity, dt);
    if (status != Status::ok) return refuse(status, dt);
    if (!state_.started) begin(depth);
    const double elapsed = state_.waited + dt, travel = depth - state_.noisy.shown;
    state_.waited = 0.0;
    const double before = state_.last.force, to = felt_at(depth, elapsed), felt = to - state_.depth;
    const double speed = std::abs(velocity == no_velocity ? felt / elapsed : velocity);
    const std::size_t pierced = state_.pierced;
    const double dissipated = move(to, speed, elapsed, aside);
    if (velocity == no_velocity)
      velocity = std::clamp(travel / elapsed, -limits_.max_speed, limits_.max_speed);
    const Sample sample = sampled(depth, felt, velocity, state_.pierced > pierced);
    if (noise_.range > 0.0) state_.noisy.add(before, dissipated, sample.force, noise_);
    return sample;
  }

  [[gnu::noinline]] Sample refuse(Status status, double dt) noexcept {
    const bool waits = dt > 0.0 && std::isfinite(dt);
    if (waits) state_.waited = std::min(state_.waited + dt, longest);
    const bool holding = valid_ && waits && state_.waited <= limits_.hold_time;
    return refused(holding ? state_.last : Sample{}, state_.noisy.shown, status);
  }

  /// A first step below the puncture of a layer finds the needle there, in a path that it cut, without any
  /// force on the shaft.
  void begin(double depth) noexcept {
    state_.depth = state_.noisy.exactly(depth);
    state_.started = true;
    const auto pierces = [depth](const PathLayer& layer) noexcept {
      return depth > layer.top + layer.puncture;
    };
    while (state_.pierced < layers_.count() && pierces(layers_[state_.pierced])) ++state_.pierced;
    if (state_.pierced == 0) return;
    const bool all = state_.pierced == layers_.count();
    state_.tip = state_.cut = all ? depth : std::min(depth, layers_[state_.pierced].top);
    motion(layers_.relaxing(1.0)).know(state_.tip);
  }

  /// Where the needle is felt [m]. Above the tissue and before a puncture nothing slips.
  double felt_at(double depth, double elapsed) noexcept {
    if (noise_.range == 0.0 || state_.pierced == 0 || !in_tissue(state_)) return state_.noisy.exactly(depth);
    return state_.noisy.felt(depth, state_.depth, state_.last.force, elapsed, noise_);
  }

  /// In parts of at most half a spacing, so that bounds and tip follow; in the air at once. Returns what is
  /// dissipated [J].
  double move(double depth, double speed, double elapsed, double aside) noexcept {
    if (!in_tissue(state_)) state_.depth = std::max(state_.depth, std::min(depth, 0.0));
    const double before = state_.depth, way = depth - before;
    const std::size_t pierced = state_.pierced;
    // as many as twice the path has, also where tissue that is pulled up goes along for longer
    const auto parts =
        1 + static_cast<std::size_t>(std::min(std::abs(way) / (0.5 * tissue_.spacing), max_parts));
    layers_.at_speed(speed);
    ShaftAndTip moved = motion(layers_.relaxing(elapsed / static_cast<double>(parts)));
    if (aside != 0.0) moved.slip(aside, way);
    double dissipated = 0.0;
    for (std::size_t k = 1; k < parts && (in_tissue(state_) || way > 0.0); ++k)
      dissipated += moved.move(before + way * static_cast<double>(k) / static_cast<double>(parts), speed);
    dissipated += moved.move(depth, speed);
    if (!(aside > 0.0 && state_.pierced > pierced)) return dissipated;
    ShaftAndTip begun = motion(layers_.relaxing(0.0));  // a cut that begins unloads as its tip slips aside
    begun.slip(aside, 0.0);
    return dissipated + begun.move(depth, speed);
  }

  /// `travel` is that which is felt.
  Sample sampled(double depth, double travel, double velocity, bool punctured) noexcept {
    const double force_before = state_.last.force;
    Sample sample;
    sample.depth = depth;
    sample.velocity = velocity;
    for (std::size_t i = 0; i < state_.shaft.known; ++i) sample.friction += state_.shaft.force[i];
    (state_.on_contact ? sample.stiffness : sample.cutting) = state_.tip_force;
    sample.force = sample.friction + state_.tip_force;
    sample.lateral = lateral_ratio_ * sample.cutting;
    sample.punctured = punctured;
    const bool was_in = state_.phase != Phase::free;
    const bool in = in_tissue(state_);
    sample.contact = in && !was_in;
    sample.exit = was_in && !in;
    state_.phase = sample.phase = !in                   ? Phase::free
                                  : state_.pierced == 0 ? Phase::deformation
                                  : rests()             ? Phase::hold
                                  : travel > 0.0        ? Phase::insertion
                                  : travel < 0.0        ? Phase::extraction
                                                        : Phase::hold;
    sample.force_by_depth = state_.pierced == 0                   ? layers_[0].contact_slope(depth)
                            : std::abs(travel) >= shortest_travel ? (sample.force - force_before) / travel
                                                                  : state_.last.force_by_depth;
    state_.last = sample;
    return sample;
  }

  /// True if noise explains the travel since longer than a moving needle would stay within it.
  bool rests() const noexcept { return noise_.range > 0.0 && state_.noisy.slip.still >= noise_.rest_time; }
  ShaftAndTip motion(const Relaxing& relaxing) noexcept { return {tissue_, layers_, state_, relaxing}; }

  CondensedTissue tissue_{};
  PathLayers layers_{};
  CondensedState state_{};
  Limits limits_{};
  DepthNoise noise_{};
  double lateral_ratio_ = 0.0;
  std::uint64_t model_ = 0;
  bool valid_ = false;
};

}  // namespace needleforce::solid
