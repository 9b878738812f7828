// SPDX-License-Identifier: Apache-2.0
// What is expected of a tissue before the needle moves, with how uncertain that is.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "../tip.hpp"

namespace needleforce::online {

/// A value that is expected, and its standard deviation; `known` is false where nothing is.
struct Expected {
  double mean = 0.0;
  double sd = 0.0;
  bool known() const noexcept { return sd > 0.0; }
};

/// Of one layer. Depths are from the contact with the first layer.
struct LayerPrior {
  Expected modulus{};    ///< reduced modulus of the contact [Pa]
  Expected cutting{};    ///< cutting force [N]
  Expected friction{};   ///< per embedded length [N/m]
  Expected top{};        ///< where it begins to be indented [m]; of the first layer 0
  Expected puncture{};   ///< depth of its puncture [m]
  Expected remainder{};  ///< share of the force that is left after its puncture
};

inline constexpr std::size_t most_layers = 8;

/// Mean and standard deviation of the force of earlier insertions below their contact, at equal distances.
struct EarlierInsertions {
  static constexpr std::size_t points = 161;
  double spacing = 0.0;  ///< [m]; 0 without any
  std::array<double, points> mean{}, sd{};

  /// A little below the deepest the force is still that at the deepest.
  bool known(double indentation) const noexcept { return spacing > 0.0 && indentation < 1.1 * deepest(); }
  double deepest() const noexcept { return spacing * static_cast<double>(points - 1); }
  double at(const std::array<double, points>& values, double indentation) const noexcept {
    const double place = std::clamp(indentation / spacing, 0.0, static_cast<double>(points - 1) - 1e-9);
    const auto left = static_cast<std::size_t>(place);
    const double share = place - static_cast<double>(left);
    return (1.0 - share) * values[left] + share * values[left + 1];
  }
};

struct OnlinePrior {
  std::size_t layers = 0;    ///< how many punctures are expected; 0 if that is unknown
  bool same_tissue = false;  ///< from recordings of it, by this law, instead of a model of another
  double radius = 0.1;       ///< of the shank, where the contact stops growing [m]
  Tip tip{tips::Cone{45.0 * tips::degree}};
  std::array<LayerPrior, most_layers> layer{};
  EarlierInsertions earlier{};
};

}  // namespace needleforce::online
