// SPDX-License-Identifier: Apache-2.0
// What an insertion into a solid remembers between two steps: plain numbers, copied as they are.
#pragma once

#include <cmath>
#include <cstddef>

#include "../limits.hpp"
#include "../noisy_depth.hpp"
#include "../sample.hpp"
#include "../state.hpp"
#include "condensed_tissue.hpp"
#include "relaxing_table.hpp"
#include "shaft_balance.hpp"

namespace needleforce::solid {

/// What an insertion into a solid remembers between two steps.
struct CondensedState {
  ShaftState shaft{};
  Sample last{};
  NoisyDepth noisy{};
  double depth = 0.0;      ///< of the last accepted step, as it is felt [m]
  double waited = 0.0;     ///< time since the last accepted step [s]
  double tip = 0.0;        ///< along the path, in the tissue as it was [m]
  double cut = 0.0;        ///< how far the path is cut [m]
  double tip_force = 0.0;  ///< [N]
  double yield = 2.5;      ///< by how much the way ahead shrinks when the tip moves
  ShaftState by_travel{};  ///< changes in the last motion, by its travel
  double tip_by_travel = 0.0;
  RelaxingState relaxing{};
  std::size_t pierced = 0;
  std::size_t row = 0;  ///< whose displacement is computed afresh next
  Phase phase = Phase::free;
  bool started = false;
  bool on_contact = false;  ///< the force of the tip is that of the contact law
  bool steady = false;      ///< in the last motion the tip stuck
};

/// True for a state from outside that an insertion can have, as far as a step relies on it. Wait-free.
inline bool possible(const CondensedState& state, const CondensedTissue& tissue,
                     std::size_t layers) noexcept {
  const auto along = [&](double distance) { return distance >= 0.0 && distance <= tissue.length(); };
  return needleforce::possible(state.last) && is_flag(state.started) && is_flag(state.steady) &&
         is_flag(state.on_contact) && std::abs(state.depth) <= farthest && state.waited >= 0.0 &&
         along(state.tip) && along(state.cut) && state.tip <= state.cut && state.pierced <= layers &&
         state.shaft.known <= tissue.nodes && state.row < max_path_nodes && state.yield > 0.1 &&
         state.yield < 10.0 && state.phase >= Phase::free && state.phase <= Phase::extraction;
}

}  // namespace needleforce::solid
