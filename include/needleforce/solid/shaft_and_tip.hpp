// SPDX-License-Identifier: Apache-2.0
// Shaft and tip of a needle in a solid, in one part of a step: friction and the force at the tip in balance
// with the tissue, while the tip breaks through, cuts, or recedes in its own path.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>

#include "condensed_state.hpp"
#include "path_layers.hpp"
#include "relaxing_table.hpp"
#include "shaft_balance.hpp"

namespace needleforce::solid {

inline constexpr double shortest_travel = 1e-7;  ///< from which rates are taken [m]

/// Displacement of the tissue at a node of the path by the forces alone, as if they had come at once [m].
/// Wait-free.
inline double displacement(const CondensedTissue& tissue, const CondensedState& state,
                           std::size_t node) noexcept {
  const auto at = BetweenNodes::at(state.tip, tissue);
  const double by_tip = (1.0 - at.share) * tissue.at(node, at.node) + at.share * tissue.at(node, at.node + 1);
  return displaced(state.shaft, tissue, node) + state.tip_force * by_tip;
}

/// Moves a needle's shaft and tip through a condensed tissue: what is remembered is in `state`.
class ShaftAndTip {
 public:
  static constexpr std::size_t max_sweeps = 8;    ///< in one part of a step
  static constexpr std::size_t leap_sweeps = 24;  ///< where that part is longer than a leap
  static constexpr double leap = 30e-6;           ///< [m]
  static constexpr std::size_t max_turns = 4;     ///< of balance and motion of the tip
  static constexpr std::size_t begin_turns = 12;  ///< where a cut begins
  static constexpr double tolerance = 1e-9;       ///< change of a displacement that ends the sweeps [m]

  /// `relaxing` over one part of a step.
  ShaftAndTip(const CondensedTissue& tissue, const PathLayers& layers, CondensedState& state,
              const Relaxing& relaxing) noexcept
      : tissue_(tissue), layers_(layers), state_(state), table_(relaxing), relaxing_(relaxing) {}

  /// Displacements are kept up to two nodes behind a distance along the path [m], in eights; of tissue that
  /// relaxes all, as what is beyond remembers.
  void know(double distance) noexcept {
    const auto nodes = static_cast<std::size_t>(distance / tissue_.spacing) + 3;
    const std::size_t covered = std::min((nodes + 7) / 8 * 8, tissue_.nodes), before = state_.shaft.known;
    const std::size_t wanted = relaxing_.relaxes ? tissue_.nodes : covered;
    if (wanted + 8 <= before) state_.shaft.known = wanted;  // what is beyond bears no force
    if (wanted <= before) return;
    for (std::size_t i = before; i < wanted; ++i) state_.shaft.force[i] = 0.0;
    state_.shaft.known = wanted;
    for (std::size_t i = before; i < wanted; ++i) {
      state_.shaft.displacement[i] = displacement(tissue_, state_, i);
      state_.shaft.anchor[i] = state_.depth - state_.shaft.displacement[i];
      state_.by_travel.force[i] = state_.by_travel.displacement[i] = 0.0;
    }
    state_.steady = false;
  }

  /// The tip moves by `aside` [m] without the cut, before the needle does by `travel`: tissue that it pressed
  /// springs back by as much, so far as it was pressed.
  void slip(double aside, double travel) noexcept {
    if (state_.tip < state_.cut || state_.on_contact || !(state_.tip_force > 0.0)) return;
    const double gap = state_.depth + travel - state_.tip - by_shaft(BetweenNodes::at(state_.tip, tissue_));
    place_tip(std::clamp(state_.tip + std::min(aside, std::max(0.0, gap)), 0.0, farthest_tip()));
    state_.cut = state_.tip;
  }

