// SPDX-License-Identifier: Apache-2.0
// Tip and shape estimated in the loop, from the base wrench and from tip readings that come late and seldom.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <type_traits>

#include "expected_error.hpp"
#include "flexible_insertion.hpp"
#include "path_filter.hpp"

namespace needleforce::bending {

inline constexpr std::size_t max_modes = 6;

/// Where the tip is, and how sure that is.
struct TipEstimate {
  Vector tip{};                        ///< [m]
  std::array<double, 2> slope{};       ///< of the needle at the tip, in x and y
  std::array<double, 3> covariance{};  ///< of the tip across: xx, xy, yy [m^2]
  BentSample sample{};                 ///< of the likeliest needle: forces, wrench, status
};

/// Runs the likeliest needle and one for each mode of its parameters, a standard deviation off; their
/// difference is how the tip depends on the mode. A Kalman filter takes the readings. A reading of the tip
/// may be late: the needles' tips of the last time are kept. Trivially copyable: a snapshot is a copy. For
/// one thread at a time.
class TipEstimator {
 public:
  using Filter = PathFilter<max_modes>;
  using Plane = std::array<double, 2>;
  static constexpr std::size_t kept_rows = 512;

  /// `varied` are insertions with the parameters one standard deviation along each mode, at most `max_modes`;
  /// all are reset. With more, or none of its own, every estimate is that of `likely`; with an uncertainty
  /// outside its ranges, too, and its status is `invalid_parameter`.
  TipEstimator(const SpatialInsertion& likely, std::span<const SpatialInsertion> varied,
               const PathUncertainty& uncertainty) noexcept
      : valid_(!first_invalid(uncertainty)),
        given_(valid_ ? uncertainty : PathUncertainty{}),
        filter_(given_),
        count_(std::min(varied.size(), max_modes)),
        likely_(likely) {
    for (std::size_t m = 0; m < max_modes; ++m) varied_[m] = m < count_ ? varied[m] : likely;
    reset();
  }

  /// The error of the tip that other insertions had, at depths every `spacing` [m]; for use before the loop.
  /// False, and no error is expected, where one or the spacing is outside its range.
  bool expect(std::span<const Plane> errors, double spacing) noexcept { return known_.set(errors, spacing); }

  /// One cycle. Wait-free; it costs one step for the needle and one for each mode.
  TipEstimate step(const Base& base, double dt) noexcept {
    const double front = likely_.path().empty() ? 0.0 : likely_.path().front();
    sample_ = likely_.step(base, dt);
    if (dt > 0.0 && std::isfinite(dt)) time_ += dt;  // also while the base is not known: readings have an age
    if (!sample_.moved) {
      for (std::size_t m = 0; m < count_; ++m)
        varied_[m].step(base, dt);  // they wait as long as the likely one
      return estimate();
    }
    if (likely_.path().empty() ? front > 0.0 : likely_.path().front() < front) leave();
    const double before = deepest_,
                 moved = std::abs(base.depth - base_.depth) +
                         std::hypot(base.lateral[0] - base_.lateral[0], base.lateral[1] - base_.lateral[1]);
    base_ = base;
    moved_ += moved;
    deepest_ = std::max(deepest_, base.depth);
    Kept& now = newest();
    now = row_of(sample_, base.depth, time_);
    for (std::size_t m = 0; m < count_; ++m) {
      const BentSample aside = varied_[m].step(base, dt);
      aside.moved ? vary(now, m, aside) : keep(now, m);
    }
    if (deepest_ > before && before >= 0.0) filter_.advance(deepest_ - before);
    current_ = now;
    return estimate();
  }

