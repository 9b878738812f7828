// SPDX-License-Identifier: Apache-2.0
// A bank of hypotheses on texture and prior, weighted by what each foresaw.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "../events/running_noise.hpp"
#include "online_prior.hpp"
#include "tissue_estimate.hpp"

namespace needleforce::online {

/// A value with its standard deviation, and that of the prior.
struct Learnt {
  double value = 0.0, sd = 0.0, before = 0.0;
  void check(StateCheck& check, const char* part, double most = largest_in_a_state) const noexcept {
    check.numbers(part, *this, most);
    check.number(part, sd, 0.0, most);
  }
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

/// The same readings by hypotheses of two correlation lengths and three travels over which parameters hold,
/// the longest with the next layer's contact from the puncture on, or from where the force shows it; where
/// there is a prior, as many again doubt it tenfold. Wait-free.
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
      bank_[m].late = begins_late(m);
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
  /// One more thing that is known of a parameter.
  void know(std::size_t slot, Expected expected) noexcept {
    Slots row{};
    row[slot] = 1.0 / expected.sd;
    for (std::size_t m = 0; m < count_; ++m) bank_[m].information.add(row, expected.mean / expected.sd);
  }
  /// Standard deviations of all parameters grow by a factor.
  void doubt(double factor) noexcept {
    for (std::size_t m = 0; m < count_; ++m)
      bank_[m].information.forget_share(bank_[m].information.size(), 1.0 / factor);
  }
  /// Room for the parameters of one more layer.
  void another_layer() noexcept {
    for (std::size_t m = 0; m < count_; ++m) bank_[m].information.shift(2);
  }

  /// What this reading was worth to all of them together; the residual is that of those without a contact
  /// yet.
  Innovation learn(const Reading& now, double memory) noexcept {
    const Weights before = weights();
    double squared = 0.0, worth = 0.0, rise = 0.0;
    for (std::size_t m = 0; m < count_; ++m) {
      const Innovation found = bank_[m].add(now, last_, memory);
      squared += before[m] * found.squared;
      if (bank_[m].late)
        rise += found.residual * static_cast<double>(lengths) / (2.0 * static_cast<double>(count_));
      worth += before[m] / found.widening;
    }
    last_ = now;
    normalise();
    return {squared, 1.0 / worth, rise};
  }

  /// Those whose contact begins late, as they are now.
  void keep_late() noexcept {
    std::size_t at = 0;
    for (std::size_t m = 0; m < count_; ++m)
      if (bank_[m].late) kept_[at++] = bank_[m];
  }
  /// Back to what was kept, with the contact that the last reading has.
  void take_back_late(const ContactSlots& contact) noexcept {
    std::size_t at = 0;
    for (std::size_t m = 0; m < count_; ++m)
      if (bank_[m].late) bank_[m] = kept_[at++];
    last_.late = contact;
    normalise();
  }

  std::size_t count() const noexcept { return count_; }
  const TissueEstimate& operator[](std::size_t m) const noexcept { return bank_[m]; }
  const Reading& last() const noexcept { return last_; }
  Learnt learnt(std::size_t slot, Expected expected) const noexcept {
    Slots unit{};
    unit[slot] = 1.0;
    return learnt(unit, unit, expected);
  }
  /// A sum of parameters, by those whose contact begins late another one.
  Learnt learnt(const Slots& by, const Slots& by_late, Expected expected) const noexcept {
    const Weights weight = weights();
    std::array<double, most> mean{};
    Learnt result;
    for (std::size_t m = 0; m < count_; ++m) {
      const Slots theta = bank_[m].information.mean(), &row = bank_[m].late ? by_late : by;
      mean[m] = std::inner_product(theta.begin(), theta.end(), row.begin(), 0.0);
      result.value += weight[m] * mean[m];
    }
    double variance = 0.0;
    for (std::size_t m = 0; m < count_; ++m) {
      const double off = mean[m] - result.value;
      variance += weight[m] * (bank_[m].information.variance(bank_[m].late ? by_late : by) + off * off);
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
  /// Looks at them from outside, of a tissue with a prior or without one.
  void check(StateCheck& check, bool prior_known, std::size_t pierced) const noexcept {
    const std::size_t size = slot::cutting + 2 * std::max<std::size_t>(pierced, 1);
    check.require("hypotheses", count_ == (prior_known ? most : lengths));
    if (check.fault()) return;
    last_.check(check);
    std::size_t late = 0;
    for (std::size_t m = 0; m < count_ && !check.fault(); ++m) {
      bank_[m].check(check, size);
      if (check.fault()) return;  // a flag of any byte is not read
      check.require("hypotheses", bank_[m].late == begins_late(m));
      if (pierced && begins_late(m)) kept_[late++].check(check, size);
    }
  }

 private:
  static constexpr std::array<double, 2> correlation_lengths{1e-4, 1e-3};
  static constexpr std::array<double, 4> held{1.5e-3, 6e-3, 1e9, 1e9};
  static constexpr double least_log_weight = -30.0;

  static constexpr bool begins_late(std::size_t m) noexcept { return m % lengths / 2 == 3; }
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
  std::array<TissueEstimate, most / 4> kept_{};
  Reading last_{};
  std::size_t count_ = lengths;
};

}  // namespace needleforce::online
