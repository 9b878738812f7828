// SPDX-License-Identifier: Apache-2.0
// Sneddon's contact of a tip with an elastic half-space, and its saturation at the shank.
#pragma once

#include <limits>

namespace needleforce {

/// One state of contact: depth of the apex [m], contact radius [m], force [N], stored elastic energy [J].
struct Contact {
  double depth;
  double contact_radius;
  double force;
  double energy;
};

/// No shank: the tip goes on for ever, as the paper's eq. (6) assumes.
inline constexpr double no_shank = std::numeric_limits<double>::infinity();

/// Contact of `tip` at contact radius a [m] within the tip, for a reduced modulus [Pa].
template <class TipShape>
Contact contact_at_radius(const TipShape& tip, double a, double reduced_modulus) noexcept {
  return {tip.depth(a), a, reduced_modulus * tip.force(a), reduced_modulus * tip.energy(a)};
}

/// Contact of `tip` at depth h [m]; h <= 0 is no contact. Beyond the depth at which the contact radius
/// reaches `shank_radius` it stays there, and dF/dh = 2 E_r R (Galin's form with a fixed edge). Wait-free.
template <class TipShape>
Contact contact_at_depth(const TipShape& tip, double h, double reduced_modulus,
                         double shank_radius = no_shank) noexcept {
  if (!(h > 0.0)) return {h, 0.0, 0.0, 0.0};
  const double a = tip.contact_radius(h);
  if (a <= shank_radius) {
    Contact within = contact_at_radius(tip, a, reduced_modulus);
    within.depth = h;
    return within;
  }
  const Contact edge = contact_at_radius(tip, shank_radius, reduced_modulus);
  const double beyond = h - edge.depth;
  const double slope = 2.0 * reduced_modulus * shank_radius;
  return {h, shank_radius, edge.force + slope * beyond,
          edge.energy + edge.force * beyond + 0.5 * slope * beyond * beyond};
}

}  // namespace needleforce
