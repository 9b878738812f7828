// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "../law.hpp"

namespace needleforce::laws {

/// No force at the tip: a hole that is there already, or a friction law that counts the tip itself.
template <class Real>
struct BasicNoCutting {
  static constexpr const char* name = "no_cutting";
  static constexpr Family family = Family::cutting;
  static constexpr bool monotone = true;
  static constexpr const char* summary = "No cutting force.";
  static constexpr const char* source = "by definition";
  static constexpr const char* validity =
      "An existing hole; friction laws that count the rupture themselves.";
  static constexpr std::array<Parameter<BasicNoCutting, Real>, 0> table{};

  struct Prepared {
    using Memory = NoMemory;
    Real steady(Real = 0.0) const noexcept { return 0.0; }
    void enter(BasicCut<Real>& cut, Memory&, Real depth, Real) const noexcept { cut.front = depth; }
    void advance(BasicCut<Real>& cut, Memory&, const BasicMove<Real>& move) const noexcept {
      cut.front = larger(cut.front, move.depth);
    }
    Real forceless(const BasicCut<Real>&, Real depth) const noexcept { return depth; }
    Real force(const BasicCut<Real>&, const Memory&, Real) const noexcept { return 0.0; }
    Real by_depth(const BasicCut<Real>&, const Memory&, Real) const noexcept { return 0.0; }
  };
  Prepared prepare() const noexcept { return {}; }
};
using NoCutting = BasicNoCutting<double>;

}  // namespace needleforce::laws
