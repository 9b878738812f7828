// SPDX-License-Identifier: Apache-2.0
// The paper's numbers, for the tests.
#pragma once

#include <array>

#include "needleforce/insertion.hpp"

namespace paper {

inline constexpr double degree = needleforce::tips::degree;
inline constexpr double half_angle = 15.0 * degree;
inline constexpr double puncture = 3.237e-3;
inline constexpr double friction = 18.6;
inline constexpr double cutting = 0.0776;

inline needleforce::Model model(double reduced_modulus = 116e3, double dimple_ratio = 0.0) {
  return {needleforce::laws::Cone{reduced_modulus, half_angle}, needleforce::laws::PunctureDepth{puncture},
          needleforce::laws::Coulomb{friction, 20e-6, dimple_ratio},
          needleforce::laws::ConstantCutting{cutting, 20e-6}};
}

/// A tissue of one layer.
inline std::array<needleforce::Layer, 1> one(const needleforce::Model& model) {
  return {needleforce::Layer{0.0, model}};
}

/// Moves the tip to `target` in equal steps of at most `step`, calling `visit` with each sample.
template <class Visit>
void move(needleforce::Insertion& insertion, double from, double target, double step, Visit visit) {
  const int n = static_cast<int>(std::ceil(std::abs(target - from) / step));
  for (int i = 1; i <= n; ++i)
    visit(insertion.step(from + (target - from) * i / n, needleforce::no_velocity, 1e-3));
}

inline void move(needleforce::Insertion& insertion, double from, double target, double step = 1e-5) {
  move(insertion, from, target, step, [](const needleforce::Sample&) {});
}

}  // namespace paper
