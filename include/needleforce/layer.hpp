// SPDX-License-Identifier: Apache-2.0
// One layer in the loop: its laws, prepared, and what it remembers.
#pragma once

#include <algorithm>
#include <limits>
#include <type_traits>
#include <utility>
#include <variant>

#include "dispatch.hpp"
#include "model.hpp"
#include "sample.hpp"

namespace needleforce {

/// Cutting at the tip: force [N] and its derivative by depth [N/m].
struct TipForce {
  double force = 0.0;
  double by_depth = 0.0;
};

/// Friction along the shaft: force [N], its derivatives, and whether a layer holds the needle.
struct Dragged {
  double force = 0.0;
  double by_depth = 0.0;
  double by_velocity = 0.0;
  bool hold = false;
  void operator+=(const Dragged& other) noexcept {
    force += other.force;
    by_depth += other.by_depth;
    by_velocity += other.by_velocity;
    hold |= other.hold;
  }
};

/// What a layer remembers between two steps.
struct LayerState {
  Element contact{};
  Shaft shaft{};
  Relaxing relaxing{};
  double indentation = 0.0;     ///< of the last step in contact [m]
  double contact_force = 0.0;   ///< [N]
  double contact_slope = 0.0;   ///< [N/m]
  double work = 0.0;            ///< of indentation, where it relaxes [J]
  double puncture_depth = 0.0;  ///< depth of the puncture [m]
  bool pierced = false;
};

/// A layer's laws with everything computed that does not change in the loop. Every method is wait-free.
class PreparedLayer {
 public:
  PreparedLayer() = default;
  explicit PreparedLayer(const Layer& layer) noexcept
      : top(layer.top),
        stiffness_(prepare(layer.laws.stiffness)),
        friction_(prepare(layer.laws.friction)),
        cutting_(prepare(layer.laws.cutting)),
        relaxation_(prepare(layer.laws.relaxation)),
        criterion_(layer.laws.puncture),
        puncture(layer.top + puncture_depth(layer.laws.puncture, stiffness_)),
        fades_(relaxing(1.0).fades),
        reach_(dispatch(stiffness_, [](const auto& law) { return law.reach(); })) {}

  /// True for the paper's friction and cutting without relaxation.
  bool plain() const noexcept {
    return std::holds_alternative<laws::Coulomb::Prepared>(friction_) &&
           std::holds_alternative<laws::ConstantCutting::Prepared>(cutting_) && !fades_;
  }
  /// False for an interface that lets the tip through.
  bool resists() const noexcept { return puncture > top; }
  /// True where the stiffness law's formula has ended.
  bool beyond(double depth) const noexcept { return depth - top > reach_; }
  Relaxing relaxing(double dt) const noexcept {
    return dispatch(relaxation_, [&](const auto& law) { return law.over(dt); });
  }

  /// The contact of a layer that is whole; true if it gives way instead. `first`: there was no step before.
  /// `elastic`: the caller knows that nothing fades.
  template <bool elastic>
  [[gnu::always_inline]] bool press(LayerState& state, const Move& move, bool first) const noexcept {
    const bool fades = !elastic && fades_;
    if (move.depth > puncture && (!fades || first || breaks(state))) return true;
    const double indentation = std::max(0.0, move.depth - top);
    if (indentation == 0.0 && !fades) {
      state.indentation = state.contact_force = state.contact_slope = 0.0;
      return false;
    }
    dispatch(stiffness_, [&](const auto& law) { press<elastic>(law, state, move, indentation); });
    return false;
  }

  /// Hands over to friction what the contact held; returns its energy [J]. An elastic contact gave way where
  /// it was said to, one that relaxed where the tip stands.
  [[gnu::noinline]] double pierce(LayerState& state, double depth) const noexcept {
    if (!fades_) state.contact.elastic = state.contact_force;
    const double energy =
        dispatch(stiffness_, [&](const auto& law) { return law.energy(state.indentation); });
    const ContactAtPuncture held{state.contact, state.contact_force, energy, state.contact_slope};
    dispatch(friction_, [&](const auto& law) { law.pierce(state.shaft, held); });
    state.puncture_depth =
        fades_ && !std::holds_alternative<laws::PunctureDepth>(criterion_) ? depth : puncture;
    state.pierced = true;
    return energy;
  }

