// SPDX-License-Identifier: Apache-2.0
// The tip of a needle that bends: in the tissue that it cuts, on the surface before, and what it leaves.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "elementary.hpp"
#include "flexible_state.hpp"

namespace needleforce::bending {

/// What holds the tip, and what its lateral energy gains as it cuts. Base of `ShapeInTissue`.
template <std::size_t dimension, class Axial>
class TipInTissue {
 public:
  using Place = std::array<double, dimension>;

  const BeamMesh<dimension>& mesh() const noexcept { return state_.beam.mesh(); }

 protected:
  TipInTissue(const Axial& axial, const FlexibleSettings& settings) noexcept
      : axial_(axial),
        settings_(settings),
        shortens_(!settings.small_slopes && axial.pays(pushes(settings.beam))),
        state_(settings.lengths.path_spacing) {}

  /// True where bending shortens the needle, by no more than what its slopes may be. A tip that is pushed
  /// aside where cutting does not pay for it has no energy to be a derivative of: its needle is as long as it
  /// was.
  bool coupled() const noexcept {
    const double length = mesh().count() > 0 ? mesh().tip().travel - mesh().base().travel : 0.0;
    return shortens_ && std::abs(state_.beam.shortening().whole()) <= length / 3.0;
  }
  bool in_tissue() const noexcept { return state_.embedded && state_.reached > 0.0; }
  Place tip_place() const noexcept { return mesh().count() > 0 ? mesh().tip().place : Place{}; }

