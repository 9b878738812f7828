// SPDX-License-Identifier: Apache-2.0
// One row of an insertion, and the words for its phase and status.
#pragma once

namespace needleforce {

enum class Phase { free, deformation, insertion, hold, extraction };
inline constexpr const char* phase_names[] = {"free", "deformation", "insertion", "hold", "extraction"};

enum class Status { ok, outside_range, invalid_parameter, not_finite };
inline constexpr const char* status_names[] = {"ok", "outside_range", "invalid_parameter", "not_finite"};

/// Force of the tissue on the needle [N], + opposes insertion, its parts, and its derivatives.
template <class Real>
struct BasicSample {
  double depth = 0.0;              ///< [m] past the undeformed surface
  double velocity = 0.0;           ///< [m/s]
  Real force = 0.0;                ///< [N], the sum of the parts
  Real stiffness = 0.0;            ///< [N]
  Real friction = 0.0;             ///< [N]
  Real cutting = 0.0;              ///< [N]
  Real lateral = 0.0;              ///< [N] across the axis, towards the bevel's point; 0 without an estimate
  double force_by_depth = 0.0;     ///< [N/m], the memory moving with the depth
  double force_by_velocity = 0.0;  ///< [N s/m]
  Phase phase = Phase::free;
  Status status = Status::ok;
  bool contact = false;    ///< true in the one step that touches the tissue
  bool punctured = false;  ///< true in the one step that breaks through a layer
  bool exit = false;       ///< true in the one step that leaves the tissue
};
using Sample = BasicSample<double>;

/// The row of a step that was refused: what is held of the last one, at rest where it was, without an event.
template <class Real>
BasicSample<Real> refused(BasicSample<Real> held, double depth, Status status) noexcept {
  held.depth = depth;
  held.velocity = 0.0;
  held.contact = held.punctured = held.exit = false;
  held.status = status;
  return held;
}

}  // namespace needleforce