  /// Balance with the tip where it is in the tissue, then the tip moves on, in turns: the balance is a convex
  /// problem, and where the shaft sticks next to the tip, tissue follows the tip by more than it moves.
  /// Returns what the base has paid for sliding and cutting [J].
  double move(double depth, double speed) noexcept {
    const double travel = depth - state_.depth, tip = state_.tip, tip_force = state_.tip_force;
    TipMove last{};
    state_.depth = depth;
    know(state_.tip);
    const double crept = creep(travel);
    contact_ = state_.relaxing.contact;
    const ShaftState before = state_.shaft;
    expect(travel);
    std::size_t allowed = std::max(std::abs(travel), crept) > leap ? leap_sweeps : max_sweeps,
                turns = max_turns;
    begins_ = {};
    travel_ = std::abs(travel);
    std::size_t sweeps = 0;
    bool moved = false;
    for (std::size_t turn = 0; turn < turns; ++turn) {
      const std::span<FrictionBounds> bounds = bound();
      do {
        const double change = balance_tip(depth, speed);
        const double swept = sweep(state_.shaft, tissue_, bounds, depth, table_.scale(), sweeps % 2 == 1);
        if (std::max(change, swept) < tolerance) break;
      } while (++sweeps < allowed);
      if (overdrawn()) {
        begins_.bare = true;
        turn = sweeps = 0;
        continue;
      }
      moved = moved_tip(depth, speed, last);
      if (begins_.limited()) allowed = leap_sweeps, turns = begin_turns;
      if (sweeps >= allowed || !moved) break;
    }
    if (moved) clamp_forces(speed);
    // where a cut begins, nobody would pay for what is left to be made up in the next step
    if (begins_.limited()) balance_tip(depth, speed);
    const double slid = slide(state_.shaft, bounds_, depth, begins_.limited());
    remember(before, tip_force, travel, state_.tip == tip);
    table_.end(state_.relaxing, state_.shaft, state_.tip_force);
    remember_contact();
    return begins_.limited() ? 0.0 : slid + cut_from(tip);  // what the contact left has moved the tip
  }

 private:
  /// Motion of the tip along the path in one turn, and how far it had to go [m].
  struct TipMove {
    double ahead = 0.0, by = 0.0;
  };
  /// What a cut that begins may hold until the end of its part of a step: no more force than the contact had,
  /// and with the shaft no more energy.
  struct Beginning {
    double force = std::numeric_limits<double>::infinity(), energy = force;  // [N], [J]
    bool bare = false;  // the first shaft begins without force
    bool limited() const noexcept { return force < std::numeric_limits<double>::infinity(); }
  };
  // by how much a motion of the tip along the path changes how far it has to go, in the secant; above 1, as a
  // tip that rounding puts too far has lost of its force
  static constexpr double min_yield = 1.001, max_yield = 3.0;

  /// What the tissue creeps to under the forces that it has, less what they lose if the needle rests; and
  /// one row of displacements afresh, so that rounding does not add up. Returns the largest creep [m].
  double creep(double travel) noexcept {
    table_ = RelaxingTable(relaxing_);
    const auto [largest, lost] = table_.begin(state_.relaxing, state_.shaft);
    if (lost > 0.0 && std::abs(travel) < shortest_travel) {
      for (std::size_t i = 0; i < state_.shaft.known; ++i) {
        const double held = table_.at_once(state_.relaxing, state_.shaft, i);
        state_.shaft.displacement[i] -= lost * table_.scale() * held;
        state_.shaft.force[i] *= 1.0 - lost;
      }
      state_.tip_force *= 1.0 - lost;
    }
    state_.row = state_.row + 1 < state_.shaft.known ? state_.row + 1 : 0;
    state_.shaft.displacement[state_.row] = table_.scale() * displacement(tissue_, state_, state_.row) +
                                            table_.standing(state_.relaxing, state_.row);
    return largest;
  }
  /// Adds a force [N] at a node, or between two.
  template <class Where>
  void push(const Where& at, double force) noexcept {
    solid::push(state_.shaft, tissue_, at, table_.scale() * force);
  }

  /// Bounds of friction where the tip is.
  std::span<FrictionBounds> bound() noexcept {
    const std::span<FrictionBounds> bounds(bounds_.data(), tissue_.nodes);
    if (begins_.bare)
      std::ranges::fill(bounds, FrictionBounds{});
    else
      layers_.bounds(bounds, state_.tip);
    return bounds;
  }