  /// The surface is punctured: the tissue closes around the shaft, whose tip stood where it touched. It holds
  /// no more energy than the contact did.
  void enter(double depth) noexcept {
    state_.embedded = true;
    const double reached = std::max(0.0, depth);
    const double grips = layer_at(0.0).modulus * reached;
    const double share = grips > state_.grip ? std::sqrt(state_.grip / grips) : 1.0;
    Place place = state_.touch;
    for (std::size_t d = 0; d < dimension && mesh().count() > 0; ++d)
      place[d] = mesh().tip().place[d] - share * (mesh().tip().place[d] - state_.touch[d]);
    while (state_.path.empty() || state_.path.next_node() <= reached)
      state_.path.write(state_.path.next_node(), place, mesh().tip().slope);
    state_.path.write(reached, place);
    state_.ahead = place;
    state_.push = state_.lean = state_.wedge = state_.wedged = {};
  }
  /// A tip that presses on a half space of nu = 1/2 is held across by 2/3 of the axial stiffness (Mindlin).
  /// What more of it touches is unloaded there; what loses touch has no force.
  void press(const Sample& sample) noexcept {
    const double before = state_.grip;
    state_.grip =
        state_.embedded || !(state_.reached > 0.0) ? 0.0 : 2.0 / 3.0 * std::max(0.0, sample.force_by_depth);
    if (!(state_.grip > before) || mesh().count() == 0) return;
    for (std::size_t d = 0; d < dimension; ++d) {
      const double place = mesh().tip().place[d];
      state_.touch[d] = place - before / state_.grip * (place - state_.touch[d]);
    }
  }
  /// The tip's lateral force follows the bevel while the tip cuts. The face is a wedge: its force is a share
  /// of the cutting force, which pays for what it does.
  void turn_tip(const Base& to, double before, const Sample& sample) noexcept {
    state_.charge = 0.0;
    if (!in_tissue()) return;
    const double cut = state_.reached - std::max(state_.path.front(), before);
    if (!(cut > 0.0)) return;
    const double share = std::min(1.0, cut / (state_.reached - before));
    state_.tip_load.advance(cut, settings_.lengths.bevel_length,
                            to.roll - share * (to.roll - state_.base.roll), to.roll);
    const double left = 1.0 - falling(cut / settings_.lengths.tip_memory);
    const double pays = 1.0 - falling(cut / state_.path.spacing);
    const double turned = 1.0 - falling(cut / shortest);
    const double full = sample.lateral + tip_force_at(state_.reached), wedge = wedge_at(state_.reached);
    for (std::size_t d = 0; d < dimension; ++d) {
      state_.ahead[d] += left * (state_.path.front_place()[d] - state_.ahead[d]);
      const double bevel = state_.tip_load.share()[d];
      const double change = turned * (wedge * bevel - state_.wedge[d]);
      if (shortens_)
        state_.wedge[d] += change, state_.wedged[d] += change;  // so the cut pays for all of this way
      else
        state_.push[d] = full * bevel;
    }
    state_.charge = state_.owed * pays / cut;
    state_.owed -= state_.owed * pays;
  }
  /// The newest `piece` [m] of the path does not pull a tip back that cuts. From node to node, whatever the
  /// steps.
  void lean(double piece) noexcept {
    if (mesh().embedded() == 0) return;
    const double spacing = state_.path.spacing;
    const double left = 1.0 - falling(spacing / settings_.lengths.tip_memory);
    const LateralLayer& layer = layer_at(state_.reached);
    const double drags = !coupled() ? 0.0
                                    : (layer.modulus + layer.yielding_modulus) * piece * piece *
                                          (piece / 12.0 + spacing / 6.0) / (piece + spacing);
    for (std::size_t d = 0; d < dimension; ++d) {
      const double lag = mesh().tip().along[d] - mesh().tip().slope[d];
      state_.lean[d] -= left * (drags * lag + state_.lean[d]);
    }
  }
  /// The share of friction in the axial force, as of a needle that goes in; where the shaft is, stays.
  void share_friction() noexcept {
    const double whole = state_.sample.friction + state_.sample.cutting;
    if (!(whole > 0.0)) return;
    state_.slide.share = std::clamp(state_.sample.friction / whole, 0.0, 1.0);
  }
  void forget() noexcept {
    state_.embedded = state_.buckled = false;
    state_.slide = {};
    state_.wedge = state_.wedged = {};
    state_.path.clear();
    state_.tip_load.clear();
  }
  /// How far the tip is behind the front, apart from what the noise of the depth explains [m].
  double behind(double depth) const noexcept {
    const double explained = 2.0 * axial_.limits().depth_noise;
    return std::max(0.0, state_.path.front() - std::min(explained, state_.path.front()) - depth);
  }
  /// What is left of the lateral forces on the tip as it withdraws.
  double share_left(double depth) const noexcept {
    return std::max(0.0, 1.0 - behind(depth) / settings_.lengths.unloading);
  }
  /// What the lateral energy gains per travel of the tip along its path, at the shape of the last solution
  /// [N].
  double tip_pull(const BeamLoad<dimension>& load, double axial, double cutting) const noexcept {
    if (!in_tissue()) return 0.0;
    const LateralLayer& layer = layer_at(state_.reached);
    const auto& tip = mesh().tip();
    const std::size_t n = mesh().embedded(), last = mesh().count() - 1;
    const double h = mesh().h(), left = share_left(state_.reached);
    const bool newest = !(state_.reached < state_.path.last_node());
    const Place place = load.cuts || n == 0 ? tip.place : state_.path.at(state_.reached);
    double sum = state_.beam.advancing() + (load.cuts ? state_.charge : 0.0), square = 0.0, pivot = 0.0,
           held = 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      const double surface = mesh()[mesh().surface()].place[d] - state_.path.entry()[d];
      const double off = tip.place[d] - state_.ahead[d];
      pivot += surface * surface;
      held += 0.5 * layer.tip_stiffness * off * off -
              (state_.push[d] + state_.lean[d]) * (tip.place[d] - state_.path.front_place()[d]);
      const double away = n > 0 ? tip.place[d] - place[d] : surface;
      square += away * away;
      if (n == 0) continue;
      const double slope = tip.slope[d] - tip.along[d];
      const double turn = newest ? 0.0 : (tip.along[d] - mesh()[last - 1].along[d]) / h;
      sum += load.compression.tip * ((tip.place[d] - tip.path[d]) * turn - 0.5 * slope * slope) +
             (1.0 - state_.slide.share) * axial * tip.drag[d] * slope +
             tip.slope[d] * (load.contact * off - load.tip_force[d]) - load.wedge[d] * cutting * slope;
    }
    if (left > 0.0 && left < 1.0) sum += held / settings_.lengths.unloading;
    if (load.pivot < 1.0)
      sum += 0.5 * settings_.beam.support.pivot_stiffness * pivot / settings_.lengths.tip_memory;
    if (n == 0) return sum + (load.cuts ? 1.0 / 3.0 : 1.0) * short_energy(layer, std::sqrt(square));
    return load.cuts ? sum : sum + energy_per_length(layer, std::sqrt(square));
  }
  static double short_energy(const LateralLayer& layer, double offset) noexcept {
    return foundation_energy(layer.form, offset, layer.modulus, layer.scale);
  }
  /// That of the layers within half a spacing of the path: so the path, straight between its nodes, turns
  /// where they meet.
  double tip_force_at(double depth) const noexcept {
    const BeamProperties& beam = settings_.beam;
    double force = beam.layers[0].tip_force;
    for (std::size_t i = 1; i < beam.layer_count; ++i)
      force += (beam.layers[i].tip_force - beam.layers[i - 1].tip_force) *
               std::clamp(0.5 + (depth - beam.layers[i].top) / state_.path.spacing, 0.0, 1.0);
    return force;
  }
  /// Lateral over cutting force of the tip at a depth.
  double wedge_at(double depth) const noexcept {
    const double cutting = axial_.steady_cutting(), force = tip_force_at(depth);
    const double by_layer = cutting > 0.0 ? std::clamp(force / cutting, -steepest, steepest) : 0.0;
    return axial_.lateral_ratio() + by_layer;
  }
  const LateralLayer& layer_at(double depth) const noexcept {
    const BeamProperties& beam = settings_.beam;
    std::size_t layer = 0;
    while (layer + 1 < beam.layer_count && beam.layers[layer + 1].top < depth) ++layer;
    return beam.layers[layer];
  }

  static bool pushes(const BeamProperties& beam) noexcept {
    const auto end =
        beam.layers.begin() + static_cast<std::ptrdiff_t>(std::min(beam.layer_count, max_lateral_layers));
    return std::any_of(beam.layers.begin(), end,
                       [](const LateralLayer& layer) { return layer.tip_force != 0.0; });
  }

  static constexpr double shortest = 1e-6;  // cut [m] in which the face takes its force up
  static constexpr double steepest = 10.0;  // lateral over cutting force of a layer

  Axial axial_;
  FlexibleSettings settings_;
  bool shortens_;  // as it bends, and its axial laws feel it
  FlexibleState<dimension> state_;
};

}  // namespace needleforce::bending
