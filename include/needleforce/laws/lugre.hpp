// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "../law.hpp"

namespace needleforce::laws {

/// LuGre friction per embedded length, bristles of mean deflection zeta:
///
///     dzeta/dt = v - sigma_0 |v| zeta / g(v)      f = sigma_0 zeta + sigma_1 dzeta/dt + sigma_2 v
///     g(v) = F_c + (F_s - F_c) exp(-|v / v_s|^gamma)
///
/// stepped exactly for constant velocity; the bristles follow the change of depth, the rates the velocity.
/// With F_s = F_c and sigma_1 = 0 it is Dahl's law with a viscous part.
struct LuGre {
  double bristle_stiffness;
  double bristle_damping;
  double viscous;
  double coulomb;
  double static_friction;
  double stribeck_speed;
  double stribeck_exponent;

  static constexpr const char* name = "lugre";
  static constexpr Family family = Family::friction;
  static constexpr const char* summary =
      "LuGre bristle friction per embedded length, with the exact exponential step.";
  static constexpr const char* source =
      "Canudas de Wit et al. 1995; per embedded length after Asadian, Kermani & Patel 2012 (reconstruction)";
  static constexpr const char* validity =
      "Passive from velocity to force if sigma_2 >= sigma_1 (F_s - F_c) / F_c (Barabanov & Ortega 2000, "
      "unconfirmed).";
  static constexpr std::array<Parameter<LuGre>, 7> table{{
      {&LuGre::bristle_stiffness, "bristle_stiffness", "N/m^2", 1.0, 1e12, required, "sigma_0",
       "stiffness of the bristles per length", "Canudas de Wit et al. 1995"},
      {&LuGre::bristle_damping, "bristle_damping", "N s/m^2", 0.0, 1e7, 0.0, "sigma_1",
       "damping of the bristles per length", "Canudas de Wit et al. 1995"},
      {&LuGre::viscous, "viscous", "N s/m^2", 0.0, 1e7, 0.0, "sigma_2", "viscous friction per length",
       "Canudas de Wit et al. 1995"},
      {&LuGre::coulomb, "coulomb", "N/m", 1e-6, 1e5, required, "F_c",
       "friction per length while sliding fast, without its viscous part", "Canudas de Wit et al. 1995"},
      {&LuGre::static_friction, "static_friction", "N/m", 1e-6, 1e5, required, "F_s",
       "friction per length at the onset of sliding", "Canudas de Wit et al. 1995"},
      {&LuGre::stribeck_speed, "stribeck_speed", "m/s", 1e-9, 1.0, 1e-3, "v_s",
       "speed at which the friction falls from static to sliding", "Canudas de Wit et al. 1995"},
      {&LuGre::stribeck_exponent, "stribeck_exponent", "1", 1.0, 2.0, 2.0, "gamma",
       "shape of that fall; 1 or 2 in the literature", "Canudas de Wit et al. 1995"},
  }};

  const char* contradiction() const noexcept {
    return static_friction < coulomb ? "static_friction is below coulomb: the friction would rise with speed"
                                     : nullptr;
  }
  /// Least sigma_2 [N s/m^2] with which velocity to force is passive (Barabanov & Ortega 2000, unconfirmed).
  double min_passive_viscous() const noexcept {
    return bristle_damping * (static_friction - coulomb) / coulomb;
  }

  /// Mean deflection [m] of the bristles after `dt` [s] at a constant velocity [m/s].
  double deflected(double deflection, double velocity, double dt) const noexcept;
  /// Friction per length [N/m] at a deflection [m] and a velocity [m/s].
  double traction(double deflection, double velocity) const noexcept;

  struct Prepared;
  Prepared prepare() const noexcept;
};

struct LuGre::Prepared {
  LuGre law;

