// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>

#include "../law.hpp"

namespace needleforce::laws {

/// A constant force while the tip is at the deepest cut; it unloads elastically as the tip recedes and loads
/// again on return, so noise at rest never switches it on and off and an existing hole is not cut
/// again.
struct ConstantCutting {
  double force;
  double unloading;

  static constexpr const char* name = "constant_cutting";
  static constexpr Family family = Family::cutting;
  static constexpr bool monotone = true;
  static constexpr bool cuts = true;
  static constexpr const char* summary = "Constant cutting force at the deepest cut.";
  static constexpr const char* source = "sec. 2.3";
  static constexpr const char* validity =
      "Steady cutting: at 1 mm/s the force in the paper oscillates between 0.04 and 0.1 N.";
  static constexpr std::array<Parameter<ConstantCutting>, 2> table{{
      {&ConstantCutting::force, "force", "N", 0.0, 1e3, required, "f_c",
       "cutting force while the tip advances in fresh tissue", "sec. 2.3"},
      {&ConstantCutting::unloading, "unloading", "m", 1e-9, 5e-2, 20e-6, "s_c",
       "travel away from the deepest cut over which the force falls to zero", "free: elastic unloading"},
  }};

  struct Prepared {
    using Memory = NoMemory;
    double full;        // the force at the deepest cut [N]
    double per_travel;  // 1 / unloading [1/m]
    double steady(double = 0.0) const noexcept { return full; }
    void enter(Cut& cut, Memory&, double depth, double) const noexcept { cut.front = depth; }
    void advance(Cut& cut, Memory&, const Move& move) const noexcept {
      cut.front = std::max(cut.front, move.depth);
    }
    /// Where the front may be of a tip at a depth that presses no more [m].
    double forceless(const Cut& cut, double depth) const noexcept {
      return depth + cut.held + 1.0 / per_travel;
    }
    /// The share of the force that is left `cut.front - depth` behind the deepest cut.
    double loaded(const Cut& cut, double depth) const noexcept {
      return std::max(0.0, 1.0 - std::max(0.0, cut.front - cut.held - depth) * per_travel);
    }
    double force(const Cut& cut, const Memory&, double depth) const noexcept {
      return full * loaded(cut, depth);
    }
    double by_depth(const Cut& cut, const Memory&, double depth) const noexcept {
      return depth < cut.front - cut.held && loaded(cut, depth) > 0.0 ? full * per_travel : 0.0;
    }
  };
  Prepared prepare() const noexcept { return {force, 1.0 / unloading}; }
};

}  // namespace needleforce::laws
