// SPDX-License-Identifier: Apache-2.0
// The layered law as the identifier has it: what each parameter contributes to the force at a depth.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "../laws/tip_contact.hpp"
#include "online_prior.hpp"
#include "tissue_estimate.hpp"

namespace needleforce::online {

/// Layers as far as they are pierced. Inwards: contact of the intact one, cutting force of the last pierced,
/// and friction along the shaft in each; outwards friction alone, of the opposite sign.
class LayeredForce {
 public:
  explicit LayeredForce(const OnlinePrior& prior) noexcept
      : contact_(laws::TipContact{1.0, prior.radius, prior.tip}.prepare()) {}

  std::array<double, most_layers> tops{};  ///< of the pierced layers, and of the first [m]
  std::size_t pierced = 0;
  double intact_from = 0.0;  ///< where the tip met the layer that is intact [m]
  bool outwards = false;
  bool zero_moved = false;  ///< before the first puncture

  const laws::TipContact::Prepared& contact() const noexcept { return contact_; }
  /// Whether an intact layer may be under the tip.
  bool another(const OnlinePrior& prior) const noexcept {
    return pierced < most_layers &&
           (prior.layers == 0 || pierced < prior.layers || prior.layer[pierced].modulus.known());
  }
  /// Where the contact of the intact layer begins [m].
  double contact_from(const OnlinePrior& prior) const noexcept {
    if (pierced == 0) return tops[0];
    const Expected& top = prior.layer[std::min(pierced, most_layers - 1)].top;
    return top.known() ? tops[0] + top.mean : intact_from;
  }
  Slots by_parameters(const OnlinePrior& prior, double depth) const noexcept {
    Slots by{};
    if (!outwards && (pierced == 0 || another(prior))) {
      const double h = depth - contact_from(prior);
      if (h > 0.0) {
        by[slot::modulus] = contact_.force(h);
        by[slot::stiffening] = by[slot::modulus] * h;
        if (pierced == 0) by[slot::shift] = contact_.slope(h);
      }
    }
    if (pierced == 0) {
      by[slot::cutting] = zero_moved ? 1.0 : 0.0;
      return by;
    }
    if (!outwards) by[slot::cutting] = 1.0;
    const double sign = outwards ? -1.0 : 1.0;
    double bottom = depth;
    for (std::size_t j = pierced; j-- > 0;) {
      by[slot::friction + 2 * (pierced - 1 - j)] = sign * std::max(bottom - tops[j], 0.0);
      bottom = std::min(bottom, tops[j]);
    }
    return by;
  }

 private:
  laws::TipContact::Prepared contact_;
};

}  // namespace needleforce::online
