// SPDX-License-Identifier: Apache-2.0
// A bank of hypotheses on texture and prior, weighted by what each foresaw.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "../events/running_noise.hpp"
#include "online_prior.hpp"
#include "tissue_estimate.hpp"

namespace needleforce::online {

/// A value with its standard deviation, and that of the prior.
struct Learnt {
  double value = 0.0, sd = 0.0, before = 0.0;
};

/// Innovations over the last readings: larger than a stated rate allows, they are of another tissue.
class Surprise {
 public:
  void add(double squared) noexcept {
    sum_ = (1.0 - 1.0 / window) * sum_ + squared;
    count_ = (1.0 - 1.0 / window) * count_ + 1.0;
  }
  double mean() const noexcept { return count_ > 0.0 ? sum_ / count_ : 1.0; }
  /// Whether chance makes them so large with at most this probability.
  bool beyond(double probability) const noexcept {
    if (count_ < 0.8 * window) return false;
    const double spread = 2.0 / (9.0 * count_);  // Wilson and Hilferty
    const double root = 1.0 - spread + events::upper_quantile(probability) * std::sqrt(spread);
    return sum_ > count_ * root * root * root;
  }
  /// Looks at one from outside.
  void check(StateCheck& check) const noexcept {
    check.number("surprise", sum_, 0.0, largest_in_a_state);
    check.number("surprise", count_, 0.0, 1.0001 * window);
  }

 private:
  static constexpr double window = 10.0;
  double sum_ = 0.0, count_ = 0.0;
};

/// The same readings by hypotheses of two correlation lengths, three travels over which parameters hold, and
/// a contact that stiffens; where there is a prior, as many again doubt it tenfold. Wait-free.
class Hypotheses {
 public:
  static constexpr std::size_t lengths = 8, most = 2 * lengths;
  using Weights = std::array<double, most>;
  /// Weights and means of all.
  struct Means {
    Weights weight{};
    std::array<Slots, most> theta{};
  };
  /// Before any reading; parameters have to be `expect`ed.
  void begin(bool prior_known) noexcept {
    last_ = {};
    count_ = prior_known ? most : lengths;
    for (std::size_t m = 0; m < count_; ++m) {
      bank_[m] = {};
      bank_[m].correlation_length = correlation_lengths[m % lengths % 2];
      bank_[m].holds_over = held[m % lengths / 2];
      bank_[m].stiffens = m % lengths / 2 == 3;
      bank_[m].doubt = m < lengths ? 1.0 : 10.0;
      bank_[m].log_weight = m < lengths ? 0.0 : -2.0;
    }
  }
  void expect(std::size_t slot, Expected expected) noexcept {
    for (std::size_t m = 0; m < count_; ++m)
      bank_[m].information.set(slot, expected.mean, bank_[m].doubt * expected.sd);
  }
  /// A parameter that nothing depends on yet.
  void set_aside(std::size_t slot) noexcept { expect(slot, {0.0, 1.0}); }
  /// That the contact stiffens beyond its law, of those that hold so.
  void expect_stiffening(double sd) noexcept {
    for (std::size_t m = 0; m < count_; ++m)
      bank_[m].information.set(slot::stiffening, 0.0, bank_[m].doubt * (bank_[m].stiffens ? sd : 1e-9));
  }
  /// Room for the parameters of one more layer.
  void another_layer() noexcept {
    for (std::size_t m = 0; m < count_; ++m) bank_[m].information.shift(2);
  }

  /// What this reading was worth to all of them together.
  Innovation learn(const Reading& now, double memory) noexcept {
    const Weights before = weights();
    double squared = 0.0, worth = 0.0;
    for (std::size_t m = 0; m < count_; ++m) {
      const Innovation found = bank_[m].add(now, last_, memory);
      squared += before[m] * found.squared;
      worth += before[m] / found.widening;
    }
    last_ = now;
    normalise();
    return {squared, 1.0 / worth};
  }

  std::size_t count() const noexcept { return count_; }
  const TissueEstimate& operator[](std::size_t m) const noexcept { return bank_[m]; }
  const Reading& last() const noexcept { return last_; }
  Learnt learnt(std::size_t slot, Expected expected) const noexcept {
    const Weights weight = weights();
    std::array<double, most> mean{};
    Learnt result;
    for (std::size_t m = 0; m < count_; ++m) {
      mean[m] = bank_[m].information.mean()[slot];
      result.value += weight[m] * mean[m];
    }
    double variance = 0.0;
    for (std::size_t m = 0; m < count_; ++m) {
      const double off = mean[m] - result.value;
      variance += weight[m] * (bank_[m].information.variance(slot) + off * off);
    }
    result.sd = std::sqrt(variance);
    result.before = expected.sd;
    return result;
  }
  Means means() const noexcept {
    Means result{weights(), {}};
    for (std::size_t m = 0; m < count_; ++m) result.theta[m] = bank_[m].information.mean();
    return result;
  }
  /// Looks at them from outside, of a tissue with a prior or without one, of `size` parameters.
  void check(StateCheck& check, bool prior_known, std::size_t size) const noexcept {
    check.require("hypotheses", count_ == (prior_known ? most : lengths));
    if (check.fault()) return;
    last_.check(check);
    for (std::size_t m = 0; m < count_; ++m) bank_[m].check(check, size);
  }

 private:
  static constexpr std::array<double, 2> correlation_lengths{1e-4, 1e-3};
  static constexpr std::array<double, 4> held{1.5e-3, 6e-3, 1e9, 1e9};
  static constexpr double least_log_weight = -30.0;

  void normalise() noexcept {
    double largest = bank_[0].log_weight;
    for (std::size_t m = 1; m < count_; ++m) largest = std::max(largest, bank_[m].log_weight);
    for (std::size_t m = 0; m < count_; ++m)
      bank_[m].log_weight = std::max(bank_[m].log_weight - largest, least_log_weight);
  }
  Weights weights() const noexcept {
    Weights result{};
    double sum = 0.0;
    for (std::size_t m = 0; m < count_; ++m) sum += result[m] = std::exp(bank_[m].log_weight);
    for (double& each : result) each /= sum;
    return result;
  }

  std::array<TissueEstimate, most> bank_{};
  Reading last_{};
  std::size_t count_ = lengths;
};

}  // namespace needleforce::online
