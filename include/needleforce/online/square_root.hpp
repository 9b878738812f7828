// SPDX-License-Identifier: Apache-2.0
// Linear least squares, a row at a time, as the square root of the information.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "../state_check.hpp"

namespace needleforce::online {

/// What a row of measurement was worth: its residual in its own predicted standard deviations, that squared,
/// and by how much that variance was larger than the row's own.
struct Innovation {
  double squared = 0.0;
  double widening = 1.0;
  double residual = 0.0;
};

/// R and R theta of the normal equations R'R theta = R'y, R upper triangular, by Givens rotations. To drop
/// the first rows forgets the first parameters and keeps the marginal distribution of the others, so what is
/// forgotten first comes first. Wait-free, bounded by `capacity` squared.
template <std::size_t capacity>
class SquareRoot {
 public:
  using Row = std::array<double, capacity>;

  /// The parameter `i` before any row: independent of the others.
  void set(std::size_t i, double mean, double sd) noexcept {
    r_[i].fill(0.0);
    r_[i][i] = 1.0 / sd;
    right_[i] = mean / sd;
    size_ = std::max(size_, i + 1);
  }
  /// Inserts room for `n` parameters in front; each has to be `set`.
  void shift(std::size_t n) noexcept {
    size_ = std::min(size_, capacity - n);
    for (std::size_t i = size_; i-- > 0;) {
      right_[i + n] = right_[i];
      Row moved{};
      for (std::size_t j = i; j < size_; ++j) moved[j + n] = r_[i][j];
      r_[i + n] = moved;
    }
    size_ += n;
  }

  /// Forgets a share of what is known of the first `n` parameters, given the others.
  void forget_share(std::size_t n, double kept) noexcept {
    for (std::size_t i = 0; i < std::min(n, size_); ++i) {
      if (r_[i][i] * kept < least) continue;  // nothing is known of it any more
      right_[i] *= kept;
      for (std::size_t j = i; j < size_; ++j) r_[i][j] *= kept;
    }
  }

  /// A row x theta = y of unit variance.
  Innovation add(Row x, double y) noexcept {
    double widening = 1.0;
    for (std::size_t i = 0; i < size_; ++i) {
      if (x[i] == 0.0) continue;
      const double a = r_[i][i], b = x[i], length = std::sqrt(a * a + b * b);
      const double c = a / length, s = b / length;
      widening *= (length / a) * (length / a);
      for (std::size_t j = i; j < size_; ++j) {
        const double above = r_[i][j];
        r_[i][j] = c * above + s * x[j];
        x[j] = c * x[j] - s * above;
      }
      const double above = right_[i];
      right_[i] = c * above + s * y;
      y = c * y - s * above;
    }
    return {y * y, widening, y};
  }

  std::size_t size() const noexcept { return size_; }
  Row mean() const noexcept {
    Row theta{};
    for (std::size_t i = size_; i-- > 0;) {
      double rest = right_[i];
      for (std::size_t j = i + 1; j < size_; ++j) rest -= r_[i][j] * theta[j];
      theta[i] = rest / r_[i][i];
    }
    return theta;
  }
  /// Variance of x theta.
  double variance(const Row& x) const noexcept {
    Row solved{};  // R' solved = x
    double sum = 0.0;
    for (std::size_t i = 0; i < size_; ++i) {
      double rest = x[i];
      for (std::size_t j = 0; j < i; ++j) rest -= r_[j][i] * solved[j];
      solved[i] = rest / r_[i][i];
      sum += solved[i] * solved[i];
    }
    return sum;
  }
  double variance(std::size_t i) const noexcept {
    Row unit{};
    unit[i] = 1.0;
    return variance(unit);
  }
  /// Looks at one from outside, of `size` parameters: what it knows of them is finite.
  void check(StateCheck& check, std::size_t size) const noexcept {
    check.require("information", size_ == size);
    if (check.fault()) return;
    check.numbers("information", r_);
    check.numbers("information", right_);
    for (std::size_t i = 0; i < size_; ++i) check.number("information", r_[i][i], least, largest_in_a_state);
    if (check.fault()) return;
    check.numbers("information", mean());
    for (std::size_t i = 0; i < size_; ++i) check.number("information", variance(i), 0.0, most_variance);
  }

 private:
  static constexpr double least = 1e-60, most_variance = 1e150;  // of a parameter that is all but forgotten
  std::array<Row, capacity> r_{};
  Row right_{};
  std::size_t size_ = 0;
};

}  // namespace needleforce::online
