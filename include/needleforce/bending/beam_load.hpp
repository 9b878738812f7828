// SPDX-License-Identifier: Apache-2.0
// What acts on the needle in one solution, and what it is made of.
#pragma once

#include <array>
#include <cstddef>

#include "cut_path.hpp"
#include "lateral_layer.hpp"
#include "needle_section.hpp"
#include "support.hpp"

namespace needleforce::bending {

inline constexpr std::size_t max_lateral_layers = 8;
inline constexpr std::size_t path_capacity = 3001;

template <std::size_t dimension>
using TissuePath = CutPath<dimension, path_capacity>;

/// Axial forces along the needle [N], compression positive: above the surface, and linear from the surface to
/// the tip.
struct Compression {
  double free = 0.0, surface = 0.0, tip = 0.0;
  double cutting = 0.0;  ///< the part of that at the tip which follows the needle
};

/// What acts on the needle in one solution.
template <std::size_t dimension>
struct BeamLoad {
  using Place = std::array<double, dimension>;
  double embedded = 0.0;     ///< travel of the tip in the tissue [m]
  double free_length = 0.0;  ///< of the needle from the base to the surface, or to the tip above it [m]
  Place lateral{}, tilt{};   ///< of the base [m], [rad]
  Place tip_force{};         ///< [N]
  Place wedge{};             ///< lateral over cutting force at the face of the tip
  double cutting = 0.0;      ///< force at the tip [N], until the face is at its place
  Place bend{};              ///< direction in which the unloaded needle is bent, a unit vector
  Place bend_turns{};        ///< its derivative by the roll
  Compression compression{};
  double contact = 0.0;     ///< lateral stiffness of the tissue at the tip [N/m]
  Place contact_place{};    ///< where that is unloaded
  double pivot = 1.0;       ///< share of the pivot that holds already
  bool cuts = false;        ///< the tip is at the front of its path and writes it
  bool shortens = false;    ///< bending does, of a needle whose shaft slides less then
  bool pulls_back = false;  ///< the newest piece of path, which the tip writes, holds the tip
  bool rubs = false;        ///< lateral pressure makes axial friction

  bool has_face() const noexcept {
    for (const double each : wedge)
      if (each != 0.0) return true;
    return false;
  }
};

/// Chosen before the loop.
struct BeamProperties {
  Sections sections{};
  Support support{};
  std::array<LateralLayer, max_lateral_layers> layers{};
  std::size_t layer_count = 0;
  std::size_t elements = 40;
  std::size_t max_iterations = 60;
  double tolerance = 1e-11;  ///< largest change of a node in the last iteration [m]

  bool linear() const noexcept {
    for (std::size_t i = 0; i < layer_count; ++i)
      if (!layers[i].linear()) return false;
    return true;
  }
  bool yields() const noexcept {
    for (std::size_t i = 0; i < layer_count; ++i)
      if (layers[i].yields()) return true;
    return false;
  }
};

}  // namespace needleforce::bending
