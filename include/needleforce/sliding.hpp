// SPDX-License-Identifier: Apache-2.0
// The force of a first insertion and its withdrawal while sliding, as a function of depth: no memory, fast
// over arrays.
#pragma once

#include <cstddef>

#include "model.hpp"

namespace needleforce {

/// Writes the force [N] at each of n depths [m] to `force`: the paper's complete model. `velocity` gives the
/// direction
/// (>= 0 inwards) or is nullptr for insertion throughout. The arrays may not overlap. Allocates nothing.
inline void sliding_force(const Model& model, const double* __restrict depth,
                          const double* __restrict velocity, double* __restrict force,
                          std::size_t n) noexcept {
  const auto loop = [=](const auto& contact, const auto& friction, const auto& cutting, double puncture) {
    const double surface = friction.dimple_ratio * puncture;
    const auto inwards = [&](double z) {
      const double pierced = friction.per_length * (z > surface ? z - surface : 0.0) + cutting.force;
      const double pushed = contact.force(z > 0.0 ? z : 0.0);
      return z > puncture ? pierced : pushed;
    };
    const auto outwards = [&](double z) { return -friction.per_length * (z > surface ? z - surface : 0.0); };
    if (velocity == nullptr)
      for (std::size_t i = 0; i < n; ++i) force[i] = inwards(depth[i]);
    else
      for (std::size_t i = 0; i < n; ++i)
        force[i] = velocity[i] >= 0.0 ? inwards(depth[i]) : outwards(depth[i]);
  };
  const auto contact = prepare(model.stiffness);
  const double puncture = puncture_depth(model.puncture, contact);
  std::visit([&](const auto&... part) { loop(part..., puncture); }, contact, model.friction, model.cutting);
}

}  // namespace needleforce
