// SPDX-License-Identifier: Apache-2.0
// One hypothesis on the texture: parameters by least squares whose residual is correlated along the depth.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "square_root.hpp"

namespace needleforce::online {

/// The contact of the intact layer: its modulus times what its power of the depth is above its law's, the
/// modulus, and that times the distance by which it began higher; then cutting force and friction per length
/// of each pierced layer, the deepest first.
namespace slot {
inline constexpr std::size_t power = 0, modulus = 1, shift = 2, cutting = 3, friction = 4;
}
inline constexpr std::size_t contact_slots = 3, slots = 19;
using Information = SquareRoot<slots>;
using Slots = Information::Row;

/// What the parameters of a contact contribute to a force.
using ContactSlots = std::array<double, contact_slots>;

/// A mean reading: what each parameter contributes to it, and those of a contact that begins later; the force
/// [N], the depth [m], the size [N] by which texture is measured there, and whether it continues the one
/// before.
struct Reading {
  Slots by{};
  ContactSlots late{};
  double force = 0.0, depth = 0.0, size = 1.0;
  bool continues = false;
};

/// The residual is an Ornstein-Uhlenbeck process in depth with this correlation length, of a size that is
/// learnt and forgotten; so the difference of two neighbours, less what is still correlated, is white.
struct TissueEstimate {
  double correlation_length = 1e-3;
  double holds_over = 1e9;  ///< travel over which the parameters of a layer hold [m]
  bool late = false;        ///< the contact with the next layer begins where the force shows it
  double doubt = 1.0;       ///< by which the standard deviations of the prior are multiplied
  double log_weight = 0.0;
  double scale = 1.0;  ///< variance of the residual over that of Reading::size
  double seen = 0.0;   ///< readings that were worth something for the scale
  Information information{};

  double kept(double travel) const noexcept { return std::exp(-std::abs(travel) / correlation_length); }

  /// Variance of the innovation over what was expected, and the weight of that. Wait-free.
  Innovation add(const Reading& now, const Reading& before, double memory) noexcept {
    const double travel = now.continues ? now.depth - before.depth : 0.0;
    const double rho = now.continues ? kept(travel) : 0.0;
    if (now.continues && travel > 0.0)
      information.forget_share(contact_slots + 2, std::exp(-0.5 * travel / holds_over));
    const double own = 1.0 / std::sqrt(scale * (1.0 - rho * rho));
    const double here = own / now.size, there = rho * own / before.size;
    Slots by{};
    for (std::size_t i = 0; i < information.size(); ++i) by[i] = here * now.by[i] - there * before.by[i];
    if (late)
      for (std::size_t i = 0; i < contact_slots; ++i) by[i] = here * now.late[i] - there * before.late[i];
    const Innovation found = information.add(by, here * now.force - there * before.force);
    log_weight = keeping * log_weight + std::log(own) - 0.5 * std::log(found.widening) -
                 0.5 * (freedom + 1.0) * std::log1p(found.squared / freedom);
    const double gain =
        std::max(1.0 / (seen + trust), 1.0 - std::exp(-std::abs(travel) / memory)) / found.widening;
    seen += 1.0 / found.widening;
    scale = std::clamp(scale * (1.0 + gain * (std::min(found.squared, largest) - 1.0)), 1e-12, 1e12);
    return found;
  }

 private:
  static constexpr double keeping = 0.99;  // of the weights: another texture is believed after some readings
  static constexpr double freedom = 5.0;   // of Student's t, whose tails a texture has
  static constexpr double trust = 5.0;     // readings that the scale at the start is worth
  static constexpr double largest = 16.0;  // square of an innovation that counts
};

}  // namespace needleforce::online
