// SPDX-License-Identifier: Apache-2.0
// The face of a bevelled tip is a wedge: its lateral force is a share of the cutting force, and what the tip
// moves with that, the cut has not moved.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "beam_foundation.hpp"

namespace needleforce::bending {

/// A tip without a face.
struct NoFace {
  template <class Place>
  double operator()(const Place&) const noexcept {
    return 0.0;
  }
};

/// Where a force equals what a law makes of it, one that falls with the force: false position between one
/// that was tried and the law's answer to it. Wait-free.
template <class Law>
double met(const Law& law, double tried, double answer) noexcept {
  double low = tried, above = answer - tried, high = answer, below = law(answer) - answer;
  if (below == 0.0) return answer;
  double found = high;
  for (int tries = 0; tries < 20 && above * below < 0.0; ++tries) {
    found = low + (high - low) * above / (above - below);
    const double missing = law(found) - found;
    if (std::abs(missing) <= 1e-10) break;
    if (missing * below < 0.0)
      low = high, above = below;
    else
      above *= below / (below + missing);  // Anderson and Bjoerck: an end that stays counts less
    high = found, below = missing;
  }
  return found;
}

/// Adds to a solution for the shape what the lateral force of the face changes until it fits the cutting
/// force, which `face` gives for a place of the tip; returns that force [N]. Wait-free.
template <std::size_t dimension, class Face>
double push_face(BeamEquations<dimension>& solved, std::size_t last, const BeamLoad<dimension>& load,
                 double tried, const Face& face) noexcept {
  const auto place = solved.value[last].y;
  const double answer = face(place);
  if (answer == tried) return tried;
  std::array<NodeValue<1>, max_nodes> unit;
  solved.unit_at_last(unit);
  const auto at = [&](double cutting) noexcept {
    auto moved = place;
    for (std::size_t d = 0; d < dimension; ++d)
      moved[d] += unit[last].y[0] * load.wedge[d] * (cutting - tried);
    return face(moved);
  };
  const double cutting = met(at, tried, answer);
  for (std::size_t i = 0; i <= last; ++i)
    for (std::size_t d = 0; d < dimension; ++d) {
      const double force = load.wedge[d] * (cutting - tried);
      solved.value[i].y[d] += force * unit[i].y[0];
      solved.value[i].r[d] += force * unit[i].r[0];
    }
  return cutting;
}

}  // namespace needleforce::bending
