// SPDX-License-Identifier: Apache-2.0
// One layer in the loop: its laws, prepared, and what it remembers.
#pragma once

#include <limits>
#include <type_traits>
#include <utility>
#include <variant>

#include "dispatch.hpp"
#include "force_sums.hpp"
#include "layer_contact.hpp"
#include "model.hpp"
#include "state.hpp"

namespace needleforce {

/// A layer's laws with everything computed that does not change in the loop. Every method is wait-free. `tip`
/// is the table that all layers share.
template <class Real>
class BasicPreparedLayer {
 public:
  /// Calls `visit` with the contact law.
  template <class Visit>
  [[gnu::always_inline]] decltype(auto) on_contact(const TipTable& tip, Visit visit) const noexcept {
    return stiffness_.on(tip, visit);
  }
  BasicPreparedLayer() = default;
  explicit BasicPreparedLayer(const BasicLayer<Real>& layer, const TipTable& tip) noexcept
      : top(layer.top),
        stiffness_(layer.laws.stiffness),
        friction_(prepare(layer.laws.friction)),
        cutting_(prepare(layer.laws.cutting)),
        relaxation_(prepare(layer.laws.relaxation)),
        criterion_(layer.laws.puncture),
        puncture(layer.top + on_contact(tip,
                                        [&](const auto& contact) {
                                          return dispatch(criterion_, [&](const auto& law) {
                                            return law.puncture_depth(contact);
                                          });
                                        })),
        relaxes_(relaxing(1.0).relaxes),
        reach_(on_contact(tip, [](const auto& law) { return law.reach(); })) {}

  /// True for the paper's friction and cutting.
  bool plain() const noexcept {
    return std::holds_alternative<typename laws::BasicCoulomb<Real>::Prepared>(friction_) &&
           std::holds_alternative<typename laws::BasicConstantCutting<Real>::Prepared>(cutting_);
  }
  bool relaxes() const noexcept { return relaxes_; }
  /// False for an interface without resistance.
  bool resists() const noexcept { return puncture > top; }
  /// True beyond the range of the stiffness law's formula.
  bool beyond(double depth) const noexcept { return depth - top > reach_; }
  BasicRelaxing<Real> relaxing(double dt) const noexcept {
    return dispatch(relaxation_, [&](const auto& law) { return law.over(dt); });
  }

  /// No less than a contact of the layer can hold [N], also where another model pressed it.
  double largest_contact(const TipTable& tip) const noexcept {
    return 1e3 + 3.0 * on_contact(tip, [](const auto& law) { return value_of(law.force(farthest)); });
  }
  /// Looks at the cut of the layer that the tip is in, whose force may have come with a speed [m/s].
  void check(StateCheck& check, const BasicCut<Real>& cut, double speed) const noexcept {
    dispatch(cutting_, [&](const auto& law) {
      double most = 2.0 * farthest;
      if constexpr (requires { law.law.springs; })
        most += (1e3 + law.law.damping * speed) / law.law.stiffness;
      check.number("cut", cut.front, -most, most);
      check.number("cut", cut.entry, -farthest, farthest);
      check.number("cut", cut.retreat_limit, -farthest, farthest);
    });
  }

  /// True if a contact is punctured by a tip at a depth [m].
  template <bool elastic>
  [[gnu::always_inline]] bool gives_way(const BasicLayerState<Real>& state, double depth,
                                        bool first) const noexcept {
    return depth > puncture && (elastic || !relaxes_ || first || breaks(state));
  }
  /// Calls `visit` with the friction law and its memory.
  template <class Visit>
  auto with_friction(const BasicLayerState<Real>& state, Visit visit) const noexcept {
    return dispatch(friction_, [&](const auto& law) { return visit(law, memory_of(law, state.friction)); });
  }

  /// The contact of a layer that is not pierced; true if it is punctured instead. `first`: the first step.
  /// `elastic`: no relaxation, known to the caller.
  template <bool elastic, class Motion>
  [[gnu::always_inline]] bool press(BasicLayerState<Real>& state, const Motion& move, bool first,
                                    const TipTable& tip) const noexcept {
    const bool relaxes = !elastic && relaxes_;
    if (gives_way<elastic>(state, value_of(move.depth), first)) return true;
    const Real indentation = larger(0.0, move.depth - top);
    if (indentation == 0.0 && !relaxes) {
      state.indentation = state.contact_force = state.contact_slope = 0.0;
      return false;
    }
    on_contact(tip,
               [&](const auto& law) NEEDLEFORCE_INLINED { press<elastic>(law, state, move, indentation); });
    return false;
  }

