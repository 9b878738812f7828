// SPDX-License-Identifier: Apache-2.0
// What is expected of a tissue before the needle moves, with how uncertain that is.
#pragma once

#include <array>
#include <cstddef>

#include "../tip.hpp"
#include "earlier_insertions.hpp"

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

struct OnlinePrior {
  std::size_t layers = 0;    ///< how many punctures are expected; 0 if that is unknown
  bool same_tissue = false;  ///< from recordings of it, by this law, instead of a model of another
  double radius = 0.1;       ///< of the shank, where the contact stops growing [m]
  Tip tip{tips::Cone{45.0 * tips::degree}};
  std::array<LayerPrior, most_layers> layer{};
  EarlierInsertions earlier{};
};

}  // namespace needleforce::online
