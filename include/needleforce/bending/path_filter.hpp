// SPDX-License-Identifier: Apache-2.0
// A Kalman filter over the travel of a tip: modes of the parameters, and what the mechanics leave
// unexplained.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "../parameter.hpp"

namespace needleforce::bending {

/// How uncertain the path of an identified needle is. The defaults of the path are those of
/// src/needleforce/steering/path_errors.py; the wrench is that of tissue at another site than those of the
/// fit.
struct PathUncertainty {
  double tip_noise = 0.2e-3;
  double slope_noise = 4e-3;
  double force_noise = 5e-3;
  double moment_noise = 2e-4;
  double wrench_error = 0.2;
  double wrench_length = 30e-3;
  double offset = 1e-3;
  double tilt = 0.015;
  double unevenness = 1e-4;
  double common_slope = 5e-3;
  double common_length = 0.03;
  double longest_delay = 1.0;

  static constexpr const char* name = "path_uncertainty";
  static constexpr const char* summary =
      "Noise of tip and wrench, and errors of the path that the mechanics leave.";
  static constexpr std::array<Parameter<PathUncertainty>, 12> table{{
      {&PathUncertainty::tip_noise, "tip_noise", "m", 1e-9, 1.0, 0.2e-3, "s_y", "of a reading of the tip",
       "free"},
      {&PathUncertainty::slope_noise, "slope_noise", "1", 1e-9, 1.0, 4e-3, "s_t", "of a reading of its slope",
       "free"},
      {&PathUncertainty::force_noise, "force_noise", "N", 1e-9, 100.0, 5e-3, "s_F", "of a lateral force",
       "free"},
      {&PathUncertainty::moment_noise, "moment_noise", "N m", 1e-12, 10.0, 2e-4, "s_M", "of a bending moment",
       "free"},
      {&PathUncertainty::wrench_error, "wrench_error", "1", 0.0, 10.0, 0.2, "e_w",
       "what the mechanics get wrong of a wrench, as a share of the largest", "free"},
      {&PathUncertainty::wrench_length, "wrench_length", "m", 1e-6, 1.0, 30e-3, "l_w",
       "motion over which that error stays the same", "free"},
      {&PathUncertainty::offset, "offset", "m", 0.0, 1.0, 1e-3, "s_o", "of the entry against the base",
       "free"},
      {&PathUncertainty::tilt, "tilt", "rad", 0.0, 1.0, 0.015, "s_a", "of the axis of an insertion", "free"},
      {&PathUncertainty::unevenness, "unevenness", "1/m", 0.0, 1.0, 1e-4, "q",
       "uneven tissue: spectral density of a white noise of curvature", "free: integrated Wiener process"},
      {&PathUncertainty::common_slope, "common_slope", "1", 0.0, 1.0, 5e-3, "s_c",
       "slope that the law gets wrong along the path", "free: Ornstein-Uhlenbeck process"},
      {&PathUncertainty::common_length, "common_length", "m", 1e-6, 10.0, 0.03, "l_c",
       "along which it varies", "free"},
      {&PathUncertainty::longest_delay, "longest_delay", "s", 1e-3, 1e4, 1.0, "T",
       "of a reading of the tip that is still used", "free"},
  }};
};

/// Of the modes z ~ N(0, 1), and in each plane of the error e of the tip's position, its slope w that wanders
/// and its slope o that relaxes: e' = w + o, w' = white noise, o' = -o / l + white noise.
template <std::size_t modes>
class PathFilter {
 public:
  static constexpr std::size_t size = modes + 6;
  using Row = std::array<double, size>;
  static constexpr std::size_t position(std::size_t plane) { return modes + 3 * plane; }
  static constexpr std::size_t slope(std::size_t plane) { return modes + 3 * plane + 1; }
  static constexpr std::size_t common(std::size_t plane) { return modes + 3 * plane + 2; }

  explicit PathFilter(const PathUncertainty& uncertainty) noexcept : given_(uncertainty) { reset(); }

  void reset() noexcept {
    state_ = {};
    covariance_ = {};
    for (std::size_t i = 0; i < modes; ++i) covariance_[i][i] = 1.0;
    begin_path();
  }