  /// Ends the contact. An elastic one is punctured at its puncture depth, one that relaxed at the depth of
  /// the tip. Of the energy [J] of a contact that relaxed, no more than the share of its force is left.
  [[gnu::noinline]] BasicContactAtPuncture<Real> pierce(BasicLayerState<Real>& state, Real depth,
                                                        const TipTable& tip) const noexcept {
    if (!relaxes_) state.contact.elastic = state.contact_force;
    const auto [instant, energy] = on_contact(tip, [&](const auto& law) {
      return std::pair{law.force(state.indentation), law.energy(state.indentation)};
    });
    const bool by_load =
        relaxes_ && resists() && !std::holds_alternative<laws::BasicPunctureDepth<Real>>(criterion_);
    state.puncture_depth = by_load ? loaded_place(state, depth) : puncture;
    state.pierced = true;
    const Real left = instant > 0.0 ? bounded(state.contact_force / instant, 0.0, 1.0) : 0.0;
    BasicContactAtPuncture<Real> contact{state.contact, state.contact_force, energy, state.contact_slope};
    contact.free_energy = left * energy;
    contact.free_force = state.contact_force;
    contact.left = left;
    whole(contact, state, tip);
    contact.relaxing = state.relaxing;
    contact.extent = {top, state.puncture_depth, std::numeric_limits<double>::infinity(), true, top};
    contact.depth = depth;
    return contact;
  }
  /// Force, energy and work at the depth of the puncture, which the last step in contact did not reach.
  void whole(BasicContactAtPuncture<Real>& contact, const BasicLayerState<Real>& state,
             const TipTable& tip) const noexcept {
    on_contact(tip, [&](const auto& law) {
      const Real deepest = state.puncture_depth - top;
      contact.whole_force = contact.left * law.force(deepest);
      contact.whole_energy = contact.left * law.energy(deepest);
      contact.work = contact.whole_energy;
      if (relaxes_) contact.work += state.work - contact.left * law.energy(state.indentation);
    });
  }
  /// Friction takes over from the contact.
  void take_over(BasicLayerState<Real>& state, const BasicContactAtPuncture<Real>& contact) const noexcept {
    dispatch(friction_, [&](const auto& law) { law.pierce(memory_of(law, state.friction), contact); });
  }

  /// True where friction has numbers of the motion alone.
  bool looks_ahead() const noexcept {
    return dispatch(friction_, []<class Law>(const Law& law) {
      return requires(typename Law::Memory memory) { law.look_ahead(memory, 0.0, 0.0); };
    });
  }
  /// Finds them before a step.
  template <class Motion>
  void look_ahead(BasicLayerState<Real>& state, const Motion& move) const noexcept {
    if (!state.pierced) return;
    dispatch(friction_, [&]<class Law>(const Law& law) {
      if constexpr (requires(typename Law::Memory memory) { law.look_ahead(memory, 0.0, 0.0); })
        law.look_ahead(memory_of(law, state.friction), move.velocity, move.below);
    });
  }

  /// The same, for a memory that comes from elsewhere and has them.
  void look_again(BasicLayerState<Real>& state) const noexcept {
    dispatch(friction_, [&]<class Law>(const Law& law) {
      if constexpr (requires(typename Law::Memory memory) { law.look_again(memory); })
        if (law.looked(memory_of(law, std::as_const(state.friction))))
          law.look_again(memory_of(law, state.friction));
    });
  }

  /// Moves the shaft and returns its force, if the layer is pierced. Embedding in the next layer starts at
  /// `bottom`. `Law` is the friction law if the caller knows it, otherwise void; `elastic` as for press().
  template <class Law, bool elastic, class Motion>
  [[gnu::always_inline]] BasicDragged<Real> drag(BasicLayerState<Real>& state, const Motion& move,
                                                 Real bottom, Real root, const DepthNoise& noise,
                                                 const TipTable& tip) const noexcept {
    const BasicLayerExtent<Real> extent{top, state.pierced ? state.puncture_depth : puncture, bottom,
                                        state.pierced, root};
    const BasicRelaxing<Real>& relaxing = elastic ? no_relaxing<Real> : state.relaxing;
    return dispatch_as<Law>(friction_, [&](const auto& law) NEEDLEFORCE_INLINED -> BasicDragged<Real> {
      auto& memory = memory_of(law, state.friction);
      bool known = false;
      if constexpr (in_general<Motion> && requires { law.slip(state.shaft, memory); })
        if (noise.range > 0.0) known = true, advance_in_noise(law, memory, state, move, extent, noise);
      if (!known) law.advance(state.shaft, memory, move, extent, relaxing);
      if constexpr (requires { law.keeps_contact; })
        if (state.pierced) keep_contact(law, memory, move, extent, relaxing, tip);
      // above the tissue nothing drags the shaft; layers that add up have a moving surface of their own
      if constexpr (!requires { law.own_surface; })
        if (move.depth <= 0.0) release(state.shaft, memory);
      if (!state.pierced) return {};
      const Real force = law.force(state.shaft, memory, move.velocity);
      return {force, value_of(law.by_depth(state.shaft, memory, move.velocity)),
              value_of(law.by_velocity(state.shaft, memory, move.velocity)),
              state.shaft.embedded > 0.0 || force != 0.0};
    });
  }

