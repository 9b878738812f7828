// SPDX-License-Identifier: Apache-2.0
// A friction law for the test of the places for a new law: it has a memory of its own.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "../law.hpp"

namespace needleforce::laws {

/// t' = f' / s_g v, between -f' and f': traction of a grip that slides at its limit.
struct ElasticGrip {
  double per_length;
  double grip_travel;

  static constexpr const char* name = "elastic_grip";
  static constexpr Family family = Family::friction;
  static constexpr const char* summary = "Friction per embedded length with an elastic grip.";
  static constexpr const char* source = "Test law 2026, eq. (1)";
  static constexpr const char* validity = "Tests.";
  static constexpr std::array<Parameter<ElasticGrip>, 2> table{{
      {&ElasticGrip::per_length, "per_length", "N/m", 0.0, 1e5, required, "f'",
       "friction force per embedded length while sliding", "Test law 2026"},
      {&ElasticGrip::grip_travel, "grip_travel", "m", 1e-9, 5e-2, 20e-6, "s_g",
       "travel over which the grip is loaded", "Test law 2026"},
  }};

  struct Prepared {
    struct Memory {
      double traction = 0.0;  ///< [N/m]
      bool sticks = true;

      double held() const noexcept { return traction; }
      void take_over(const TakenOver& taken) noexcept { traction = taken.held; }
    };

    double per_length;
    double stiffness;  // of the grip per length [N/m^2]
    double surface(double top, double) const noexcept { return top; }
    double sliding(double embedded, double v) const noexcept {
      return std::copysign(per_length, v) * embedded;
    }
    void advance(Shaft& shaft, Memory& memory, const Move& move, const LayerExtent& extent,
                 const Relaxing&) const noexcept {
      const double loaded = memory.traction + stiffness * move.below;
      memory.traction = std::clamp(loaded, -per_length, per_length);
      memory.sticks = std::abs(memory.traction) < per_length;
      shaft.embed(extent, move.depth, extent.top);
    }
    void pierce(Memory&, const ContactAtPuncture&) const noexcept {}
    double force(const Shaft& shaft, const Memory& memory, double) const noexcept {
      return memory.traction * shaft.embedded;
    }
    double by_depth(const Shaft& shaft, const Memory& memory, double) const noexcept {
      return memory.traction * shaft.embedded_by_depth + (memory.sticks ? stiffness * shaft.embedded : 0.0);
    }
    double by_velocity(const Shaft&, const Memory&, double) const noexcept { return 0.0; }
  };
  Prepared prepare() const noexcept { return {per_length, per_length / grip_travel}; }
};

}  // namespace needleforce::laws