  /// Moves the shaft; its force, if the layer is pierced. `bottom` is where the next layer's embedding
  /// starts.
  /// `Law` is the friction law where the caller knows it, else void.
  template <class Law>
  [[gnu::always_inline]] Dragged drag(LayerState& state, const Move& move, double bottom) const noexcept {
    const LayerExtent bed{top, state.pierced ? state.puncture_depth : puncture, bottom, state.pierced};
    const Relaxing elastic{};
    const Relaxing& relaxing = std::is_void_v<Law> ? state.relaxing : elastic;
    return dispatch_as<Law>(friction_, [&](const auto& law) __attribute__((always_inline)) -> Dragged {
      law.advance(state.shaft, move, bed, relaxing);
      // above the tissue nothing drags the shaft; layers that add up know their own, moving surface
      if constexpr (!requires { law.own_surface; })
        if (move.depth <= 0.0) state.shaft.release();
      if (!state.pierced) return {};
      const double force = law.force(state.shaft, move.velocity);
      return {force, law.by_depth(state.shaft, move.velocity), law.by_velocity(state.shaft, move.velocity),
              state.shaft.embedded > 0.0 || force != 0.0};
    });
  }

  void enter(Cut& cut, double depth, double carried) const noexcept {
    dispatch(cutting_, [&](const auto& law) { law.enter(cut, depth, carried); });
  }
  /// Moves the cut and returns its force; `Law` as for drag().
  template <class Law>
  [[gnu::always_inline]] TipForce cut(Cut& cut, const Move& move) const noexcept {
    return dispatch_as<Law>(cutting_, [&](const auto& law) __attribute__((always_inline)) {
      law.advance(cut, move);
      return TipForce{law.force(cut, move.depth), law.by_depth(cut, move.depth)};
    });
  }
  /// The force of the cut as it stands.
  TipForce cut(const Cut& cut, double depth) const noexcept {
    return dispatch(
        cutting_, [&](const auto& law) { return TipForce{law.force(cut, depth), law.by_depth(cut, depth)}; });
  }

  /// Goes on with the memory of a layer that this one replaces, the tip at `depth` [m], the next layer below
  /// at `bottom` [m]; see docs/decisions/0009. A contact's forces grow as its law at the deepest point;
  /// friction keeps its traction within the new limits, and takes hold anew where its law is of another kind.
  void adopt(LayerState& state, const PreparedLayer& old, double deepest, double depth,
             double bottom) const noexcept {
    if (!state.pierced) adopt_contact(state, old, deepest);
    adopt_shaft(state, old, std::min(depth, bottom) - top);
    state.puncture_depth = std::clamp(state.puncture_depth + (top - old.top), top, std::max(top, deepest));
  }
  /// Becomes a layer that the tip went through before it was known to be there, or, where it is not
  /// `pierced`, one that was never touched. Of the shaft it has what the tissue there had, but for a law that
  /// counts its own.
  void begin(LayerState& state, bool pierced, double deepest) const noexcept {
    Shaft shaft = state.shaft;
    if (counts_whole_shaft()) shaft = Shaft{};
    state = LayerState{};
    state.shaft = shaft;
    state.pierced = pierced;
    state.puncture_depth = std::min(puncture, std::max(top, deepest));
  }
  /// The same for the cut, which this layer goes on with.
  void adopt(Cut& cut, const PreparedLayer& old, double depth) const noexcept {
    const double at = std::max(cut.front, depth), carried = old.cut(std::as_const(cut), at).force;
    if (cutting_.index() != old.cutting_.index()) cut.speed = 0.0, cut.running = false;
    dispatch(cutting_, [&](const auto& law) {
      law.enter(cut, at, carried);
      if constexpr (requires { law.adopt(cut, depth); }) law.adopt(cut, depth);
    });
  }

  double top = 0.0;  ///< [m]

