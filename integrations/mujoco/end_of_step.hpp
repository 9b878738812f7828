// SPDX-License-Identifier: Apache-2.0
// The force of the tissue at the end of the simulator's step, so that it stays stable however stiff it is.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "needleforce/insertion.hpp"

namespace needleforce::mujoco {

// MuJoCo takes a passive force F as it is at the beginning of a step. A light needle of mass m in stiff
// friction K = dF/dz then diverges where K dt^2 / m > 4, and below rings for ever: bristles that do not slip
// lose nothing.
//
// We split the step: first the tissue alone moves the needle, implicitly, then all other forces do. The first
// half, backward Euler, uses the depth z at its end and the force there:
//
//     z = x + dt v - (dt^2 / m) F(z)                  x, v: depth and velocity at the beginning; 1 / m:
//     mobility
//
// Its solution exists and is unique where F rises with z; F is continuous in x and v, and never gives more
// energy than the tissue stored. MuJoCo then applies F and adds the impulse of the rest, which we need not
// know. In the limit of a rigid tissue at z0, F = (m / dt^2) (x + dt v - z0): a spring and damper that bring
// the needle to rest in two steps of Euler (both eigenvalues 0), and damp to 0.61 a step in RK4 (h lambda =
// -1/2 +- i sqrt(3)/2).
//
// The engine's memory sees z, and never the x of MuJoCo: otherwise a needle at rest under a load u would let
// its bristles back by dt^2 u / m in every step, and creep. So at rest F = u to the last digit and the
// friction breaks at its own limit; the price is that the engine's depth differs from the needle's by dt^2 u
// / m: 20 micrometres for 1 N on 50 g at 1 ms, 5 at 0.5 ms. It vanishes with the step as the error of MuJoCo
// itself does.
//
// The mass is the effective one, 1 / (J inv(M) J^T), of the degree of freedom or of the tip along its axis:
// other mass on it, armature, contacts, implicit damping, only makes the needle heavier, which the
// splitting forgives without limit (eigenvalues of modulus sqrt(1 - m / m_true)). It forgives a true mass
// down to 3/4 of m. Needles that share a tree each take their part of its mass, so that together they do not
// exceed it.

/// Where the needle is going to be without the tissue, and how far 1 N takes it back.
struct Free {
  double depth;      ///< x + dt v [m]
  double per_force;  ///< dt^2 / m [m/N]
  double elapsed;    ///< since the last step of the engine's memory [s]
};

inline constexpr double same_force = 1e-6;  ///< [N] to which force and motion agree; no device shows less
inline constexpr int max_attempts = 24;     ///< at a puncture, where the force drops, halving ends here

/// Solves z + per_force F(z) = depth by Newton's method between brackets. `step_to(z)` gives the engine's
/// sample there, from the same memory each time; `last_force` [N], of the step before, is where the search
/// starts. Wait-free if `step_to` is; the sample of the last call is the answer.
template <class StepTo>
Sample at_end_of_step(const Free& free, double last_force, StepTo step_to) noexcept {
  double low = -std::numeric_limits<double>::infinity(), high = -low;
  double z = free.depth - free.per_force * last_force;
  Sample sample{};
  for (int attempt = 0; attempt < max_attempts; ++attempt) {
    sample = step_to(z);
    const double miss = z - free.depth + free.per_force * sample.force;
    if (!(std::abs(miss) > free.per_force * same_force)) break;
    (miss > 0.0 ? high : low) = z;
    const double rise = sample.force_by_depth + sample.force_by_velocity / free.elapsed;
    const double next = z - miss / (1.0 + free.per_force * std::max(0.0, rise));
    z = next > low && next < high ? next : 0.5 * (low + high);
  }
  return sample;
}

}  // namespace needleforce::mujoco
