// SPDX-License-Identifier: Apache-2.0
// Many insertions into one layer with the paper's friction and cutting: their laws, and what each remembers,
// in columns.
#pragma once

#include <algorithm>
#include <cstddef>
#include <variant>
#include <vector>

#include "../model.hpp"
#include "../state.hpp"
#include "lanes.hpp"

namespace needleforce {

/// True for a model whose insertions stand in columns.
inline bool plain(const Model& model) noexcept {
  return std::holds_alternative<laws::Coulomb>(model.friction) &&
         std::holds_alternative<laws::ConstantCutting>(model.cutting) &&
         std::holds_alternative<laws::NoRelaxation>(model.relaxation);
}

/// The laws of each member, or of all: depths [m] of top, puncture and the surface of the embedded shaft,
/// friction [N/m] and its stiffness [N/m^2], cutting force [N] over its unloading [1/m].
struct PlainLaws {
  Column top, puncture, surface, per_length, stiffness, full, per_travel;
  std::vector<Prepared<Stiffness>> contact;

  explicit PlainLaws(std::size_t n)
      : top(n), puncture(n), surface(n), per_length(n), stiffness(n), full(n), per_travel(n) {
    contact.reserve(n);
  }
  void add(const Layer& layer) {
    contact.emplace_back();
    put(contact.size() - 1, layer);
  }
  void put(std::size_t i, const Layer& layer) {
    contact[i] = prepare(layer.laws.stiffness);
    const auto friction = std::get<laws::Coulomb>(layer.laws.friction).prepare();
    const auto cutting = std::get<laws::ConstantCutting>(layer.laws.cutting).prepare();
    top[i] = layer.top;
    puncture[i] = layer.top + puncture_depth(layer.laws.puncture, contact[i]);
    surface[i] = friction.surface(top[i], puncture[i]);
    per_length[i] = friction.per_length;
    stiffness[i] = friction.stiffness;
    full[i] = cutting.full;
    per_travel[i] = cutting.per_travel;
  }
};

/// What plain members remember between two steps.
struct PlainColumns {
  Column depth, waited, front, entry, retreat_limit, traction;
  Column pierced, free, started;  // 1 or 0

  explicit PlainColumns(std::size_t n)
      : depth(n),
        waited(n),
        front(n),
        entry(n),
        retreat_limit(n),
        traction(n),
        pierced(n),
        free(Column(n, 1.0)),
        started(n) {}

  bool all_pierced(std::size_t at, std::size_t n) const noexcept {
    return std::all_of(&pierced[at], &pierced[at] + n, [](double each) { return each > 0.0; });
  }
  /// The memory of a member as an `Insertion` has it, but for what no plain law reads.
  InsertionState state(std::size_t i, const PlainLaws& laws, std::size_t law) const noexcept {
    InsertionState state;
    state.started = started[i] > 0.0;
    state.depth = depth[i];
    state.waited = waited[i];
    state.deepest = state.started ? depth[i] : -farthest;
    state.pierced = pierced[i] > 0.0 ? 1 : 0;
    state.phase = free[i] > 0.0 ? Phase::free : Phase::insertion;
    state.cut = {entry[i], retreat_limit[i], front[i], 0.0};
    LayerState& layer = state.layers[0];
    // where the last step put it: a shaft that begins at a puncture is as long as the tissue above allows
    if (state.started) layer.shaft.surface = laws.surface[law];
    layer.pierced = pierced[i] > 0.0;
    layer.puncture_depth = layer.pierced ? laws.puncture[law] : 0.0;
    layer.friction.of<TractionMemory>() = {{traction[i]}, traction[i]};
    if (layer.pierced || !state.started) return state;
    layer.indentation = std::max(0.0, depth[i] - laws.top[law]);
    layer.contact_force =
        dispatch(laws.contact[law], [&](const auto& contact) { return contact.force(layer.indentation); });
    return state;
  }
  void remember(std::size_t i, const InsertionState& state) noexcept {
    started[i] = state.started ? 1.0 : 0.0;
    depth[i] = state.depth;
    waited[i] = state.waited;
    pierced[i] = state.pierced > 0 ? 1.0 : 0.0;
    free[i] = state.phase == Phase::free ? 1.0 : 0.0;
    entry[i] = state.cut.entry;
    retreat_limit[i] = state.cut.retreat_limit;
    front[i] = state.cut.front;
    traction[i] = state.layers[0].friction.of<TractionMemory>().traction;
  }
};

}  // namespace needleforce
