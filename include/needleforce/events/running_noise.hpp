// SPDX-License-Identifier: Apache-2.0
// A running model of the force, and from its innovations the noise: how large, how correlated, how well
// known.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "../state_check.hpp"

namespace needleforce::events {

/// x with a probability p above it for a standard normal number, to 5e-4: Abramowitz and Stegun 26.2.23.
inline double upper_quantile(double p) noexcept {
  const double u = std::sqrt(-2.0 * std::log(std::clamp(p, 1e-300, 0.5)));
  return u -
         (2.515517 + u * (0.802853 + u * 0.010328)) / (1.0 + u * (1.432788 + u * (0.189269 + u * 0.001308)));
}
/// Normal distribution function, to 2e-4: a logistic function of a cubic.
inline double normal(double x) noexcept {
  const double bounded = std::clamp(x, -8.0, 8.0);
  return 1.0 / (1.0 + std::exp(-bounded * (1.5976 + 0.070566 * bounded * bounded)));
}

/// A line of the force over the travel, that forgets over `within`. Where the needle stands it is a level.
class LocalForce {
 public:
  void restart() noexcept { *this = {}; }
  bool known() const noexcept { return weight_ > 2.0; }

  /// Difference of a force from what was expected at this depth, over how uncertain that was in units of the
  /// noise. Wait-free.
  double innovation(double force, double depth, double depth_noise) const noexcept {
    const double spread = depth_variance_ + depth_noise * depth_noise, away = depth - depth_;
    const double expected = force_ + covariance_ / spread * away;
    return (force - expected) / std::sqrt(1.0 + (1.0 + away * away / spread) / weight_);
  }
  /// The most that the force grows by a travel, for a noise that its slope was found in: two standard
  /// deviations above what it is. Wait-free.
  double growth(double depth_noise, double noise) const noexcept {
    const double spread = depth_variance_ + depth_noise * depth_noise;
    const double most = covariance_ / spread + 2.0 * noise / std::sqrt(std::max(weight_, 1.0) * spread);
    return std::clamp(most, -1e9, 1e9);
  }
  void add(double force, double depth, double kept) noexcept {
    weight_ = kept * weight_ + 1.0;
    const double share = 1.0 / weight_, away = depth - depth_, off = force - force_;
    depth_ += share * away;
    force_ += share * off;
    depth_variance_ = (1.0 - share) * (depth_variance_ + share * away * away);
    covariance_ = (1.0 - share) * (covariance_ + share * away * off);
  }

  /// Looks at a model from outside. Wait-free.
  void check(StateCheck& check) const noexcept {
    check.require("model", weight_ == 0.0 || (weight_ >= 1.0 && weight_ <= 1e15));
    check.number("model", depth_variance_, 0.0, 1e9);
    check.numbers("model", std::array{depth_, force_, covariance_}, 1e12);
  }

 private:
  double weight_ = 0.0, depth_ = 0.0, force_ = 0.0, depth_variance_ = 0.0, covariance_ = 0.0;
};

/// Scale and correlation of the innovations, from medians and signs: a puncture among them counts as one
/// sample. What slides is rougher than free travel, and grows with the force; it is followed over `memory`.
class RunningNoise {
 public:
  static constexpr double memory = 2.0;  ///< [s]

  void add(double innovation, double dt) noexcept {
    const double gain = std::clamp(dt / memory, 1.0 / (count_ + 1.0), 0.5);
    const double size = std::abs(innovation);
    if (count_ == 0.0)
      median_ = size;
    else
      median_ *= size > median_ ? 1.0 + 2.0 * gain : 1.0 / (1.0 + 2.0 * gain);
    median_ = std::clamp(median_, 1e-12, 1e9);
    agreement_ += gain * ((innovation * last_ > 0.0 ? 1.0 : -1.0) - agreement_);
    last_ = innovation;
    count_ += count_ < 1e6;
  }
  /// The smallest step between two readings is the sensor's quantum.
  void see_step(double step) noexcept {
    if (step > 0.0) quantum_ = std::min(quantum_, step);
  }
  /// After a gap less is known. Wait-free.
  void doubt() noexcept { count_ = std::min(count_, few + 0.25 * (std::max(count_, few) - few)); }

  bool known() const noexcept { return count_ >= few; }
  double quantum() const noexcept { return quantum_ < 1e9 ? quantum_ : 0.0; }
  double sd(double least) const noexcept {
    return std::max({median_ / 0.6745, least, quantum() / std::sqrt(12.0), 1e-12});
  }
  /// Standard deviation of a mean of n readings over that of one, for a correlation that decays.
  double of_mean(double n) const noexcept {
    const double r = correlation();
    return std::sqrt(std::min(1.0, (1.0 + r) / (1.0 - r) / n));
  }
  /// Standard deviations that noise exceeds `rate` times a second in all windows together, at most. Wider
  /// where little was seen (Student's t): a median has 0.37 of the weight of a mean square.
  double threshold(double rate, double dt, double within) const noexcept {
    const double z = upper_quantile(rate * dt * dt / (2.0 * within));
    return z * (1.0 + (z * z + 1.0) / (4.0 * std::min(count_, memory / dt) * worth()));
  }

  /// Looks at a noise from outside. Wait-free.
  void check(StateCheck& check) const noexcept {
    check.number("noise", median_, 0.0, 1e9);
    check.number("noise", agreement_, -1.0, 1.0);
    check.number("noise", count_, 0.0, 1e6);
    check.require("noise", quantum_ > 0.0 && quantum_ <= 1e9);
    check.numbers("noise", last_);
  }

 private:
  static constexpr double few = 10.0;
  /// What a reading adds to what is known of the scale, over an independent one in a mean square. A median
  /// has 0.37 of that weight: of what it counts, 0.37 correlates as the square of the innovations, the rest
  /// as their sixth power or less (the even Hermite terms of |x| > median).
  double worth() const noexcept {
    const double r2 = correlation() * correlation(), r6 = r2 * r2 * r2;
    return 0.37 / (0.37 * (1.0 + r2) / (1.0 - r2) + 0.63 * (1.0 + r6) / (1.0 - r6));
  }
  /// Of an innovation with the one before, from how often their signs agree (the arcsine law).
  double correlation() const noexcept {
    return std::clamp(std::sin(1.5707963267948966 * agreement_), 0.0, 0.99);
  }
  double median_ = 0.0, agreement_ = 0.0, last_ = 0.0, count_ = 0.0, quantum_ = 1e9;
};

}  // namespace needleforce::events
