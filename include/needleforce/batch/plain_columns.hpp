// SPDX-License-Identifier: Apache-2.0
// Many insertions into layers with the paper's friction and cutting: their laws, and what each remembers, in
// columns.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "../layer_contact.hpp"
#include "../model.hpp"
#include "../model_fingerprint.hpp"
#include "../state.hpp"
#include "lanes.hpp"

namespace needleforce {

/// True for a model whose insertions stand in columns.
inline bool plain(const Model& model) noexcept {
  return std::holds_alternative<laws::Coulomb>(model.friction) &&
         (std::holds_alternative<laws::ConstantCutting>(model.cutting) ||
          std::holds_alternative<laws::NoCutting>(model.cutting)) &&
         std::holds_alternative<laws::NoRelaxation>(model.relaxation);
}

/// The laws of a layer of each member: depths [m] of top, puncture and the surface of the embedded shaft, and
/// how far this is below that of the same tissue above; friction [N/m] and its stiffness [N/m^2], cutting
/// force [N] over its unloading [1/m]; 1 for a layer that continues the one above.
struct PlainLayerLaws {
  Column top, puncture, surface, rise, per_length, stiffness, full, per_travel, joined;

  explicit PlainLayerLaws(std::size_t n)
      : top(n),
        puncture(n),
        surface(n),
        rise(n),
        per_length(n),
        stiffness(n),
        full(n),
        per_travel(n, 1.0),
        joined(n) {}
};

/// The laws of each member, or those of all, as often as is read at a time.
struct PlainLaws {
  using Tip = std::shared_ptr<const TipTable>;  // which members, copies of a batch too, may have in common
  std::vector<PlainLayerLaws> layers;
  std::vector<BasicLayerContact<double>> contacts;  // of all layers of a member in turn
  std::vector<Tip> tips;

  PlainLaws(std::size_t n, std::size_t count)
      : layers(count, PlainLayerLaws(n)), contacts(n * count), tips(n) {}

  /// Calls `visit` with a contact law.
  template <class Visit>
  decltype(auto) on_contact(std::size_t i, std::size_t layer, Visit visit) const noexcept {
    return contacts[i * layers.size() + layer].on(*tips[i], visit);
  }
  /// Memory that it takes [B].
  std::size_t bytes() const noexcept {
    std::size_t tables = 0;
    for (std::size_t i = 0; i < tips.size(); ++i) tables += i == 0 || tips[i] != tips[i - 1];
    return contacts.size() * (sizeof(contacts[0]) + 9 * sizeof(double)) + tips.size() * sizeof(Tip) +
           tables * sizeof(TipTable);
  }
  void put(std::size_t i, std::span<const Layer> stack, Tip tip) {
    tips[i] = std::move(tip);
    double root = 0.0;
    for (std::size_t k = 0; k < stack.size(); ++k) {
      const Layer& layer = stack[k];
      contacts[i * layers.size() + k] = BasicLayerContact<double>(layer.laws.stiffness);
      const auto friction = std::get<laws::Coulomb>(layer.laws.friction).prepare();
      PlainLayerLaws& laws = layers[k];
      laws.top[i] = layer.top;
      laws.puncture[i] = layer.top + on_contact(i, k, [&](const auto& contact) {
                           return dispatch(layer.laws.puncture,
                                           [&](const auto& law) { return law.puncture_depth(contact); });
                         });
      laws.surface[i] = friction.surface(layer.top, laws.puncture[i]);
      laws.per_length[i] = friction.per_length;
      laws.stiffness[i] = friction.stiffness;
      const bool joined = k > 0 && !(laws.puncture[i] > layer.top) &&
                          same_law(layer.laws.friction, stack[k - 1].laws.friction);
      laws.joined[i] = joined ? 1.0 : 0.0;
      if (!joined) root = laws.surface[i];
      laws.rise[i] = std::max(0.0, laws.surface[i] - root);
      if (const auto* cuts = std::get_if<laws::ConstantCutting>(&layer.laws.cutting)) {
        laws.full[i] = cuts->prepare().full;
        laws.per_travel[i] = cuts->prepare().per_travel;
      } else {
        laws.full[i] = 0.0, laws.per_travel[i] = 1.0;
      }
    }
  }
};

/// What plain members remember between two steps.
struct PlainColumns {
  struct InLayer {
    Column traction, pierced;  // 1 or 0
  };
  Column depth, waited, front, entry, retreat_limit;
  Column free, started;  // 1 or 0
  std::vector<InLayer> layers;

  PlainColumns(std::size_t n, std::size_t count)
      : depth(n),
        waited(n),
        front(n),
        entry(n),
        retreat_limit(n),
        free(Column(n, 1.0)),
        started(n),
        layers(count, InLayer{Column(n), Column(n)}) {}

  /// The memory of a member as an `Insertion` has it, but for what no plain law reads.
  InsertionState state(std::size_t i, const PlainLaws& laws, std::size_t law) const noexcept {
    InsertionState state;
    state.started = started[i] > 0.0;
    state.depth = depth[i];
    state.waited = waited[i];
    state.deepest = state.started ? depth[i] : -farthest;
    state.phase = free[i] > 0.0 ? Phase::free : Phase::insertion;
    state.cut = {entry[i], retreat_limit[i], front[i], 0.0};
    double bottom = std::numeric_limits<double>::infinity();
    for (std::size_t k = layers.size(); k-- > 0;) {
      LayerState& layer = state.layers[k];
      layer.pierced = layers[k].pierced[i] > 0.0;
      if (layer.pierced) state.pierced = std::max(state.pierced, k + 1);
      const double surface = laws.layers[k].surface[law];
      layer.puncture_depth = layer.pierced ? laws.layers[k].puncture[law] : 0.0;
      layer.friction.of<TractionMemory>() = {{layers[k].traction[i]}, layers[k].traction[i]};
      if (!state.started) continue;
      // where the last step put it: a shaft that begins at a puncture is as long as the tissue above allows
      layer.shaft.surface = surface;
      if (layer.pierced && depth[i] > 0.0)
        layer.shaft.embedded = embedded_length(std::min(depth[i], bottom), surface);
      bottom = surface;
      if (layer.pierced) continue;
      layer.indentation = std::max(0.0, depth[i] - laws.layers[k].top[law]);
      layer.contact_force =
          laws.on_contact(law, k, [&](const auto& contact) { return contact.force(layer.indentation); });
    }
    return state;
  }
  void remember(std::size_t i, const InsertionState& state) noexcept {
    started[i] = state.started ? 1.0 : 0.0;
    depth[i] = state.depth;
    waited[i] = state.waited;
    free[i] = state.phase == Phase::free ? 1.0 : 0.0;
    entry[i] = state.cut.entry;
    retreat_limit[i] = state.cut.retreat_limit;
    front[i] = state.cut.front;
    for (std::size_t k = 0; k < layers.size(); ++k) {
      layers[k].pierced[i] = state.layers[k].pierced ? 1.0 : 0.0;
      layers[k].traction[i] = state.layers[k].friction.of<TractionMemory>().traction;
    }
  }
};

}  // namespace needleforce
