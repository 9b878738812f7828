// SPDX-License-Identifier: Apache-2.0
// What an insertion remembers between two steps: plain numbers, copied as they are.
#pragma once

#include <array>
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

}  // namespace needleforce
