// SPDX-License-Identifier: Apache-2.0
// What earlier insertions into the same tissue had at a depth, and how like them this one is.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace needleforce::online {

/// Mean and standard deviation of the force of earlier insertions below their contact, at equal distances.
struct EarlierInsertions {
  static constexpr std::size_t points = 161;
  double spacing = 0.0;  ///< [m]; 0 without any
  std::array<double, points> mean{}, sd{};

  bool known(double indentation) const noexcept { return spacing > 0.0 && indentation < deepest(); }
  double deepest() const noexcept { return spacing * static_cast<double>(points - 1); }
  double at(const std::array<double, points>& values, double indentation) const noexcept {
    const double place = std::clamp(indentation / spacing, 0.0, static_cast<double>(points - 1) - 1e-9);
    const auto left = static_cast<std::size_t>(place);
    const double share = place - static_cast<double>(left);
    return (1.0 - share) * values[left] + share * values[left + 1];
  }
};

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

 private:
  static constexpr double correlation_length = 3e-3;
  double wider_ = 1.0;
};

}  // namespace needleforce::online
