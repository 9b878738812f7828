// SPDX-License-Identifier: Apache-2.0
// What an insertion remembers between two steps: plain numbers, copied as they are.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "limits.hpp"
#include "model.hpp"
#include "sample.hpp"

namespace needleforce {

/// What a layer remembers between two steps.
struct LayerState {
  Element contact{};
  Shaft shaft{};
  MemoryOf<Friction> friction{};
  Relaxing relaxing{};
  double indentation = 0.0;     ///< of the last step in contact [m]
  double contact_force = 0.0;   ///< [N]
  double contact_slope = 0.0;   ///< [N/m]
  double work = 0.0;            ///< of indentation, where it relaxes [J]
  double puncture_depth = 0.0;  ///< where the layer was punctured [m]
  ReturnableSlip returnable{};  ///< of the shaft
  bool pierced = false;
};

/// What an insertion remembers between two steps.
struct InsertionState {
  Sample last{};
  double depth = 0.0;   ///< of the last accepted step [m]
  double waited = 0.0;  ///< time since the last accepted step [s]
  double deepest = -farthest;
  double relaxation_dt = 0.0;  ///< the step [s] for which the layers keep the exponentials of relaxation
  Cut cut{};
  MemoriesOf<Cutting> cutting{};
  ReturnableSlip returnable{};  ///< of the crack
  std::size_t pierced = 0;
  Phase phase = Phase::free;  ///< of the last accepted step
  bool started = false;
  std::array<LayerState, max_layers> layers{};
};

/// True for a sample from outside whose words and flags are ones.
inline bool possible(const Sample& sample) noexcept {
  return sample.phase >= Phase::free && sample.phase <= Phase::extraction && sample.status >= Status::ok &&
         sample.status <= Status::not_finite && is_flag(sample.contact) && is_flag(sample.punctured) &&
         is_flag(sample.exit);
}
inline bool possible(const LayerState& layer) noexcept {
  const Relaxing& relaxing = layer.relaxing;
  return is_flag(layer.pierced) && is_flag(relaxing.relaxes) && is_flag(relaxing.only_at_rest) &&
         is_flag(relaxing.restores) && layer.friction.possible();
}
/// True for a state from outside that a stack of so many layers can have, as far as the loop relies on it:
/// numbers of layers, words, flags, where the tip is and how long it waited. Wait-free.
inline bool possible(const InsertionState& state, std::size_t layers) noexcept {
  bool result = state.pierced <= layers && state.phase >= Phase::free && state.phase <= Phase::extraction &&
                is_flag(state.started) && std::abs(state.depth) <= farthest && state.waited >= 0.0 &&
                possible(state.last) && state.cutting.possible();
  for (const LayerState& layer : state.layers) result = result && possible(layer);
  return result;
}

}  // namespace needleforce
