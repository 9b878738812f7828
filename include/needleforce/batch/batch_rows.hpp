// SPDX-License-Identifier: Apache-2.0
// What one cycle of many insertions gives: a row for each number of a sample.
#pragma once

#include <array>
#include <cstddef>

#include "../limits.hpp"
#include "../sample.hpp"

namespace needleforce {

/// The numbers of a `Sample` that a batch gives, one row each; words and events are whole numbers.
enum class BatchRow {
  depth,
  velocity,
  force,
  stiffness,
  friction,
  cutting,
  lateral,
  force_by_depth,
  force_by_velocity,
  phase,
  status,
  contact,
  punctured,
  exit
};
inline constexpr std::size_t batch_rows = 14;

/// Where the samples of a batch go: rows of so many numbers in turn, or the row of the force alone, of which
/// whole motions have one for each step.
struct BatchSamples {
  double* first;
  std::size_t members;
  bool force_alone = false;

  double* row(BatchRow which, std::size_t step = 0) const noexcept {
    return first + (force_alone ? step : static_cast<std::size_t>(which)) * members;
  }
  /// Writes the sample of a member.
  void put(std::size_t i, const Sample& sample, std::size_t step = 0) const noexcept {
    if (force_alone) {
      row(BatchRow::force, step)[i] = sample.force;
      return;
    }
    const std::array<double, batch_rows> numbers{sample.depth,
                                                 sample.velocity,
                                                 sample.force,
                                                 sample.stiffness,
                                                 sample.friction,
                                                 sample.cutting,
                                                 sample.lateral,
                                                 sample.force_by_depth,
                                                 sample.force_by_velocity,
                                                 static_cast<double>(sample.phase),
                                                 static_cast<double>(sample.status),
                                                 sample.contact ? 1.0 : 0.0,
                                                 sample.punctured ? 1.0 : 0.0,
                                                 sample.exit ? 1.0 : 0.0};
    for (std::size_t k = 0; k < batch_rows; ++k) first[k * members + i] = numbers[k];
  }
};

/// What moves a batch in one cycle: depths [m], velocities [m/s] or nullptr for the change of depth, and the
/// time since the last cycle [s], of each member or of all. A whole motion has a row of depths (and of
/// velocities) and one time for each step.
struct BatchMove {
  const double* depth;
  const double* velocity;
  const double* dt;
  bool same_dt;
  std::size_t members = 0;  ///< from one row to the next

  const double* depths(std::size_t step) const noexcept { return depth + step * members; }
  const double* velocities(std::size_t step) const noexcept { return velocity + step * members; }
  double velocity_of(std::size_t i, std::size_t step) const noexcept {
    return velocity ? velocities(step)[i] : no_velocity;
  }
  double dt_of(std::size_t i, std::size_t step = 0) const noexcept { return dt[same_dt ? step : i]; }
};

}  // namespace needleforce
