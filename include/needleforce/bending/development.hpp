// SPDX-License-Identifier: Apache-2.0
// From slopes along the needle to its curve in space.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "beam_mesh.hpp"

namespace needleforce::bending {

using Vector = std::array<double, 3>;

/// Follows the needle from the base on, chord by chord. Slopes are read as angles in a frame that does not
/// turn about the needle, so that a path of constant curvature is an arc, whatever its angle.
template <std::size_t dimension>
class Development;

/// In a plane the angles add up.
template <>
class Development<1> {
 public:
  using Slope = std::array<double, 1>;
  explicit Development(const Vector& start) noexcept : position_(start) {}

  /// Goes `length` [m] in the direction of a slope. Wait-free.
  void advance(double length, const Slope& slope) noexcept {
    const auto [sine, cosine] = direction(slope[0]);
    position_[0] += length * sine;
    position_[2] += length * cosine;
  }
  const Vector& position() const noexcept { return position_; }
  /// The tangent at the end, where the needle has a slope.
  Vector tangent(const Slope& slope) noexcept {
    const auto [sine, cosine] = direction(slope[0]);
    return {sine, 0.0, cosine};
  }

 private:
  /// Sine and cosine as series, good to 3e-8 at an angle of 1.
  static std::array<double, 2> direction(double angle) noexcept {
    const double a = std::clamp(angle, -1.5, 1.5), s = a * a;
    // nested, with reciprocals: a division takes as long as all the rest
    const double sine =
        1.0 -
        s * (1.0 / 6.0) * (1.0 - s * (1.0 / 20.0) * (1.0 - s * (1.0 / 42.0) * (1.0 - s * (1.0 / 72.0))));
    const double cosine =
        1.0 - s * (1.0 / 2.0) *
                  (1.0 - s * (1.0 / 12.0) *
                             (1.0 - s * (1.0 / 30.0) * (1.0 - s * (1.0 / 56.0) * (1.0 - s * (1.0 / 90.0)))));
    return {a * sine, cosine};
  }
  Vector position_;
};

/// In space each change of slope turns the frame.
template <>
class Development<2> {
 public:
  using Slope = std::array<double, 2>;
  explicit Development(const Vector& start) noexcept : position_(start) {}

  /// Goes `length` [m] in the direction of a slope. Wait-free.
  void advance(double length, const Slope& slope) noexcept {
    turn_to(slope);
    const Vector along = z_axis();
    for (std::size_t i = 0; i < 3; ++i) position_[i] += length * along[i];
  }
  const Vector& position() const noexcept { return position_; }
  /// The tangent at the end, where the needle has a slope.
  Vector tangent(const Slope& slope) noexcept {
    turn_to(slope);
    return z_axis();
  }

 private:
  void turn_to(const Slope& slope) noexcept {
    double x = slope[0] - slope_[0], y = slope[1] - slope_[1], s = x * x + y * y;
    slope_ = slope;
    if (s > 2.0) {  // beyond what a needle does between two nodes: no more than the series bears
      const double scale = std::sqrt(2.0 / s);
      x *= scale, y *= scale, s = 2.0;
    }
    // quaternion of the rotation vector (-y, x, 0), sine and cosine of half its angle as series
    const double half = 0.5 - s * (1.0 / 48.0) * (1.0 - s * (1.0 / 80.0) * (1.0 - s * (1.0 / 168.0)));
    const double whole = 1.0 - s * (1.0 / 8.0) * (1.0 - s * (1.0 / 48.0) * (1.0 - s * (1.0 / 120.0)));
    const double a = -half * y, b = half * x;
    const auto& [w, i, j, k] = rotation_;
    rotation_ = {whole * w - i * a - j * b, whole * i + w * a - k * b, whole * j + w * b + k * a,
                 whole * k + i * b - j * a};
  }
  Vector z_axis() const noexcept {
    const auto& [w, i, j, k] = rotation_;
    return {2.0 * (i * k + w * j), 2.0 * (j * k - w * i), w * w - i * i - j * j + k * k};
  }

