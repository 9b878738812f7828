// SPDX-License-Identifier: Apache-2.0
// Condensed solids for the tests, without a mesh: compliances that fall with the distance of the nodes.
#pragma once

#include <cmath>
#include <cstddef>

#include "needleforce/solid/condensed_insertion.hpp"
#include "paper.hpp"

namespace solid_tests {

using namespace needleforce;
using namespace needleforce::solid;

/// Own compliance `scale` [m/N], falling to the e-th part over four nodes: positive definite
/// (Ornstein-Uhlenbeck).
inline CondensedTissue tissue(double scale, std::size_t nodes = 61) {
  CondensedTissue result;
  result.nodes = nodes;
  result.spacing = 1e-3;
  for (std::size_t i = 0; i < nodes; ++i)
    for (std::size_t j = 0; j < nodes; ++j) {
      const double apart = std::abs(static_cast<double>(i) - static_cast<double>(j));
      result.compliance[i * max_path_nodes + j] = scale * std::exp(-0.25 * apart);
    }
  return result;
}

inline Model laws_of(double friction, double cutting, double puncture, double presliding = 1e-6) {
  return {laws::Polynomial{100.0, 0.0}, laws::PunctureForce{puncture},
          laws::Coulomb{friction, presliding, 0.0}, laws::ConstantCutting{cutting, presliding}};
}

inline CondensedInsertion insertion(double scale, const Model& laws, const Limits& limits = {}) {
  const Layer layer{0.0, laws};
  return CondensedInsertion(tissue(scale), std::span(&layer, 1), limits);
}

}  // namespace solid_tests
