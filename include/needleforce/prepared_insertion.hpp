// SPDX-License-Identifier: Apache-2.0
// An insertion without its memory: layers that are prepared once, and one cycle through them.
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

/// The laws of up to eight layers with what does not change between two steps: an insertion without its
/// memory, which many insertions may share. Trivially copyable; every method is wait-free.
class PreparedInsertion {
 public:
  /// Checks and prepares the model; with an invalid one every step gives force 0 and `invalid_parameter`.
  explicit PreparedInsertion(std::span<const Layer> layers, const Limits& limits = {},
                             const Bevel& bevel = {}) noexcept
      : limits_(limits),
        valid_(!first_fault(layers).reason && valid(limits) && !first_invalid(bevel)),
        count_(valid_ ? layers.size() : 1) {
    if (!valid_) return;
    lateral_ratio_ = bevel.lateral_ratio();
    model_ = fingerprint(layers);
    if (const auto* law = detail::first_tip(layers)) tip_ = TipTable(law->tip, law->radius);
    for (std::size_t i = 0; i < layers.size(); ++i) layers_[i] = PreparedLayer(layers[i], tip_);
    for (std::size_t i = 1; i < layers.size(); ++i) {
      // a law that stands alone has a spring of its own in each layer
      same_friction_[i] = !layers_[i].resists() && !detail::adds(layers[i].laws) &&
                          same_law(layers[i].laws.friction, layers[i - 1].laws.friction);
      same_cutting_[i] = same_law(layers[i].laws.cutting, layers[i - 1].laws.cutting);
    }
    noise_ = noise_of(limits.depth_noise);
    plain_ = count_ == 1 && layers_[0].plain() && noise_.range == 0.0;
  }

  /// One cycle of an insertion that remembers `state`: see `Insertion::step`.
  Sample step(InsertionState& state, double depth, double velocity, double dt) const noexcept {
    const Status status = check(state, depth, velocity, dt);
    if (status != Status::ok) return refuse(state, status, dt);
    return accept(state, depth, velocity, dt, 0.0);
  }

  /// The same for a tip that moved by `aside` [m] where its face pushes it, by which the cut has moved less.
  /// Wait-free.
  Sample step_aside(InsertionState& state, double depth, double aside, double dt) const noexcept {
    const Status status = check(state, depth, no_velocity, dt);
    if (status != Status::ok) return refuse(state, status, dt);
    return accept(state, depth, no_velocity, dt, aside);
  }

  /// The memory of an insertion as bytes.
  using Saved = StateBytes<InsertionState>;
  /// Why bytes are no memory of an insertion into these layers, as the part of it that is at fault, or
  /// nullptr.
  const char* restore_fault(const Saved& bytes) const noexcept {
    if (!valid_) return "model of this insertion";
    if (const char* part = foreign_part(bytes, model_)) return part;
    const InsertionState state = bytes.state();
    StateCheck check;
    needleforce::check(check, state, count_);
    for (std::size_t i = 0; i < max_layers; ++i)
      needleforce::check(check, state.layers[i], i < count_ ? layers_[i].largest_contact(tip_) : 0.0);
    if (!check.fault() && state.pierced > 0)
      layers_[state.pierced - 1].check(check, state.cut, std::min(limits_.max_speed, fastest));
    return check.fault();
  }

  /// Puts the exponentials of relaxation into a memory that comes from elsewhere.
  void restore_relaxation(InsertionState& state) const noexcept {
    if (state.relaxation_dt > 0.0) relax(state, state.relaxation_dt);
  }
  /// The memory of an insertion into other layers, in these: docs/decisions/0009.
  InsertionState continued(const PreparedInsertion& old, const InsertionState& state) const noexcept {
    return model_ == old.model_ ? state : ModelSwap::continued(old.stack(), state, stack());
  }

