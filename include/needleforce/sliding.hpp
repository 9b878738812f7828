// SPDX-License-Identifier: Apache-2.0
// The force of a first insertion and its withdrawal while sliding, as a function of depth: no memory, fast
// over arrays.
#pragma once

#include <cstddef>

#include "model.hpp"

namespace needleforce {

namespace detail {

/// The paper's three phases with everything computed that does not change along the array.
template <class Contact, class Shaft>
struct Sliding {
  Contact contact;
  Shaft shaft;
  double puncture, surface, cutting;

  // comparisons are so written that a depth that is not finite shows
  double friction(double z) const noexcept { return shaft.sliding(z <= surface ? 0.0 : z - surface); }
  double inwards(double z) const noexcept {
    const double pierced = friction(z) + cutting;
    const double pushed = contact.force(z <= 0.0 ? 0.0 : z);
    return z > puncture ? pierced : pushed;
  }
  double outwards(double z) const noexcept { return -friction(z); }
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
      force[i] = (velocity[i] >= 0.0 ? in : out) + 0.0 * velocity[i];  // a velocity that is not finite shows
    }
  };
  const auto contact = prepare(model.stiffness);
  const double puncture = puncture_depth(model.puncture, contact);
  const double cutting = std::visit([](const auto& law) { return law.steady(); }, prepare(model.cutting));
  const auto shaft = prepare(model.friction);
  // one visit inside the other: the compiler sees through them, and widens the loops as far as its caller
  // asks
  std::visit(
      [&](const auto& pushed) {
        std::visit(
            [&](const auto& friction) {
              loop(detail::Sliding{pushed, friction, puncture, friction.surface(puncture), cutting});
            },
            shaft);
      },
      contact);
}

}  // namespace needleforce
