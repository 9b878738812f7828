// SPDX-License-Identifier: Apache-2.0
// Parameters for every law, for the benchmarks.
#pragma once

#include <algorithm>
#include <cmath>

#include "needleforce/laws/all.hpp"

namespace needleforce {

/// Every parameter of a law at its default, otherwise at the geometric middle of its range.
template <Law L>
L typical() {
  L law{};
  for (const auto& parameter : L::table) {
    const double low = std::max(parameter.low, 1e-9 * parameter.high);
    const bool negative = parameter.high <= 0.0;
    const double middle = negative ? -1e-2 : std::sqrt(low * parameter.high);
    law.*parameter.member = parameter.initial == parameter.initial ? parameter.initial : middle;
  }
  return law;
}

// where the middle of the ranges would contradict itself, the presets' parameters
template <>
inline laws::LuGre typical() {
  return {1e6, 100.0, 200.0, 18.0, 25.0, 1e-3, 2.0};
}
template <>
inline laws::RelaxingSurface typical() {
  return {18.6, 20e-6, 1.0, 82.3, 0.0776};
}
template <>
inline laws::DraggedTissuePassive typical() {
  return {140.0, 220.0, 0.4e-3, 1e-3};
}
template <>
inline laws::DraggedTissueAsFitted typical() {
  return {140.0, 220.0, 0.4e-3, 1e-3};
}
template <>
inline laws::CubicFoundation typical() {
  return {18.6, 0.7, 12e-3, 0.1, 20e-6, 0.0};
}
template <>
inline laws::HyperbolicFoundation typical() {
  return {18.6, 1.5, 12e-3, 0.1, 20e-6, 0.0};
}
template <>
inline laws::TanhFoundation typical() {
  return {18.6, 1.5, 12e-3, 0.1, 20e-6, 0.0};
}
template <>
inline laws::YieldingTissue typical() {
  return {140.0, 220.0, 0.4e-3, 1e-3, 0.0, 0.0};
}
template <>
inline laws::YieldingCoulomb typical() {
  return {18.6, 20e-6, 0.4e-3, 2.0};
}
template <>
inline laws::StickSlip typical() {
  return {0.1, 0.04, 1.5e-3, 25.07, 200.0};
}
template <>
inline laws::StribeckCutting typical() {
  return {0.1, 0.0033, 0.5714e-3, 20.73, 200.0, 2e-3};
}
template <>
inline laws::TipContact typical() {
  return {117546.06, 0.35e-3, tips::TangentOgive{0.35e-3, 1.3e-3}};
}

}  // namespace needleforce