  /// The friction [N] of a shaft that has moved, at a velocity [m/s].
  Real friction(const BasicLayerState<Real>& state, double velocity) const noexcept {
    if (!state.pierced) return 0.0;
    return dispatch(friction_, [&](const auto& law) {
      return law.force(state.shaft, memory_of(law, state.friction), velocity);
    });
  }

  /// The layer below was punctured, and its surface went down: a length [m] of unstrained tissue is added
  /// here.
  [[gnu::noinline]] void lengthen(BasicLayerState<Real>& state, Real length) const noexcept {
    dispatch(friction_, [&](const auto& law) {
      auto& memory = memory_of(law, state.friction);
      if constexpr (requires { memory.thin(1.0); })
        memory.thin(state.shaft.embedded / (state.shaft.embedded + length));
    });
  }

  void enter(BasicCut<Real>& cut, MemoriesOf<BasicCutting<Real>>& memories, Real depth,
             Real carried) const noexcept {
    dispatch(cutting_, [&](const auto& law) { law.enter(cut, memory_of(law, memories), depth, carried); });
  }
  /// Moves the cut and returns its force; `Law` as for drag().
  template <class Law, class Motion>
  [[gnu::always_inline]] BasicTipForce<Real> cut(BasicCut<Real>& cut,
                                                 MemoriesOf<BasicCutting<Real>>& memories,
                                                 BasicReturnableSlip<Real>& returnable, const Motion& move,
                                                 const DepthNoise& noise) const noexcept {
    return dispatch_as<Law>(cutting_, [&](const auto& law) NEEDLEFORCE_INLINED {
      auto& memory = memory_of(law, memories);
      if constexpr (in_general<Motion> && requires { law.law.springs; })
        if (noise.range > 0.0) {
          cut_in_noise(law, cut, memory, returnable, move, noise);
          return BasicTipForce<Real>{law.force(cut, memory, move.depth),
                                     law.by_depth(cut, memory, move.depth)};
        }
      law.advance(cut, memory, move);
      if (noise.range > 0.0) cut.held = smaller(noise.range, larger(cut.held, cut.front - cut.entry));
      return BasicTipForce<Real>{law.force(cut, memory, move.depth), law.by_depth(cut, memory, move.depth)};
    });
  }
  /// The tip at a depth has moved by `aside` [m] without the cut: so far as that pressed. Returns how far.
  Real slip(BasicCut<Real>& cut, Real depth, Real aside) const noexcept {
    const Real last = dispatch(cutting_, [&](const auto& law) { return law.forceless(cut, depth); });
    const Real before = std::exchange(cut.front, smaller(cut.front + aside, larger(cut.front, last)));
    return cut.front - before;
  }
  /// Mean force of slow cutting [N].
  Real steady_cutting() const noexcept {
    return dispatch(cutting_, [](const auto& law) { return law.steady(0.0); });
  }
  /// True where a tip that withdraws gets nothing back of its cutting force.
  bool keeps() const noexcept {
    return dispatch(cutting_, [](const auto& law) {
      if constexpr (requires { law.recovered; }) return !(law.recovered * law.spread > 0.0);
      return true;
    });
  }
  /// The force of the cut without moving it.
  BasicTipForce<Real> cut_force(const BasicCut<Real>& cut, const MemoriesOf<BasicCutting<Real>>& memories,
                                Real depth) const noexcept {
    return dispatch(cutting_, [&](const auto& law) {
      const auto& memory = memory_of(law, memories);
      return BasicTipForce<Real>{law.force(cut, memory, depth), law.by_depth(cut, memory, depth)};
    });
  }

  Real top = 0.0;  ///< [m]

 private:
  friend class ModelSwap;

  template <class Memory>
  [[gnu::always_inline]] static void release(BasicShaft<Real>& shaft, Memory& memory) noexcept {
    shaft.release();
    if constexpr (requires { memory.release(); })
      memory.release();
    else
      memory = Memory{};
  }
  /// What is left of the contact after the puncture, for a friction law that keeps it.
  template <class Law, class Memory>
  [[gnu::noinline]] void keep_contact(const Law& law, Memory& memory, const BasicMove<Real>& move,
                                      const BasicLayerExtent<Real>& extent,
                                      const BasicRelaxing<Real>& relaxing,
                                      const TipTable& tip) const noexcept {
    const Real indentation = law.yield(memory, move, extent, relaxing);
    on_contact(tip, [&](const auto& contact) {
      law.press(memory, contact.force(indentation), contact.slope(indentation));
    });
  }
  template <class Law, class Laws, class Visit>
  [[gnu::always_inline]] static auto dispatch_as(const Laws& laws, Visit visit) noexcept {
    if constexpr (std::is_void_v<Law>)
      return dispatch(laws, visit);
    else
      return visit(known(std::get_if<Law>(&laws)));
  }