  double puncture_depth_in_model() const noexcept { return layers_[0].puncture; }
  /// False if the model or a limit was refused: then no step has a force.
  bool accepted() const noexcept { return valid_; }
  const Limits& limits() const noexcept { return limits_; }
  /// Lateral force of the bevel as a share of the cutting force. Wait-free.
  double lateral_ratio() const noexcept { return lateral_ratio_; }
  /// Mean force of slow cutting in the layer that the tip is in [N]. Wait-free.
  double steady_cutting(const InsertionState& state) const noexcept {
    return state.pierced > 0 ? front(state).steady_cutting() : 0.0;
  }
  /// True where cutting pays for the lateral force of the bevel, which is a share of its own, and in each
  /// layer for one of another cause, if there is.
  bool pays(bool other) const noexcept {
    if (!(other || lateral_ratio_ != 0.0)) return true;
    for (std::size_t i = 0; i < count_; ++i)
      if (!layers_[i].keeps() || (other && !(layers_[i].steady_cutting() > 0.0))) return false;
    return true;
  }
  /// A number that distinguishes layers.
  std::uint64_t layers_fingerprint() const noexcept { return model_; }
  /// The same with the lateral force of the bevel.
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
  void along_shaft(const InsertionState& state, double velocity, Visit visit) const noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
      const LayerState& layer = state.layers[i];
      const auto& [from, length] = std::pair{layer.shaft.surface, layer.shaft.embedded};
      if (length > 0.0) visit(from, from + length, layers_[i].friction(layer, velocity));
    }
  }

 private:
  /// Ordinary input passes a few comparisons; the rest is classified.
  [[gnu::always_inline]] Status check(const InsertionState& state, double depth, double velocity,
                                      double dt) const noexcept {
    if (!valid_) return Status::invalid_parameter;
    if (!ordinary(depth, velocity, dt)) return refusal(depth, velocity, dt);
    const bool possible = state.started
                              ? consistent(limits_, depth - state.depth, velocity, state.waited + dt)
                              : velocity == no_velocity || std::abs(velocity) <= limits_.max_speed;
    return possible ? Status::ok : Status::outside_range;
  }

  /// The last force for a bounded time, then zero; depth and memory do not change.
  [[gnu::noinline]] Sample refuse(InsertionState& state, Status status, double dt) const noexcept {
    const bool waits = dt > 0.0 && std::isfinite(dt);
    if (waits) state.waited = std::min(state.waited + dt, longest);
    const bool holding = valid_ && waits && state.waited <= limits_.hold_time;
    return refused(holding ? state.last : Sample{}, state.depth, status);
  }

  Move moved(const InsertionState& state, double depth, double travel, double velocity,
             double elapsed) const noexcept {
    const bool withdrawing = depth < state.deepest - std::max(noise_of_depth, noise_.range);
    const bool advancing = !withdrawing && travel > speed_at_rest * elapsed;
    const double below = depth > 0.0 ? std::min(travel, depth) : 0.0;
    return {depth, travel, below, velocity, elapsed, state.deepest, advancing, withdrawing};
  }

  [[gnu::always_inline]] Sample accept(InsertionState& state, double depth, double velocity, double dt,
                                       double aside) const noexcept {
    const bool first = !state.started;
    const double travel = first ? 0.0 : depth - state.depth;
    const double elapsed = state.waited + dt;
    if (velocity == no_velocity) velocity = noise_.range == 0.0 ? travel / elapsed : rate(travel, elapsed);
    state.deepest = std::max(state.deepest, depth);
    state.depth = depth;
    state.waited = 0.0;
    state.started = true;
    // rare and slow cases are out of line, so that the short path calls nothing
    const bool whole = state.pierced > 0 || !(depth > layers_[0].puncture);
    if (!(plain_ && whole)) return in_general(state, depth, travel, velocity, elapsed, first, aside);
    return through<true>(state, moved(state, depth, travel, velocity, elapsed), first, aside);
  }

  [[gnu::noinline]] Sample in_general(InsertionState& state, double depth, double travel, double velocity,
                                      double elapsed, bool first, double aside) const noexcept {
    return through<false>(state, moved(state, depth, travel, velocity, elapsed), first, aside);
  }

  /// Cut, contacts from the surface down, shafts from the bottom up, then their sum. Small values
  /// go by value, so that they stay in registers. `plain` is one layer with the paper's friction and cutting
  /// and no relaxation, known at compile time: the same code, half the time.
  template <bool plain>
  [[gnu::always_inline]] Sample through(InsertionState& state, const Move& move, bool first,
                                        double aside) const noexcept {
    using KnownFriction = std::conditional_t<plain, laws::Coulomb::Prepared, void>;
    using KnownCutting = std::conditional_t<plain, laws::ConstantCutting::Prepared, void>;
    const std::size_t count = plain ? 1 : count_;
    const DepthNoise noise = plain ? DepthNoise{} : noise_;
    if (!plain && move.dt != state.relaxation_dt) relax(state, move.dt);
    Contacts contacts{};
    Move cuts = move;    // what the cut has still to do in this step
    unsigned fresh = 0;  // bits of the layers that are punctured in this step
    for (std::size_t i = 0; i < count; ++i) {
      LayerState& layer = state.layers[i];
      if (layer.pierced) continue;
      if (!layers_[i].template press<plain>(layer, move, first, tip_)) {
        contacts.add(layers_[i], layer, move.depth);
        continue;
      }
      if constexpr (!plain) {
        const bool punctured = pierce(state, i, cuts);
        contacts.punctured |= punctured;
        fresh |= static_cast<unsigned>(punctured) << i;
      }
    }
    TipForce tip{};
    if (state.pierced > 0) {
      const PreparedLayer& layer = layers_[plain ? 0 : state.pierced - 1];
      if (aside != 0.0) cuts.travel -= layer.slip(state.cut, cuts.depth, aside);
      tip = plain || cuts.dt > 0.0
                ? layer.template cut<KnownCutting>(state.cut, state.cutting, state.returnable, cuts, noise)
                : layer.cut_force(state.cut, state.cutting, cuts.depth);
    }
    if (state.pierced > 0 && move.depth <= state.cut.entry) tip = state.cut.receding(tip, move.depth);
    Dragged shafts{};
    double bottom = std::numeric_limits<double>::infinity();
    for (std::size_t i = count; i-- > 0;) {
      const double root = plain ? std::numeric_limits<double>::infinity() : root_of(state, i);
      const Move& own = !plain && (fresh >> i & 1u) ? since_puncture(state, move, i) : move;
      const double last_surface = state.layers[i].shaft.surface;
      shafts += layers_[i].template drag<KnownFriction>(state.layers[i], own, bottom, root, noise, tip_);
      const double surface = state.layers[i].shaft.surface;
      if (!plain && i > 0 && (fresh >> i & 1u)) go_down(state, i - 1, last_surface, surface);
      bottom = surface;
      if (!plain) continue_below(state, i);
    }
    return total(state, move, contacts, shafts, tip);
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
  [[gnu::always_inline]] Sample total(InsertionState& state, const Move& move, const Contacts& contacts,
                                      const Dragged& shafts, const TipForce& tip) const noexcept {
    const bool pushes = contacts.force > tip.force;
    const double stiffness = pushes ? contacts.force - tip.force : 0.0;
    const Phase before = std::exchange(state.phase, phase(state, contacts, shafts, move.velocity));
    const bool was_free = before == Phase::free, is_free = state.phase == Phase::free;
    Sample sample{.depth = move.depth,
                  .velocity = move.velocity,
                  .force = stiffness + shafts.force + tip.force,
                  .stiffness = stiffness,
                  .friction = shafts.force,
                  .cutting = tip.force,
                  .lateral = lateral_ratio_ * tip.force,
                  .force_by_depth = shafts.by_depth + (pushes ? contacts.slope : tip.by_depth),
                  .force_by_velocity = shafts.by_velocity,
                  .phase = state.phase,
                  .status = contacts.beyond ? Status::outside_range : Status::ok,
                  .contact = was_free && !is_free,
                  .punctured = contacts.punctured,
                  .exit = is_free && !was_free};
    if (limits_.hold_time > 0.0) state.last = sample;  // otherwise never used again
    return sample;
  }

  Phase phase(const InsertionState& state, const Contacts& contacts, const Dragged& shafts,
              double velocity) const noexcept {
    if (state.pierced == 0) return contacts.touched ? Phase::deformation : Phase::free;
    if (!shafts.hold) return Phase::free;
    if (std::abs(velocity) < speed_at_rest || rests(state)) return Phase::hold;
    return velocity > 0.0 ? Phase::insertion : Phase::extraction;
  }

  /// True if noise explains the travel since longer than a moving needle would stay within it.
  bool rests(const InsertionState& state) const noexcept {
    return noise_.range > 0.0 && state.layers[state.pierced - 1].returnable.still >= noise_.rest_time;
  }

  /// Velocity [m/s] of a travel that noise may have made longer: no more than `max_speed`.
  double rate(double travel, double elapsed) const noexcept {
    const double most = std::min(limits_.max_speed, fastest);
    return std::clamp(travel / elapsed, -most, most);
  }

  /// The exponentials of relaxation, where the step's length changed.
  [[gnu::noinline]] void relax(InsertionState& state, double dt) const noexcept {
    state.relaxation_dt = dt;
    for (std::size_t i = 0; i < count_; ++i) state.layers[i].relaxing = layers_[i].relaxing(dt);
  }

  /// The layer is punctured: its friction takes over the contact's force. The cut comes to the puncture in
  /// the layer before, and `cuts` is what is left of the step. An interface without resistance does not
  /// change the cut; the result is then false.
  [[gnu::noinline]] bool pierce(InsertionState& state, std::size_t i, Move& cuts) const noexcept {
    const bool carries_on = state.pierced > 0 && !layers_[i].resists();
    ContactAtPuncture contact = layers_[i].pierce(state.layers[i], cuts.depth, tip_);
    const double at = cut_down_to(state, contact.extent.puncture, cuts);
    const double carried = carries_on ? front(state).cut_force(state.cut, state.cutting, at).force : -1.0;
    state.pierced = std::max(state.pierced, i + 1);
    front(state).enter(state.cut, state.cutting, at, carried);
    if (!(carries_on && same_cutting_[i])) start_crack(state, at);
    if (carries_on) {
      if (!same_cutting_[i]) state.cut.begin(at, 1.0, 0.0, 0.0);  // nobody has loaded the other cut
      if (!same_friction_[i]) layers_[i].take_over(state.layers[i], contact);
      return false;
    }
    const double force = front(state).cut_force(state.cut, state.cutting, at).force;
    state.cut.begin(at, force, at - layers_[i].top, contact.free_energy);
    contact.cut = force;
    contact.free_force = std::max(0.0, contact.free_force - force);
    contact.free_energy *= 0.5;  // the cut has the other half
    layers_[i].take_over(state.layers[i], contact);
    return true;
  }
  /// What strains the tissue ahead of a crack at its start, nobody has paid: slip does, before any is
  /// returned.
  void start_crack(InsertionState& state, double at) const noexcept {
    const TipForce begun = front(state).cut_force(state.cut, state.cutting, at);
    state.returnable = {};
    if (begun.by_depth > 0.0) state.returnable.energy = -0.5 * begun.force * begun.force / begun.by_depth;
  }
  /// Moves the cut down to a depth that the step passes; returns where it is, and in `cuts` the rest of the
  /// step.
  double cut_down_to(InsertionState& state, double depth, Move& cuts) const noexcept {
    const double left = cuts.travel > 0.0 ? std::clamp((cuts.depth - depth) / cuts.travel, 0.0, 1.0) : 0.0;
    Move until = cuts;
    until.depth = std::min(std::max(depth, cuts.depth - cuts.travel), cuts.depth);
    until.travel -= left * cuts.travel;
    until.dt -= left * cuts.dt;
    if (state.pierced > 0 && until.dt > 0.0)
      front(state).template cut<void>(state.cut, state.cutting, state.returnable, until, noise_);
    cuts.travel *= left;
    cuts.dt *= left;
    return until.depth;
  }
  /// Tissue that continues below layer i, where the tip has not come, is strained as in the layer.
  void continue_below(InsertionState& state, std::size_t i) const noexcept {
    const std::size_t below = i + 1;
    if (below < count_ && same_friction_[below] && state.layers[below].shaft.embedded == 0.0)
      state.layers[below].friction = state.layers[i].friction;
  }
  /// The surface below layer i went down from a depth to another, where the tip is deeper.
  [[gnu::noinline]] void go_down(InsertionState& state, std::size_t i, double from,
                                 double to) const noexcept {
    const double added = std::min(to, state.depth) - from;
    if (added > 0.0 && state.layers[i].shaft.embedded > 0.0) layers_[i].lengthen(state.layers[i], added);
  }
  /// The travel of a step since the puncture of layer i in it, which is all that strains its tissue.
  [[gnu::noinline]] static Move since_puncture(const InsertionState& state, Move move,
                                               std::size_t i) noexcept {
    move.below = std::min(move.below, std::max(0.0, move.depth - state.layers[i].puncture_depth));
    return move;
  }
  /// Where the tissue around the shaft of layer i begins: above interfaces that do not resist.
  double root_of(const InsertionState& state, std::size_t i) const noexcept {
    while (i > 0 && same_friction_[i]) --i;
    return state.layers[i].shaft.surface;
  }

  ModelSwap::Stack stack() const noexcept { return {{layers_.data(), count_}, tip_}; }
  const PreparedLayer& front(const InsertionState& state) const noexcept {
    return layers_[state.pierced - 1];
  }

  static constexpr double noise_of_depth = 3e-5;  // [m] behind the deepest point that is no withdrawal yet

  std::array<PreparedLayer, max_layers> layers_{};
  TipTable tip_{};                                // of the layers whose contact is that of a tip
  std::array<bool, max_layers> same_friction_{};  // as the layer above, without an interface
  std::array<bool, max_layers> same_cutting_{};   // as the layer above
  Limits limits_;
  bool valid_;
  bool plain_ = false;
  DepthNoise noise_{};
  double lateral_ratio_ = 0.0;
  std::uint64_t model_ = 0;  // the fingerprint of the model
  std::size_t count_;
};

static_assert(std::is_trivially_copyable_v<PreparedInsertion>);

}  // namespace needleforce
