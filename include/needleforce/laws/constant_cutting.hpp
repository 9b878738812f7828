// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "../law.hpp"

namespace needleforce::laws {

/// A constant force while the tip is at the deepest cut; it unloads elastically as the tip recedes and loads
/// again on return, so noise at rest never switches it on and off and an existing hole is not cut
/// again.
template <class Real>
struct BasicConstantCutting {
  Real force;
  Real unloading;

  static constexpr const char* name = "constant_cutting";
  static constexpr Family family = Family::cutting;
  static constexpr bool monotone = true;
  static constexpr bool cuts = true;
  static constexpr const char* summary = "Constant cutting force at the deepest cut.";
  static constexpr const char* source = "sec. 2.3";
  static constexpr const char* validity =
      "Steady cutting: at 1 mm/s the force in the paper oscillates between 0.04 and 0.1 N.";
  static constexpr std::array<Parameter<BasicConstantCutting, Real>, 2> table{{
      {&BasicConstantCutting::force, "force", "N", 0.0, 1e3, required, "f_c",
       "cutting force while the tip advances in fresh tissue", "sec. 2.3"},
      {&BasicConstantCutting::unloading, "unloading", "m", 1e-9, 5e-2, 20e-6, "s_c",
       "travel away from the deepest cut over which the force falls to zero", "free: elastic unloading"},
  }};

  struct Prepared {
    using Memory = NoMemory;
    Real full;        // the force at the deepest cut [N]
    Real per_travel;  // 1 / unloading [1/m]
    Real steady(Real = 0.0) const noexcept { return full; }
    void enter(BasicCut<Real>& cut, Memory&, Real depth, Real) const noexcept { cut.front = depth; }
    template <class Motion>
    void advance(BasicCut<Real>& cut, Memory&, const Motion& move) const noexcept {
      cut.front = larger(cut.front, move.depth);
    }
    /// Where the front may be of a tip at a depth that presses no more [m].
    Real forceless(const BasicCut<Real>& cut, Real depth) const noexcept {
      return depth + cut.held + 1.0 / per_travel;
    }
    /// The share of the force that is left `cut.front - depth` behind the deepest cut.
    Real loaded(const BasicCut<Real>& cut, Real depth) const noexcept {
      return larger(0.0, 1.0 - larger(0.0, cut.front - cut.held - depth) * per_travel);
    }
    Real force(const BasicCut<Real>& cut, const Memory&, Real depth) const noexcept {
      return full * loaded(cut, depth);
    }
    Real by_depth(const BasicCut<Real>& cut, const Memory&, Real depth) const noexcept {
      return depth < cut.front - cut.held && loaded(cut, depth) > 0.0 ? full * per_travel : 0.0;
    }
  };
  Prepared prepare() const noexcept { return {force, 1.0 / unloading}; }
};
using ConstantCutting = BasicConstantCutting<double>;

}  // namespace needleforce::laws
