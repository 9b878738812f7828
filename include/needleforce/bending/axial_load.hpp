// SPDX-License-Identifier: Apache-2.0
// The axial force along the needle: at the tip, and friction along the shaft in each layer.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "../insertion.hpp"

namespace needleforce::bending {

/// Compression [N] at the tip and the friction per length [N/m] between depths, from an insertion at one
/// depth. Both follow the tangent of the needle.
class AxialLoad {
 public:
  AxialLoad() = default;
  AxialLoad(const Insertion& insertion, const Sample& sample) noexcept
      : tip_(sample.cutting + sample.stiffness) {
    for (std::size_t i = 0; i < insertion.layers(); ++i) {
      const auto [force, from, length] = insertion.shaft_friction(i, sample.velocity);
      if (length > 0.0) pieces_[count_++] = {from, from + length, force / length};
    }
  }
  double tip() const noexcept { return tip_; }
  /// True without any axial force. Wait-free.
  bool none() const noexcept { return tip_ == 0.0 && count_ == 0; }
  /// Compression [N] at a depth, of the tip and the shaft below it. Wait-free.
  double at(double depth) const noexcept {
    double sum = tip_;
    for (std::size_t i = 0; i < count_; ++i) {
      const auto& [begin, end, per_length] = pieces_[i];
      sum += per_length * std::max(0.0, end - std::max(depth, begin));
    }
    return sum;
  }

 private:
  struct Piece {
    double from, to, per_length;
  };
  double tip_ = 0.0;
  std::array<Piece, max_layers> pieces_{};
  std::size_t count_ = 0;
};

}  // namespace needleforce::bending
