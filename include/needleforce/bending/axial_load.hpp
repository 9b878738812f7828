// SPDX-License-Identifier: Apache-2.0
// The axial force along the needle: at the tip, and friction along the shaft.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "../sample.hpp"

namespace needleforce::bending {

/// Compression [N] at the tip and the friction per length [N/m] between depths. Both follow the tangent of
/// the needle.
class AxialLoad {
 public:
  static constexpr std::size_t max_pieces = 64;
  static constexpr double shortest = 1e-12;  ///< length of shaft that bears a finite force per length [m]

  AxialLoad() noexcept {}  // pieces that are not used stay as they are: there are many

  /// Takes over the forces of an insertion, and of its last sample. Wait-free.
  template <class Axial>
  void take(const Axial& insertion, const Sample& sample) noexcept {
    tip_ = sample.cutting + sample.stiffness;
    count_ = 0;
    insertion.along_shaft(sample.velocity, [this](double from, double to, double force) noexcept {
      const double length = std::max(to - from, shortest);
      if (count_ < max_pieces) pieces_[count_++] = {to - length, to, force / length, 0.0};
    });
    double below = tip_;
    for (std::size_t i = count_; i-- > 0;) {
      pieces_[i].below = below;
      below += pieces_[i].per_length * (pieces_[i].to - pieces_[i].from);
    }
  }
  double tip() const noexcept { return tip_; }
  /// True without any axial force. Wait-free.
  bool none() const noexcept { return tip_ == 0.0 && count_ == 0; }
  /// Compression [N] at a depth, of the tip and the shaft below it. Wait-free.
  double at(double depth) const noexcept {
    const Piece* const end = pieces_.data() + count_;
    const Piece* const piece = std::partition_point(
        pieces_.data(), end, [depth](const Piece& each) noexcept { return each.to <= depth; });
    if (piece == end) return tip_;
    return piece->below + piece->per_length * (piece->to - std::max(depth, piece->from));
  }

 private:
  struct Piece {
    double from, to, per_length;
    double below;  // [N] at its end
  };
  double tip_ = 0.0;
  std::size_t count_ = 0;
  std::array<Piece, max_pieces> pieces_;  // from the surface down
};

}  // namespace needleforce::bending
