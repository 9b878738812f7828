// SPDX-License-Identifier: Apache-2.0
// From slopes along the needle to its curve in space.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace needleforce::bending {

using Vector = std::array<double, 3>;

/// Follows the needle from the base on, with a frame that does not turn about it: an element of a length
/// turns the frame by the change of slope along it, whose two components are angles. A path of constant
/// curvature so becomes an arc, whatever its angle.
class Development {
 public:
  explicit Development(const Vector& start) noexcept : position_(start) {}

  /// Turns the frame by the angles `x` and `y` [rad]. Wait-free.
  void turn(double x, double y) noexcept {
    // quaternion of the rotation vector (-y, x, 0), by Cayley's form with tan(angle / 2) as a series
    const double square = 0.25 * (x * x + y * y);
    const double half = 0.5 * (1.0 + square * (1.0 / 3.0 + square * (2.0 / 15.0 + square * 17.0 / 315.0)));
    const double a = -half * y, b = half * x;
    const auto [w, i, j, k] = rotation_;
    rotation_ = {w - i * a - j * b, i + w * a - k * b, j + w * b + k * a, k + i * b - j * a};
  }
  /// Goes `length` [m] along the tangent. Wait-free.
  void advance(double length) noexcept {
    const auto [w, i, j, k] = rotation_;
    const double scale = length / (w * w + i * i + j * j + k * k);
    position_[0] += 2.0 * scale * (i * k + w * j);
    position_[1] += 2.0 * scale * (j * k - w * i);
    position_[2] += scale * (w * w - i * i - j * j + k * k);
  }
  /// Goes along an element whose slopes change by `change`, and whose chord is off the first by `chord`.
  template <std::size_t dimension>
  void follow(double length, const std::array<double, dimension>& chord,
              const std::array<double, dimension>& change) noexcept {
    double square = 0.0;
    for (std::size_t d = 0; d < dimension; ++d) square += change[d] * change[d];
    turn(chord[0], second(chord));
    advance(length / (1.0 + square / 24.0));
    turn(change[0] - chord[0], second(change) - second(chord));
  }

  const Vector& position() const noexcept { return position_; }
  Vector tangent() const noexcept {
    const auto [w, i, j, k] = rotation_;
    const double scale = 1.0 / (w * w + i * i + j * j + k * k);
    return {2.0 * scale * (i * k + w * j), 2.0 * scale * (j * k - w * i),
            scale * (w * w - i * i - j * j + k * k)};
  }

 private:
  template <std::size_t dimension>
  static double second(const std::array<double, dimension>& value) noexcept {
    if constexpr (dimension > 1)
      return value[1];
    else
      return 0.0;
  }

  Vector position_;
  std::array<double, 4> rotation_{1.0, 0.0, 0.0, 0.0};  // not normalised
};

}  // namespace needleforce::bending
