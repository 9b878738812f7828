// SPDX-License-Identifier: Apache-2.0
// The tissue as a linear elastic half-space, and its contact modulus against a needle.
#pragma once

#include <array>

#include "needle.hpp"
#include "parameter.hpp"

namespace needleforce {

/// Linear elastic, isotropic, homogeneous tissue. The Poisson ratio has no default: 0.5 instead of 0 is +33 %
/// in force.
struct Tissue {
  double young_modulus;
  double poisson_ratio;

  static constexpr const char* name = "tissue";
  static constexpr const char* summary = "Linear elastic isotropic tissue.";
  static constexpr std::array<Parameter<Tissue>, 2> table{{
      {&Tissue::young_modulus, "young_modulus", "Pa", 1.0, 1e10, required, "E_2",
       "Young's modulus of the tissue", "eq. (4)"},
      {&Tissue::poisson_ratio, "poisson_ratio", "1", 0.0, 0.5, required, "nu_2",
       "Poisson ratio of the tissue; never assumed, as 0.5 puts the paper's peak force 32 % too high",
       "eq. (4)"},
  }};
};

/// Plane-strain modulus E / (1 - nu^2) [Pa].
template <class Body>
constexpr double plane_strain_modulus(const Body& body) noexcept {
  return body.young_modulus / (1.0 - body.poisson_ratio * body.poisson_ratio);
}

/// Reduced modulus [Pa] of two elastic bodies in contact, eq. (4); symmetric in the bodies.
template <class First, class Second>
constexpr double reduced_modulus(const First& first, const Second& second) noexcept {
  return 1.0 / (1.0 / plane_strain_modulus(first) + 1.0 / plane_strain_modulus(second));
}

}  // namespace needleforce