  /// After the tip moved without a balance: no force beyond what shaft and tip can bear where they are now.
  void clamp_forces(double speed) noexcept {
    const std::span<FrictionBounds> bounds = bound();
    for (std::size_t i = 0; i < state_.shaft.known; ++i) {
      const double force = std::clamp(state_.shaft.force[i], bounds[i].low, bounds[i].high);
      if (force == state_.shaft.force[i]) continue;
      push(i, force - state_.shaft.force[i]);
      state_.shaft.force[i] = force;
    }
    const double contact = pressing() ? layers_[state_.pierced].puncture_force() : 0.0;
    const double limit = state_.tip >= state_.cut ? std::max(contact, cut_force(speed)) : 0.0;
    if (state_.tip_force <= limit) return;
    push(BetweenNodes::at(state_.tip, tissue_), limit - state_.tip_force);
    state_.tip_force = limit;
    state_.on_contact = state_.on_contact && pressing();
  }

  /// What the last motion did while the tip stuck, again: most steps are like the one before.
  void expect(double travel) noexcept {
    if (!state_.steady) return;
    for (std::size_t i = 0; i < state_.shaft.known; ++i) {
      state_.shaft.force[i] += travel * state_.by_travel.force[i];
      state_.shaft.displacement[i] += table_.scale() * travel * state_.by_travel.displacement[i];
    }
    state_.tip_force += travel * state_.tip_by_travel;
  }

  /// At which the tip cuts the layer that it is in, the last that is pierced, or begins to [N].
  double cut_force(double speed) const noexcept {
    if (state_.pierced == 0) return 0.0;
    const double force = layers_[state_.pierced - 1].cutting(speed);
    return begins_.limited() ? std::min(force, beginning_force()) : force;
  }
  /// Of a cut that continues from the contact with the next layer. Above others the contact is that of a
  /// needle without a shaft in tissue, and may hold less than the solid would with its force; the base has
  /// paid for it with the mean of the forces before and after the step.
  Beginning beginning(double gap, const BetweenNodes& at) const noexcept {
    const PathLayer& layer = layers_[state_.pierced];
    const double force = state_.tip_force, instant = layer.contact_force(gap);
    // of a contact that has relaxed no more than the least that its force can have
    const double left = relaxing_.relaxes && force < instant ? force / instant : 1.0;
    const double paid = left * left * layer.contact_energy(gap) - 0.5 * force * travel_;
    if (state_.pierced == 0) return {std::min(force, layer.puncture_force()), std::max(0.0, paid)};
    const double own = std::max(paid, 0.5 * at.compliance(tissue_) * force * force);
    return {force, strained() + force * shaft_at_once(at) + own};
  }
  /// With which shaft and tip hold the energy that the contact left [N].
  double beginning_force() const noexcept {
    const auto at = BetweenNodes::at(state_.tip, tissue_);
    const double own = at.compliance(tissue_), by = shaft_at_once(at);
    const double left = begins_.energy - strained();
    return std::clamp((std::sqrt(std::max(0.0, by * by + 2.0 * own * left)) - by) / own, 0.0, begins_.force);
  }
  /// True where the first shaft would begin with more than half of the energy that the contact left.
  bool overdrawn() const noexcept {
    return begins_.limited() && !begins_.bare && state_.pierced == 1 && 2.0 * strained() > begins_.energy;
  }
  /// Energy of the shaft's forces alone [J], as if they had come at once: what has relaxed is the same before
  /// a cut begins and after.
  double strained() const noexcept {
    double twice = -state_.tip_force * shaft_at_once(BetweenNodes::at(state_.tip, tissue_));
    for (std::size_t i = 0; i < state_.shaft.known; ++i) {
      const double force = state_.shaft.force[i];
      twice += force * (table_.at_once(state_.relaxing, state_.shaft, i) + bounds_[i].compliance * force);
    }
    return 0.5 * twice;
  }
  /// True where the tip presses on a layer that it has not broken through.
  bool pressing() const noexcept {
    return state_.pierced < layers_.count() && state_.cut >= layers_[state_.pierced].top;
  }

