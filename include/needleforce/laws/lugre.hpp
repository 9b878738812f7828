// SPDX-License-Identifier: Apache-2.0
#pragma once

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
template <class Real>
struct BasicLuGre {
  Real bristle_stiffness;
  Real bristle_damping;
  Real viscous;
  Real coulomb;
  Real static_friction;
  Real stribeck_speed;
  Real stribeck_exponent;

  static constexpr const char* name = "lugre";
  static constexpr Family family = Family::friction;
  static constexpr const char* summary =
      "LuGre bristle friction per embedded length, with the exact exponential step.";
  static constexpr const char* source =
      "Canudas de Wit et al. 1995; per embedded length after Asadian, Kermani & Patel 2012 (reconstruction)";
  static constexpr const char* validity =
      "Passive from velocity to force if sigma_2 >= sigma_1 (F_s - F_c) / F_c (Barabanov & Ortega 2000, "
      "unconfirmed).";
  static constexpr std::array<Parameter<BasicLuGre, Real>, 7> table{{
      {&BasicLuGre::bristle_stiffness, "bristle_stiffness", "N/m^2", 1.0, 1e12, required, "sigma_0",
       "stiffness of the bristles per length", "Canudas de Wit et al. 1995"},
      {&BasicLuGre::bristle_damping, "bristle_damping", "N s/m^2", 0.0, 1e7, 0.0, "sigma_1",
       "damping of the bristles per length", "Canudas de Wit et al. 1995"},
      {&BasicLuGre::viscous, "viscous", "N s/m^2", 0.0, 1e7, 0.0, "sigma_2", "viscous friction per length",
       "Canudas de Wit et al. 1995"},
      {&BasicLuGre::coulomb, "coulomb", "N/m", 1e-6, 1e5, required, "F_c",
       "friction per length while sliding fast, without its viscous part", "Canudas de Wit et al. 1995"},
      {&BasicLuGre::static_friction, "static_friction", "N/m", 1e-6, 1e5, required, "F_s",
       "friction per length at the onset of sliding", "Canudas de Wit et al. 1995"},
      {&BasicLuGre::stribeck_speed, "stribeck_speed", "m/s", 1e-9, 1.0, 1e-3, "v_s",
       "speed at which the friction falls from static to sliding", "Canudas de Wit et al. 1995"},
      {&BasicLuGre::stribeck_exponent, "stribeck_exponent", "1", 1.0, 2.0, 2.0, "gamma",
       "shape of that fall; 1 or 2 in the literature", "Canudas de Wit et al. 1995"},
  }};

  const char* contradiction() const noexcept {
    return static_friction < coulomb ? "static_friction is below coulomb: the friction would rise with speed"
                                     : nullptr;
  }
  /// Why an insertion with it could return more energy than it received; null if it cannot.
  const char* returns_energy() const noexcept {
    if (viscous >= min_passive_viscous()) return nullptr;
    return "below bristle_damping (static_friction - coulomb) / coulomb: the bristles' damping would return "
           "energy";
  }
  /// Smallest sigma_2 [N s/m^2] with which velocity to force is passive (Barabanov & Ortega 2000,
  /// unconfirmed).
  Real min_passive_viscous() const noexcept {
    return bristle_damping * (static_friction - coulomb) / coulomb;
  }

  /// Mean deflection [m] of the bristles after `dt` [s] at a constant velocity [m/s].
  Real deflected(Real deflection, double velocity, Real dt) const noexcept;
  /// Friction per length [N/m] at a deflection [m] and a velocity [m/s].
  Real traction(Real deflection, double velocity) const noexcept;

  struct Prepared;
  Prepared prepare() const noexcept;
};
using LuGre = BasicLuGre<double>;

/// What follows from a motion alone, of a velocity [m/s] and a travel [m], if there is a limit.
template <class Real>
struct BasicBristleMotion {
  double velocity = 0.0;
  Real travel = 0.0;
  Real limit = 0.0;      ///< g(v) [N/m]
  Real per_limit = 0.0;  ///< 1 / g(v) [m/N]
  Real weakening = 0.0;  ///< dg/dv [N s/m^2]
  Real left = 1.0;       ///< share of the deflection that the travel leaves
};

