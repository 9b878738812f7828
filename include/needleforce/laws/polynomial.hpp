// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "../law.hpp"

namespace needleforce::laws {

/// F = a_1 h + a_2 h^2, fitted to a tissue and a needle, with no mechanics behind it. The constant a_0 of the
/// source would be a force without contact and is left out.
template <class Real>
struct BasicPolynomial {
  Real linear;
  Real quadratic;

  static constexpr const char* name = "polynomial";
  static constexpr Family family = Family::stiffness;
  static constexpr const char* summary = "Second-order polynomial of the depth.";
  static constexpr const char* source = "Simone & Okamura 2002; Okamura, Simone & O'Leary 2004";
  static constexpr const char* validity =
      "The needle, tissue and speed it was fitted to, up to the deepest point of the fit.";
  static constexpr std::array<Parameter<BasicPolynomial, Real>, 2> table{{
      {&BasicPolynomial::linear, "linear", "N/m", 1e-6, 1e6, required, "a_1", "stiffness at first contact",
       "Okamura, Simone & O'Leary 2004"},
      {&BasicPolynomial::quadratic, "quadratic", "N/m^2", 0.0, 1e10, required, "a_2",
       "coefficient of the depth squared", "Okamura, Simone & O'Leary 2004"},
  }};

  struct Prepared {
    Real linear, quadratic;
    Real reach() const noexcept { return std::numeric_limits<double>::infinity(); }
    Real force(Real h) const noexcept { return h * (linear + quadratic * h); }
    Real slope(Real h) const noexcept { return linear + 2.0 * quadratic * h; }
    Real energy(Real h) const noexcept { return h * h * (linear / 2.0 + quadratic * h / 3.0); }
    Real indentation(Real force) const noexcept {
      // the root in the form that does not cancel, and holds without a quadratic part
      return 2.0 * force / (linear + sqrt(linear * linear + 4.0 * quadratic * force));
    }
  };
  Prepared prepare() const noexcept { return {linear, quadratic}; }
};
using Polynomial = BasicPolynomial<double>;

}  // namespace needleforce::laws
