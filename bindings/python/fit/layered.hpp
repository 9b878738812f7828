// SPDX-License-Identifier: Apache-2.0
// The layered law for identification: the engine's laws, run along a recorded motion for many sets of
// parameters.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <type_traits>

#include "needleforce/insertion.hpp"

namespace needleforce::fit {

/// Parameters of one layer as a log identifies them; depths in the recording's own zero.
struct LayerNumbers {
  double coefficient;      ///< c [N/m^2], force c h^2 before the contact saturates
  double saturation;       ///< h_s [m]
  double top;              ///< z_0 [m]
  double puncture;         ///< z_1 [m]
  double per_length;       ///< f' [N/m]
  double stiffness;        ///< k_t [N/m]
  double rupture_length;   ///< delta [m]
  double resting_surface;  ///< z_r - z_0 [m]
  double brittleness;      ///< q, of a contact that yields
  double withdrawal;       ///< rho, friction outwards over friction inwards
};

/// Shares and time constants [s] of relaxation, the same in every layer.
struct RelaxationNumbers {
  double share_1, time_1, share_2, time_2;
};

/// Only c and h_s set the force; they are given here for a cone of 45 degrees, whose tangent is 1.
inline laws::ConeCylinder contact_of(const LayerNumbers& layer) noexcept {
  constexpr double half = 0.5 * std::numbers::pi;
  return {half * layer.coefficient, 0.5 * half, layer.saturation / half};
}

/// The form that was fitted to recordings and may return energy; the one that drops what its spring may not
/// take over; and the one whose contact yields along the travel after the puncture. The last two are passive.
enum class LayeredForm { as_fitted, passive, yielding };

template <class Relaxation>
Model laws_of(const LayerNumbers& layer, const Friction& friction,
              const RelaxationNumbers& relaxation) noexcept {
  return {contact_of(layer), laws::PunctureDepth{layer.puncture - layer.top}, friction, laws::NoCutting{},
          Relaxation{relaxation.share_1, relaxation.time_1, relaxation.share_2, relaxation.time_2}};
}

inline Model laws_of(const LayerNumbers& layer, const RelaxationNumbers& relaxation,
                     LayeredForm form) noexcept {
  const auto& [c, h_s, top, puncture, per_length, stiffness, length, surface, brittleness, rho] = layer;
  switch (form) {
    case LayeredForm::passive:
      return laws_of<laws::Prony>(
          layer, laws::DraggedTissuePassive{per_length, stiffness, length, surface, rho}, relaxation);
    case LayeredForm::yielding:
      return laws_of<laws::PronyLocked>(
          layer, laws::YieldingTissue{per_length, stiffness, length, surface, brittleness, 0.0, rho},
          relaxation);
    default:
      return laws_of<laws::PronyAtRest>(
          layer, laws::DraggedTissueAsFitted{per_length, stiffness, length, surface, rho}, relaxation);
  }
}

/// Whether the engine accepts the parameters of a layer.
inline bool valid(const LayerNumbers& layer, const RelaxationNumbers& relaxation, LayeredForm form) noexcept {
  return needleforce::valid(laws_of(layer, relaxation, form));
}

/// One step of a motion, with what it has in common for every set of parameters.
struct LayerStep {
  double depth, travel, dt, velocity, deepest;
  bool advancing, withdrawing;
  double left[2], during[2];  ///< of `Relaxing`
};

/// Gives steps the relaxation with other time constants.
inline void relax_steps(const RelaxationNumbers& times, std::span<LayerStep> steps) noexcept {
  const laws::PronyAtRest::Prepared series{{0.25, 0.25}, {times.time_1, times.time_2}};
  Relaxing relaxing{};
  double last = -1.0;
  for (LayerStep& step : steps) {
    if (step.dt != last) relaxing = series.over(last = step.dt);
    for (int j = 0; j < 2; ++j) step.left[j] = relaxing.left[j], step.during[j] = relaxing.during[j];
  }
}

/// The steps of a motion at `depth` [m] after steps of `dt` [s], classified as `Insertion` does.
inline void prepare_steps(std::span<const double> depth, std::span<const double> dt,
                          const RelaxationNumbers& times, LayerStep* steps) noexcept {
  constexpr double speed_at_rest = 1e-4, noise_of_depth = 3e-5;  // of `Insertion`
  double deepest = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const double travel = i == 0 ? 0.0 : depth[i] - depth[i - 1];
    deepest = std::max(deepest, depth[i]);
    const bool withdrawing = depth[i] < deepest - noise_of_depth;
    steps[i] = {depth[i],       travel,  dt[i],
                travel / dt[i], deepest, !withdrawing && travel > speed_at_rest * dt[i],
                withdrawing,    {},      {}};
  }
  relax_steps(times, {steps, depth.size()});
}

/// The laws of a layer by form, as `laws_of`.
template <LayeredForm form>
struct LawsOf {
  using Friction = std::conditional_t<
      form == LayeredForm::passive, laws::DraggedTissuePassive,
      std::conditional_t<form == LayeredForm::yielding, laws::YieldingTissue, laws::DraggedTissueAsFitted>>;
  using Relaxation = std::conditional_t<
      form == LayeredForm::passive, laws::Prony,
      std::conditional_t<form == LayeredForm::yielding, laws::PronyLocked, laws::PronyAtRest>>;
};

/// A layer after so many `steps` of the motion without a puncture. It does not depend on friction, nor on how
/// much deeper the puncture is.
struct PressedLayer {
  std::size_t steps = 0;
  Element element{};
  double indentation = 0.0, force = 0.0, slope = 0.0, work = 0.0;
};

