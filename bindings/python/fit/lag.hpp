// SPDX-License-Identifier: Apache-2.0
// How well a force follows the reversal of a depth that is some time earlier or later, in closed form.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace needleforce::fit {

/// A force at times in order, and the travel back from where the needle rested, at times of its own in order.
struct Reversal {
  std::span<const double> time, force;
  std::span<const double> travel_time, travel;
};

/// How the force follows a travel of x stretches: linearly up to 1, or as 1 - exp(-x).
enum class Follows { linearly, exponentially };

inline double followed(Follows how, double x) noexcept {
  const double limited = std::clamp(x, -1.0, 50.0);
  return how == Follows::linearly ? std::min(limited, 1.0) : 1.0 - std::exp(-limited);
}

/// The travel of each sample's time less the lag, by straight lines between its samples.
inline void delayed_travel(const Reversal& r, double lag, std::span<double> out) noexcept {
  const std::size_t n = r.travel_time.size();
  const auto begin = r.travel_time.begin();
  std::size_t next =
      static_cast<std::size_t>(std::upper_bound(begin, r.travel_time.end(), r.time[0] - lag) - begin);
  for (std::size_t i = 0; i < r.time.size(); ++i) {
    const double at = r.time[i] - lag;
    while (next < n && r.travel_time[next] <= at) ++next;
    if (next == 0 || next == n) {
      out[i] = r.travel[next == 0 ? 0 : n - 1];
    } else {
      const double t = r.travel_time[next - 1], z = r.travel[next - 1];
      out[i] = (r.travel[next] - z) / (r.travel_time[next] - t) * (at - t) + z;
    }
  }
}

/// A line over time by which a constant and a slope are taken out of a series.
class Detrended {
 public:
  explicit Detrended(std::span<const double> time) noexcept : time_(time) {
    for (const double t : time) middle_ += t / static_cast<double>(time.size());
    for (const double t : time) size_ += (t - middle_) * (t - middle_);
  }

  void operator()(std::span<double> values) const noexcept {
    double sum = 0, product = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      sum += values[i], product += values[i] * (time_[i] - middle_);
    }
    const double mean = sum / static_cast<double>(values.size()), slope = size_ > 0 ? product / size_ : 0.0;
    for (std::size_t i = 0; i < values.size(); ++i) values[i] -= mean + slope * (time_[i] - middle_);
  }

 private:
  std::span<const double> time_;
  double middle_ = 0, size_ = 0;
};

/// The least sum of squares of a line over time and a force that follows the travel over one of the stretches
/// [m], for each lag [s]. A travel with a mean square below `least` over its stretch counts as none.
/// `scratch` takes three times as many values as there are of the force.
inline void squares_by_lag(const Reversal& r, Follows how, std::span<const double> lags,
                           std::span<const double> stretches, double least, std::span<double> scratch,
                           std::span<double> squares) noexcept {
  const std::size_t n = r.time.size();
  const std::span<double> rest = scratch.first(n), travel = scratch.subspan(n, n),
                          follow = scratch.subspan(2 * n, n);
  const Detrended detrended(r.time);
  std::copy(r.force.begin(), r.force.end(), rest.begin());
  detrended(rest);
  double all = 0;
  for (const double value : rest) all += value * value;
  for (std::size_t k = 0; k < lags.size(); ++k) {
    delayed_travel(r, lags[k], travel);
    double gain = 0;
    for (const double stretch : stretches) {
      for (std::size_t i = 0; i < n; ++i) follow[i] = followed(how, travel[i] / stretch);
      detrended(follow);
      double size = 0, product = 0;
      for (std::size_t i = 0; i < n; ++i) size += follow[i] * follow[i], product += follow[i] * rest[i];
      if (size > least * static_cast<double>(n)) gain = std::max(gain, product * product / size);
    }
    squares[k] = all - gain;
  }
}

}  // namespace needleforce::fit
