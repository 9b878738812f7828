// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "../law.hpp"

namespace needleforce::laws {

/// Purely elastic: a hold keeps its force.
template <class Real>
struct BasicNoRelaxation {
  static constexpr const char* name = "no_relaxation";
  static constexpr Family family = Family::relaxation;
  static constexpr bool monotone = true;
  static constexpr const char* summary = "No relaxation: a hold keeps its force.";
  static constexpr const char* source = "by definition";
  static constexpr const char* validity = "Tissue that does not creep within the time of an insertion.";
  static constexpr std::array<Parameter<BasicNoRelaxation, Real>, 0> table{};

  struct Prepared {
    BasicRelaxing<Real> over(double) const noexcept { return {}; }
  };
  Prepared prepare() const noexcept { return {}; }
};
using NoRelaxation = BasicNoRelaxation<double>;

}  // namespace needleforce::laws
