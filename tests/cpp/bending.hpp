// SPDX-License-Identifier: Apache-2.0
// Needles that bend, for the tests: the values of reference_values_deflection.json.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "needleforce/bending/flexible_insertion.hpp"
#include "paper.hpp"

namespace bending_tests {

using namespace needleforce;
using namespace needleforce::bending;

/// Laws without any axial force.
inline Model forceless() {
  return {laws::Polynomial{1.0, 0.0}, laws::PunctureDepth{0.0}, laws::Coulomb{0.0, 20e-6, 0.0},
          laws::NoCutting{}};
}
inline constexpr Limits any_speed{.max_speed = std::numeric_limits<double>::infinity()};

inline FlexibleSettings settings(double stiffness, double modulus, double tip_force, double bevel_length,
                                 double guide_distance) {
  const std::array section{Section{.stiffness = stiffness}};
  FlexibleSettings result;
  result.beam.sections = Sections(std::span<const Section>(section));
  result.beam.support.guide_distance = guide_distance;
  result.beam.layers[0] = {.modulus = modulus, .tip_force = tip_force};
  result.beam.layer_count = 1;
  result.lengths.bevel_length = bevel_length;
  result.small_slopes = true;
  return result;
}

/// The needle of `insertion_guided_uniform_tip80mm`.
inline FlexibleSettings guided() { return settings(0.0206517998, 20e3, 0.2, 0.002612, 0.03); }
/// A thin needle in a stiff tissue: the `path_attached_beam` group.
inline FlexibleSettings thin(double bevel_length = 0.002612) {
  return settings(0.0001662, 71350.0, 0.0776, bevel_length, 0.03);
}

template <std::size_t dimension>
FlexibleInsertion<dimension> forceless_insertion(const FlexibleSettings& settings) {
  return FlexibleInsertion<dimension>(Insertion(forceless(), any_speed), settings);
}

/// From one base to another in n even steps; the last sample.
template <class Engine>
BentSample move(Engine& engine, const Base& from, const Base& to, int n, double dt = 1.0) {
  BentSample sample;
  for (int i = 0; i <= n; ++i) {
    const double share = static_cast<double>(i) / n;
    sample = engine.step(between(from, to, share, from.depth + share * (to.depth - from.depth)), dt);
  }
  return sample;
}
template <class Engine>
BentSample insert(Engine& engine, double depth, int n) {
  return move(engine, {.depth = 0.0}, {.depth = depth}, n);
}

}  // namespace bending_tests
