// SPDX-License-Identifier: Apache-2.0
// The error of the tip that other insertions of a tissue had, as a table over the depth.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

namespace needleforce::bending {

/// Linear between its nodes; none until it is set.
class ExpectedError {
 public:
  using Plane = std::array<double, 2>;
  static constexpr std::size_t capacity = 128;

  /// Errors [m] at depths every `spacing` [m] from 0 on; more than `capacity` are left out. False, and none
  /// is expected, where a number is none that a needle can have.
  bool set(std::span<const Plane> errors, double spacing) noexcept {
    count_ = 0;
    if (!(spacing >= 1e-6 && spacing <= 1.0)) return false;
    for (const Plane& error : errors)
      if (!(std::abs(error[0]) <= 1.0 && std::abs(error[1]) <= 1.0)) return false;
    count_ = std::min(errors.size(), capacity);
    spacing_ = spacing;
    std::copy_n(errors.begin(), count_, nodes_.begin());
    return true;
  }
  /// In plane d [m]; beyond the table as at its end. Wait-free.
  double at(double depth, std::size_t d) const noexcept {
    if (count_ < 2) return 0.0;
    const double place = std::clamp(depth / spacing_, 0.0, static_cast<double>(count_ - 1));
    const std::size_t k = std::min(static_cast<std::size_t>(place), count_ - 2);
    return nodes_[k][d] + (place - static_cast<double>(k)) * (nodes_[k + 1][d] - nodes_[k][d]);
  }
  /// Its slope; beyond the table as at its end. Wait-free.
  double slope(double depth, std::size_t d) const noexcept {
    if (count_ < 2) return 0.0;
    const double half = 0.5 * spacing_, end = spacing_ * static_cast<double>(count_ - 1);
    const double middle = std::clamp(depth, half, end - half);
    return (at(middle + half, d) - at(middle - half, d)) / spacing_;
  }

 private:
  std::array<Plane, capacity> nodes_{};
  std::size_t count_ = 0;
  double spacing_ = 1.0;
};

}  // namespace needleforce::bending
