// SPDX-License-Identifier: Apache-2.0
// The force of a first insertion and its withdrawal while sliding, as a function of depth: no memory, fast
// over arrays.
#pragma once

#include <cstddef>
#include <variant>

#include "model.hpp"

namespace needleforce {

namespace detail {

/// The paper's three phases with everything computed that does not change along the array.
template <class Contact, class Shaft, class Tip>
struct Sliding {
  Contact contact;
  Shaft shaft;
  Tip tip;
  double puncture, surface;

  // comparisons are so written that a depth that is not finite shows
  double friction(double z, double v) const noexcept { return shaft.sliding(embedded_length(z, surface), v); }
  double inwards(double z, double v) const noexcept {
    const double pierced = friction(z, v) + tip.steady(v);
    const double pushed = contact.force(z <= 0.0 ? 0.0 : z);
    return z > puncture ? pierced : pushed;
  }
};

/// The tip of any law whose steady force [N] does not depend on the speed: one loop for all of them.
struct TipAtAnySpeed {
  double force;
  double steady(double) const noexcept { return force; }
};

template <class Sliding>
void slide_slowly(const Sliding& sliding, const double* __restrict depth, double* __restrict force,
                  std::size_t n) noexcept {
  for (std::size_t i = 0; i < n; ++i) force[i] = sliding.inwards(depth[i], 0.0);
}

template <class Sliding>
void slide(const Sliding& sliding, const double* __restrict depth, const double* __restrict velocity,
           double* __restrict force, std::size_t n) noexcept {
  for (std::size_t i = 0; i < n; ++i) {
    const double z = depth[i], v = velocity[i] + 0.0;  // -0.0 is inwards, as 0.0 is
    // both directions are computed and one is selected: a branch would keep the compiler from vectorising
    const double in = sliding.inwards(z, v), out = sliding.friction(z, v < 0.0 ? v : -0.0);
    force[i] = (v >= 0.0 ? in : out) + 0.0 * v;  // a velocity that is not finite shows
  }
}

/// `sliding_force` for one contact law, which punctures at a depth `puncture` [m]. A function of its own, so
/// that a caller who widens the loops can compile them law by law: all in one function take the compiler five
/// times as long.
template <class Contact>
void slide_after(const Contact& pushed, double puncture, const Model& model, const double* __restrict depth,
                 const double* __restrict velocity, double* __restrict force, std::size_t n) noexcept {
  const auto shaft = prepare(model.friction);
  const auto tip = prepare(model.cutting);
  const TipAtAnySpeed slow{std::visit([](const auto& cut) { return cut.steady(0.0); }, tip)};
  const bool at_any_speed = std::visit([](const auto& cut) { return requires { cut.steady(); }; }, tip);
  // one visit inside the other: the compiler sees through them, and widens the loops as far as its caller
  // asks
  const auto along = [&](const auto& friction) {
    const auto sliding = [&](const auto& cut) {
      return Sliding{pushed, friction, cut, puncture, friction.surface(0.0, puncture)};
    };
    if (velocity == nullptr) return slide_slowly(sliding(slow), depth, force, n);
    if (at_any_speed) return slide(sliding(slow), depth, velocity, force, n);
    std::visit(
        [&](const auto& cut) {
          if constexpr (!requires { cut.steady(); }) slide(sliding(cut), depth, velocity, force, n);
        },
        tip);
  };
  std::visit(
      [&]<class F>(const F& friction) {
        if constexpr (SlidesSteadily<F>) along(friction);
      },
      shaft);
}

}  // namespace detail

/// True if the model has a force while sliding that needs no memory.
inline bool slides_steadily(const Model& model) noexcept {
  const auto steady = []<class L>(const L&) { return SlidesSteadily<typename L::Prepared>; };
  return std::visit(steady, model.friction) && std::holds_alternative<laws::NoRelaxation>(model.relaxation);
}

/// Writes the force [N] at each of n depths [m] to `force`: the paper's complete model. `velocity` [m/s]
/// gives the direction (>= 0 inwards) and the rate terms, or is nullptr for slow insertion throughout. The
/// arrays may not overlap. Allocates nothing; writes nothing unless `slides_steadily(model)`.
inline void sliding_force(const Model& model, const double* __restrict depth,
                          const double* __restrict velocity, double* __restrict force,
                          std::size_t n) noexcept {
  const auto contact = prepare(model.stiffness);
  const double puncture = puncture_depth(model.puncture, contact);
  std::visit(
      [&](const auto& pushed) { detail::slide_after(pushed, puncture, model, depth, velocity, force, n); },
      contact);
}

}  // namespace needleforce
