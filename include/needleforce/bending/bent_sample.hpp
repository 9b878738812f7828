// SPDX-License-Identifier: Apache-2.0
// What goes into a step of a needle that bends, and what comes out.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "../sample.hpp"
#include "development.hpp"

namespace needleforce::bending {

/// Where the base is, in the frame of the tissue: z along the axis of the insertion, x and y across.
struct Base {
  double depth = 0.0;                       ///< travel of the needle, 0 with its tip at the surface [m]
  std::array<double, 2> lateral{}, tilt{};  ///< [m], [rad]
  double roll = 0.0;                        ///< of the needle about its axis, not wrapped [rad]
};

/// Between two places, at a share of the way and a depth.
inline Base between(const Base& from, const Base& to, double share, double depth) noexcept {
  Base result;
  result.depth = depth;
  for (std::size_t d = 0; d < 2; ++d) {
    result.lateral[d] = from.lateral[d] + share * (to.lateral[d] - from.lateral[d]);
    result.tilt[d] = from.tilt[d] + share * (to.tilt[d] - from.tilt[d]);
  }
  result.roll = from.roll + share * (to.roll - from.roll);
  return result;
}

/// One row of the insertion of a needle that bends.
struct BentSample {
  Vector tip{};                    ///< [m] in the tissue, its surface at z = 0
  Vector tangent{};                ///< of the tip, a unit vector
  std::array<double, 6> wrench{};  ///< of the tissue on the needle at the base, in its frame [N], [N m]
  double force = 0.0;              ///< axial force [N], + opposes insertion
  double lateral = 0.0;            ///< on the tip [N]
  double unsupported = 0.0;        ///< length between base and surface [m]
  Sample axial{};                  ///< parts of the axial force, phase and events
  Status status = Status::ok;
  bool buckled = false;
  bool moved = false;  ///< the step was taken; a refused one leaves the needle where it was
};

/// Wait-free.
inline bool finite(const BentSample& sample) noexcept {
  double sum = sample.force + sample.lateral + sample.unsupported + sample.axial.force;
  for (std::size_t i = 0; i < 3; ++i)
    sum += sample.tip[i] + sample.tangent[i] + sample.wrench[i] + sample.wrench[i + 3];
  return std::isfinite(sum);
}

}  // namespace needleforce::bending
