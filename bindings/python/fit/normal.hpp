// SPDX-License-Identifier: Apache-2.0
// Normal equations of at most six unknowns, some of which may be held.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace needleforce::fit {

/// Order of the unknowns: c [N/m²], z0 [m], f' [N/m], f_c [N], h_s [m], and the sensor's force zero b [N].
enum Unknown : std::size_t { stiffness, contact, friction, cutting, saturation, offset };
inline constexpr std::size_t unknowns = 6;

using Vector = std::array<double, unknowns>;
using Matrix = std::array<Vector, unknowns>;
using Free = std::array<bool, unknowns>;

/// J'J (its lower triangle), J'r and r'r of one stroke or of both.
struct Normal {
  Matrix gram{};
  Vector gradient{};
  double sse = 0, count = 0;

  Normal& operator+=(const Normal& other) noexcept {
    for (std::size_t i = 0; i < unknowns; ++i) {
      for (std::size_t k = 0; k < unknowns; ++k) gram[i][k] += other.gram[i][k];
      gradient[i] += other.gradient[i];
    }
    sse += other.sse;
    count += other.count;
    return *this;
  }
};

/// Solves gram * step = gradient over the free unknowns by Cholesky, after scaling to a unit diagonal (the
/// unknowns differ by six orders of magnitude). An unknown the data do not determine gets no step.
inline Vector solve(const Normal& normal, const Free& free) noexcept {
  Matrix lower{};
  Vector scale{}, step{};
  for (std::size_t i = 0; i < unknowns; ++i)
    if (free[i] && normal.gram[i][i] > 0) scale[i] = 1 / std::sqrt(normal.gram[i][i]);
  for (std::size_t i = 0; i < unknowns; ++i) {
    if (scale[i] == 0) continue;
    for (std::size_t k = 0; k <= i; ++k) {
      double sum = scale[i] * scale[k] * normal.gram[i][k];
      for (std::size_t m = 0; m < k; ++m) sum -= lower[i][m] * lower[k][m];
      if (k < i)
        lower[i][k] = lower[k][k] > 0 ? sum / lower[k][k] : 0;
      else
        lower[i][i] = sum > 1e-14 ? std::sqrt(sum) : 0;
    }
  }
  for (std::size_t i = 0; i < unknowns; ++i) {
    double sum = scale[i] * normal.gradient[i];
    for (std::size_t m = 0; m < i; ++m) sum -= lower[i][m] * step[m];
    step[i] = lower[i][i] > 0 ? sum / lower[i][i] : 0;
  }
  for (std::size_t i = unknowns; i-- > 0;) {
    for (std::size_t m = i + 1; m < unknowns; ++m) step[i] -= lower[m][i] * step[m];
    step[i] = lower[i][i] > 0 ? step[i] / lower[i][i] : 0;
  }
  for (std::size_t i = 0; i < unknowns; ++i) step[i] *= scale[i];
  return step;
}

/// Inverse of the whole symmetric gram over the free unknowns; a column of zeros where the data do not
/// determine one.
inline Matrix inverse(const Normal& normal, const Free& free) noexcept {
  Matrix columns{};
  Normal unit = normal;
  for (std::size_t i = 0; i < unknowns; ++i) {
    unit.gradient = {};
    unit.gradient[i] = 1;
    columns[i] = solve(unit, free);
  }
  return columns;
}

}  // namespace needleforce::fit