 private:
  /// True for a friction whose memory is a force and not one per length.
  bool counts_whole_shaft() const noexcept {
    return dispatch(friction_, [](const auto& law) { return requires { law.own_surface; }; });
  }
  /// Force [N] and energy [J] of the contact without relaxation where the tip was at most at a depth [m].
  std::pair<double, double> most(double deepest) const noexcept {
    const double indentation = std::clamp(deepest - top, 0.0, puncture - top);
    return dispatch(stiffness_, [&](const auto& law) {
      return std::pair{law.force(indentation), law.energy(indentation)};
    });
  }

  void adopt_contact(LayerState& state, const PreparedLayer& old, double deepest) const noexcept {
    if (!old.fades_) state.contact = Element{state.contact_force};
    state.contact.continue_with(old.relaxing(1.0), relaxing(1.0));
    const auto [force, energy] = most(deepest);
    const auto [old_force, old_energy] = old.most(deepest);
    const double grown = old_force > 1e-12 ? force / old_force : 0.0;
    for (double* number : {&state.contact.elastic, &state.contact.memory[0], &state.contact.memory[1],
                           &state.contact_force, &state.contact_slope})
      *number *= grown;
    state.work *= old_energy > 1e-15 ? energy / old_energy : 0.0;
    const double max_indentation = fades_ ? std::numeric_limits<double>::infinity() : puncture - top;
    state.indentation = std::clamp(state.indentation + (old.top - top), 0.0, max_indentation);
  }

  void adopt_shaft(LayerState& state, const PreparedLayer& old, double length) const noexcept {
    const bool same = friction_.index() == old.friction_.index();
    if (!same) take_hold(state, old, length);
    dispatch(friction_, [&](const auto& law) {
      if constexpr (requires { law.adopt(state.shaft); })
        law.adopt(state.shaft);
      else
        state.shaft.element.continue_with(same ? old.relaxing(1.0) : Relaxing{}, relaxing(1.0));
    });
  }
  /// The force stays, as a traction along `length` [m] or the other way round, and the place of the surface.
  void take_hold(LayerState& state, const PreparedLayer& old, double length) const noexcept {
    Shaft& shaft = state.shaft;
    if (counts_whole_shaft() && !old.counts_whole_shaft()) shaft.traction *= shaft.embedded;
    if (!counts_whole_shaft() && old.counts_whole_shaft())
      shaft.traction = length > 0.0 ? shaft.traction / length : 0.0;
    shaft.element = Element{shaft.traction};
    shaft.slides = false;
    const double dimple = state.puncture_depth - old.top;
    if (state.pierced)
      shaft.dimple = dimple > 0.0 ? std::clamp((shaft.surface - old.top) / dimple, 0.0, 1.0) : 0.0;
  }

  template <class Law, class Laws, class Visit>
  [[gnu::always_inline]] static auto dispatch_as(const Laws& laws, Visit visit) noexcept {
    if constexpr (std::is_void_v<Law>)
      return dispatch(laws, visit);
    else
      return visit(*std::get_if<Law>(&laws));
  }

  template <bool elastic, class Contact>
  [[gnu::always_inline]] void press(const Contact& law, LayerState& state, const Move& move,
                                    double indentation) const noexcept {
    const double before = state.contact_force;
    const double instant = law.force(indentation);
    state.contact_slope = law.slope(indentation);
    state.indentation = indentation;
    state.contact_force = instant;
    if (elastic || !fades_) return;
    // a contact only pushes: a tip that recedes faster than the dimple recovers leaves it
    state.contact_force =
        state.contact.load(instant - state.contact.elastic, 0.0, std::numeric_limits<double>::infinity(),
                           state.relaxing, move.advancing);
    state.contact_slope *= state.contact.stiffening;
    state.work += 0.5 * (before + state.contact_force) * move.travel;
  }
  bool breaks(const LayerState& state) const noexcept {
    return dispatch(criterion_, [&](const auto& law) { return law.breaks(state.contact_force, state.work); });
  }

  Prepared<Stiffness> stiffness_{};
  Prepared<Friction> friction_{};
  Prepared<Cutting> cutting_{};
  Prepared<Relaxation> relaxation_{};
  Puncture criterion_{};

 public:
  double puncture = 0.0;  ///< depth [m] at which an elastic contact gives way

 private:
  bool fades_ = false;
  double reach_ = std::numeric_limits<double>::infinity();
};

}  // namespace needleforce
