// SPDX-License-Identifier: Apache-2.0
// What a needle that bends remembers between two steps: plain numbers, copied as they are.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "../state.hpp"
#include "axial_drive.hpp"
#include "beam_equilibrium.hpp"
#include "bent_sample.hpp"
#include "flexible_settings.hpp"
#include "tip_load.hpp"

namespace needleforce::bending {

/// What is remembered in addition to the state of the axial insertion.
template <std::size_t dimension>
struct FlexibleState {
  using Place = std::array<double, dimension>;

  explicit FlexibleState(double path_spacing = 1e-4) noexcept : path(path_spacing) {}

  TissuePath<dimension> path;
  BeamEquilibrium<dimension> beam{};
  TipLoad tip_load{};
  Sample sample{};  ///< of the axial insertion, in the last part of the last step
  BentSample last{};
  Base base{};            ///< of the last accepted step
  Slide slide{};          ///< of the shaft
  double slid = 0.0;      ///< travel of the shaft that base and shape give, which limits may hold back [m]
  double reached = 0.0;   ///< travel of the tip, negative above the tissue [m]
  double along = 0.0;     ///< axial force in the needle at its base [N]
  double force = 0.0;     ///< of a hand that pushes it on there [N]
  double tip_pull = 0.0;  ///< what the lateral energy gains per travel of the tip [N]
  double give = 0.0;      ///< how much less the shaft slides per force [m/N]
  Place touch{};          ///< where a tip on the surface is unloaded
  double grip = 0.0;      ///< lateral stiffness of the surface that it presses on [N/m]
  Place ahead{};          ///< where the tissue ahead of the tip is unloaded
  Place push{};           ///< lateral force on the tip when it last cut [N]
  Place wedge{};          ///< lateral over cutting force of the face when the tip last cut
  Place wedged{};         ///< what of it was left in the last solution
  Place lean{};           ///< what makes the axial force there follow the needle, not the path [N]
  double charge = 0.0;    ///< axial force that pays for the work of the lateral force on a tip that cuts [N]
  double owed = 0.0;      ///< what it has not paid yet [J]
  double waited = 0.0;    ///< time since the last accepted step [s]
  double moved_across = 0.0;  ///< since the tissue yielded [m]
  bool started = false, embedded = false, buckled = false;
};

/// Looks at what a needle with these settings remembers. Wait-free.
template <std::size_t dimension>
void check(StateCheck& check, const FlexibleState<dimension>& state,
           const FlexibleSettings& settings) noexcept {
  for (const bool* flag :
       {&state.started, &state.embedded, &state.buckled, &state.last.buckled, &state.last.moved})
    check.flag("flags", *flag);
  if (check.fault()) return;  // flags are read below
  const double spacing = settings.lengths.path_spacing;
  state.path.check(check, spacing);
  state.beam.check(check);
  check.require("embedded", state.embedded == !state.path.empty());
  check.require("started", !state.started || state.beam.mesh().count() > 0);
  check.word("last.status", state.last.status, Status::not_finite);
  check.sample("sample", state.sample);
  check.sample("last.axial", state.last.axial);
  check.numbers("last", std::array{state.last.force, state.last.lateral, state.last.unsupported});
  check.numbers("last.tip", state.last.tip);
  check.numbers("last.tangent", state.last.tangent);
  check.numbers("last.wrench", state.last.wrench, 1e100);
  check.number("base.depth", state.base.depth, -farthest, std::min(farthest, state.path.longest()));
  check.numbers("base.lateral", state.base.lateral, farthest);
  check.numbers("base.tilt", state.base.tilt, 1.0);
  check.require("base.roll", std::isfinite(state.base.roll));
  check.numbers("tip_load", state.tip_load.share(), 1.0 + 1e-9);
  for (const std::array<double, dimension>* each :
       {&state.touch, &state.ahead, &state.push, &state.lean, &state.wedge, &state.wedged})
    check.numbers("tip", *each);
  check.numbers("tip", std::array{state.along, state.force, state.tip_pull, state.charge, state.owed});
  check.number("reached", state.reached, -2.0 * farthest, 2.0 * farthest);
  check.number("slid", state.slid, -4.0 * farthest, 4.0 * farthest);
  check.number("give", state.give, 0.0, 1.0);
  check.number("grip", state.grip, 0.0, largest_in_a_state);
  check.number("waited", state.waited, 0.0, longest);
  check.number("moved_across", state.moved_across, 0.0, 20.0 * spacing);
  state.slide.check(check);
}

}  // namespace needleforce::bending