template <class Real>
struct BasicLuGre<Real>::Prepared {
  struct Memory {
    Real elastic = 0.0;    ///< sigma_0 zeta [N/m]
    Real traction = 0.0;   ///< force per embedded length [N/m]
    Real slipped = 0.0;    ///< travel of the last step that did not bend the bristles [m]
    Real limit = 0.0;      ///< g(v) of this step [N/m]
    Real per_limit = 0.0;  ///< 1 / g(v) [m/N]
    Real left = 1.0;       ///< share of the deflection that the travel leaves
    BasicBristleMotion<Real> found{};

    Real held() const noexcept { return traction; }
    void take_over(const BasicTakenOver<Real>& taken) noexcept { elastic = traction = taken.held; }
    void thin(Real share) noexcept { elastic *= share; }
    void release() noexcept { elastic = traction = 0.0; }
  };

  static constexpr double rounding = 1e-11;  // of a motion, relative

  BasicLuGre<Real> law;
  Real per_speed, compliance;  // 1 / v_s [s/m], 1 / sigma_0 [m^2/N]

  /// A number with derivatives takes the power: it has one by the exponent too.
  bool square() const noexcept { return is_plain<Real> && law.stribeck_exponent == 2.0; }
  Real fall(double v) const noexcept {
    const Real ratio = abs(v) * per_speed;
    return exp(-(square() ? ratio * ratio : pow(ratio, law.stribeck_exponent)));
  }
  /// g(v) [N/m], and dg/dv [N s/m^2], for all that follows.
  void find_limit(BasicBristleMotion<Real>& found, double v) const noexcept {
    found.velocity = v;
    const Real weaker = (law.static_friction - law.coulomb) * fall(v);
    const Real ratio = abs(v) * per_speed;
    const Real steep = square() ? ratio : pow(ratio, law.stribeck_exponent - 1.0);
    found.limit = law.coulomb + weaker;
    found.per_limit = 1.0 / found.limit;
    // far above v_s the product would be 0 times infinity
    found.weakening = weaker > 0.0 ? copysign(law.stribeck_exponent * steep * weaker * per_speed, -v) : 0.0;
  }
  void find_left(BasicBristleMotion<Real>& found, Real travel) const noexcept {
    found.travel = travel;
    found.left = exp(-exponent(travel, found.per_limit));
  }
  Real exponent(Real travel, Real per_limit) const noexcept {
    return law.bristle_stiffness * abs(travel) * per_limit;
  }
  /// The exponentials of a step, which depend on its motion alone: an insertion finds those of all layers
  /// before the first shaft moves, so that they do not wait for each other. Of a motion that differs from the
  /// one before by its rounding they follow to first order, without an error.
  void look_ahead(Memory& memory, double v, Real travel) const noexcept {
    BasicBristleMotion<Real>& found = memory.found;
    if (is_plain<Real> && found.velocity == v && found.travel == travel && looked(memory))
      return take(memory);
    const double faster = v - found.velocity;
    if (!(looked(memory) && abs(faster) <= rounding * abs(found.velocity)))
      return look_anew(memory, v, travel);
    memory.limit = found.limit + found.weakening * faster;
    memory.per_limit = found.per_limit * (2.0 - memory.limit * found.per_limit);
    const Real more = exponent(travel, memory.per_limit) - exponent(found.travel, found.per_limit);
    if (!(abs(more) <= rounding)) return look_anew(memory, v, travel);
    memory.left = found.left - found.left * more;
  }
  [[gnu::noinline]] void look_anew(Memory& memory, double v, Real travel) const noexcept {
    find_limit(memory.found, v);
    find_left(memory.found, travel);
    take(memory);
  }
  static void take(Memory& memory) noexcept {
    memory.limit = memory.found.limit;
    memory.per_limit = memory.found.per_limit;
    memory.left = memory.found.left;
  }
  static bool looked(const Memory& memory) noexcept { return memory.found.limit > 0.0; }
  /// Of a memory that comes from elsewhere nothing is believed that follows from its motion.
  void look_again(Memory& memory) const noexcept {
    look_anew(memory, memory.found.velocity, memory.found.travel);
  }
  Real surface(Real top, Real) const noexcept { return top; }
  Real sliding(Real embedded, double v) const noexcept {
    const Real limit = law.coulomb + (law.static_friction - law.coulomb) * fall(v);
    return embedded * (copysign(limit, v) + law.viscous * v);
  }
  /// Remaining share of the bristles' deflection to sliding at velocity v: 1 - sigma_0 zeta sgn(v) / g(v).
  Real remaining(const Memory& memory, double v) const noexcept {
    return 1.0 - copysign(memory.elastic, v * memory.elastic) * memory.per_limit;
  }
  /// The elastic part [N/m] after the travel.
  Real dragged(const Memory& memory, Real travel) const noexcept {
    const Real slides = copysign(memory.limit, travel);
    return slides + (memory.elastic - slides) * memory.left;
  }
  [[gnu::always_inline]] void advance(BasicShaft<Real>& shaft, Memory& memory, const BasicMove<Real>& move,
                                      const BasicLayerExtent<Real>& extent,
                                      const BasicRelaxing<Real>&) const noexcept {
    shaft.embed(extent, move.depth, extent.top);
    const Real largest = law.static_friction;
    const auto [low, high] = shaft.limits(extent, law.bristle_stiffness, -largest, largest);
    if (!extent.pierced) return memory.release();  // nothing bends the bristles, and no exponential is needed
    look_ahead(memory, move.velocity, move.below);
    const Real before = memory.elastic;
    memory.elastic = bounded(dragged(memory, move.below), low, high);
    memory.slipped = move.below - (memory.elastic - before) * compliance;
    memory.traction = traction(memory, move.velocity);
  }
  void pierce(Memory& memory, const BasicContactAtPuncture<Real>& contact) const noexcept {
    const Real length = embedded_length(contact.depth, contact.extent.top);
    memory.elastic = traction_at_puncture(contact, length, law.bristle_stiffness, law.coulomb);
  }
  /// Bristles loaded by another law or by other parameters hold no more than static friction.
  void adopt(Memory& memory) const noexcept {
    memory.elastic = bounded(memory.elastic, -law.static_friction, law.static_friction);
    memory.found.limit = 0.0;  // was that of another law
  }
  Real traction(const Memory& memory, double v) const noexcept {
    return memory.elastic + (law.bristle_damping * remaining(memory, v) + law.viscous) * v;
  }
  Real force(const BasicShaft<Real>& shaft, const Memory& memory, Real) const noexcept {
    return memory.traction * shaft.embedded;
  }
  Real by_depth(const BasicShaft<Real>& shaft, const Memory& memory, double v) const noexcept {
    // bristles that bend further damp less: d(dzeta/dt)/dzeta = -sigma_0 |v| / g
    const Real bending = law.bristle_stiffness * (1.0 - law.bristle_damping * abs(v) * memory.per_limit);
    return memory.traction * shaft.embedded_by_depth + bending * remaining(memory, v) * shaft.embedded;
  }
  BasicSlip<Real> slip(const BasicShaft<Real>& shaft, const Memory& memory) const noexcept {
    return slip_along(shaft, memory.elastic, memory.slipped, law.bristle_stiffness);
  }
  Real by_velocity(const BasicShaft<Real>& shaft, const Memory& memory, double v) const noexcept {
    const Real left = remaining(memory, v);
    const Real weakened = (1.0 - left) * v * memory.found.weakening * memory.per_limit;
    return (law.bristle_damping * (left + weakened) + law.viscous) * shaft.embedded;
  }
};

template <class Real>
inline typename BasicLuGre<Real>::Prepared BasicLuGre<Real>::prepare() const noexcept {
  return {*this, 1.0 / stribeck_speed, 1.0 / bristle_stiffness};
}

template <class Real>
inline Real BasicLuGre<Real>::deflected(Real deflection, double velocity, Real dt) const noexcept {
  typename Prepared::Memory memory;
  memory.elastic = bristle_stiffness * deflection;
  prepare().look_ahead(memory, velocity, velocity * dt);
  return prepare().dragged(memory, velocity * dt) / bristle_stiffness;
}

template <class Real>
inline Real BasicLuGre<Real>::traction(Real deflection, double velocity) const noexcept {
  typename Prepared::Memory memory;
  memory.elastic = bristle_stiffness * deflection;
  prepare().look_ahead(memory, velocity, 0.0);
  return prepare().traction(memory, velocity);
}

}  // namespace needleforce::laws
