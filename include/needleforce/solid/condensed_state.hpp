// SPDX-License-Identifier: Apache-2.0
// What an insertion into a solid remembers between two steps: plain numbers, copied as they are.
#pragma once

#include <array>
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

/// True where shaft or tip are in the tissue. Wait-free.
inline bool in_tissue(const CondensedState& state) noexcept {
  const bool below = state.pierced > 0 && state.started && state.depth > state.shaft.displacement[0];
  return state.tip_force > 0.0 || state.tip > 0.0 || below;
}

/// Looks at what a needle remembers in a solid of so many layers, whose contacts hold `most` [N] at most.
/// Wait-free.
inline void check(StateCheck& check, const CondensedState& state, const CondensedTissue& tissue,
                  std::size_t layers, double most) noexcept {
  for (const bool* flag : {&state.started, &state.on_contact, &state.steady}) check.flag("flags", *flag);
  check.word("phase", state.phase, Phase::extraction);
  check.require("pierced", state.pierced <= layers);
  check.require("shaft.known", state.shaft.known <= tissue.nodes);
  check.require("row", state.row < max_path_nodes);
  check.number("depth", state.depth, -farthest, farthest);
  check.number("noisy.shown", state.noisy.shown, -farthest, farthest);
  check.number("waited", state.waited, 0.0, longest);
  check.number("cut", state.cut, 0.0, tissue.length());
  check.number("tip", state.tip, 0.0, state.cut);
  check.number("yield", state.yield, 0.1, 10.0);
  for (const ShaftState* shaft : {&state.shaft, &state.by_travel}) {
    check.numbers("shaft.force", shaft->force);
    check.numbers("shaft.displacement", shaft->displacement);
    check.numbers("shaft.anchor", shaft->anchor);
  }
  check.number("tip_force", state.tip_force, 0.0, largest_in_a_state);
  check.numbers("tip_by_travel", state.tip_by_travel);
  state.noisy.slip.check(check, "noisy.slip");
  check.numbers("relaxing", state.relaxing);
  const Element& contact = state.relaxing.contact;
  check.numbers("relaxing.contact", std::array{contact.elastic, contact.memory[0], contact.memory[1]}, most);
  check.sample("last", state.last);
}

}  // namespace needleforce::solid
