// SPDX-License-Identifier: Apache-2.0
// What an insertion remembers between two steps: plain numbers, copied as they are.
#pragma once

#include <array>
#include <cstddef>

#include "limits.hpp"
#include "model.hpp"
#include "sample.hpp"

namespace needleforce {

/// How a contact that relaxes rises along the motion: only derivatives ask.
template <class Real>
struct Rise {
  double by_depth = 0.0;  ///< [N/m]
};
template <>
struct Rise<double> {};

/// What a layer remembers between two steps.
template <class Real>
struct BasicLayerState {
  BasicElement<Real> contact{};
  BasicShaft<Real> shaft{};
  MemoryOf<BasicFriction<Real>> friction{};
  BasicRelaxing<Real> relaxing{};
  Real indentation = 0.0;                  ///< of the last step in contact [m]
  Real contact_force = 0.0;                ///< [N]
  Real contact_slope = 0.0;                ///< [N/m]
  Real work = 0.0;                         ///< of indentation, where it relaxes [J]
  Real puncture_depth = 0.0;               ///< where the layer was punctured [m]
  BasicReturnableSlip<Real> returnable{};  ///< of the shaft
  bool pierced = false;
  [[no_unique_address]] Rise<Real> rise{};
};
using LayerState = BasicLayerState<double>;

/// What an insertion remembers between two steps.
template <class Real>
struct BasicInsertionState {
  BasicSample<Real> last{};
  double depth = 0.0;   ///< of the last accepted step [m]
  double waited = 0.0;  ///< time since the last accepted step [s]
  double deepest = -farthest;
  double relaxation_dt = 0.0;  ///< the step [s] for which the layers keep the exponentials of relaxation
  BasicCut<Real> cut{};
  MemoriesOf<BasicCutting<Real>> cutting{};
  BasicReturnableSlip<Real> returnable{};  ///< of the crack
  std::size_t pierced = 0;
  Phase phase = Phase::free;  ///< of the last accepted step
  bool started = false;
  std::array<BasicLayerState<Real>, max_layers> layers{};
};
using InsertionState = BasicInsertionState<double>;

/// Looks at what a layer remembers whose contact holds `most` [N] at most. Wait-free.
inline void check(StateCheck& check, const LayerState& layer, double most) noexcept {
  check.flag("layers.pierced", layer.pierced);
  for (const bool* flag : {&layer.relaxing.relaxes, &layer.relaxing.only_at_rest, &layer.relaxing.restores})
    check.flag("layers.relaxing", *flag);
  check.numbers("layers.contact", layer.contact);
  check.number("layers.contact", layer.contact.elastic, -most, most);
  check.numbers("layers.contact", layer.contact.memory, most);
  check.number("layers.contact_force", layer.contact_force, 0.0, most);
  check.number("layers.indentation", layer.indentation, 0.0, 2.0 * farthest);
  check.number("layers.puncture_depth", layer.puncture_depth, -farthest, farthest);
  check.numbers("layers.contact_slope", layer.contact_slope);
  check.numbers("layers.work", layer.work);
  check.numbers("layers.shaft",
                std::array{layer.shaft.surface, layer.shaft.embedded, layer.shaft.embedded_by_depth});
  layer.returnable.check(check, "layers.returnable");
  layer.friction.check(check, "layers.friction", most);
}
/// Looks at what an insertion into so many layers remembers: numbers of layers, words, flags, and lengths and
/// times from which the loop counts; each layer looks at its own. Wait-free.
inline void check(StateCheck& check, const InsertionState& state, std::size_t layers) noexcept {
  check.flag("started", state.started);
  check.word("phase", state.phase, Phase::extraction);
  check.require("pierced", state.pierced <= layers);
  check.number("depth", state.depth, -farthest, farthest);
  check.number("deepest", state.deepest, -farthest, farthest);
  check.number("waited", state.waited, 0.0, longest);
  check.number("relaxation_dt", state.relaxation_dt, 0.0, 2.0 * longest);
  check.numbers("cut", state.cut);
  state.returnable.check(check, "returnable");
  check.sample("last", state.last);
  state.cutting.check(check, "cutting", largest_in_a_state);
}

}  // namespace needleforce
