// SPDX-License-Identifier: Apache-2.0
// The force of a first insertion and its withdrawal while sliding, as a function of depth: no memory, fast
// over arrays.
#pragma once

#include <cstddef>

#include "model.hpp"

namespace needleforce {

namespace detail {

/// The paper's three phases with everything computed that does not change along the array.
template <class Contact>
struct Sliding {
  Contact contact;
  double puncture, surface, per_length, cutting;

  double inwards(double z) const noexcept {
    const double embedded = z > surface ? z - surface : 0.0;
    const double pierced = per_length * embedded + cutting;
    const double pushed = contact.force(z > 0.0 ? z : 0.0);
    return z > puncture ? pierced : pushed;
  }
  double outwards(double z) const noexcept { return -per_length * (z > surface ? z - surface : 0.0); }
};

}  // namespace detail

/// Writes the force [N] at each of n depths [m] to `force`: the paper's complete model. `velocity` gives the
/// direction (>= 0 inwards) or is nullptr for insertion throughout. The arrays may not overlap. Allocates
/// nothing.
inline void sliding_force(const Model& model, const double* __restrict depth,
                          const double* __restrict velocity, double* __restrict force,
                          std::size_t n) noexcept {
  const auto loop = [=](const auto sliding) {
    if (velocity == nullptr) {
      for (std::size_t i = 0; i < n; ++i) force[i] = sliding.inwards(depth[i]);
      return;
    }
    for (std::size_t i = 0; i < n; ++i) {
      // both directions are computed and one is selected: a branch would keep the compiler from vectorising
      const double in = sliding.inwards(depth[i]), out = sliding.outwards(depth[i]);
      force[i] = velocity[i] >= 0.0 ? in : out;
    }
  };
  const auto contact = prepare(model.stiffness);
  const double puncture = puncture_depth(model.puncture, contact);
  std::visit(
      [&](const auto& prepared, const auto& friction, const auto& cutting) {
        loop(detail::Sliding{prepared, puncture, friction.dimple_ratio * puncture, friction.per_length,
                             cutting.force});
      },
      contact, model.friction, model.cutting);
}

}  // namespace needleforce
