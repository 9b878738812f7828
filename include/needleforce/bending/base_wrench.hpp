// SPDX-License-Identifier: Apache-2.0
// The wrench at the base in axes that are tilted with it, so that its work on any motion is exact.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace needleforce::bending {

/// Axes of a base with slopes s: t along (s_x, s_y, 1), x the unit vector of e_x - t_x t, y = t x x.
class BaseAxes {
 public:
  explicit BaseAxes(const std::array<double, 2>& slope) noexcept
      : length_(std::sqrt(1.0 + slope[0] * slope[0] + slope[1] * slope[1])),
        t_{slope[0] / length_, slope[1] / length_, 1.0 / length_},
        across_(std::sqrt(1.0 - t_[0] * t_[0])) {}

  /// A force of the tissue's axes in these. Wait-free.
  std::array<double, 3> force(const std::array<double, 3>& f) const noexcept {
    const double along = t_[0] * f[0] + t_[1] * f[1] + t_[2] * f[2];
    return {(f[0] - t_[0] * along) / across_, (t_[2] * f[1] - t_[1] * f[2]) / across_, along};
  }
  /// The moment whose work is that of `by_slope` [N m] on the slopes and of `by_roll` on the roll. A slope
  /// turns about x and y, and, as they turn with t, a little about t. Wait-free.
  std::array<double, 3> moment(const std::array<double, 2>& by_slope, double by_roll) const noexcept {
    const double about_y = length_ * by_slope[0] / across_;
    const double about_x = -(length_ * by_slope[1] * across_ + about_y * t_[0] * t_[1]) / t_[2];
    return {about_x - by_roll * t_[0] / across_, about_y, by_roll};
  }

 private:
  double length_;
  std::array<double, 3> t_;
  double across_;  ///< length of e_x - t_x t
};

}  // namespace needleforce::bending
