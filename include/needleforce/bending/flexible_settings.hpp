// SPDX-License-Identifier: Apache-2.0
// What a needle that bends meets, how it is held and how finely it is computed; checked before the loop.
#pragma once

#include <cstddef>
#include <cstdint>

#include "../model_fingerprint.hpp"
#include "beam_load.hpp"
#include "bending.hpp"

namespace needleforce::bending {

/// Chosen before the loop.
struct FlexibleSettings {
  BeamProperties beam{};
  Bending lengths{};
  bool small_slopes = false;  ///< tip and shape without the second order of the slopes
};

/// What is wrong with the settings, or nullptr. For use before the loop.
inline const char* fault(const FlexibleSettings& settings) noexcept {
  const BeamProperties& beam = settings.beam;
  if (!beam.sections.valid()) return "sections";
  if (const auto* bad = first_invalid(beam.support)) return bad->name;
  if (const auto* bad = first_invalid(settings.lengths)) return bad->name;
  if (beam.layer_count < 1 || beam.layer_count > max_lateral_layers) return "number of lateral layers";
  for (std::size_t i = 0; i < beam.layer_count; ++i) {
    if (const auto* bad = first_invalid(beam.layers[i])) return bad->name;
    const bool below = i == 0 ? beam.layers[i].top == 0.0 : beam.layers[i].top > beam.layers[i - 1].top;
    if (!below) return "top";
  }
  if (beam.elements < 1 || beam.elements > max_elements) return "elements";
  if (beam.max_iterations < 1 || beam.max_iterations > 1000) return "max_iterations";
  if (!(beam.tolerance > 0.0 && beam.tolerance <= 1e-3)) return "tolerance";
  return nullptr;
}

/// A number that distinguishes settings. For use before the loop.
inline std::uint64_t fingerprint(const FlexibleSettings& settings) noexcept {
  const BeamProperties& beam = settings.beam;
  Fingerprint print;
  for (std::size_t i = 0; i < beam.layer_count; ++i) needleforce::detail::add_numbers(print, beam.layers[i]);
  for (std::size_t i = 0; i < beam.sections.count; ++i) {
    const auto& [end, stiffness, curvature] = beam.sections.list[i];
    for (const double number : {end, stiffness, curvature}) print.add(number);
  }
  needleforce::detail::add_numbers(print, beam.support);
  needleforce::detail::add_numbers(print, settings.lengths);
  for (const std::size_t count : {beam.layer_count, beam.sections.count, beam.elements, beam.max_iterations})
    print.add(std::uint64_t{count});
  print.add(beam.tolerance);
  print.add(std::uint64_t{settings.small_slopes});
  return print.value();
}

}  // namespace needleforce::bending