  /// Force at the tip; returns the change, as a displacement [m].
  double balance_tip(double depth, double speed) noexcept {
    const auto at = BetweenNodes::at(state_.tip, tissue_);
    const double gap = depth - state_.tip - by_shaft(at);  // to be taken up by the tip's own compliance
    const double own = table_.scale() * at.compliance(tissue_);
    double force = 0.0;
    state_.on_contact = false;
    const bool touches = state_.tip >= state_.cut;
    const double contact = pressing() ? press(touches ? gap + own_standing(at) : 0.0) : 0.0;
    if (touches) {
      // on an interface the tissue above still bears the cutting force, until the contact is stronger
      force = std::clamp(gap / own, 0.0, cut_force(speed));
      state_.on_contact = contact > force;
      force = std::max(force, contact);
    }
    const double by = force - state_.tip_force;
    if (by == 0.0) return 0.0;
    state_.tip_force = force;
    push(at, by);
    return std::abs(by) * own;
  }

  /// Force of the contact with the next layer at an indentation [m].
  double press(double indentation) noexcept {
    const double instant = layers_[state_.pierced].contact_force(indentation);
    if (!relaxing_.relaxes) return instant;
    contact_ = state_.relaxing.contact;
    const double endless = std::numeric_limits<double>::infinity();
    const double force = contact_.load(instant - contact_.elastic, 0.0, endless, relaxing_, false);
    indentation_ = indentation;
    work_ = state_.relaxing.work;
    work_ += 0.5 * (state_.relaxing.pressed + force) * (indentation - state_.relaxing.indentation);
    return pressed_ = force;
  }
  void remember_contact() noexcept {
    if (!relaxing_.relaxes) return;
    const bool pressed = pressing();
    state_.relaxing.contact = pressed ? contact_ : Element{};
    state_.relaxing.pressed = pressed ? pressed_ : 0.0;
    state_.relaxing.indentation = pressed ? indentation_ : 0.0;
    state_.relaxing.work = pressed ? work_ : 0.0;
  }

  /// The tip breaks through, cuts on, or recedes in its own path; false if it stays.
  bool moved_tip(double depth, double speed, TipMove& last) noexcept {
    const auto at = BetweenNodes::at(state_.tip, tissue_);
    const double gap = depth - state_.tip - by_shaft(at);
    const double indentation = gap + own_standing(at);
    if (state_.tip >= state_.cut && pressing() && breaks(indentation)) {
      begins_ = beginning(indentation, at);
      if (state_.pierced == 0)
        table_.renew(state_.relaxing, state_.shaft);  // nothing but the contact pressed it
      ++state_.pierced;
      return true;
    }
    const double ahead = to_go(gap, at, speed);
    if (std::abs(ahead) < tolerance) return false;
    if (std::abs(last.by) > tolerance)  // secant
      state_.yield = std::clamp((last.ahead - ahead) / last.by, min_yield, max_yield);
    const double from = state_.tip;
    place_tip(std::clamp(from + ahead / state_.yield, 0.0, farthest_tip()));
    state_.cut = std::max(state_.cut, state_.tip);
    last = {ahead, state_.tip - from};
    return last.by != 0.0;
  }

  /// What cutting has dissipated from where the tip was [J]: its force along what it went of the tissue,
  /// which is strained already, less what strains the tissue along the longer shaft.
  double cut_from(double tip) const noexcept {
    const double way = state_.tip - tip;
    if (!(way > 0.0 && state_.tip_force > 0.0)) return 0.0;
    const auto at = BetweenNodes::at(state_.tip, tissue_);
    const auto slope = [&](const auto& value) {
      return (value(at.node + 1) - value(at.node)) / tissue_.spacing;
    };
    const double strain = slope([&](std::size_t i) { return state_.shaft.displacement[i]; });
    const double spread = slope([&](std::size_t i) {
      return (1.0 - at.share) * tissue_.at(i, at.node) + at.share * tissue_.at(i, at.node + 1);
    });
    const double own = slope([&](std::size_t i) { return tissue_.at(i, i); }) - 2.0 * spread;
    const double along = 1.0 + strain + own * (tip_strained() - 0.5 * state_.tip_force);
    return way * (state_.tip_force * std::max(0.0, along) - layers_.straining(state_.tip));
  }
  /// Moves the tip with its force.
  void place_tip(double to) noexcept {
    const double force = std::exchange(state_.tip_force, 0.0);
    push(BetweenNodes::at(state_.tip, tissue_), -force);
    state_.tip = to;
    know(to);
    state_.tip_force = force;
    push(BetweenNodes::at(to, tissue_), force);
  }

