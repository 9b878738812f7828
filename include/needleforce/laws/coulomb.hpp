// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>

#include "../law.hpp"

namespace needleforce::laws {

/// f = f' l s: Coulomb friction per embedded length l, with an elastic-slip state s in [-1, 1] that follows
/// the change of depth. Sliding gives s = +-1, the paper's law; at rest s keeps its value, so a hold keeps
/// its friction.
struct Coulomb {
  double per_length;
  double presliding;
  double dimple_ratio;

  static constexpr const char* name = "coulomb";
  static constexpr Family family = Family::friction;
  static constexpr const char* summary =
      "Coulomb friction per embedded length, reversing over a short elastic travel.";
  static constexpr const char* source = "eqs. (7)-(11); elastic-slip element after Dahl 1968";
  static constexpr const char* validity =
      "A straight needle: the paper sees it break down beyond 12 mm. No dependence on speed.";
  static constexpr std::array<Parameter<Coulomb>, 3> table{{
      {&Coulomb::per_length, "per_length", "N/m", 0.0, 1e5, required, "f'",
       "friction force per embedded length while sliding", "sec. 2.2"},
      {&Coulomb::presliding, "presliding", "m", 1e-9, 5e-2, 20e-6, "s_0",
       "travel that takes the friction from nothing to sliding", "Dahl 1968"},
      {&Coulomb::dimple_ratio, "dimple_ratio", "1", 0.0, 1.0, 0.0, "z_s/z_1",
       "share of the puncture depth at which the surface stays: 0 undeformed, 1 deformed", "sec. 2.4"},
  }};

  struct Prepared {
    double per_length;
    double per_travel;  // 1 / presliding [1/m]
    double dimple_ratio;
    double surface(double puncture_depth) const noexcept { return dimple_ratio * puncture_depth; }
    double sliding(double embedded) const noexcept { return per_length * embedded; }
    /// The element after a change of depth [m].
    double advance(double bristle, double travel) const noexcept {
      return std::clamp(bristle + travel * per_travel, -1.0, 1.0);
    }
    double force(double bristle, double embedded) const noexcept { return per_length * embedded * bristle; }
    double by_depth(double bristle, double embedded) const noexcept {
      if (embedded <= 0.0) return 0.0;
      const double turning = bristle > -1.0 && bristle < 1.0 ? per_length * embedded * per_travel : 0.0;
      return per_length * bristle + turning;
    }
  };
  Prepared prepare() const noexcept { return {per_length, 1.0 / presliding, dimple_ratio}; }
};

}  // namespace needleforce::laws