/// One layer with laws known at compile time: the same laws and order as in `Insertion`, a quarter of the
/// time; a test compares the two.
template <LayeredForm form>
class LoneLayer {
  using Friction = typename LawsOf<form>::Friction;
  using Shafts = typename Friction::Prepared;

 public:
  LoneLayer(const LayerNumbers& layer, const RelaxationNumbers& relaxation,
            const PressedLayer& pressed) noexcept
      : pressed_(pressed),
        top_(layer.top),
        puncture_(layer.puncture - layer.top),
        contact_(contact_of(layer).prepare()),
        friction_(friction_of(layer).prepare()),
        relaxing_(typename LawsOf<form>::Relaxation{relaxation.share_1, relaxation.time_1, relaxation.share_2,
                                                    relaxation.time_2}
                      .prepare()
                      .over(1.0)) {}

  const PressedLayer& pressed() const noexcept { return pressed_; }

  /// Force [N] after a step.
  double step(const LayerStep& step) noexcept {
    const double depth = step.depth - top_;
    if (!pierced_ && depth <= 0.0 && pressed_.element.elastic == 0.0) {  // not touched yet
      ++pressed_.steps;
      return 0.0;
    }
    for (int j = 0; j < 2; ++j) relaxing_.left[j] = step.left[j], relaxing_.during[j] = step.during[j];
    Move move{depth,          step.travel,     depth > 0.0 ? std::min(step.travel, depth) : 0.0,
              step.velocity,  step.dt,         step.deepest - top_,
              step.advancing, step.withdrawing};
    if (!pierced_) {
      if (!(depth > puncture_)) return press(move);
      pierce(depth);
      move.below = std::min(move.below, std::max(0.0, depth - puncture_));
    }
    return drag(move);
  }

 private:
  static Friction friction_of(const LayerNumbers& layer) noexcept {
    if constexpr (form == LayeredForm::yielding)
      return {layer.per_length,      layer.stiffness,   layer.rupture_length,
              layer.resting_surface, layer.brittleness, 0.0,
              layer.withdrawal};
    else
      return {layer.per_length, layer.stiffness, layer.rupture_length, layer.resting_surface,
              layer.withdrawal};
  }

  double press(const Move& move) noexcept {
    auto& [steps, element, indentation, force, slope, work] = pressed_;
    const double before = force;
    ++steps;
    indentation = std::max(0.0, move.depth);
    slope = contact_.slope(indentation);
    force = element.load(contact_.force(indentation) - element.elastic, 0.0,
                         std::numeric_limits<double>::infinity(), relaxing_, move.advancing);
    slope *= element.stiffening;
    work += 0.5 * (before + force) * move.travel;
    return force;
  }

  [[gnu::noinline]] void pierce(double depth) noexcept {
    const auto& [steps, element, indentation, force, slope, work] = pressed_;
    const double instant = contact_.force(indentation), energy = contact_.energy(indentation);
    const double left = instant > 0.0 ? std::clamp(force / instant, 0.0, 1.0) : 0.0;
    ContactAtPuncture contact{element, force, energy, slope};
    contact.left = left;
    contact.whole_force = left * contact_.force(puncture_);
    contact.whole_energy = left * contact_.energy(puncture_);
    contact.work = contact.whole_energy + work - left * energy;
    contact.relaxing = relaxing_;
    contact.extent = extent();
    contact.depth = depth;
    friction_.pierce(memory_, contact);
    pierced_ = true;
  }

  double drag(const Move& move) noexcept {
    friction_.advance(shaft_, memory_, move, extent(), relaxing_);
    if constexpr (requires { Shafts::keeps_contact; }) {
      const double indentation = friction_.yield(memory_, move, extent(), relaxing_);
      friction_.press(memory_, contact_.force(indentation), contact_.slope(indentation));
    }
    return friction_.force(shaft_, memory_, move.velocity);
  }

  LayerExtent extent() const noexcept {
    constexpr double below = std::numeric_limits<double>::infinity();
    return {0.0, puncture_, below, true, below};
  }

  PressedLayer pressed_;
  double top_, puncture_;
  laws::ConeCylinder::Prepared contact_;
  Shafts friction_;
  Relaxing relaxing_;
  Shaft shaft_{};
  typename Shafts::Memory memory_{};
  bool pierced_ = false;
};

template <LayeredForm form>
void layer_force(const LayerNumbers& layer, const RelaxationNumbers& relaxation,
                 std::span<const LayerStep> steps, PressedLayer& pressed, double* force) noexcept {
  LoneLayer<form> lone(layer, relaxation, pressed);
  for (std::size_t i = pressed.steps; i < steps.size(); ++i) force[i] = lone.step(steps[i]);
  pressed = lone.pressed();
}

/// Force (n,) [N] of one layer along a motion, from what is `pressed` already on; NaN throughout where the
/// engine refuses the parameters. Layers of dragged tissue add up, so that a stack is the sum of its layers.
inline void layer_force(const LayerNumbers& layer, const RelaxationNumbers& relaxation, LayeredForm form,
                        std::span<const LayerStep> steps, PressedLayer& pressed, double* force) noexcept {
  if (!valid(layer, relaxation, form)) {
    std::fill_n(force, steps.size(), std::numeric_limits<double>::quiet_NaN());
    pressed = {};
  } else if (form == LayeredForm::passive) {
    layer_force<LayeredForm::passive>(layer, relaxation, steps, pressed, force);
  } else if (form == LayeredForm::yielding) {
    layer_force<LayeredForm::yielding>(layer, relaxation, steps, pressed, force);
  } else {
    layer_force<LayeredForm::as_fitted>(layer, relaxation, steps, pressed, force);
  }
}

}  // namespace needleforce::fit