  /// As `advance`, for a depth with noise: slip is returned before the tissue unloads.
  template <class Motion>
  static constexpr bool in_general = std::is_same_v<Motion, BasicMove<Real>>;
  template <class Law, class Memory>
  [[gnu::noinline]] static void advance_in_noise(const Law& law, Memory& memory, BasicLayerState<Real>& state,
                                                 const BasicMove<Real>& move,
                                                 const BasicLayerExtent<Real>& extent,
                                                 const DepthNoise& noise) noexcept {
    const BasicSlip<Real> before = law.slip(state.shaft, memory);
    BasicMove<Real> felt = move;
    Real& strains = own_surface<Law> ? felt.travel : felt.below;
    strains = state.returnable.felt(strains, before, move.dt, noise);
    felt.shift = state.returnable.shift;
    felt.waits = state.returnable.waits(strains, noise);
    felt.advancing = move.advancing && strains != 0.0;
    law.advance(state.shaft, memory, felt, extent, state.relaxing);
    state.returnable.add(before.force, law.slip(state.shaft, memory), noise);
  }
  template <class Law>
  static constexpr bool own_surface = requires(const Law& law) { law.own_surface; };
  /// The same for a crack with a spring between the tip and its front, which moves with the tip where the
  /// force stays.
  template <class Law, class Memory>
  [[gnu::noinline]] static void cut_in_noise(const Law& law, BasicCut<Real>& cut, Memory& memory,
                                             BasicReturnableSlip<Real>& returnable,
                                             const BasicMove<Real>& move, const DepthNoise& noise) noexcept {
    const Real before = law.force(cut, memory, move.depth - move.travel);
    BasicMove<Real> felt = move;
    felt.travel = returnable.felt(move.travel, {.force = before}, move.dt, noise);
    cut.front += move.travel - felt.travel;
    const Real front = cut.front;
    law.advance(cut, memory, felt);
    returnable.add(before, {cut.front - front, law.force(cut, memory, move.depth)}, noise);
  }

  template <bool elastic, class Contact, class Motion>
  [[gnu::always_inline]] void press(const Contact& law, BasicLayerState<Real>& state, const Motion& move,
                                    Real indentation) const noexcept {
    const Real before = state.contact_force;
    Real instant;
    if constexpr (requires { law.at(indentation); }) {
      const auto [force, slope] = law.at(indentation);
      instant = force, state.contact_slope = slope;
    } else {
      instant = law.force(indentation), state.contact_slope = law.slope(indentation);
    }
    state.indentation = indentation;
    state.contact_force = instant;
    if (elastic || !relaxes_) return;
    // a contact only pushes: a tip that recedes faster than the dimple recovers leaves it
    state.contact_force =
        state.contact.load(instant - state.contact.elastic, 0.0, std::numeric_limits<double>::infinity(),
                           state.relaxing, move.advancing);
    state.contact_slope *= state.contact.stiffening;
    state.work += 0.5 * (before + state.contact_force) * move.travel;
    if constexpr (!is_plain<Real>)
      if (move.travel > 0.0) state.rise.by_depth = value_of((state.contact_force - before) / move.travel);
  }
  /// Where a contact that relaxes is punctured: at the tip, which an implicit condition of force or work put
  /// there.
  Real loaded_place(const BasicLayerState<Real>& state, const Real& depth) const noexcept {
    if constexpr (is_plain<Real>)
      return depth;
    else
      return dispatch(criterion_, [&](const auto& law) {
        if constexpr (requires { law.energy; })
          return implied(depth, state.work - law.energy, state.contact_force);
        else if constexpr (requires { law.force; })
          return implied(depth, state.contact_force - law.force, state.rise.by_depth);
        else
          return depth;
      });
  }
  bool breaks(const BasicLayerState<Real>& state) const noexcept {
    return dispatch(criterion_, [&](const auto& law) { return law.breaks(state.contact_force, state.work); });
  }

  BasicLayerContact<Real> stiffness_{};
  Prepared<BasicFriction<Real>> friction_{};
  Prepared<BasicCutting<Real>> cutting_{};
  Prepared<BasicRelaxation<Real>> relaxation_{};
  BasicPuncture<Real> criterion_{};

 public:
  Real puncture = 0.0;  ///< depth [m] at which an elastic contact is punctured

 private:
  bool relaxes_ = false;
  Real reach_ = std::numeric_limits<double>::infinity();
};
using PreparedLayer = BasicPreparedLayer<double>;

}  // namespace needleforce

#undef NEEDLEFORCE_INLINED
