// SPDX-License-Identifier: Apache-2.0
// Sneddon's contact of a tip with an elastic half-space, and its saturation at the shank.
#pragma once

#include <algorithm>
#include <limits>

#include "sneddon.hpp"

namespace needleforce {

/// One state of contact: depth of the apex [m], contact radius [m], force [N], stored elastic energy [J].
struct Contact {
  double depth;
  double contact_radius;
  double force;
  double energy;
};

/// No shank: an infinite tip, as the paper's eq. (6) assumes.
inline constexpr double no_shank = std::numeric_limits<double>::infinity();

/// The radius [m] where the contact of `tip` on a shank stops growing: the shank's, or where the tip ends.
template <class TipShape>
double saturation_radius(const TipShape& tip, double shank_radius) noexcept {
  return std::min(shank_radius, sneddon::last_radius(tip));
}

namespace detail {

/// Depth and force over reduced modulus at contact radius a, in one quadrature where there is one.
template <class TipShape>
sneddon::Touch touch(const TipShape& tip, double a) noexcept {
  if constexpr (requires { tip.touch(a); })
    return tip.touch(a);
  else
    return {tip.depth(a), tip.force(a)};
}

}  // namespace detail

/// Contact radius [m] and force over reduced modulus [m^2].
struct Reach {
  double contact_radius;
  double force;
};

/// The contact at depth h > 0 without its energy. Beyond the depth at which the contact radius reaches
/// `limit`, of saturation_radius(), it stays there, and dF/dh = 2 E_r a (Galin's form with a fixed edge).
/// Wait-free.
template <class TipShape>
Reach reach_at_depth(const TipShape& tip, double h, double limit) noexcept {
  const double a = std::min(tip.contact_radius(h), limit);
  const sneddon::Touch edge = detail::touch(tip, a);
  // before saturation h is edge.depth but for what the last digit of a leaves, much of it near a tangent end
  return {a, edge.force + 2.0 * a * (h - edge.depth)};
}

/// Contact of `tip` at contact radius a [m] within the tip, for a reduced modulus [Pa].
template <class TipShape>
Contact contact_at_radius(const TipShape& tip, double a, double reduced_modulus) noexcept {
  const sneddon::Touch edge = detail::touch(tip, a);
  return {edge.depth, a, reduced_modulus * edge.force, reduced_modulus * tip.energy(a)};
}

/// Contact of `tip` at depth h [m]; h <= 0 is no contact. The contact stops growing where the shank or the
/// end of the tip is reached: a flat face saturates from the start. Wait-free.
template <class TipShape>
Contact contact_at_depth(const TipShape& tip, double h, double reduced_modulus,
                         double shank_radius = no_shank) noexcept {
  if (!(h > 0.0)) return {h, 0.0, 0.0, 0.0};
  const double a = std::min(tip.contact_radius(h), saturation_radius(tip, shank_radius));
  const sneddon::Touch edge = detail::touch(tip, a);
  const double beyond = h - edge.depth;
  const double energy = tip.energy(a) + beyond * (edge.force + a * beyond);
  return {h, a, reduced_modulus * (edge.force + 2.0 * a * beyond), reduced_modulus * energy};
}

/// Contact pressure [Pa] at radius r [m] of a contact with depth h and radius a. To 1e-8, for pictures.
template <class TipShape>
double contact_pressure(const TipShape& tip, double h, double a, double reduced_modulus, double r) noexcept {
  return reduced_modulus * sneddon::pressure(tip, h, a, r);
}

}  // namespace needleforce
