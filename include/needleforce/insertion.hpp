// SPDX-License-Identifier: Apache-2.0
// The simulated insertion: the only stateful object, one cycle at a time.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

#include "bevel.hpp"
#include "layer.hpp"
#include "limits.hpp"
#include "model.hpp"
#include "model_fingerprint.hpp"
#include "model_swap.hpp"
#include "sample.hpp"
#include "state.hpp"
#include "state_bytes.hpp"

namespace needleforce {

/// A needle going in and out of up to eight layers. Trivially copyable: a snapshot is a copy, restoring is
/// assignment. For one thread at a time, as every class here that does not state otherwise; objects share
/// nothing.
class Insertion {
 public:
  /// Checks and prepares the model; with an invalid one every step gives force 0 and `invalid_parameter`.
  /// A first step below a puncture depth counts as pierced and cuts there.
  explicit Insertion(const Model& model, const Limits& limits = {}, const Bevel& bevel = {}) noexcept
      : Insertion(std::span<const Layer>(std::array{Layer{0.0, model}}), limits, bevel) {}

  /// The same for a stack of layers, from the surface down.
  explicit Insertion(std::span<const Layer> layers, const Limits& limits = {},
                     const Bevel& bevel = {}) noexcept
      : limits_(limits),
        valid_(!first_fault(layers).reason && valid(limits) && !first_invalid(bevel)),
        count_(valid_ ? layers.size() : 1) {
    if (!valid_) return;
    lateral_ratio_ = bevel.lateral_ratio();
    model_ = fingerprint(layers);
    for (std::size_t i = 0; i < layers.size(); ++i) layers_[i] = PreparedLayer(layers[i]);
    for (std::size_t i = 1; i < layers.size(); ++i) {
      // a law that stands alone has a spring of its own in each layer
      same_friction_[i] = !layers_[i].resists() && !detail::adds(layers[i].laws) &&
                          same_law(layers[i].laws.friction, layers[i - 1].laws.friction);
      same_cutting_[i] = same_law(layers[i].laws.cutting, layers[i - 1].laws.cutting);
    }
    noise_ = noise_of(limits.depth_noise);
    plain_ = count_ == 1 && layers_[0].plain() && noise_.range == 0.0;
  }

  /// One cycle: the tip is at `depth` [m], moves at `velocity` [m/s], `dt` [s] after the last call.
  /// Wait-free: no allocation, lock, system call or exception; the cost is bounded whatever the depth and
  /// history; only the law `stribeck_cutting` takes microseconds, while its crack runs.
  Sample step(double depth, double velocity, double dt) noexcept {
    const Status status = check(depth, velocity, dt);
    if (status != Status::ok) return refuse(status, dt);
    return accept(depth, velocity, dt, 0.0);
  }

  /// The same for a tip that moved by `aside` [m] where its face pushes it, by which the cut has moved less.
  /// Wait-free.
  Sample step_aside(double depth, double aside, double dt) noexcept {
    const Status status = check(depth, no_velocity, dt);
    if (status != Status::ok) return refuse(status, dt);
    return accept(depth, no_velocity, dt, aside);
  }

  /// Back to before the first contact.
  void reset() noexcept { state_ = InsertionState{}; }

  /// The whole object; assign it back to restore. Wait-free.
  Insertion snapshot() const noexcept { return *this; }

  /// The memory without the model, as bytes that may leave the process. Wait-free.
  using Saved = StateBytes<InsertionState>;
  Saved save() const noexcept { return state_bytes(state_, model_); }
  /// Restores a memory; returns false and changes nothing for bytes of another version or model, altered
  /// bytes, or a state that no insertion can have. Wait-free.
  bool restore(const Saved& bytes) noexcept {
    if (restore_fault(bytes)) return false;
    state_ = bytes.state();
    if (state_.relaxation_dt > 0.0) relax(state_.relaxation_dt);
    return true;
  }
  /// Why `restore` refuses a memory, as the part of it that is at fault, or nullptr. Wait-free.
  const char* restore_fault(const Saved& bytes) const noexcept {
    if (!valid_) return "model of this insertion";
    if (const char* part = foreign_part(bytes, model_)) return part;
    const InsertionState state = bytes.state();
    StateCheck check;
    needleforce::check(check, state, count_);
    for (std::size_t i = 0; i < max_layers; ++i)
      needleforce::check(check, state.layers[i], i < count_ ? layers_[i].largest_contact() : 0.0);
    if (!check.fault() && state.pierced > 0)
      layers_[state.pierced - 1].check(check, state.cut, std::min(limits_.max_speed, fastest));
    return check.fault();
  }