  Vector position_;
  Slope slope_{0.0, 0.0};
  std::array<double, 4> rotation_{1.0, 0.0, 0.0, 0.0};
};

/// In how many pieces an element above the surface is followed: it is long.
inline constexpr std::size_t free_pieces = 6;

/// Number of points of the needle's curve, none before the first step. Wait-free.
template <std::size_t dimension>
std::size_t curve_points(const BeamMesh<dimension>& mesh) noexcept {
  return mesh.count() + mesh.surface() * (free_pieces - 1);
}

/// Mean slope of a cubic element between xi and xi + share.
template <std::size_t dimension>
double cubic_chord(const BeamNode<dimension>& a, const BeamNode<dimension>& b, std::size_t d, double length,
                   double xi, double share) noexcept {
  const auto before = hermite(xi), after = hermite(xi + share);
  const std::array<double, 4> value{a.place[d], length * a.slope[d], b.place[d], length * b.slope[d]};
  double change = 0.0;
  for (std::size_t n = 0; n < 4; ++n) change += (after[n] - before[n]) * value[n];
  return change / (length * share);
}

/// Follows piece k of `count` of element i. A chord is shorter than its arc.
template <std::size_t dimension>
void follow_piece(const BeamMesh<dimension>& mesh, Development<dimension>& curve, std::size_t i,
                  std::size_t k, std::size_t count, double part) noexcept {
  const auto &a = mesh[i], &b = mesh[i + 1];
  const bool free = i < mesh.surface();
  const double more = free ? 0.0 : std::clamp(a.longer, -0.5 * mesh.h(), 0.5 * mesh.h());
  // at an angle to the path of t (1 - t^2 / 3)
  const double whole = free ? b.travel - a.travel : element_length(mesh.h(), more);
  const double turned = free ? 1.0 : 1.0 + more / (3.0 * mesh.h());
  const double share = 1.0 / static_cast<double>(count), length = whole * share;
  std::array<double, dimension> chord;
  double square = 0.0;
  for (std::size_t d = 0; d < dimension; ++d) {
    const double change = (b.slope[d] - a.slope[d]) * share;
    chord[d] = turned * (b.place[d] - a.place[d]) / whole;
    if (count > 1) chord[d] = cubic_chord(a, b, d, whole, static_cast<double>(k) * share, share);
    square += change * change;
  }
  curve.advance(part * (square < 1.0 ? length * (1.0 - square * (1.0 / 24.0)) : length), chord);
}

/// The part of its elements that a needle has: all, but where under a base that leaps, or where it turns far
/// from its path, the second order of slopes adds up to more than the needle's length [m].
template <std::size_t dimension>
double part_of_elements(const BeamMesh<dimension>& mesh, double needle_length) noexcept {
  constexpr double rounded = 1.008;  // more than in the range of the model
  double length = -mesh.base().travel;
  for (std::size_t i = mesh.surface(); i + 1 < mesh.count(); ++i)
    length += element_length(mesh.h(), mesh[i].longer);
  return std::min(1.0, rounded * needle_length / length);
}

/// Follows the needle from the base, at a depth `from` [m], to the tip, chord by chord, and calls `visit`
/// with each point [m]. Wait-free.
template <std::size_t dimension, class Visit>
Development<dimension> follow(const BeamMesh<dimension>& mesh, double from, double needle_length,
                              Visit visit) noexcept {
  const auto& first = mesh.base();
  Development<dimension> curve({first.place[0], dimension > 1 ? first.place[dimension - 1] : 0.0, from});
  if (mesh.count() == 0) return curve;
  visit(curve.position());
  const double part = part_of_elements(mesh, needle_length);
  for (std::size_t i = 0; i + 1 < mesh.count(); ++i) {
    const std::size_t count = i < mesh.surface() ? free_pieces : 1;
    for (std::size_t k = 0; k < count; ++k) {
      follow_piece(mesh, curve, i, k, count, part);
      visit(curve.position());
    }
  }
  return curve;
}

}  // namespace needleforce::bending