  double fall(double v) const noexcept {
    const double ratio = std::abs(v) / law.stribeck_speed;
    return std::exp(-(law.stribeck_exponent == 2.0 ? ratio * ratio : std::pow(ratio, law.stribeck_exponent)));
  }
  /// g(v) [N/m], and dg/dv [N s/m^2], once a step: all that follows needs them.
  void find_limit(Shaft& shaft, double v) const noexcept {
    const double weaker = (law.static_friction - law.coulomb) * fall(v);
    const double ratio = std::abs(v) / law.stribeck_speed;
    const double steep = law.stribeck_exponent == 2.0 ? ratio : std::pow(ratio, law.stribeck_exponent - 1.0);
    shaft.limit = law.coulomb + weaker;
    // far beyond v_s the product is 0 times infinity
    shaft.weakening =
        weaker > 0.0 ? std::copysign(law.stribeck_exponent * steep * weaker / law.stribeck_speed, -v) : 0.0;
  }
  double surface(double top, double) const noexcept { return top; }
  double sliding(double embedded, double v) const noexcept {
    const double limit = law.coulomb + (law.static_friction - law.coulomb) * fall(v);
    return embedded * (std::copysign(limit, v) + law.viscous * v);
  }
  /// What is left of the bristles' way to sliding at velocity v: 1 - sigma_0 zeta sgn(v) / g(v).
  double remaining(const Shaft& shaft, double v) const noexcept {
    return 1.0 - std::copysign(shaft.element.elastic, v * shaft.element.elastic) / shaft.limit;
  }
  /// The elastic part [N/m] after a travel [m].
  double dragged(const Shaft& shaft, double travel) const noexcept {
    const double slides = std::copysign(shaft.limit, travel);
    const double left = std::exp(-law.bristle_stiffness * std::abs(travel) / shaft.limit);
    return slides + (shaft.element.elastic - slides) * left;
  }
  [[gnu::noinline]] void advance(Shaft& shaft, const Move& move, const LayerExtent& bed,
                                 const Relaxing&) const noexcept {
    find_limit(shaft, move.velocity);
    shaft.element.elastic = dragged(shaft, move.below);
    shaft.traction = traction(shaft, move.velocity);
    shaft.embed(bed, move.depth, bed.top);
  }
  void pierce(Shaft&, const ContactAtPuncture&) const noexcept {}
  /// Bristles that another law or other numbers bent hold no more than these.
  void adopt(Shaft& shaft) const noexcept {
    shaft.element.elastic = std::clamp(shaft.element.elastic, -law.static_friction, law.static_friction);
  }
  double traction(const Shaft& shaft, double v) const noexcept {
    return shaft.element.elastic + (law.bristle_damping * remaining(shaft, v) + law.viscous) * v;
  }
  double force(const Shaft& shaft, double) const noexcept { return shaft.traction * shaft.embedded; }
  double by_depth(const Shaft& shaft, double v) const noexcept {
    // bristles that bend on damp less: d(dzeta/dt)/dzeta = -sigma_0 |v| / g
    const double bending = law.bristle_stiffness * (1.0 - law.bristle_damping * std::abs(v) / shaft.limit);
    return shaft.traction * shaft.embedded_by_depth + bending * remaining(shaft, v) * shaft.embedded;
  }
  double by_velocity(const Shaft& shaft, double v) const noexcept {
    const double left = remaining(shaft, v);
    const double weakened = (1.0 - left) * v * shaft.weakening / shaft.limit;
    return (law.bristle_damping * (left + weakened) + law.viscous) * shaft.embedded;
  }
};

inline LuGre::Prepared LuGre::prepare() const noexcept { return {*this}; }

inline double LuGre::deflected(double deflection, double velocity, double dt) const noexcept {
  Shaft shaft;
  shaft.element.elastic = bristle_stiffness * deflection;
  prepare().find_limit(shaft, velocity);
  return prepare().dragged(shaft, velocity * dt) / bristle_stiffness;
}

inline double LuGre::traction(double deflection, double velocity) const noexcept {
  Shaft shaft;
  shaft.element.elastic = bristle_stiffness * deflection;
  prepare().find_limit(shaft, velocity);
  return prepare().traction(shaft, velocity);
}

}  // namespace needleforce::laws
