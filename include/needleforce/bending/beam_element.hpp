// SPDX-License-Identifier: Apache-2.0
// Beam elements: cubic Hermite with axial load that follows the beam, and the exact beam-column.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "elementary.hpp"

namespace needleforce::bending {

/// A 2 x 2 matrix: rows force and moment, columns deflection and rotation. Not initialised, as a chain of
/// them is filled at once.
struct Block {
  double yy, yr, ry, rr;
  constexpr void operator+=(const Block& other) noexcept {
    yy += other.yy, yr += other.yr, ry += other.ry, rr += other.rr;
  }
};

/// Stiffness of an element between two nodes, whose freedoms are deflection y and rotation h y'.
struct ElementMatrix {
  Block first, upper, lower, second;
};

/// The four shape functions at xi in [0, 1], of y_1, h y'_1, y_2, h y'_2.
constexpr std::array<double, 4> hermite(double xi) noexcept {
  const double square = xi * xi, cube = square * xi;
  return {1.0 - 3.0 * square + 2.0 * cube, xi - 2.0 * square + cube, 3.0 * square - 2.0 * cube,
          cube - square};
}

/// Their derivatives by xi.
constexpr std::array<double, 4> hermite_slope(double xi) noexcept {
  return {6.0 * xi * (xi - 1.0), 1.0 + xi * (3.0 * xi - 4.0), 6.0 * xi * (1.0 - xi), xi * (3.0 * xi - 2.0)};
}

/// Points and weights of Gauss on [0, 1], exact to the fifth degree.
inline constexpr std::size_t gauss_count = 3;
inline constexpr std::array<double, gauss_count> gauss_points{0.11270166537925831, 0.5, 0.88729833462074169};
inline constexpr std::array<double, gauss_count> gauss_weights{5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};

/// a times the outer product of two columns of shape functions, added to an element.
constexpr void add_product(ElementMatrix& matrix, double factor, const std::array<double, 4>& rows,
                           const std::array<double, 4>& columns) noexcept {
  const double y1 = factor * rows[0], r1 = factor * rows[1], y2 = factor * rows[2], r2 = factor * rows[3];
  matrix.first += {y1 * columns[0], y1 * columns[1], r1 * columns[0], r1 * columns[1]};
  matrix.upper += {y1 * columns[2], y1 * columns[3], r1 * columns[2], r1 * columns[3]};
  matrix.lower += {y2 * columns[0], y2 * columns[1], r2 * columns[0], r2 * columns[1]};
  matrix.second += {y2 * columns[2], y2 * columns[3], r2 * columns[2], r2 * columns[3]};
}

/// Bending of a cubic element of stiffness EI [N m^2] and length h [m].
constexpr ElementMatrix bending_matrix(double stiffness, double h) noexcept {
  const double unit = stiffness / (h * h * h);
  return {{12.0 * unit, 6.0 * unit, 6.0 * unit, 4.0 * unit},
          {-12.0 * unit, 6.0 * unit, -6.0 * unit, 2.0 * unit},
          {-12.0 * unit, -6.0 * unit, 6.0 * unit, 2.0 * unit},
          {12.0 * unit, -6.0 * unit, -6.0 * unit, 4.0 * unit}};
}

/// Bending over the part [from, to] of an element alone, whose stiffness differs from the rest.
constexpr void add_bending(ElementMatrix& matrix, double stiffness, double h, double from,
                           double to) noexcept {
  const double length = to - from, unit = stiffness / (h * h * h);
  for (const double point : {0.21132486540518713, 0.78867513459481287}) {  // exact to the third degree
    const double xi = from + length * point;
    const std::array<double, 4> curvature{12.0 * xi - 6.0, 6.0 * xi - 4.0, 6.0 - 12.0 * xi, 6.0 * xi - 2.0};
    add_product(matrix, 0.5 * length * unit, curvature, curvature);
  }
}

/// What an axial compression adds that is `middle` [N] in the middle of an element and grows by `change` from
/// its first node to its second: -integral of N y' dy'. `per_h` is 1 / h.
constexpr void add_compression(ElementMatrix& matrix, double middle, double change, double per_h) noexcept {
  const double a = -middle * per_h * (1.0 / 30.0), b = -change * per_h * (1.0 / 60.0);
  matrix.first += {36.0 * a, 3.0 * a + 3.0 * b, 3.0 * a + 3.0 * b, 4.0 * a - 2.0 * b};
  matrix.upper += {-36.0 * a, 3.0 * a - 3.0 * b, -3.0 * a - 3.0 * b, -a};
  matrix.lower += {-36.0 * a, -3.0 * a - 3.0 * b, 3.0 * a - 3.0 * b, -a};
  matrix.second += {36.0 * a, -3.0 * a + 3.0 * b, -3.0 * a + 3.0 * b, 4.0 * a + 2.0 * b};
}

/// Half the integral of y'^2 over a cubic element between nodes that are `off` [m] apart across, with
/// rotations r = h y', and the same weighted by xi - 1/2.
struct SlopeSquares {
  double whole, weighted;
};
constexpr SlopeSquares slope_squares(double off, double r1, double r2, double per_h) noexcept {
  return {
      per_h * (1.0 / 30.0) * (18.0 * off * off - 3.0 * off * (r1 + r2) + 2.0 * (r1 * r1 + r2 * r2) - r1 * r2),
      per_h * (1.0 / 60.0) * (3.0 * off * (r2 - r1) + r2 * r2 - r1 * r1)};
}

/// The largest compression, as N L^2 / EI, below which a beam-column held at both ends has not buckled.
inline constexpr double clamped_buckling = 39.47841760435743;

/// Stiffnesses of a beam-column over EI / L^3, EI / L^2, EI / L and EI / L, and their derivatives by
/// p = N L^2 / EI.
struct ColumnStiffness {
  std::array<double, 4> value, by_compression;
};

namespace detail {
/// From those of its ends: s_22, s_24 and their derivatives.
constexpr ColumnStiffness column_of(double p, double s22, double s24, double d22, double d24) noexcept {
  const double s12 = s22 + s24, d12 = d22 + d24;
  return {{2.0 * s12 - p, s12, s22, s24}, {2.0 * d12 - 1.0, d12, d22, d24}};
}
}  // namespace detail

/// A beam without lateral load under a constant compression, exactly; p < 0 is tension. Wait-free.
inline ColumnStiffness column_stiffness(double p) noexcept {
  if (std::abs(p) < 0.5) {
    return detail::column_of(p, 4.0 - p * (2.0 / 15.0 + p * (11.0 / 6300.0 + p / 27000.0)),
                             2.0 + p * (1.0 / 30.0 + p * (13.0 / 12600.0 + 11.0 * p / 378000.0)),
                             -(2.0 / 15.0 + p * (11.0 / 3150.0 + p / 9000.0)),
                             1.0 / 30.0 + p * (13.0 / 6300.0 + 11.0 * p / 126000.0));
  }
  const double x = std::sqrt(std::abs(p));
  // of tension over cosh, so that nothing overflows
  const double small = p > 0.0 ? 1.0 : 2.0 * falling(x) / (1.0 + falling(2.0 * x));
  const auto [cosine, sine] = p > 0.0 ? cos_sin(x) : std::array{1.0, tanh_of(x)};
  const double sign = p > 0.0 ? 1.0 : -1.0;
  const double unit = 1.0 / (sign * 2.0 * (small - cosine) - x * sine) * sign;
  const double turn = sign * (sine - x * cosine);
  const double s22 = x * turn * unit, s24 = sign * x * (x * small - sine) * unit;
  // derivatives by x of numerators and denominator
  const double by22 = turn + x * x * sine, by24 = sign * (2.0 * x * small - sine - x * cosine);
  const double scale = sign * 0.5 / x * unit;
  return detail::column_of(p, s22, s24, scale * (by22 - s22 * turn), scale * (by24 - s24 * turn));
}

/// The element of a beam-column. Rotations are y' [rad], not scaled. `N L^2 / EI` must stay below
/// `clamped_buckling`.
inline ElementMatrix beam_column(double stiffness, double length, const ColumnStiffness& column) noexcept {
  const auto& [s11, s12, s22, s24] = column.value;
  const double a = stiffness / length, b = a / length, c = b / length;
  return {{c * s11, b * s12, b * s12, a * s22},
          {-c * s11, b * s12, -b * s12, a * s24},
          {-c * s11, -b * s12, b * s12, a * s24},
          {c * s11, -b * s12, -b * s12, a * s22}};
}

/// Half the integral of y'^2 over a beam-column, with the derivatives of its stiffnesses: what its energy
/// loses per compression.
inline double column_shortening(const ColumnStiffness& column, double length, double off, double slope1,
                                double slope2) noexcept {
  const auto& [d11, d12, d22, d24] = column.by_compression;
  return -0.5 * (d11 * off * off / length - 2.0 * d12 * off * (slope1 + slope2) +
                 length * (d22 * (slope1 * slope1 + slope2 * slope2) + 2.0 * d24 * slope1 * slope2));
}

/// An element with its rotations y' measured as h y'.
constexpr ElementMatrix rescaled(const ElementMatrix& matrix, double h) noexcept {
  const double one = 1.0 / h, two = one * one;
  const auto scaled = [=](const Block& b) { return Block{b.yy, b.yr * one, b.ry * one, b.rr * two}; };
  return {scaled(matrix.first), scaled(matrix.upper), scaled(matrix.lower), scaled(matrix.second)};
}

}  // namespace needleforce::bending
