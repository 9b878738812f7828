// SPDX-License-Identifier: Apache-2.0
// The layered law as the identifier has it: what each parameter contributes to the force at a depth.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "../laws/tip_contact.hpp"
#include "../state_check.hpp"
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
  std::array<double, most_layers> whole_from{}, whole_to{};  ///< between these a pierced layer began [m]
  double intact_from = 0.0;    ///< where the tip may have met the layer that is intact [m]
  double late_from = nowhere;  ///< where the force showed that it did [m]
  bool outwards = false;
  bool zero_moved = false;  ///< before the first puncture
  static constexpr double nowhere = 1e9;

  /// Depth of the contact at which its modulus is that of the law, whatever its power [m].
  static constexpr double unit_depth = 1e-3;

  const laws::TipContact::Prepared& contact() const noexcept { return contact_; }
  void take_contact(const LayeredForce& other) noexcept { contact_ = other.contact_; }
  void begin() noexcept {
    tops = whole_from = {};
    pierced = 0;
    intact_from = 0.0;
    late_from = nowhere;
    outwards = zero_moved = false;
  }
  /// Where the layer whose puncture was here began: where the force showed it, or half way.
  double pierce(double depth) noexcept {
    const bool shown = late_from < depth;
    whole_from[pierced] = shown ? std::max(intact_from, late_from - shown_within) : intact_from;
    whole_to[pierced] = shown ? std::min(depth, late_from + shown_within) : depth;
    return tops[pierced] = 0.5 * (whole_from[pierced] + whole_to[pierced]);
  }
  /// The layer is pierced, and the tip may meet the next one from here on.
  void next(double from) noexcept {
    ++pierced;
    intact_from = from;
    late_from = nowhere;
  }
  /// Whether the tip is between two layers, where either may hold the shaft.
  bool between_layers(double depth) const noexcept {
    for (std::size_t k = 1; k < pierced; ++k)
      if (depth > whole_from[k] && depth < whole_to[k]) return true;
    return false;
  }
  /// Whether an intact layer may be under the tip.
  bool another(const OnlinePrior& prior) const noexcept {
    return pierced < most_layers &&
           (prior.layers == 0 || pierced < prior.layers || prior.layer[pierced].modulus.known());
  }
  /// Whether it is known where the intact layer begins.
  bool top_known(const OnlinePrior& prior) const noexcept {
    return pierced == 0 || prior.layer[std::min(pierced, most_layers - 1)].top.known();
  }
  /// Where the contact of the intact layer begins [m].
  double contact_from(const OnlinePrior& prior) const noexcept {
    if (pierced == 0) return tops[0];
    const Expected& top = prior.layer[std::min(pierced, most_layers - 1)].top;
    return top.known() ? tops[0] + top.mean : intact_from;
  }
  /// Where the force showed a contact, or the tip may have met the intact layer [m].
  double contact_since() const noexcept { return late_from < nowhere ? late_from : intact_from; }
  /// What a contact from there contributes, if there is an intact layer.
  ContactSlots of_contact(const OnlinePrior& prior, double from, double depth) const noexcept {
    const double h = depth - from;
    if (outwards || !(h > 0.0) || !(pierced == 0 || another(prior))) return {};
    const double force = contact_.force(h);
    return {force * std::log(h / unit_depth), force, contact_.slope(h)};
  }
  ContactSlots of_late_contact(const OnlinePrior& prior, double depth) const noexcept {
    return of_contact(prior, pierced == 0 ? tops[0] : late_from, depth);
  }
  Slots by_parameters(const OnlinePrior& prior, double depth) const noexcept {
    Slots by{};
    const ContactSlots contact = of_contact(prior, contact_from(prior), depth);
    std::copy(contact.begin(), contact.end(), by.begin());
    if (pierced == 0) {
      by[slot::cutting] = zero_moved ? 1.0 : 0.0;
      return by;
    }
    if (outwards)
      by[slot::shift] = -1.0;  // where the first layer begins is not exactly known
    else
      by[slot::cutting] = 1.0;
    const double sign = outwards ? -1.0 : 1.0;
    double bottom = depth;
    for (std::size_t j = pierced; j-- > 0;) {
      by[slot::friction + 2 * (pierced - 1 - j)] = sign * std::max(bottom - tops[j], 0.0);
      bottom = std::min(bottom, tops[j]);
    }
    return by;
  }
  /// Looks at one from outside.
  void check(StateCheck& check) const noexcept {
    check.require("layers", pierced <= most_layers);
    check.flag("layers", outwards);
    for (const auto* depths : {&tops, &whole_from, &whole_to}) check.numbers("layers", *depths, 1e9);
    check.numbers("layers", std::array{intact_from, late_from}, 1e9);
  }

 private:
  static constexpr double shown_within = 1.5e-3;  // [m]

  laws::TipContact::Prepared contact_;
};

}  // namespace needleforce::online