  /// The memory in this process, and back to it. Wait-free.
  using State = InsertionState;
  const State& state() const noexcept { return state_; }
  void return_to(const State& state) noexcept { state_ = state; }

  /// Continues an insertion into other layers: the same tip in the same hole, with other laws; see
  /// docs/decisions/0009. Wait-free.
  void continue_from(const Insertion& old) noexcept {
    state_ = model_ == old.model_ ? old.state_ : ModelSwap::continued(old.stack(), old.state_, stack());
  }

  double puncture_depth_in_model() const noexcept { return layers_[0].puncture; }
  /// Deepest cut so far [m], 0 before the puncture.
  double deepest_cut() const noexcept { return state_.pierced > 0 ? state_.cut.front : 0.0; }
  /// How many layers are pierced, from the surface down.
  std::size_t pierced_layers() const noexcept { return state_.pierced; }
  /// False if the model or a limit was refused: then no step has a force.
  bool accepted() const noexcept { return valid_; }
  const Limits& limits() const noexcept { return limits_; }
  /// Lateral force of the bevel as a share of the cutting force. Wait-free.
  double lateral_ratio() const noexcept { return lateral_ratio_; }
  /// Mean force of slow cutting in the layer that the tip is in [N]. Wait-free.
  double steady_cutting() const noexcept { return state_.pierced > 0 ? front().steady_cutting() : 0.0; }
  /// True where cutting pays for the lateral force of the bevel, which is a share of its own, and in each
  /// layer for one of another cause, if there is.
  bool pays(bool other) const noexcept {
    return !(other || lateral_ratio_ != 0.0) || std::ranges::all_of(stack(), [&](const PreparedLayer& layer) {
      return layer.keeps() && (!other || layer.steady_cutting() > 0.0);
    });
  }
  /// A number that distinguishes models, with the lateral force of the bevel.
  std::uint64_t model_fingerprint() const noexcept {
    Fingerprint print;
    print.add(model_);
    print.add(lateral_ratio_);
    return print.value();
  }
  /// How many layers there are.
  std::size_t layers() const noexcept { return count_; }
  /// Deepest travel that a step takes [m].
  static constexpr double reach() noexcept { return farthest; }
  /// Calls `visit(from, to, force)` from the surface down: friction [N] along the shaft between two depths,
  /// of the last accepted step, whose velocity [m/s] it was. Wait-free.
  template <class Visit>
  void along_shaft(double velocity, Visit visit) const noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
      const LayerState& layer = state_.layers[i];
      const auto& [from, length] = std::pair{layer.shaft.surface, layer.shaft.embedded};
      if (length > 0.0) visit(from, from + length, layers_[i].friction(layer, velocity));
    }
  }

 private:
  /// Ordinary input passes a few comparisons; the rest is classified.
  [[gnu::always_inline]] Status check(double depth, double velocity, double dt) const noexcept {
    if (!valid_) return Status::invalid_parameter;
    if (!ordinary(depth, velocity, dt)) return refusal(depth, velocity, dt);
    const bool possible = state_.started
                              ? consistent(limits_, depth - state_.depth, velocity, state_.waited + dt)
                              : velocity == no_velocity || std::abs(velocity) <= limits_.max_speed;
    return possible ? Status::ok : Status::outside_range;
  }

  /// The last force for a bounded time, then zero; depth and memory do not change.
  [[gnu::noinline]] Sample refuse(Status status, double dt) noexcept {
    const bool waits = dt > 0.0 && std::isfinite(dt);
    if (waits) state_.waited = std::min(state_.waited + dt, longest);
    const bool holding = valid_ && waits && state_.waited <= limits_.hold_time;
    return refused(holding ? state_.last : Sample{}, state_.depth, status);
  }

  Move moved(double depth, double travel, double velocity, double elapsed) const noexcept {
    const bool withdrawing = depth < state_.deepest - std::max(noise_of_depth, noise_.range);
    const bool advancing = !withdrawing && travel > speed_at_rest * elapsed;
    const double below = depth > 0.0 ? std::min(travel, depth) : 0.0;
    return {depth, travel, below, velocity, elapsed, state_.deepest, advancing, withdrawing};
  }

  [[gnu::always_inline]] Sample accept(double depth, double velocity, double dt, double aside) noexcept {
    const bool first = !state_.started;
    const double travel = first ? 0.0 : depth - state_.depth;
    const double elapsed = state_.waited + dt;
    if (velocity == no_velocity) velocity = noise_.range == 0.0 ? travel / elapsed : rate(travel, elapsed);
    state_.deepest = std::max(state_.deepest, depth);
    state_.depth = depth;
    state_.waited = 0.0;
    state_.started = true;
    // rare and slow cases are out of line, so that the short path calls nothing
    const bool whole = state_.pierced > 0 || !(depth > layers_[0].puncture);
    if (!(plain_ && whole)) return in_general(depth, travel, velocity, elapsed, first, aside);
    return through<true>(moved(depth, travel, velocity, elapsed), first, aside);
  }

  [[gnu::noinline]] Sample in_general(double depth, double travel, double velocity, double elapsed,
                                      bool first, double aside) noexcept {
    return through<false>(moved(depth, travel, velocity, elapsed), first, aside);
  }

  /// Cut, contacts from the surface down, shafts from the bottom up, then their sum. Small values
  /// go by value, so that they stay in registers. `plain` is one layer with the paper's friction and cutting
  /// and no relaxation, known at compile time: the same code, half the time.
  template <bool plain>
  [[gnu::always_inline]] Sample through(const Move& move, bool first, double aside) noexcept {
    using KnownFriction = std::conditional_t<plain, laws::Coulomb::Prepared, void>;
    using KnownCutting = std::conditional_t<plain, laws::ConstantCutting::Prepared, void>;
    const std::size_t count = plain ? 1 : count_;
    const DepthNoise noise = plain ? DepthNoise{} : noise_;
    if (!plain && move.dt != state_.relaxation_dt) relax(move.dt);
    Contacts contacts{};
    Move cuts = move;    // what the cut has still to do in this step
    unsigned fresh = 0;  // bits of the layers that are punctured in this step
    for (std::size_t i = 0; i < count; ++i) {
      LayerState& layer = state_.layers[i];
      if (layer.pierced) continue;
      if (!layers_[i].template press<plain>(layer, move, first)) {
        contacts.add(layers_[i], layer, move.depth);
        continue;
      }
      if constexpr (!plain) {
        const bool punctured = pierce(i, cuts);
        contacts.punctured |= punctured;
        fresh |= static_cast<unsigned>(punctured) << i;
      }
    }
    TipForce tip{};
    if (state_.pierced > 0) {
      const PreparedLayer& layer = layers_[plain ? 0 : state_.pierced - 1];
      if (aside != 0.0) cuts.travel -= layer.slip(state_.cut, cuts.depth, aside);
      tip = plain || cuts.dt > 0.0
                ? layer.template cut<KnownCutting>(state_.cut, state_.cutting, state_.returnable, cuts, noise)
                : layer.cut_force(state_.cut, state_.cutting, cuts.depth);
    }
    if (state_.pierced > 0 && move.depth <= state_.cut.entry) tip = state_.cut.receding(tip, move.depth);
    Dragged shafts{};
    double bottom = std::numeric_limits<double>::infinity();
    for (std::size_t i = count; i-- > 0;) {
      const double root = plain ? std::numeric_limits<double>::infinity() : root_of(i);
      const Move& own = !plain && (fresh >> i & 1u) ? since_puncture(move, i) : move;
      const double last_surface = state_.layers[i].shaft.surface;
      shafts += layers_[i].template drag<KnownFriction>(state_.layers[i], own, bottom, root, noise);
      const double surface = state_.layers[i].shaft.surface;
      if (!plain && i > 0 && (fresh >> i & 1u)) go_down(i - 1, last_surface, surface);
      bottom = surface;
      if (!plain) continue_below(i);
    }
    return total(move, contacts, shafts, tip);
  }

  /// The contacts of all layers that are not pierced.
  struct Contacts {
    double force = 0.0, slope = 0.0;
    bool touched = false, beyond = false, punctured = false;
    void add(const PreparedLayer& layer, const LayerState& state, double depth) noexcept {
      force += state.contact_force;
      slope += state.contact_slope;
      touched |= depth > layer.top;
      beyond |= layer.beyond(depth);
    }
  };

  /// At the next interface the force is the larger of cut and contact: they share one tip.
  [[gnu::always_inline]] Sample total(const Move& move, const Contacts& contacts, const Dragged& shafts,
                                      const TipForce& tip) noexcept {
    const bool pushes = contacts.force > tip.force;
    const double stiffness = pushes ? contacts.force - tip.force : 0.0;
    const Phase before = std::exchange(state_.phase, phase(contacts, shafts, move.velocity));
    const bool was_free = before == Phase::free, is_free = state_.phase == Phase::free;
    Sample sample{.depth = move.depth,
                  .velocity = move.velocity,
                  .force = stiffness + shafts.force + tip.force,
                  .stiffness = stiffness,
                  .friction = shafts.force,
                  .cutting = tip.force,
                  .lateral = lateral_ratio_ * tip.force,
                  .force_by_depth = shafts.by_depth + (pushes ? contacts.slope : tip.by_depth),
                  .force_by_velocity = shafts.by_velocity,
                  .phase = state_.phase,
                  .status = contacts.beyond ? Status::outside_range : Status::ok,
                  .contact = was_free && !is_free,
                  .punctured = contacts.punctured,
                  .exit = is_free && !was_free};
    if (limits_.hold_time > 0.0) state_.last = sample;  // otherwise never used again
    return sample;
  }

  Phase phase(const Contacts& contacts, const Dragged& shafts, double velocity) const noexcept {
    if (state_.pierced == 0) return contacts.touched ? Phase::deformation : Phase::free;
    if (!shafts.hold) return Phase::free;
    if (std::abs(velocity) < speed_at_rest || rests()) return Phase::hold;
    return velocity > 0.0 ? Phase::insertion : Phase::extraction;
  }

  /// True if noise explains the travel since longer than a moving needle would stay within it.
  bool rests() const noexcept {
    return noise_.range > 0.0 && state_.layers[state_.pierced - 1].returnable.still >= noise_.rest_time;
  }

  /// Velocity [m/s] of a travel that noise may have made longer: no more than `max_speed`.
  double rate(double travel, double elapsed) const noexcept {
    const double most = std::min(limits_.max_speed, fastest);
    return std::clamp(travel / elapsed, -most, most);
  }

  /// The exponentials of relaxation, where the step's length changed.
  [[gnu::noinline]] void relax(double dt) noexcept {
    state_.relaxation_dt = dt;
    for (std::size_t i = 0; i < count_; ++i) state_.layers[i].relaxing = layers_[i].relaxing(dt);
  }

  /// The layer is punctured: its friction takes over the contact's force. The cut comes to the puncture in
  /// the layer before, and `cuts` is what is left of the step. An interface without resistance does not
  /// change the cut; the result is then false.
  [[gnu::noinline]] bool pierce(std::size_t i, Move& cuts) noexcept {
    const bool carries_on = state_.pierced > 0 && !layers_[i].resists();
    ContactAtPuncture contact = layers_[i].pierce(state_.layers[i], cuts.depth);
    const double at = cut_down_to(contact.extent.puncture, cuts);
    const double carried = carries_on ? front().cut_force(state_.cut, state_.cutting, at).force : -1.0;
    state_.pierced = std::max(state_.pierced, i + 1);
    front().enter(state_.cut, state_.cutting, at, carried);
    if (!(carries_on && same_cutting_[i])) start_crack(at);
    if (carries_on) {
      if (!same_cutting_[i]) state_.cut.begin(at, 1.0, 0.0, 0.0);  // nobody has loaded the other cut
      if (!same_friction_[i]) layers_[i].take_over(state_.layers[i], contact);
      return false;
    }
    const double force = front().cut_force(state_.cut, state_.cutting, at).force;
    state_.cut.begin(at, force, at - layers_[i].top, contact.free_energy);
    contact.cut = force;
    contact.free_force = std::max(0.0, contact.free_force - force);
    contact.free_energy *= 0.5;  // the cut has the other half
    layers_[i].take_over(state_.layers[i], contact);
    return true;
  }
  /// What strains the tissue ahead of a crack at its start, nobody has paid: slip does, before any is
  /// returned.
  void start_crack(double at) noexcept {
    const TipForce begun = front().cut_force(state_.cut, state_.cutting, at);
    state_.returnable = {};
    if (begun.by_depth > 0.0) state_.returnable.energy = -0.5 * begun.force * begun.force / begun.by_depth;
  }
  /// Moves the cut down to a depth that the step passes; returns where it is, and in `cuts` the rest of the
  /// step.
  double cut_down_to(double depth, Move& cuts) noexcept {
    const double left = cuts.travel > 0.0 ? std::clamp((cuts.depth - depth) / cuts.travel, 0.0, 1.0) : 0.0;
    Move until = cuts;
    until.depth = std::min(std::max(depth, cuts.depth - cuts.travel), cuts.depth);
    until.travel -= left * cuts.travel;
    until.dt -= left * cuts.dt;
    if (state_.pierced > 0 && until.dt > 0.0)
      front().template cut<void>(state_.cut, state_.cutting, state_.returnable, until, noise_);
    cuts.travel *= left;
    cuts.dt *= left;
    return until.depth;
  }
  /// Tissue that continues below layer i, where the tip has not come, is strained as in the layer.
  void continue_below(std::size_t i) noexcept {
    const std::size_t below = i + 1;
    if (below < count_ && same_friction_[below] && state_.layers[below].shaft.embedded == 0.0)
      state_.layers[below].friction = state_.layers[i].friction;
  }
  /// The surface below layer i went down from a depth to another, where the tip is deeper.
  [[gnu::noinline]] void go_down(std::size_t i, double from, double to) noexcept {
    const double added = std::min(to, state_.depth) - from;
    if (added > 0.0 && state_.layers[i].shaft.embedded > 0.0) layers_[i].lengthen(state_.layers[i], added);
  }
  /// The travel of a step since the puncture of layer i in it, which is all that strains its tissue.
  [[gnu::noinline]] Move since_puncture(Move move, std::size_t i) const noexcept {
    move.below = std::min(move.below, std::max(0.0, move.depth - state_.layers[i].puncture_depth));
    return move;
  }
  /// Where the tissue around the shaft of layer i begins: above interfaces that do not resist.
  double root_of(std::size_t i) const noexcept {
    while (i > 0 && same_friction_[i]) --i;
    return state_.layers[i].shaft.surface;
  }

  std::span<const PreparedLayer> stack() const noexcept { return {layers_.data(), count_}; }
  const PreparedLayer& front() const noexcept { return layers_[state_.pierced - 1]; }

  static constexpr double noise_of_depth = 3e-5;  // [m] behind the deepest point that is no withdrawal yet

  std::array<PreparedLayer, max_layers> layers_{};
  std::array<bool, max_layers> same_friction_{};  // as the layer above, without an interface
  std::array<bool, max_layers> same_cutting_{};   // as the layer above
  Limits limits_;
  bool valid_;
  bool plain_ = false;
  DepthNoise noise_{};
  double lateral_ratio_ = 0.0;
  std::uint64_t model_ = 0;  // the fingerprint of the model
  std::size_t count_;
  InsertionState state_{};
};

static_assert(std::is_trivially_copyable_v<Insertion>);
static_assert(noexcept(std::declval<Insertion&>().step(0.0, 0.0, 0.0)));

}  // namespace needleforce
