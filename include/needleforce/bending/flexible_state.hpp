// SPDX-License-Identifier: Apache-2.0
// What a needle that bends remembers between two steps: plain numbers, copied as they are.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "../state.hpp"
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
  Base base{};                ///< of the last accepted step
  Place touch{};              ///< where the tip was when it was last above the tissue or pressed on it
  Place ahead{};              ///< where the tissue ahead of the tip is unloaded
  Place tip_force{};          ///< [N]
  double waited = 0.0;        ///< time since the last accepted step [s]
  double moved_across = 0.0;  ///< since the tissue yielded [m]
  double rub = 0.0;           ///< share of the friction of the lateral pressure, -1 to 1
  /// Of that friction.
  ReturnableSlip returnable{};
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
  for (const std::array<double, dimension>* each : {&state.touch, &state.ahead, &state.tip_force})
    check.numbers("tip", *each);
  check.number("waited", state.waited, 0.0, longest);
  check.number("moved_across", state.moved_across, 0.0, 2.0 * spacing);
  check.number("rub", state.rub, -1.0, 1.0);
  state.returnable.check(check, "returnable");
}

}  // namespace needleforce::bending