  /// A reading of the tip across [m], `age` [s] old, and its slopes if they were read. False where it is not
  /// used: too old, not finite, or beyond what noise explains. Slopes beyond that are left out. Wait-free.
  bool tip(const Plane& across, double age, const Plane* slopes = nullptr) noexcept {
    Kept then;
    if (!std::isfinite(across[0] + across[1]) || !recall(age, then)) return false;
    if (slopes && !std::isfinite((*slopes)[0] + (*slopes)[1])) return false;
    const double behind = std::max(0.0, deepest_ - std::max(0.0, then.depth));
    const double late = given_.unevenness * behind * behind * behind / 3.0;
    const double noise = given_.tip_noise * given_.tip_noise + late;
    std::array<Filter::Row, 2> rows{};
    Plane off{};
    double distance = 0.0;
    for (std::size_t d = 0; d < 2; ++d) {
      rows[d] = position_row(then, d, behind);
      off[d] = across[d] - then.tip[d] - known_.at(then.depth, d) - filter_.expected(rows[d]);
      distance += off[d] * off[d] / (filter_.covariance(rows[d], rows[d]) + noise);
    }
    if (distance > gate) return ++rejected_, false;
    const bool plausible = slopes && slope_distance(then, *slopes) <= gate;
    rejected_ = 0;
    for (std::size_t d = 0; d < 2; ++d)
      take(rows[d], across[d] - then.tip[d] - known_.at(then.depth, d), noise);
    if (plausible) take_slopes(then, *slopes);
    return true;
  }