  /// Another insertion of the same needle: what is known of its parameters stays, its path is a new one.
  /// Wait-free.
  void begin_path() noexcept {
    for (std::size_t i = modes; i < size; ++i) {
      state_[i] = 0.0;
      for (std::size_t j = 0; j < size; ++j) covariance_[i][j] = covariance_[j][i] = 0.0;
    }
    for (std::size_t plane = 0; plane < 2; ++plane) {
      covariance_[position(plane)][position(plane)] = given_.offset * given_.offset;
      covariance_[slope(plane)][slope(plane)] = given_.tilt * given_.tilt;
      covariance_[common(plane)][common(plane)] = given_.common_slope * given_.common_slope;
    }
  }

  /// The tip advances by `travel` [m] through new tissue. Exact. Wait-free.
  void advance(double travel) noexcept {
    const double kept = std::exp(-travel / given_.common_length), along = given_.common_length * (1.0 - kept);
    for (std::size_t plane = 0; plane < 2; ++plane) {
      const std::size_t e = position(plane), w = slope(plane), o = common(plane);
      state_[e] += travel * state_[w] + along * state_[o];
      state_[o] *= kept;
      for (std::size_t j = 0; j < size; ++j) {
        covariance_[e][j] += travel * covariance_[w][j] + along * covariance_[o][j];
        covariance_[o][j] *= kept;
      }
      for (std::size_t i = 0; i < size; ++i) {
        covariance_[i][e] += travel * covariance_[i][w] + along * covariance_[i][o];
        covariance_[i][o] *= kept;
      }
      add_noise(plane, travel, kept);
    }
  }

  /// What a reading is expected to be, a row times the state. Wait-free.
  double expected(const Row& row) const noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < size; ++i) sum += row[i] * state_[i];
    return sum;
  }
  /// Covariance of two such rows. Wait-free.
  double covariance(const Row& a, const Row& b) const noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < size; ++i) {
      double part = 0.0;
      for (std::size_t j = 0; j < size; ++j) part += covariance_[i][j] * b[j];
      sum += a[i] * part;
    }
    return sum;
  }
  /// Takes a reading that is off its expected value by `off`, with a variance of its own. Wait-free.
  void take(const Row& row, double off, double variance) noexcept {
    Row gain{};
    double total = variance;
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < size; ++j) gain[i] += covariance_[i][j] * row[j];
      total += row[i] * gain[i];
    }
    const double scale = 1.0 / total;
    for (std::size_t i = 0; i < size; ++i) {
      state_[i] += gain[i] * scale * off;
      for (std::size_t j = 0; j < size; ++j) covariance_[i][j] -= gain[i] * gain[j] * scale;
    }
  }
  const Row& state() const noexcept { return state_; }
  double variance(std::size_t i) const noexcept { return covariance_[i][i]; }

 private:
  void add_noise(std::size_t plane, double travel, double kept) noexcept {
    const std::size_t e = position(plane), w = slope(plane), o = common(plane);
    const double q = given_.unevenness, l = given_.common_length;
    const double c = given_.common_slope * given_.common_slope, t = travel;
    covariance_[e][e] += q * t * t * t / 3.0;
    covariance_[e][w] += 0.5 * q * t * t;
    covariance_[w][e] += 0.5 * q * t * t;
    covariance_[w][w] += q * t;
    // of the integral of an Ornstein-Uhlenbeck process that starts from a known value
    const double lost = 1.0 - kept, x = t / l;
    const double integral = x < 1e-2 ? c * l * l * x * x * x * (2.0 / 3.0 - 0.5 * x)
                                     : c * l * l * (2.0 * x - 3.0 + 4.0 * kept - kept * kept);
    covariance_[e][e] += integral;
    covariance_[e][o] += c * l * lost * lost;
    covariance_[o][e] += c * l * lost * lost;
    covariance_[o][o] += c * (1.0 - kept * kept);
  }

  PathUncertainty given_;
  Row state_{};
  std::array<Row, size> covariance_{};
};

}  // namespace needleforce::bending
