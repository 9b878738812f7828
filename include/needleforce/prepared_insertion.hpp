// SPDX-License-Identifier: Apache-2.0
// An insertion without its memory: layers that are prepared once, and one cycle through them.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

#include "bevel.hpp"
#include "force_sums.hpp"
#include "layer.hpp"
#include "limits.hpp"
#include "model.hpp"
#include "sample.hpp"
#include "state.hpp"
#include "state_bytes.hpp"

namespace needleforce {

/// The laws of up to eight layers with what does not change between two steps: an insertion without its
/// memory, which many insertions may share. Trivially copyable; every method is wait-free.
template <class Real>
class BasicPreparedInsertion {
 public:
  /// Checks the model unless its tip's table is given; an invalid one has `invalid_parameter`, force 0.
  explicit BasicPreparedInsertion(std::span<const Layer> layers, const Limits& limits = {},
                                  const Bevel& bevel = {}, const TipTable* tip = nullptr) noexcept
      : BasicPreparedInsertion(layers, layers, limits, bevel, tip) {}

  /// The same for `numbers`, which are `layers` with derivatives.
  BasicPreparedInsertion(std::span<const Layer> layers, std::span<const BasicLayer<Real>> numbers,
                         const Limits& limits, const Bevel& bevel, const TipTable* tip = nullptr) noexcept;

  /// One cycle of an insertion that remembers `state`: see `Insertion::step`. Inlined by force, as the short
  /// path is: a loop that reads two numbers of a sample does not wait for the others.
  [[gnu::always_inline]] BasicSample<Real> step(BasicInsertionState<Real>& state, double depth,
                                                double velocity, double dt) const noexcept {
    const Status status = check(state, depth, velocity, dt);
    if (status != Status::ok) return refuse(state, status, dt);
    return accept(state, depth, velocity, dt, 0.0);
  }

  /// The same for a tip that moved by `aside` [m] where its face pushes it, by which the cut has moved less.
  /// Wait-free.
  BasicSample<Real> step_aside(BasicInsertionState<Real>& state, double depth, double aside,
                               double dt) const noexcept {
    const Status status = check(state, depth, no_velocity, dt);
    if (status != Status::ok) return refuse(state, status, dt);
    return accept(state, depth, no_velocity, dt, aside);
  }

  /// The memory of an insertion as bytes.
  using Saved = StateBytes<BasicInsertionState<Real>>;
  /// Why bytes are no memory of an insertion into these layers, as the part of it that is at fault, or
  /// nullptr.
  const char* restore_fault(const Saved& bytes) const noexcept;

  /// Puts what follows from the laws and the last motion into a memory that comes from elsewhere.
  void restore_exponentials(BasicInsertionState<Real>& state) const noexcept;
  /// The memory of an insertion into other layers, in these: docs/decisions/0009.
  BasicInsertionState<Real> continued(const BasicPreparedInsertion<Real>& old,
                                      const BasicInsertionState<Real>& state) const noexcept;

