// SPDX-License-Identifier: Apache-2.0
// The force over the next travel with its interval, and the next puncture.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "../events/running_noise.hpp"
#include "../state_check.hpp"
#include "online_prior.hpp"

namespace needleforce::online {

/// Normal distributions with weights.
template <std::size_t capacity>
class Mixture {
 public:
  struct Part {
    double weight, mean, sd;
  };
  std::size_t count() const noexcept { return count_; }
  const Part& part(std::size_t i) const noexcept { return parts_[i]; }

  void add(double weight, double mean, double variance) noexcept {
    if (count_ < capacity && weight > 0.0)
      parts_[count_++] = {weight, mean, std::sqrt(std::max(variance, 1e-24))};
  }
  /// The whole mixture with a weight.
  template <std::size_t other>
  void add(double weight, const Mixture<other>& mixture) noexcept {
    for (std::size_t i = 0; i < mixture.count(); ++i) {
      const auto& part = mixture.part(i);
      add(weight * part.weight, part.mean, part.sd * part.sd);
    }
  }
  double density(double x) const noexcept {
    double sum = 0.0, weights = 0.0;
    for (std::size_t i = 0; i < count_; ++i) {
      const double off = (x - parts_[i].mean) / parts_[i].sd;
      sum += parts_[i].weight / parts_[i].sd * std::exp(-0.5 * std::min(off * off, 200.0));
      weights += parts_[i].weight;
    }
    return weights > 0.0 ? sum / weights : 0.0;
  }
  double mean() const noexcept {
    double sum = 0.0, weights = 0.0;
    for (std::size_t i = 0; i < count_; ++i) {
      sum += parts_[i].weight * parts_[i].mean;
      weights += parts_[i].weight;
    }
    return weights > 0.0 ? sum / weights : 0.0;
  }
  double below(double x) const noexcept {
    double sum = 0.0, weights = 0.0;
    for (std::size_t i = 0; i < count_; ++i) {
      sum += parts_[i].weight * events::normal((x - parts_[i].mean) / parts_[i].sd);
      weights += parts_[i].weight;
    }
    return weights > 0.0 ? sum / weights : 0.5;
  }
  /// x with a probability p below it, to a thousandth of its distribution's width. Bounded work.
  double quantile(double p) const noexcept {
    if (count_ == 0) return 0.0;
    double low = parts_[0].mean, high = low;
    for (std::size_t i = 0; i < count_; ++i) {
      low = std::min(low, parts_[i].mean - 6.0 * parts_[i].sd);
      high = std::max(high, parts_[i].mean + 6.0 * parts_[i].sd);
    }
    for (int i = 0; i < 20; ++i) {
      const double middle = 0.5 * (low + high);
      (below(middle) < p ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }
  /// Looks at one from outside.
  void check(StateCheck& check) const noexcept {
    check.require("mixture", count_ <= capacity);
    for (const Part& each : parts_) {
      check.number("mixture", each.weight, 0.0, 1e3);
      check.number("mixture", each.mean, -1e60, 1e60);
      check.number("mixture", each.sd, 0.0, 1e100);
    }
    for (std::size_t i = 0; i < std::min(count_, capacity); ++i) check.require("mixture", parts_[i].sd > 0.0);
  }

 private:
  std::array<Part, capacity> parts_{};
  std::size_t count_ = 0;
};

/// When the next layer is pierced. A depth that is expected is believed to eight tenths, and that nothing is
/// there to one half, for a yield may show no fall; else, as for any event of unknown scale, what has held
/// over a travel holds as long again with one half.
struct NextPuncture {
  Expected expected{};    ///< depth [m] in the stream's zero
  double believed = 0.8;  ///< in that depth
  bool none = false;      ///< no further layer is expected
  double since = 0.0;     ///< depth from which this layer has held [m]

  /// Probability that it holds from `since` to this depth. Wait-free.
  double holds(double depth) const noexcept {
    const double travel = std::max(depth - since, 0.0);
    const double whole = soon / (soon + travel);
    if (none) return 0.5 + 0.5 * whole;
    if (!expected.known()) return whole;
    return believed * (1.0 - events::normal((depth - expected.mean) / expected.sd)) +
           (1.0 - believed) * whole;
  }
  /// Probability of a puncture between two depths where there was none before.
  double between(double from, double to) const noexcept {
    return std::clamp(1.0 - holds(to) / std::max(holds(from), 1e-12), 0.0, 1.0);
  }
  /// Depth before which it comes with probability p, `farthest` if it may come never.
  double quantile(double from, double p) const noexcept {
    double low = from, high = from + farthest;
    if (between(from, high) < p) return high;
    for (int i = 0; i < 30; ++i) {
      const double middle = 0.5 * (low + high);
      (between(from, middle) < p ? low : high) = middle;
    }
    return high;
  }
  static constexpr double farthest = 1.0;

 private:
  static constexpr double soon = 1e-3;  // travel after which half of the layers of an unknown tissue hold
};

/// Slope of the force over the last third of a millimetre [N/m].
class SlopeLately {
 public:
  void restart() noexcept { *this = {}; }
  void add(double force, double depth) noexcept {
    const double kept = weight_ > 0.0 ? std::exp(-std::abs(depth - last_) / 3e-4) : 0.0;
    last_ = depth;
    weight_ = kept * weight_ + 1.0;
    const double share = 1.0 / weight_, away = depth - depth_, off = force - force_;
    depth_ += share * away;
    force_ += share * off;
    spread_ = (1.0 - share) * (spread_ + share * away * away);
    together_ = (1.0 - share) * (together_ + share * away * off);
  }
  bool known() const noexcept { return spread_ > 1e-8; }  // a tenth of a millimetre, squared
  double value() const noexcept { return together_ / spread_; }
  /// Looks at one from outside.
  void check(StateCheck& check) const noexcept {
    check.require("slope", weight_ == 0.0 || (weight_ >= 1.0 && weight_ <= 1e15));
    check.numbers("slope", std::array{last_, depth_, force_, together_}, 1e12);
    check.number("slope", spread_, 0.0, 1e12);
  }

 private:
  double weight_ = 0.0, last_ = 0.0, depth_ = 0.0, force_ = 0.0, spread_ = 0.0, together_ = 0.0;
};

struct PointAhead {
  double depth = 0.0, force = 0.0, low = 0.0, high = 0.0;
};

/// Intervals hold 95 %.
struct ForceAhead {
  static constexpr std::size_t points = 11;
  std::array<PointAhead, points> at{};
  double puncture_probability = 0.0;                          ///< within this travel
  double puncture_depth = 0.0, earliest = 0.0, latest = 0.0;  ///< of the next puncture [m]
};

}  // namespace needleforce::online
