// SPDX-License-Identifier: Apache-2.0
// What an insertion keeps when its model is replaced: which layer is which, and what each law takes over;
// docs/decisions/0009-replaced-models.md. Every function is wait-free.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>

#include "layer.hpp"
#include "state.hpp"

namespace needleforce {

/// Where the layers of a model begin [m], from the surface down.
struct Tops {
  std::array<double, max_layers> depth{};
  std::size_t count = 0;

  std::size_t nearest(double to) const noexcept {
    std::size_t best = 0;
    for (std::size_t i = 1; i < count; ++i)
      if (std::abs(depth[i] - to) < std::abs(depth[best] - to)) best = i;
    return best;
  }
  /// The layer that contains a depth.
  std::size_t around(double at) const noexcept {
    std::size_t i = 0;
    while (i + 1 < count && depth[i + 1] <= at) ++i;
    return i;
  }
};

/// The layer of `old` that continues as layer `i` of `now`, or `old.count` for an added one. Equally many
/// layers correspond in order; otherwise those whose tops are nearest to each other.
inline std::size_t counterpart(const Tops& old, const Tops& now, std::size_t i) noexcept {
  if (old.count == now.count) return i;
  const std::size_t nearest = old.nearest(now.depth[i]);
  return now.nearest(old.depth[nearest]) == i ? nearest : old.count;
}

/// The memory of an insertion into one stack of layers, continued in another: the same tip in the same hole,
/// with other laws.
class ModelSwap {
 public:
  /// Layers, and the table of the tip that they share.
  struct Stack {
    std::span<const PreparedLayer> layers;
    const TipTable& tip;
    std::size_t size() const noexcept { return layers.size(); }
    const PreparedLayer& operator[](std::size_t i) const noexcept { return layers[i]; }
  };

  /// The memory of an insertion into the layers `now` that continues one into the layers `old`.
  static InsertionState continued(const Stack& old, const InsertionState& before, const Stack& now) noexcept {
    InsertionState state = before;
    state.relaxation_dt = 0.0;  // the exponentials are those of the old model
    if (!state.started) return state;
    const ModelSwap swap{old, before, now};
    state.pierced = 0;
    for (std::size_t i = 0; i < max_layers; ++i) {
      state.layers[i] = i < now.size() ? swap.layer(i) : LayerState{};
      if (state.layers[i].pierced) state.pierced = i + 1;
    }
    if (state.pierced > 0 && before.pierced > 0)
      continue_cut(now[state.pierced - 1], old[before.pierced - 1], state);
    return state;
  }

 private:
  ModelSwap(const Stack& old, const InsertionState& before, const Stack& now) noexcept
      : old_(old), now_(now), before_(before) {}

  static Tops tops(const Stack& layers) noexcept {
    Tops result{.count = layers.size()};
    for (std::size_t i = 0; i < layers.size(); ++i) result.depth[i] = layers[i].top;
    return result;
  }
  /// How far the tissue is open [m]: to the deepest point, or to the first interface that is only deformed.
  double hole() const noexcept {
    double open = before_.deepest;
    for (std::size_t i = 0; i < old_.size(); ++i)
      if (!before_.layers[i].pierced) open = std::min(open, old_[i].top);
    return open;
  }

  /// The memory of layer i of the new model: that of its counterpart, or, if the layer was added, that of the
  /// tissue at its place.
  LayerState layer(std::size_t i) const noexcept {
    const Tops before = tops(old_);
    const std::size_t same = counterpart(before, tops(now_), i);
    const bool added = same == before.count;
    const std::size_t from = added ? before.around(now_[i].top) : same;
    const bool touched = !added && before_.depth > before.depth[from];
    LayerState state = before_.layers[from];
    const bool was_pierced = state.pierced && !added;
    const bool passed = !was_pierced && (added ? now_[i].top : now_[i].puncture) < hole();
    // the shaft in a layer that the tip turns out to have passed is held as in the deepest pierced one
    const std::size_t around = passed && !state.pierced && before_.pierced > 0 ? before_.pierced - 1 : from;
    state.friction = before_.layers[around].friction;
    const double bottom = i + 1 < now_.size() ? now_[i + 1].top : farthest;
    if (!state.pierced) continue_contact(now_[i], old_[from], state, before_.deepest);
    continue_friction(now_[i], old_[around], state, std::min(before_.depth, bottom) - now_[i].top);
    continue_depth(now_[i], old_[from], state);
    if (was_pierced && now_[i].top < before_.deepest) return state;
    if (was_pierced || added || (passed && !touched)) begin(now_[i], state, passed);
    return state;
  }

  void continue_depth(const PreparedLayer& now, const PreparedLayer& old, LayerState& state) const noexcept {
    const double moved = state.puncture_depth + (now.top - old.top);
    state.puncture_depth = std::clamp(moved, now.top, std::max(now.top, before_.deepest));
  }

