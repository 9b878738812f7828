// SPDX-License-Identifier: Apache-2.0
// Relaxation of a condensed solid: one Prony series in time for the whole table, its contact and its tip.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "../relaxation.hpp"
#include "shaft_balance.hpp"

namespace needleforce::solid {

/// Strains q of the relaxing branches, q' = u' - q / tau: of the nodes as displacements, of the tip's own
/// compliance as forces; and the contact before a puncture.
struct RelaxingState {
  std::array<ShaftState::Nodes, 2> strain{};  ///< [m]
  double tip = 0.0;                           ///< force that would displace the tip as far at once [N]
  double tip_strain[2] = {};                  ///< [N]
  Element contact{};
  double pressed = 0.0, indentation = 0.0, work = 0.0;  ///< of it: [N], [m], [J]
};

/// One part of a step. Displacements obey u = S f + sum g_j (u - q_j), so that at its end they are
/// u = scale S f + standing: one factor on the table, and an offset for each node. Exact for displacements
/// that change evenly in it; stable for any step.
class RelaxingTable {
 public:
  RelaxingTable() = default;
  explicit RelaxingTable(const Relaxing& relaxing) noexcept : relaxing_(relaxing) {}

  bool relaxes() const noexcept { return relaxing_.relaxes; }
  const Relaxing& relaxing() const noexcept { return relaxing_; }
  /// On the table.
  double scale() const noexcept { return scale_; }
  /// Of a node, in displacement [m].
  double standing(const RelaxingState& state, std::size_t node) const noexcept {
    return standing(state.strain[0][node], state.strain[1][node]);
  }
  /// Displacement of a node by the forces alone, as if they had come at once [m].
  double at_once(const RelaxingState& state, const ShaftState& shaft, std::size_t node) const noexcept {
    return (shaft.displacement[node] - standing(state, node)) / scale_;
  }
  /// Of the tip's own compliance, as a force [N].
  double tip_standing(const RelaxingState& state) const noexcept {
    return standing(state.tip_strain[0], state.tip_strain[1]);
  }

  /// What begins a part: the largest creep [m], and the share of all forces that is lost if nothing moves.
  struct Crept {
    double largest = 0.0, lost = 0.0;
  };
  /// Lets the tissue creep under the forces that it has. Wait-free.
  Crept begin(RelaxingState& state, ShaftState& shaft) noexcept {
    if (!relaxes()) return {};
    double per_load = relaxing_.lasting, largest = 0.0, along = 0.0, square = 0.0;
    for (int j = 0; j < 2; ++j) per_load += relaxing_.share[j] * relaxing_.during[j];
    scale_ = 1.0 / per_load;
    for (std::size_t i = 0; i < shaft.known; ++i) {
      const double before = shaft.displacement[i];
      shaft.displacement[i] += creep(before, state.strain[0][i], state.strain[1][i]);
      const double crept = shaft.displacement[i] - before, held = at_once(state, shaft, i);
      largest = std::max(largest, std::abs(crept));
      along += crept * held;
      square += held * held;
    }
    state.tip += creep(state.tip, state.tip_strain[0], state.tip_strain[1]);
    return {largest, square > 0.0 ? std::clamp(along / (scale_ * square), 0.0, 1.0) : 0.0};
  }
  /// Remembers how far the tissue has gone, under a force at the tip [N]. Wait-free.
  void end(RelaxingState& state, const ShaftState& shaft, double tip_force) const noexcept {
    if (!relaxes()) return;
    state.tip = scale_ * tip_force + tip_standing(state);
    for (std::size_t j = 0; j < 2; ++j) {
      for (std::size_t i = 0; i < shaft.known; ++i)
        state.strain[j][i] += relaxing_.during[j] * shaft.displacement[i];
      state.tip_strain[j] += relaxing_.during[j] * state.tip;
    }
  }
  /// Until the end of this part, as if its forces had come at once: of all states with them that of least
  /// energy. `tip_force` [N]. Wait-free.
  void renew(RelaxingState& state, ShaftState& shaft) noexcept {
    if (!relaxes()) return;
    for (std::size_t i = 0; i < shaft.known; ++i) shaft.displacement[i] = at_once(state, shaft, i);
    state.strain = {};
    state.tip_strain[0] = state.tip_strain[1] = 0.0;
    for (double& during : relaxing_.during) during = 1.0;
    scale_ = 1.0;
  }

 private:
  double standing(double first, double second) const noexcept {
    return -scale_ * (relaxing_.share[0] * first + relaxing_.share[1] * second);
  }
  /// Creep of a displacement under a force that stays; the strains become those that would be left without
  /// any further displacement, less what all of it adds.
  double creep(double displacement, double& first, double& second) const noexcept {
    double by = 0.0;
    int j = 0;
    for (double* strain : {&first, &second}) {
      by += relaxing_.share[j] * (1.0 - relaxing_.left[j]) * *strain;
      *strain = relaxing_.left[j] * *strain - relaxing_.during[j] * displacement;
      ++j;
    }
    return scale_ * by;
  }

  Relaxing relaxing_{};
  double scale_ = 1.0;
};

}  // namespace needleforce::solid
