// SPDX-License-Identifier: Apache-2.0
// The lateral force on a bevelled tip: it builds up while the bevel's face enters new tissue.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "elementary.hpp"

namespace needleforce::bending {

/// Direction and share of the tip's lateral force, a vector B in the tissue of length 0 to 1. The face that
/// is new in the tissue pushes to where the bevel points now, dB/ds = (e^(i roll) - B) / b over the travel s,
/// with the length b of the bevel. A tip that turns fast while it advances so loses its force, as it does.
class TipLoad {
 public:
  /// The tip advances by `travel` [m] through new tissue while its roll goes from one angle to another
  /// [rad], evenly. Exact. Wait-free.
  void advance(double travel, double length, double roll_before, double roll_after) noexcept {
    const double ratio = length > 0.0 ? travel / length : 1e300, kept = ratio < 700.0 ? falling(ratio) : 0.0;
    const double turn = roll_after - roll_before;  // dB/ds = (e^(i(roll + w s)) - B) / b
    const double slip = ratio < 1e200 && travel > 0.0 ? turn / ratio : 0.0;  // w b
    // particular solution e^(i roll) / (1 + i w b)
    const double scale = 1.0 / (1.0 + slip * slip);
    const auto particular = [=](double roll) {
      const auto [c, s] = cos_sin(roll);
      return std::array{scale * (c + slip * s), scale * (s - slip * c)};
    };
    const auto before = particular(roll_before), after = particular(roll_after);
    for (std::size_t d = 0; d < 2; ++d) share_[d] = after[d] + (share_[d] - before[d]) * kept;
  }
  /// The share of the full force across the axis, in x and y. Wait-free.
  const std::array<double, 2>& share() const noexcept { return share_; }
  void clear() noexcept { share_ = {0.0, 0.0}; }

 private:
  std::array<double, 2> share_{0.0, 0.0};
};

}  // namespace needleforce::bending