  /// True for a contact that is pressed to the force at which the layer breaks; without one any contact
  /// breaks it.
  bool breaks(double gap) const noexcept {
    const PathLayer& layer = layers_[state_.pierced];
    return gap > 0.0 && layer.contact_force(gap) >= layer.puncture_force() &&
           (!relaxing_.relaxes || layer.breaks(state_.tip_force, work_));
  }
  /// How far the tip has still to go along the path if the tissue did not follow [m].
  double to_go(double gap, const BetweenNodes& at, double speed) const noexcept {
    if (state_.on_contact) return 0.0;
    if (state_.tip < state_.cut || gap < 0.0) return gap;
    if (pressing()) return 0.0;
    return std::max(0.0, gap - table_.scale() * at.compliance(tissue_) * cut_force(speed));
  }
  /// The deepest cut, or where cutting comes to an interface that resists, or to the end of the path [m].
  double farthest_tip() const noexcept {
    if (state_.tip < state_.cut || pressing()) return state_.cut;
    return state_.pierced < layers_.count() ? layers_[state_.pierced].top : tissue_.length();
  }

  /// Where the tip is, displacement without the tip's force in this part of a step [m].
  double by_shaft(const BetweenNodes& at) const noexcept {
    const double spread = at.spread(tissue_);
    const double by_nodes = at.of(state_.shaft.displacement) - table_.scale() * state_.tip_force * spread;
    return by_nodes + (at.compliance(tissue_) - spread) * table_.tip_standing(state_.relaxing);
  }
  /// The same by the shaft alone, as if its forces had come at once [m].
  double shaft_at_once(const BetweenNodes& at) const noexcept {
    const auto node = [&](std::size_t i) { return table_.at_once(state_.relaxing, state_.shaft, i); };
    const double by_nodes = (1.0 - at.share) * node(at.node) + at.share * node(at.node + 1);
    return by_nodes - state_.tip_force * at.spread(tissue_);
  }
  /// What the tip's earlier forces have left of its own displacement [m].
  double own_standing(const BetweenNodes& at) const noexcept {
    return at.compliance(tissue_) * table_.tip_standing(state_.relaxing);
  }
  /// Force that would displace the tip as far at once [N].
  double tip_strained() const noexcept {
    return table_.scale() * state_.tip_force + table_.tip_standing(state_.relaxing);
  }
  void remember(const ShaftState& before, double tip_force, double travel, bool stuck) noexcept {
    if (std::abs(travel) < shortest_travel) return;
    state_.steady = stuck;
    for (std::size_t i = 0; i < state_.shaft.known; ++i) {
      state_.by_travel.force[i] = (state_.shaft.force[i] - before.force[i]) / travel;
      state_.by_travel.displacement[i] =
          (state_.shaft.displacement[i] - before.displacement[i]) / (travel * table_.scale());
    }
    state_.tip_by_travel = (state_.tip_force - tip_force) / travel;
  }

  const CondensedTissue& tissue_;
  const PathLayers& layers_;
  CondensedState& state_;
  RelaxingTable table_;
  Relaxing relaxing_;
  Element contact_{};                                      // with the next layer
  double pressed_ = 0.0, indentation_ = 0.0, work_ = 0.0;  // of it [N], [m], [J]
  Beginning begins_{};
  double travel_ = 0.0;                                // of this part of a step [m]
  std::array<FrictionBounds, max_path_nodes> bounds_;  // of the last turn
};

}  // namespace needleforce::solid
