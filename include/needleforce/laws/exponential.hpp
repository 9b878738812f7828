// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "../law.hpp"

namespace needleforce::laws {

/// F = b (exp(a h) - 1), fitted to a tissue and a needle; a -> 0 with a b fixed is a linear spring. Beyond
/// a h = 50 it continues linearly: a value for the loop, no prediction.
template <class Real>
struct BasicExponential {
  Real rate;
  Real scale;

  static constexpr const char* name = "exponential";
  static constexpr Family family = Family::stiffness;
  static constexpr const char* summary = "Exponential of the depth.";
  static constexpr const char* source = "Maurin et al. 2004";
  static constexpr const char* validity =
      "The needle, tissue and speed it was fitted to, up to the deepest point of the fit.";
  static constexpr std::array<Parameter<BasicExponential, Real>, 2> table{{
      {&BasicExponential::rate, "rate", "1/m", 1e-3, 1e5, required, "a", "one over the depth of an e-fold",
       "Maurin et al. 2004"},
      {&BasicExponential::scale, "scale", "N", 1e-9, 1e6, required, "b",
       "force scale; the stiffness at first contact over the rate", "Maurin et al. 2004"},
  }};

  struct Prepared {
    Real rate, scale, end;  // end: where it continues linearly [m]
    Real reach() const noexcept { return end; }
    Real force(Real h) const noexcept {
      const Real within = h < end ? h : end;
      return scale * expm1(rate * within) + slope(end) * (h - within);
    }
    Real slope(Real h) const noexcept { return rate * scale * exp(rate * (h < end ? h : end)); }
    Real energy(Real h) const noexcept {
      const Real within = h < end ? h : end, x = rate * within, beyond = h - within;
      // expm1(x) - x cancels at small x; its series does not
      const Real grown =
          x > 1e-2 ? expm1(x) - x : x * x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0 + x / 120.0)));
      return scale / rate * grown + beyond * (scale * expm1(x) + 0.5 * slope(end) * beyond);
    }
    Real indentation(Real force) const noexcept {
      const Real last = scale * expm1(rate * end);
      return force <= last ? log1p(force / scale) / rate : end + (force - last) / slope(end);
    }
  };
  Prepared prepare() const noexcept { return {rate, scale, 50.0 / rate}; }
};
using Exponential = BasicExponential<double>;

}  // namespace needleforce::laws