  /// The memory of a layer that the tip passed before the model had it, or, without `pierced`, of one that
  /// was never touched. Friction continues that of the tissue there, except for a law that counts the whole
  /// shaft.
  void begin(const PreparedLayer& now, LayerState& state, bool pierced) const noexcept {
    LayerState begun;
    if (!counts_whole_shaft(now)) begun.shaft = state.shaft, begun.friction = state.friction;
    begun.pierced = pierced;
    begun.puncture_depth = std::min(now.puncture, std::max(now.top, before_.deepest));
    state = begun;
  }

  /// The contact's forces scale with its law at the deepest point.
  void continue_contact(const PreparedLayer& now, const PreparedLayer& old, LayerState& state,
                        double deepest) const noexcept {
    if (!old.relaxes_) state.contact = Element{state.contact_force};
    state.contact.continue_with(old.relaxing(1.0), now.relaxing(1.0));
    const auto [force, energy] = at_deepest(now, now_.tip, deepest);
    const auto [old_force, old_energy] = at_deepest(old, old_.tip, deepest);
    const double scale = old_force > 1e-12 ? force / old_force : 0.0;
    for (double* value : {&state.contact.elastic, &state.contact.memory[0], &state.contact.memory[1],
                          &state.contact_force, &state.contact_slope})
      *value *= scale;
    state.work *= old_energy > 1e-15 ? energy / old_energy : 0.0;
    const double max_indentation =
        now.relaxes_ ? std::numeric_limits<double>::infinity() : now.puncture - now.top;
    state.indentation = std::clamp(state.indentation + (old.top - now.top), 0.0, max_indentation);
  }
  /// Force [N] and energy [J] of the contact without relaxation where the tip was at most at a depth [m].
  static std::pair<double, double> at_deepest(const PreparedLayer& layer, const TipTable& tip,
                                              double deepest) noexcept {
    const double indentation = std::clamp(deepest - layer.top, 0.0, layer.puncture - layer.top);
    return layer.on_contact(
        tip, [&](const auto& law) { return std::pair{law.force(indentation), law.energy(indentation)}; });
  }

  /// Friction keeps its traction within the new limits; `length` [m] of the shaft is in the layer.
  static void continue_friction(const PreparedLayer& now, const PreparedLayer& old, LayerState& state,
                                double length) noexcept {
    const bool same = now.friction_.index() == old.friction_.index();
    const TakenOver taken = same ? TakenOver{} : taken_over(now, old, state, length);
    dispatch(now.friction_, [&](const auto& law) {
      auto& memory = memory_of(law, state.friction);
      if constexpr (requires { memory.take_over(taken); })
        if (!same) memory.take_over(taken);
      if constexpr (requires { law.adopt(memory); })
        law.adopt(memory);
      else if constexpr (requires { memory.element; })
        memory.element.continue_with(same ? old.relaxing(1.0) : Relaxing{}, now.relaxing(1.0));
    });
  }
  /// True for a friction law that remembers a force instead of a force per length.
  static bool counts_whole_shaft(const PreparedLayer& layer) noexcept {
    return dispatch(layer.friction_, [](const auto& law) { return requires { law.own_surface; }; });
  }
  /// The force stays the same, as a traction along `length` [m] or the reverse, and so does the surface.
  static TakenOver taken_over(const PreparedLayer& now, const PreparedLayer& old, const LayerState& state,
                              double length) noexcept {
    double held = dispatch(old.friction_, [&](const auto& law) {
      const auto& memory = memory_of(law, state.friction);
      if constexpr (requires { memory.held(); })
        return memory.held();
      else
        return 0.0;
    });
    if (counts_whole_shaft(now) && !counts_whole_shaft(old)) held *= state.shaft.embedded;
    if (!counts_whole_shaft(now) && counts_whole_shaft(old)) held = length > 0.0 ? held / length : 0.0;
    const double dimple = state.puncture_depth - old.top;
    const double share = dimple > 0.0 ? std::clamp((state.shaft.surface - old.top) / dimple, 0.0, 1.0) : 0.0;
    return {held, share, state.pierced};
  }

  /// The new law enters at the deepest cut with the force that the old one has there. Where it is of another
  /// kind, every crack stops.
  static void continue_cut(const PreparedLayer& now, const PreparedLayer& old,
                           InsertionState& state) noexcept {
    const double at = std::max(state.cut.front, state.depth);
    const double carried = old.cut_force(state.cut, state.cutting, at).force;
    const bool same = now.cutting_.index() == old.cutting_.index();
    if (!same) state.cutting.each(stop_crack);
    dispatch(now.cutting_, [&](const auto& law) {
      auto& memory = memory_of(law, state.cutting);
      law.enter(state.cut, memory, at, carried);
      if constexpr (requires { law.adopt(state.cut, memory, state.depth); })
        law.adopt(state.cut, memory, state.depth);
    });
  }

  static constexpr auto stop_crack = [](auto& memory) noexcept {
    if constexpr (requires { memory.stop(); }) memory.stop();
  };

  Stack old_, now_;
  const InsertionState& before_;
};

}  // namespace needleforce
