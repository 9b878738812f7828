// SPDX-License-Identifier: Apache-2.0
// Beam elements: cubic Hermite with axial load that follows the beam, and the exact beam-column.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

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

/// What an axial compression adds that is `force` [N] in the middle and grows by `friction` [N/m] towards the
/// base, where both follow the tangent of the beam: the weak form of N y''. `per_h` is 1 / h.
constexpr void add_axial(ElementMatrix& matrix, double force, double friction, double per_h) noexcept {
  const double a = -force * per_h * (1.0 / 30.0), c = friction * (1.0 / 60.0);
  matrix.first += {36.0 * a - 30.0 * c, 3.0 * a + 6.0 * c, 3.0 * a - 6.0 * c, 4.0 * a};
  matrix.upper += {-36.0 * a + 30.0 * c, 3.0 * a - 6.0 * c, -3.0 * a + 6.0 * c, -a - c};
  matrix.lower += {-36.0 * a - 30.0 * c, -3.0 * a - 6.0 * c, 3.0 * a + 6.0 * c, -a + c};
  matrix.second += {36.0 * a + 30.0 * c, -3.0 * a + 6.0 * c, -3.0 * a - 6.0 * c, 4.0 * a};
}

/// The largest compression, as N L^2 / EI, below which a beam-column held at both ends has not buckled.
inline constexpr double clamped_buckling = 39.47841760435743;

/// A beam without lateral load under the constant compression N [N], exactly; tension is negative. Rotations
/// are y' [rad], not scaled. `N L^2 / EI` must stay below `clamped_buckling`.
inline ElementMatrix beam_column(double stiffness, double length, double compression) noexcept {
  const double square = compression * length * length / stiffness;
  double s11, s12, s22, s24;  // over EI / L^3, EI / L^2, EI / L, EI / L
  if (std::abs(square) < 0.5) {
    const double p = square;
    s11 = 12.0 - p * (6.0 / 5.0 + p * (1.0 / 700.0 + p / 63000.0));
    s12 = 6.0 - p * (1.0 / 10.0 + p * (1.0 / 1400.0 + p / 126000.0));
    s22 = 4.0 - p * (2.0 / 15.0 + p * (11.0 / 6300.0 + p / 27000.0));
    s24 = 2.0 + p * (1.0 / 30.0 + p * (13.0 / 12600.0 + 11.0 * p / 378000.0));
  } else if (square > 0.0) {
    const double x = std::sqrt(square), sine = std::sin(x), cosine = std::cos(x);
    const double unit = 1.0 / (2.0 - 2.0 * cosine - x * sine);
    s11 = square * x * sine * unit;
    s12 = square * (1.0 - cosine) * unit;
    s22 = x * (sine - x * cosine) * unit;
    s24 = x * (x - sine) * unit;
  } else {
    // hyperbolic functions over cosh, so that nothing overflows
    const double x = std::sqrt(-square), small = 1.0 / std::cosh(std::min(x, 700.0)), sine = std::tanh(x);
    const double unit = 1.0 / (2.0 * small - 2.0 + x * sine);
    s11 = -square * x * sine * unit;
    s12 = -square * (1.0 - small) * unit;
    s22 = x * (x - sine) * unit;
    s24 = x * (sine - x * small) * unit;
  }
  const double a = stiffness / length, b = a / length, c = b / length;
  return {{c * s11, b * s12, b * s12, a * s22},
          {-c * s11, b * s12, -b * s12, a * s24},
          {-c * s11, -b * s12, b * s12, a * s24},
          {c * s11, -b * s12, -b * s12, a * s22}};
}

/// An element with its rotations y' measured as h y'.
constexpr ElementMatrix rescaled(const ElementMatrix& matrix, double h) noexcept {
  const double one = 1.0 / h, two = one * one;
  const auto scaled = [=](const Block& b) { return Block{b.yy, b.yr * one, b.ry * one, b.rr * two}; };
  return {scaled(matrix.first), scaled(matrix.upper), scaled(matrix.lower), scaled(matrix.second)};
}

}  // namespace needleforce::bending
