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
#include "state.hpp"

// Before C++23 a lambda takes this only as g++ and clang spell it; another compiler inlines by its own
// judgement.
#if defined(__GNUC__) || defined(__clang__)
#define NEEDLEFORCE_INLINED __attribute__((always_inline))
#else
#define NEEDLEFORCE_INLINED
#endif

namespace needleforce {

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

/// The contact laws as a layer keeps them: of `tip_contact` without the table, which the insertion has.
struct SharedTip {
  double modulus;  // reduced [Pa]
};
namespace detail {
template <class Laws>
struct contacts_in_layer;
template <class... L>
struct contacts_in_layer<std::variant<L...>> {
  template <class Law>
  static auto keep(const Law& law) noexcept {
    if constexpr (std::is_same_v<Law, laws::TipContact>)
      return SharedTip{law.reduced_modulus};
    else
      return law.prepare();
  }
  using type = std::variant<decltype(keep(std::declval<L>()))...>;
};
}  // namespace detail

/// A layer's laws with everything computed that does not change in the loop. Every method is wait-free. `tip`
/// is the table that all layers share.
class PreparedLayer {
  using Contacts = detail::contacts_in_layer<Stiffness>;

 public:
  /// Calls `visit` with the contact law.
  template <class Visit>
  [[gnu::always_inline]] decltype(auto) on_contact(const TipTable& tip, Visit visit) const noexcept {
    return dispatch(stiffness_, [&](const auto& law) NEEDLEFORCE_INLINED -> decltype(auto) {
      if constexpr (requires { law.modulus; })
        return visit(laws::TipContact::OnTable<const TipTable&>{law.modulus, tip});
      else
        return visit(law);
    });
  }
  PreparedLayer() = default;
  explicit PreparedLayer(const Layer& layer, const TipTable& tip) noexcept
      : top(layer.top),
        stiffness_(std::visit([](const auto& law) { return Contacts::type{Contacts::keep(law)}; },
                              layer.laws.stiffness)),
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

  /// True for the paper's friction and cutting without relaxation.
  bool plain() const noexcept {
    return std::holds_alternative<laws::Coulomb::Prepared>(friction_) &&
           std::holds_alternative<laws::ConstantCutting::Prepared>(cutting_) && !relaxes_;
  }
  /// False for an interface without resistance.
  bool resists() const noexcept { return puncture > top; }
  /// True beyond the range of the stiffness law's formula.
  bool beyond(double depth) const noexcept { return depth - top > reach_; }
  Relaxing relaxing(double dt) const noexcept {
    return dispatch(relaxation_, [&](const auto& law) { return law.over(dt); });
  }

  /// No less than a contact of the layer can hold [N], also where another model pressed it.
  double largest_contact(const TipTable& tip) const noexcept {
    return 1e3 + 3.0 * on_contact(tip, [](const auto& law) { return law.force(farthest); });
  }
  /// Looks at the cut of the layer that the tip is in, whose force may have come with a speed [m/s].
  void check(StateCheck& check, const Cut& cut, double speed) const noexcept {
    dispatch(cutting_, [&](const auto& law) {
      double most = 2.0 * farthest;
      if constexpr (requires { law.law.springs; })
        most += (1e3 + law.law.damping * speed) / law.law.stiffness;
      check.number("cut", cut.front, -most, most);
      check.number("cut", cut.entry, -farthest, farthest);
      check.number("cut", cut.retreat_limit, -farthest, farthest);
    });
  }

