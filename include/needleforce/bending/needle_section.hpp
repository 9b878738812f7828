// SPDX-License-Identifier: Apache-2.0
// A needle whose bending stiffness or curvature changes along its length.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "../needle.hpp"

namespace needleforce::bending {

/// A stretch of the needle, ending at a distance from the tip.
struct Section {
  double end = std::numeric_limits<double>::infinity();  ///< distance from the tip [m]
  double stiffness = 0.0;                                ///< E I [N m^2]
  double curvature = 0.0;  ///< of the unloaded needle, towards the bevel's point [1/m]
};

inline constexpr std::size_t max_sections = 4;
/// Range of E I [N m^2]: a glass fibre of a micrometre has 3e-15; of denormal numbers the square is 0.
inline constexpr double min_stiffness = 1e-15, max_stiffness = 1e9;

/// The stretches from the tip on. Plain values.
struct Sections {
  std::array<Section, max_sections> list{};
  std::size_t count = 0;

  Sections() = default;
  explicit Sections(const Needle& needle) noexcept : count(1) {
    list[0].stiffness = needle.bending_stiffness();
  }
  explicit Sections(std::span<const Section> sections) noexcept
      : count(std::min(sections.size(), max_sections)) {
    std::copy_n(sections.begin(), count, list.begin());
    // the last extends to the hub, wherever that is; what is no distance stays, to be refused
    if (count > 0 && list[count - 1].end >= 0.0)
      list[count - 1].end = std::numeric_limits<double>::infinity();
  }
  /// True for stiffnesses and curvatures in their ranges and ends that increase.
  bool valid() const noexcept {
    if (count > max_sections) return false;
    for (std::size_t i = 0; i < count; ++i) {
      const auto& [end, stiffness, curvature] = list[i];
      if (!(stiffness >= min_stiffness && stiffness <= max_stiffness)) return false;
      if (!(std::abs(curvature) <= 1e4)) return false;
      if (!(end > (i ? list[i - 1].end : 0.0))) return false;
    }
    return count > 0;
  }
  /// The stretch at a distance from the tip [m]. Wait-free.
  std::size_t at(double distance) const noexcept {
    std::size_t i = 0;
    while (i + 1 < count && distance >= list[i].end) ++i;
    return i;
  }
};

}  // namespace needleforce::bending
