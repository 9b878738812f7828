// SPDX-License-Identifier: Apache-2.0
// How like earlier insertions into the same tissue this one is, and how much more that is worth than its law.
#pragma once

#include <algorithm>
#include <cmath>

#include "force_ahead.hpp"
#include "online_prior.hpp"

namespace needleforce::online {

/// The force ahead by likeness: the mean of the earlier ones, and of the difference now what is correlated
/// with that ahead. How much wider than theirs the scatter is, is learnt a millimetre ahead.
class Likeness {
 public:
  struct Foreseen {
    double mean = 0.0, variance = 0.0;
  };
  Foreseen ahead(const EarlierInsertions& earlier, double from, double to, double force) const noexcept {
    const double sd = earlier.at(earlier.sd, to), here = earlier.at(earlier.sd, from);
    const double kept = std::exp(-(to - from) / correlation_length);
    const double gain = kept * std::clamp(sd / std::max(here, 1e-9), 0.3, 1.0);
    const double mean = earlier.at(earlier.mean, to) + gain * (force - earlier.at(earlier.mean, from));
    return {mean, wider_ * sd * sd * (1.0 - kept * kept)};
  }
  /// A force that was foreseen has come.
  void came(const Foreseen& foreseen, double force) noexcept {
    const double off = force - foreseen.mean;
    const double squared = wider_ * std::min(off * off / std::max(foreseen.variance, 1e-18), 25.0);
    wider_ = std::max(1.0, wider_ + 0.2 * (squared - wider_));
  }
  /// Looks at one from outside.
  void check(StateCheck& check) const noexcept { check.number("likeness", wider_, 1.0, 1e15); }

 private:
  static constexpr double correlation_length = 3e-3;
  double wider_ = 1.0;
};

/// What law and likeness foresaw for a depth, and by how much likeness was the better one so far.
template <class Forces>
class LawOrLikeness {
 public:
  static constexpr double compared_over = 2e-3;  // [m]

  /// Probability that this insertion is like the earlier ones over a travel [m]. Farther than the two were
  /// compared that evidence falls with the square of the travel, as a contact grows.
  double likely(double travel) const noexcept {
    const double share = std::min(1.0, compared_over / std::max(travel, compared_over));
    const double weight = at_start + share * share * (weight_ - at_start);
    return 1.0 / (1.0 + std::exp(-weight));
  }
  const Likeness& likeness() const noexcept { return likeness_; }
  /// Whether what was foreseen last has still to come.
  bool waits(double depth) const noexcept { return asked() && depth < depth_; }
  /// The force that was foreseen, if any was: which of the two foresaw it.
  void came(double force) noexcept {
    if (asked()) {
      // to err once is not to be wrong everywhere: a twentieth of each is as wide as the force
      const double wide = 0.05 / (std::abs(force) + 1e-3);
      const double better = (by_likeness_.density(force) + wide) / (by_law_.density(force) + wide);
      weight_ = std::clamp(0.9 * weight_ + std::log(better), -8.0, 8.0);
      likeness_.came(like_, force);
    }
    depth_ = nowhere;
  }
  void foresee(double depth, const Forces& by_law, const Likeness::Foreseen& like,
               const Forces& by_likeness) noexcept {
    depth_ = depth;
    by_law_ = by_law;
    like_ = like;
    by_likeness_ = by_likeness;
  }
  /// Looks at one from outside.
  void check(StateCheck& check) const noexcept {
    likeness_.check(check);
    check.number("likeness", weight_, -8.0, 8.0);
    check.number("likeness", depth_, nowhere, 1e9);
    check.number("likeness", like_.mean, -largest_in_a_state, largest_in_a_state);
    check.number("likeness", like_.variance, 0.0, largest_in_a_state);
    by_law_.check(check);
    by_likeness_.check(check);
  }

 private:
  static constexpr double nowhere = -1e9, at_start = 2.0;
  bool asked() const noexcept { return depth_ > 0.1 * nowhere; }

  Likeness likeness_{};
  double weight_ = at_start, depth_ = nowhere;
  Likeness::Foreseen like_{};
  Forces by_law_{}, by_likeness_{};
};

}  // namespace needleforce::online