  /// The contact of a layer that is not pierced; true if it is punctured instead. `first`: the first step.
  /// `elastic`: no relaxation, known to the caller.
  template <bool elastic>
  [[gnu::always_inline]] bool press(LayerState& state, const Move& move, bool first,
                                    const TipTable& tip) const noexcept {
    const bool relaxes = !elastic && relaxes_;
    if (move.depth > puncture && (!relaxes || first || breaks(state))) return true;
    const double indentation = std::max(0.0, move.depth - top);
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
  [[gnu::noinline]] ContactAtPuncture pierce(LayerState& state, double depth,
                                             const TipTable& tip) const noexcept {
    if (!relaxes_) state.contact.elastic = state.contact_force;
    const auto [instant, energy] = on_contact(tip, [&](const auto& law) {
      return std::pair{law.force(state.indentation), law.energy(state.indentation)};
    });
    state.puncture_depth =
        relaxes_ && resists() && !std::holds_alternative<laws::PunctureDepth>(criterion_) ? depth : puncture;
    state.pierced = true;
    const double left = instant > 0.0 ? std::clamp(state.contact_force / instant, 0.0, 1.0) : 0.0;
    ContactAtPuncture contact{state.contact, state.contact_force, energy, state.contact_slope};
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
  void whole(ContactAtPuncture& contact, const LayerState& state, const TipTable& tip) const noexcept {
    on_contact(tip, [&](const auto& law) {
      const double deepest = state.puncture_depth - top;
      contact.whole_force = contact.left * law.force(deepest);
      contact.whole_energy = contact.left * law.energy(deepest);
      contact.work = contact.whole_energy;
      if (relaxes_) contact.work += state.work - contact.left * law.energy(state.indentation);
    });
  }
  /// Friction takes over from the contact.
  void take_over(LayerState& state, const ContactAtPuncture& contact) const noexcept {
    dispatch(friction_, [&](const auto& law) { law.pierce(memory_of(law, state.friction), contact); });
  }

  /// Moves the shaft and returns its force, if the layer is pierced. Embedding in the next layer starts at
  /// `bottom`. `Law` is the friction law if the caller knows it, otherwise void.

  template <class Law>
  [[gnu::always_inline]] Dragged drag(LayerState& state, const Move& move, double bottom, double root,
                                      const DepthNoise& noise, const TipTable& tip) const noexcept {
    const LayerExtent extent{top, state.pierced ? state.puncture_depth : puncture, bottom, state.pierced,
                             root};
    const Relaxing elastic{};
    const Relaxing& relaxing = std::is_void_v<Law> ? state.relaxing : elastic;
    return dispatch_as<Law>(friction_, [&](const auto& law) NEEDLEFORCE_INLINED -> Dragged {
      auto& memory = memory_of(law, state.friction);
      bool known = false;
      if constexpr (requires { law.slip(state.shaft, memory); })
        if (noise.range > 0.0) known = true, advance_in_noise(law, memory, state, move, extent, noise);
      if (!known) law.advance(state.shaft, memory, move, extent, relaxing);
      if constexpr (requires { law.keeps_contact; })
        if (state.pierced) keep_contact(law, memory, move, extent, relaxing, tip);
      // above the tissue nothing drags the shaft; layers that add up have a moving surface of their own
      if constexpr (!requires { law.own_surface; })
        if (move.depth <= 0.0) release(state.shaft, memory);
      if (!state.pierced) return {};
      const double force = law.force(state.shaft, memory, move.velocity);
      return {force, law.by_depth(state.shaft, memory, move.velocity),
              law.by_velocity(state.shaft, memory, move.velocity),
              state.shaft.embedded > 0.0 || force != 0.0};
    });
  }

  /// The friction [N] of a shaft that has moved, at a velocity [m/s].
  double friction(const LayerState& state, double velocity) const noexcept {
    if (!state.pierced) return 0.0;
    return dispatch(friction_, [&](const auto& law) {
      return law.force(state.shaft, memory_of(law, state.friction), velocity);
    });
  }

  /// The layer below was punctured, and its surface went down: a length [m] of unstrained tissue is added
  /// here.
  [[gnu::noinline]] void lengthen(LayerState& state, double length) const noexcept {
    dispatch(friction_, [&](const auto& law) {
      auto& memory = memory_of(law, state.friction);
      if constexpr (requires { memory.thin(1.0); })
        memory.thin(state.shaft.embedded / (state.shaft.embedded + length));
    });
  }

  void enter(Cut& cut, MemoriesOf<Cutting>& memories, double depth, double carried) const noexcept {
    dispatch(cutting_, [&](const auto& law) { law.enter(cut, memory_of(law, memories), depth, carried); });
  }
  /// Moves the cut and returns its force; `Law` as for drag().
  template <class Law>
  [[gnu::always_inline]] TipForce cut(Cut& cut, MemoriesOf<Cutting>& memories, ReturnableSlip& returnable,
                                      const Move& move, const DepthNoise& noise) const noexcept {
    return dispatch_as<Law>(cutting_, [&](const auto& law) NEEDLEFORCE_INLINED {
      auto& memory = memory_of(law, memories);
      if constexpr (requires { law.law.springs; })
        if (noise.range > 0.0) {
          cut_in_noise(law, cut, memory, returnable, move, noise);
          return TipForce{law.force(cut, memory, move.depth), law.by_depth(cut, memory, move.depth)};
        }
      law.advance(cut, memory, move);
      if (noise.range > 0.0) cut.held = std::min(noise.range, std::max(cut.held, cut.front - cut.entry));
      return TipForce{law.force(cut, memory, move.depth), law.by_depth(cut, memory, move.depth)};
    });
  }
  /// The tip at a depth has moved by `aside` [m] without the cut: so far as that pressed. Returns how far.
  double slip(Cut& cut, double depth, double aside) const noexcept {
    const double last = dispatch(cutting_, [&](const auto& law) { return law.forceless(cut, depth); });
    const double before = std::exchange(cut.front, std::min(cut.front + aside, std::max(cut.front, last)));
    return cut.front - before;
  }
  /// Mean force of slow cutting [N].
  double steady_cutting() const noexcept {
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
  TipForce cut_force(const Cut& cut, const MemoriesOf<Cutting>& memories, double depth) const noexcept {
    return dispatch(cutting_, [&](const auto& law) {
      const auto& memory = memory_of(law, memories);
      return TipForce{law.force(cut, memory, depth), law.by_depth(cut, memory, depth)};
    });
  }

  double top = 0.0;  ///< [m]

 private:
  friend class ModelSwap;

  template <class Memory>
  [[gnu::always_inline]] static void release(Shaft& shaft, Memory& memory) noexcept {
    shaft.release();
    if constexpr (requires { memory.release(); })
      memory.release();
    else
      memory = Memory{};
  }
  /// What is left of the contact after the puncture, for a friction law that keeps it.
  template <class Law, class Memory>
  [[gnu::noinline]] void keep_contact(const Law& law, Memory& memory, const Move& move,
                                      const LayerExtent& extent, const Relaxing& relaxing,
                                      const TipTable& tip) const noexcept {
    const double indentation = law.yield(memory, move, extent, relaxing);
    on_contact(tip, [&](const auto& contact) {
      law.press(memory, contact.force(indentation), contact.slope(indentation));
    });
  }
  template <class Law, class Laws, class Visit>
  [[gnu::always_inline]] static auto dispatch_as(const Laws& laws, Visit visit) noexcept {
    if constexpr (std::is_void_v<Law>)
      return dispatch(laws, visit);
    else
      return visit(*std::get_if<Law>(&laws));
  }

  /// As `advance`, for a depth with noise: slip is returned before the tissue unloads.
  template <class Law, class Memory>
  [[gnu::noinline]] static void advance_in_noise(const Law& law, Memory& memory, LayerState& state,
                                                 const Move& move, const LayerExtent& extent,
                                                 const DepthNoise& noise) noexcept {
    const Slip before = law.slip(state.shaft, memory);
    Move felt = move;
    double& strains = own_surface<Law> ? felt.travel : felt.below;
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
  [[gnu::noinline]] static void cut_in_noise(const Law& law, Cut& cut, Memory& memory,
                                             ReturnableSlip& returnable, const Move& move,
                                             const DepthNoise& noise) noexcept {
    const double before = law.force(cut, memory, move.depth - move.travel);
    Move felt = move;
    felt.travel = returnable.felt(move.travel, {.force = before}, move.dt, noise);
    cut.front += move.travel - felt.travel;
    const double front = cut.front;
    law.advance(cut, memory, felt);
    returnable.add(before, {cut.front - front, law.force(cut, memory, move.depth)}, noise);
  }

  template <bool elastic, class Contact>
  [[gnu::always_inline]] void press(const Contact& law, LayerState& state, const Move& move,
                                    double indentation) const noexcept {
    const double before = state.contact_force;
    const double instant = law.force(indentation);
    state.contact_slope = law.slope(indentation);
    state.indentation = indentation;
    state.contact_force = instant;
    if (elastic || !relaxes_) return;
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

  Contacts::type stiffness_{};
  Prepared<Friction> friction_{};
  Prepared<Cutting> cutting_{};
  Prepared<Relaxation> relaxation_{};
  Puncture criterion_{};

 public:
  double puncture = 0.0;  ///< depth [m] at which an elastic contact is punctured

 private:
  bool relaxes_ = false;
  double reach_ = std::numeric_limits<double>::infinity();
};

}  // namespace needleforce

#undef NEEDLEFORCE_INLINED