  Real puncture_depth_in_model() const noexcept { return layers_[0].puncture; }
  /// False if the model or a limit was refused: then no step has a force.
  bool accepted() const noexcept { return valid_; }
  const Limits& limits() const noexcept { return limits_; }
  /// Lateral force of the bevel as a share of the cutting force. Wait-free.
  double lateral_ratio() const noexcept { return lateral_ratio_; }
  /// Mean force of slow cutting in the layer that the tip is in [N]. Wait-free.
  Real steady_cutting(const BasicInsertionState<Real>& state) const noexcept;
  /// True where cutting pays for the lateral force of the bevel, which is a share of its own, and in each
  /// layer for one of another cause, if there is.
  bool pays(bool other) const noexcept;
  /// A number that distinguishes layers.
  std::uint64_t layers_fingerprint() const noexcept { return model_; }
  /// The same with the lateral force of the bevel.
  std::uint64_t model_fingerprint() const noexcept {
    Fingerprint print;
    print.add(model_);
    print.add(lateral_ratio_);
    return print.value();
  }
  /// One of the layers. Wait-free.
  const BasicPreparedLayer<Real>& layer(std::size_t i) const noexcept { return layers_[i]; }
  /// How many layers there are.
  std::size_t layers() const noexcept { return count_; }
  /// Deepest travel that a step takes [m].
  static constexpr double reach() noexcept { return farthest; }
  /// Calls `visit(from, to, force)` from the surface down: friction [N] along the shaft between two depths,
  /// of the last accepted step, whose velocity [m/s] it was. Wait-free.
  template <class Visit>
  void along_shaft(const BasicInsertionState<Real>& state, double velocity, Visit visit) const noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
      const BasicLayerState<Real>& layer = state.layers[i];
      const auto& [from, length] = std::pair{layer.shaft.surface, layer.shaft.embedded};
      if (length > 0.0) visit(from, from + length, layers_[i].friction(layer, velocity));
    }
  }

 private:
  /// Ordinary input passes a few comparisons; the rest is classified.
  [[gnu::always_inline]] Status check(const BasicInsertionState<Real>& state, double depth, double velocity,
                                      double dt) const noexcept {
    if (!valid_) return Status::invalid_parameter;
    if (!ordinary(depth, velocity, dt)) return refusal(depth, velocity, dt);
    const bool possible = state.started
                              ? consistent(limits_, depth - state.depth, velocity, state.waited + dt)
                              : velocity == no_velocity || abs(velocity) <= limits_.max_speed;
    return possible ? Status::ok : Status::outside_range;
  }

  /// The last force for a bounded time, then zero; depth and memory do not change.
  [[gnu::noinline]] BasicSample<Real> refuse(BasicInsertionState<Real>& state, Status status,
                                             double dt) const noexcept {
    const bool waits = dt > 0.0 && std::isfinite(dt);
    if (waits) state.waited = smaller(state.waited + dt, longest);
    const bool holding = valid_ && waits && state.waited <= limits_.hold_time;
    return refused(holding ? state.last : BasicSample<Real>{}, state.depth, status);
  }

  Move moved(const BasicInsertionState<Real>& state, double depth, double travel, double velocity,
             double elapsed) const noexcept {
    const bool withdrawing = depth < state.deepest - larger(noise_of_depth, noise_.range);
    const bool advancing = !withdrawing && travel > speed_at_rest * elapsed;
    const double below = depth > 0.0 ? smaller(travel, depth) : 0.0;
    return {depth, travel, below, velocity, elapsed, state.deepest, advancing, withdrawing};
  }

  [[gnu::always_inline]] BasicSample<Real> accept(BasicInsertionState<Real>& state, double depth,
                                                  double velocity, double dt, double aside) const noexcept {
    const bool first = !state.started;
    const double travel = first ? 0.0 : depth - state.depth;
    const double elapsed = state.waited + dt;
    if (velocity == no_velocity) velocity = noise_.range == 0.0 ? travel / elapsed : rate(travel, elapsed);
    state.deepest = larger(state.deepest, depth);
    state.depth = depth;
    state.waited = 0.0;
    state.started = true;
    // rare and slow cases are out of line, so that the short path calls nothing
    const bool pierced = state.pierced > 0, whole = pierced || !(depth > layers_[0].puncture);
    if (plain_ && relaxes_ && pierced)
      return through<true, false>(state, moved(state, depth, travel, velocity, elapsed), false, aside);
    if (!(plain_ && !relaxes_ && whole))
      return in_general(state, depth, travel, velocity, elapsed, first, aside);
    return through<true, true>(state, moved(state, depth, travel, velocity, elapsed), first, aside);
  }

  [[gnu::noinline]] BasicSample<Real> in_general(BasicInsertionState<Real>& state, double depth,
                                                 double travel, double velocity, double elapsed, bool first,
                                                 double aside) const noexcept;

  /// Cut, contacts from the surface down, shafts from the bottom up, then their sum. Small values
  /// go by value, so that they stay in registers. `plain` is one layer with the paper's friction and cutting,
  /// `elastic` without relaxation, otherwise pierced, known at compile time: the same code, half the time.
  template <bool plain, bool elastic, class Motion>
  [[gnu::always_inline]] BasicSample<Real> through(BasicInsertionState<Real>& state, const Motion& move,
                                                   bool first, double aside) const noexcept {
    using KnownFriction = std::conditional_t<plain, typename laws::BasicCoulomb<Real>::Prepared, void>;
    using KnownCutting = std::conditional_t<plain, typename laws::BasicConstantCutting<Real>::Prepared, void>;
    const std::size_t count = plain ? 1 : count_;
    const DepthNoise noise = plain ? DepthNoise{} : noise_;
    if (!elastic && value_of(move.dt) != state.relaxation_dt) relax(state, value_of(move.dt));
    BasicPressed<Real> contacts{};
    Motion cuts = move;  // what the cut has still to do in this step
    unsigned fresh = 0;  // bits of the layers that are punctured in this step
    constexpr bool pierced = plain && !elastic;
    for (std::size_t i = 0; i < count && !pierced; ++i) {
      BasicLayerState<Real>& layer = state.layers[i];
      if (layer.pierced) continue;
      if (!layers_[i].template press<elastic>(layer, move, first, tip_)) {
        contacts.add(layers_[i], layer, value_of(move.depth));
        continue;
      }
      if constexpr (!plain) {
        const bool punctured = pierce(state, i, cuts);
        contacts.punctured |= punctured;
        fresh |= static_cast<unsigned>(punctured) << i;
      }
    }
    BasicTipForce<Real> tip{};
    if (state.pierced > 0) {
      const BasicPreparedLayer<Real>& layer = layers_[plain ? 0 : state.pierced - 1];
      if (aside != 0.0) cuts.travel -= value_of(layer.slip(state.cut, cuts.depth, aside));
      tip = plain || cuts.dt > 0.0
                ? layer.template cut<KnownCutting>(state.cut, state.cutting, state.returnable, cuts, noise)
                : layer.cut_force(state.cut, state.cutting, cuts.depth);
    }
    if (state.pierced > 0 && move.depth <= state.cut.entry) tip = state.cut.receding(tip, move.depth);
    for (std::size_t i = 0; !plain && looks_ahead_ && i < count; ++i)
      layers_[i].look_ahead(state.layers[i], move);
    BasicDragged<Real> shafts{};
    Real bottom = endless;
    Motion since = move;
    for (std::size_t i = count; i-- > 0;) {
      const Real root = plain ? endless : state.layers[roots_[i]].shaft.surface;
      if constexpr (!plain)
        if (fresh >> i & 1u) since = since_puncture(state, move, i);
      const Motion& own = !plain && (fresh >> i & 1u) ? since : move;
      const Real last_surface = state.layers[i].shaft.surface;
      shafts +=
          layers_[i].template drag<KnownFriction, elastic>(state.layers[i], own, bottom, root, noise, tip_);
      const Real surface = state.layers[i].shaft.surface;
      if (!plain && i > 0 && (fresh >> i & 1u)) go_down(state, i - 1, last_surface, surface);
      bottom = surface;
      if (!plain) continue_below(state, i);
    }
    return total(state, move, contacts, shafts, tip);
  }

  template <class Motion>
  [[gnu::always_inline]] BasicSample<Real> total(BasicInsertionState<Real>& state, const Motion& move,
                                                 const BasicPressed<Real>& contacts,
                                                 const BasicDragged<Real>& shafts,
                                                 const BasicTipForce<Real>& tip) const noexcept {
    const Phase before = std::exchange(state.phase, phase(state, contacts, shafts, move.velocity));
    BasicSample<Real> sample = summed(move, contacts, shafts, tip);
    sample.lateral = lateral_ratio_ * tip.force;
    sample.phase = state.phase;
    sample.contact = before == Phase::free && state.phase != Phase::free;
    sample.exit = before != Phase::free && state.phase == Phase::free;
    if (limits_.hold_time > 0.0) state.last = sample;  // otherwise never used again
    return sample;
  }

  Phase phase(const BasicInsertionState<Real>& state, const BasicPressed<Real>& contacts,
              const BasicDragged<Real>& shafts, double velocity) const noexcept {
    if (state.pierced == 0) return contacts.touched ? Phase::deformation : Phase::free;
    if (!shafts.hold) return Phase::free;
    if (abs(velocity) < speed_at_rest || rests(state)) return Phase::hold;
    return velocity > 0.0 ? Phase::insertion : Phase::extraction;
  }

  /// True if noise explains the travel since longer than a moving needle would stay within it.
  bool rests(const BasicInsertionState<Real>& state) const noexcept {
    return noise_.range > 0.0 && state.layers[state.pierced - 1].returnable.still >= noise_.rest_time;
  }

  /// Velocity [m/s] of a travel that noise may have made longer: no more than `max_speed`.
  double rate(double travel, double elapsed) const noexcept {
    const double most = smaller(limits_.max_speed, fastest);
    return bounded(travel / elapsed, -most, most);
  }

  /// The exponentials of relaxation, where the step's length changed.
  [[gnu::noinline]] void relax(BasicInsertionState<Real>& state, double dt) const noexcept {
    state.relaxation_dt = dt;
    for (std::size_t i = 0; i < count_; ++i) state.layers[i].relaxing = layers_[i].relaxing(dt);
  }

  /// The layer is punctured: its friction takes over the contact's force. The cut comes to the puncture in
  /// the layer before, and `cuts` is what is left of the step. An interface without resistance does not
  /// change the cut; the result is then false.
  [[gnu::noinline]] bool pierce(BasicInsertionState<Real>& state, std::size_t i,
                                BasicMove<Real>& cuts) const noexcept {
    const bool carries_on = state.pierced > 0 && !layers_[i].resists();
    BasicContactAtPuncture<Real> contact = layers_[i].pierce(state.layers[i], cuts.depth, tip_);
    const Real at = cut_down_to(state, contact.extent.puncture, cuts);
    const Real carried = carries_on ? front(state).cut_force(state.cut, state.cutting, at).force : -1.0;
    if (state.pierced <= i) state.pierced = i + 1;
    front(state).enter(state.cut, state.cutting, at, carried);
    if (!(carries_on && same_cutting_[i])) start_crack(state, at);
    if (carries_on) {
      if (!same_cutting_[i]) state.cut.begin(at, 1.0, 0.0, 0.0);  // nobody has loaded the other cut
      if (!continues(i)) layers_[i].take_over(state.layers[i], contact);
      return false;
    }
    const Real force = front(state).cut_force(state.cut, state.cutting, at).force;
    state.cut.begin(at, force, at - layers_[i].top, contact.free_energy);
    contact.cut = force;
    contact.free_force = larger(0.0, contact.free_force - force);
    contact.free_energy *= 0.5;  // the cut has the other half
    layers_[i].take_over(state.layers[i], contact);
    return true;
  }
  /// What strains the tissue ahead of a crack at its start, nobody has paid: slip does, before any is
  /// returned.
  void start_crack(BasicInsertionState<Real>& state, Real at) const noexcept {
    const BasicTipForce<Real> begun = front(state).cut_force(state.cut, state.cutting, at);
    state.returnable = {};
    if (begun.by_depth > 0.0) state.returnable.energy = -0.5 * begun.force * begun.force / begun.by_depth;
  }
  /// Moves the cut down to a depth that the step passes; returns where it is, and in `cuts` the rest of the
  /// step.
  Real cut_down_to(BasicInsertionState<Real>& state, Real depth, BasicMove<Real>& cuts) const noexcept {
    const Real left = cuts.travel > 0.0 ? bounded((cuts.depth - depth) / cuts.travel, 0.0, 1.0) : 0.0;
    BasicMove<Real> until = cuts;
    until.depth = smaller(larger(depth, cuts.depth - cuts.travel), cuts.depth);
    until.travel -= left * cuts.travel;
    until.dt -= left * cuts.dt;
    if (state.pierced > 0 && until.dt > 0.0)
      front(state).template cut<void>(state.cut, state.cutting, state.returnable, until, noise_);
    cuts.travel *= left;
    cuts.dt *= left;
    return until.depth;
  }
  /// The same tissue as the layer above, without an interface.
  bool continues(std::size_t i) const noexcept { return roots_[i] != i; }
  /// Tissue that continues below layer i, where the tip has not come, is strained as in the layer.
  void continue_below(BasicInsertionState<Real>& state, std::size_t i) const noexcept {
    const std::size_t below = i + 1;
    if (below < count_ && continues(below) && state.layers[below].shaft.embedded == 0.0)
      state.layers[below].friction = state.layers[i].friction;
  }
  /// The surface below layer i went down from a depth to another, where the tip is deeper.
  [[gnu::noinline]] void go_down(BasicInsertionState<Real>& state, std::size_t i, Real from,
                                 Real to) const noexcept {
    const Real added = smaller(to, state.depth) - from;
    if (added > 0.0 && state.layers[i].shaft.embedded > 0.0) layers_[i].lengthen(state.layers[i], added);
  }
  /// Of a step in which layer i was punctured, the travel since then, which is all that strains its tissue.
  [[gnu::noinline]] static BasicMove<Real> since_puncture(const BasicInsertionState<Real>& state,
                                                          BasicMove<Real> move, std::size_t i) noexcept {
    move.below = smaller(move.below, larger(move.depth - state.layers[i].puncture_depth, Real(0.0)));
    return move;
  }
  const BasicPreparedLayer<Real>& front(const BasicInsertionState<Real>& state) const noexcept {
    return layers_[state.pierced - 1];
  }
  static constexpr double endless = std::numeric_limits<double>::infinity();
  static constexpr double noise_of_depth = 3e-5;  // [m] behind the deepest point that is no withdrawal yet

  std::array<BasicPreparedLayer<Real>, max_layers> layers_{};
  TipTable tip_{};                               // of the layers whose contact is that of a tip
  std::array<bool, max_layers> same_cutting_{};  // as the layer above
  // where the tissue around the shaft begins: above interfaces that do not resist
  std::array<std::uint8_t, max_layers> roots_{};
  Limits limits_;
  bool valid_;
  bool plain_ = false;        // one layer with the paper's friction and cutting
  bool relaxes_ = false;      // and it relaxes
  bool looks_ahead_ = false;  // several layers, and in one friction has numbers of the motion alone
  DepthNoise noise_{};
  double lateral_ratio_ = 0.0;
  std::uint64_t model_ = 0;  // the fingerprint of the model
  std::size_t count_;
};
using PreparedInsertion = BasicPreparedInsertion<double>;

static_assert(std::is_trivially_copyable_v<PreparedInsertion>);

}  // namespace needleforce
