// SPDX-License-Identifier: Apache-2.0
// What a needle that bends remembers between two steps: plain numbers, copied as they are.
#pragma once

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
  Place lean{};           ///< what makes the axial force there follow the needle, not the path [N]
  double charge = 0.0;    ///< axial force that pays for the work of the lateral force on a tip that cuts [N]
  double owed = 0.0;      ///< what it has not paid yet [J]
  double waited = 0.0;    ///< time since the last accepted step [s]
  double moved_across = 0.0;  ///< since the tissue yielded [m]
  bool started = false, embedded = false, buckled = false;
};

inline bool possible(const BentSample& sample) noexcept {
  return needleforce::possible(sample.axial) && sample.status >= Status::ok &&
         sample.status <= Status::not_finite && is_flag(sample.buckled) && is_flag(sample.moved);
}
/// True for a state from outside that a needle with these settings can have, as far as a step relies on it:
/// numbers of nodes, words, flags, and the lengths from which nodes are counted. Wait-free.
template <std::size_t dimension>
bool possible(const FlexibleState<dimension>& state, const FlexibleSettings& settings) noexcept {
  if (!is_flag(state.started) || !is_flag(state.embedded) || !is_flag(state.buckled)) return false;
  const double spacing = settings.lengths.path_spacing;
  return state.path.possible(spacing) && state.embedded == !state.path.empty() &&
         state.beam.mesh().possible() && (state.beam.mesh().count() > 0 || !state.started) &&
         needleforce::possible(state.sample) && possible(state.last) &&
         std::abs(state.base.depth) <= farthest && state.base.depth <= state.path.longest() &&
         std::abs(state.reached) <= 2.0 * farthest && state.waited >= 0.0 && state.moved_across >= 0.0 &&
         state.moved_across <= 20.0 * spacing;
}

}  // namespace needleforce::bending
