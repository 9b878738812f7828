// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>

#include "../law.hpp"

namespace needleforce::laws {

/// No force at the tip: a hole that is there already, or a friction law that counts the tip itself.
struct NoCutting {
  static constexpr const char* name = "no_cutting";
  static constexpr Family family = Family::cutting;
  static constexpr bool monotone = true;
  static constexpr const char* summary = "No cutting force.";
  static constexpr const char* source = "by definition";
  static constexpr const char* validity =
      "An existing hole; friction laws that count the rupture themselves.";
  static constexpr std::array<Parameter<NoCutting>, 0> table{};

  struct Prepared {
    using Memory = NoMemory;
    double steady(double = 0.0) const noexcept { return 0.0; }
    void enter(Cut& cut, Memory&, double depth, double) const noexcept { cut.front = depth; }
    void advance(Cut& cut, Memory&, const Move& move) const noexcept {
      cut.front = std::max(cut.front, move.depth);
    }
    double forceless(const Cut&, double depth) const noexcept { return depth; }
    double force(const Cut&, const Memory&, double) const noexcept { return 0.0; }
    double by_depth(const Cut&, const Memory&, double) const noexcept { return 0.0; }
  };
  Prepared prepare() const noexcept { return {}; }
};

}  // namespace needleforce::laws