  /// A reading of the wrench of the tissue on the needle at the base, now. It counts once in a millimetre of
  /// motion, as the error of the mechanics stays the same for longer. False where it is not used: too soon,
  /// after a refused step, not finite, or beyond what noise and errors of the mechanics explain. Wait-free.
  bool wrench(const std::array<double, 6>& reading) noexcept {
    double sum = 0.0;
    for (const double value : reading) sum += value;
    if (!std::isfinite(sum) || !(moved_ >= wrench_spacing) || !sample_.moved) return false;
    const std::array<double, 4> lateral{reading[0], reading[1], reading[3], reading[4]};
    std::array<double, 4> variance{};
    Plane largest = largest_;
    for (std::size_t k = 0; k < 4; ++k)
      largest[k / 2] = std::max(largest[k / 2], std::abs(current_.wrench[k]));
    double distance = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
      const double noise = k < 2 ? given_.force_noise : given_.moment_noise;
      const double wrong = given_.wrench_error * largest[k / 2];
      const double off = lateral[k] - current_.wrench[k] - filter_.expected(wrench_row(k));
      distance +=
          off * off / (filter_.covariance(wrench_row(k), wrench_row(k)) + noise * noise + wrong * wrong);
      variance[k] = noise * noise + wrong * wrong * std::max(1.0, given_.wrench_length / moved_);
    }
    if (distance > wrench_gate) return false;
    moved_ = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
      largest_[k / 2] = std::max({largest_[k / 2], largest[k / 2], std::abs(lateral[k])});
      take(wrench_row(k), lateral[k] - current_.wrench[k], variance[k]);
    }
    return true;
  }

  /// Calls `visit` with the points of the needle from the base to the tip [m], as estimated. Wait-free.
  template <class Visit>
  void shape(Visit visit) const noexcept {
    std::array<Vector, max_points> points, aside;
    const std::size_t n = points_of(likely_, points);
    std::array<Vector, max_points> result = points;
    for (std::size_t m = 0; m < count_; ++m) {
      if (points_of(varied_[m], aside) != n) continue;
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t d = 0; d < 3; ++d) result[i][d] += filter_.state()[m] * (aside[i][d] - points[i][d]);
    }
    const double above = std::max(1e-9, sample_.unsupported);
    for (std::size_t i = 0; i < n; ++i) {
      const double behind = std::max(0.0, deepest_ - std::max(0.0, points[i][2]));
      const double held = std::clamp(1.0 + points[i][2] / above, 0.0, 1.0);  // the base is where it is
      for (std::size_t d = 0; d < 2; ++d) result[i][d] += held * error_behind(d, behind, points[i][2]);
      visit(result[i]);
    }
  }

  TipEstimate estimate() const noexcept {
    TipEstimate result;
    result.sample = sample_;
    if (!valid_) result.sample.status = Status::invalid_parameter;
    result.tip = sample_.tip;
    const double behind = std::max(0.0, deepest_ - std::max(0.0, base_.depth));
    std::array<Filter::Row, 2> rows{};
    for (std::size_t d = 0; d < 2; ++d) {
      rows[d] = position_row(current_, d, behind);
      result.tip[d] = current_.tip[d] + known_.at(base_.depth, d) + filter_.expected(rows[d]);
      result.slope[d] =
          current_.slope[d] + known_.slope(base_.depth, d) + filter_.expected(slope_row(current_, d));
    }
    result.covariance = {filter_.covariance(rows[0], rows[0]), filter_.covariance(rows[0], rows[1]),
                         filter_.covariance(rows[1], rows[1])};
    return result;
  }
  /// Modes of the parameters, in standard deviations; and their variances, 1 before any reading.
  double mode(std::size_t m) const noexcept { return filter_.state()[m]; }
  double mode_variance(std::size_t m) const noexcept { return filter_.variance(m); }
  std::size_t modes() const noexcept { return count_; }
  /// Readings of the tip in a row that were beyond what noise explains: another frame, or another needle.
  std::size_t rejected() const noexcept { return rejected_; }

  /// Back to before the first contact.
  void reset() noexcept {
    likely_.reset();
    for (auto& each : varied_) each.reset();
    filter_.reset();
    kept_ = {};
    current_ = {};
    sample_ = {};
    base_ = {};
    time_ = deepest_ = moved_ = 0.0;
    written_ = rejected_ = 0;
    largest_ = {};
  }

 private:
  static constexpr double gate = 30.0;         // of a squared distance of two numbers: one in 3 million
  static constexpr double wrench_gate = 36.0;  // of one of four numbers: one in 3 million
  static constexpr double wrench_spacing = 1e-3;
  static constexpr std::size_t max_points = max_nodes + 16;

  /// What the needles did at one time.
  struct Kept {
    double time = -1.0, depth = 0.0;
    Plane tip{}, slope{};
    std::array<double, 4> wrench{};  // lateral forces and moments
    std::array<Plane, max_modes> tip_by_mode{}, slope_by_mode{};
    std::array<std::array<double, 4>, max_modes> wrench_by_mode{};
  };

  static Plane slope_of(const BentSample& sample) noexcept {
    const double along = std::max(1e-3, sample.tangent[2]);
    return {sample.tangent[0] / along, sample.tangent[1] / along};
  }
  /// The needle will enter elsewhere: readings of the old path are of no use for the new one.
  void leave() noexcept {
    filter_.begin_path();
    deepest_ = 0.0;
    written_ = 0;
  }
  static Kept row_of(const BentSample& sample, double depth, double time) noexcept {
    Kept row;
    row.time = time;
    row.depth = depth;
    row.tip = {sample.tip[0], sample.tip[1]};
    row.slope = slope_of(sample);
    row.wrench = {sample.wrench[0], sample.wrench[1], sample.wrench[3], sample.wrench[4]};
    return row;
  }
  void vary(Kept& row, std::size_t m, const BentSample& aside) const noexcept {
    const Plane slope = slope_of(aside);
    for (std::size_t d = 0; d < 2; ++d) {
      row.tip_by_mode[m][d] = aside.tip[d] - row.tip[d];
      row.slope_by_mode[m][d] = slope[d] - row.slope[d];
      row.wrench_by_mode[m][d] = aside.wrench[d] - row.wrench[d];
      row.wrench_by_mode[m][2 + d] = aside.wrench[3 + d] - row.wrench[2 + d];
    }
  }
  /// A needle that did not take the step: what depended on its mode stays as it was.
  void keep(Kept& row, std::size_t m) const noexcept {
    row.tip_by_mode[m] = current_.tip_by_mode[m];
    row.slope_by_mode[m] = current_.slope_by_mode[m];
    row.wrench_by_mode[m] = current_.wrench_by_mode[m];
  }
  /// The place of the newest row: another one when the last has become old enough.
  Kept& newest() noexcept {
    const double apart = given_.longest_delay / static_cast<double>(kept_rows - 2);
    if (written_ == 0 || time_ - kept_[(written_ + kept_rows - 2) % kept_rows].time >= apart) ++written_;
    return kept_[(written_ - 1) % kept_rows];
  }
  /// What the needles did `age` [s] ago, between two rows; false if that is not kept.
  bool recall(double age, Kept& found) const noexcept {
    if (!(age >= 0.0) || !(age <= given_.longest_delay) || written_ == 0) return false;
    const double when = time_ - age;
    for (std::size_t back = 0; back < std::min(written_, kept_rows); ++back) {
      const Kept& row = kept_[(written_ - 1 - back) % kept_rows];
      if (row.time <= when) {
        found = back == 0 ? row : between(row, kept_[(written_ - back) % kept_rows], when);
        return true;
      }
    }
    return false;
  }
  static Kept between(const Kept& a, const Kept& b, double when) noexcept {
    const double t = b.time > a.time ? std::clamp((when - a.time) / (b.time - a.time), 0.0, 1.0) : 0.0;
    Kept row = a;
    row.depth += t * (b.depth - a.depth);
    for (std::size_t d = 0; d < 2; ++d) {
      row.tip[d] += t * (b.tip[d] - a.tip[d]);
      row.slope[d] += t * (b.slope[d] - a.slope[d]);
      for (std::size_t m = 0; m < max_modes; ++m) {
        row.tip_by_mode[m][d] += t * (b.tip_by_mode[m][d] - a.tip_by_mode[m][d]);
        row.slope_by_mode[m][d] += t * (b.slope_by_mode[m][d] - a.slope_by_mode[m][d]);
      }
    }
    return row;
  }

  /// Position of the tip in one plane, `behind` [m] the deepest point.
  Filter::Row position_row(const Kept& row, std::size_t d, double behind) const noexcept {
    Filter::Row result{};
    for (std::size_t m = 0; m < count_; ++m) result[m] = row.tip_by_mode[m][d];
    result[Filter::position(d)] = 1.0;
    result[Filter::slope(d)] = result[Filter::common(d)] = -behind;
    return result;
  }
  Filter::Row slope_row(const Kept& row, std::size_t d) const noexcept {
    Filter::Row result{};
    for (std::size_t m = 0; m < count_; ++m) result[m] = row.slope_by_mode[m][d];
    result[Filter::slope(d)] = result[Filter::common(d)] = 1.0;
    return result;
  }
  void take(const Filter::Row& row, double reading, double variance) noexcept {
    filter_.take(row, reading - filter_.expected(row), variance);
  }
  Filter::Row wrench_row(std::size_t k) const noexcept {
    Filter::Row row{};
    for (std::size_t m = 0; m < count_; ++m) row[m] = current_.wrench_by_mode[m][k];
    return row;
  }
  double slope_distance(const Kept& then, const Plane& slopes) const noexcept {
    double distance = 0.0;
    for (std::size_t d = 0; d < 2; ++d) {
      const Filter::Row row = slope_row(then, d);
      const double off = slopes[d] - then.slope[d] - known_.slope(then.depth, d) - filter_.expected(row);
      distance += off * off / (filter_.covariance(row, row) + given_.slope_noise * given_.slope_noise);
    }
    return distance;
  }
  void take_slopes(const Kept& then, const Plane& slopes) noexcept {
    for (std::size_t d = 0; d < 2; ++d)
      take(slope_row(then, d), slopes[d] - then.slope[d] - known_.slope(then.depth, d),
           given_.slope_noise * given_.slope_noise);
  }

  double error_behind(std::size_t d, double behind, double depth) const noexcept {
    const auto& state = filter_.state();
    return state[Filter::position(d)] - behind * (state[Filter::slope(d)] + state[Filter::common(d)]) +
           known_.at(std::max(0.0, depth), d);
  }
  static std::size_t points_of(const SpatialInsertion& needle,
                               std::array<Vector, max_points>& points) noexcept {
    std::size_t n = 0;
    needle.shape([&](const Vector& point) noexcept {
      if (n < max_points) points[n++] = point;
    });
    return n;
  }

  bool valid_;
  PathUncertainty given_;
  Filter filter_;
  std::size_t count_;
  SpatialInsertion likely_;
  std::array<SpatialInsertion, max_modes> varied_{likely_, likely_, likely_, likely_, likely_, likely_};
  ExpectedError known_{};
  std::array<Kept, kept_rows> kept_{};
  Kept current_{};
  BentSample sample_{};
  Base base_{};
  double time_ = 0.0, deepest_ = 0.0, moved_ = 0.0;
  std::size_t written_ = 0, rejected_ = 0;
  Plane largest_{};  // force and moment
};

static_assert(std::is_trivially_copyable_v<TipEstimator>);

}  // namespace needleforce::bending
