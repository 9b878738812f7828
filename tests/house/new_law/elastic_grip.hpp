// SPDX-License-Identifier: Apache-2.0
// A friction law for the test of the places for a new law: it has a memory of its own.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "../law.hpp"

namespace needleforce::laws {

/// t' = f' / s_g v, between -f' and f': traction of a grip that slides at its limit.
template <class Real>
struct BasicElasticGrip {
  Real per_length;
  Real grip_travel;

  static constexpr const char* name = "elastic_grip";
  static constexpr Family family = Family::friction;
  static constexpr const char* summary = "Friction per embedded length with an elastic grip.";
  static constexpr const char* source = "Test law 2026, eq. (1)";
  static constexpr const char* validity = "Tests.";
  static constexpr std::array<Parameter<BasicElasticGrip, Real>, 2> table{{
      {&BasicElasticGrip::per_length, "per_length", "N/m", 0.0, 1e5, required, "f'",
       "friction force per embedded length while sliding", "Test law 2026"},
      {&BasicElasticGrip::grip_travel, "grip_travel", "m", 1e-9, 5e-2, 20e-6, "s_g",
       "travel over which the grip is loaded", "Test law 2026"},
  }};

  struct Prepared {
    struct Memory {
      Real traction = 0.0;  ///< [N/m]
      bool sticks = true;

      Real held() const noexcept { return traction; }
      void take_over(const BasicTakenOver<Real>& taken) noexcept { traction = taken.held; }
    };

    Real per_length;
    Real stiffness;  // of the grip per length [N/m^2]
    Real surface(Real top, Real) const noexcept { return top; }
    Real sliding(Real embedded, double v) const noexcept { return copysign(per_length, v) * embedded; }
    void advance(BasicShaft<Real>& shaft, Memory& memory, const BasicMove<Real>& move,
                 const BasicLayerExtent<Real>& extent, const BasicRelaxing<Real>&) const noexcept {
      const Real loaded = memory.traction + stiffness * move.below;
      memory.traction = bounded(loaded, -per_length, per_length);
      memory.sticks = abs(memory.traction) < per_length;
      shaft.embed(extent, move.depth, extent.top);
    }
    void pierce(Memory&, const BasicContactAtPuncture<Real>&) const noexcept {}
    Real force(const BasicShaft<Real>& shaft, const Memory& memory, Real) const noexcept {
      return memory.traction * shaft.embedded;
    }
    Real by_depth(const BasicShaft<Real>& shaft, const Memory& memory, Real) const noexcept {
      return memory.traction * shaft.embedded_by_depth + (memory.sticks ? stiffness * shaft.embedded : 0.0);
    }
    Real by_velocity(const BasicShaft<Real>&, const Memory&, Real) const noexcept { return 0.0; }
  };
  Prepared prepare() const noexcept { return {per_length, per_length / grip_travel}; }
};
using ElasticGrip = BasicElasticGrip<double>;

}  // namespace needleforce::laws
