// SPDX-License-Identifier: Apache-2.0
// What is known of each layer, and what is expected of the next one.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "hypotheses.hpp"
#include "layered_force.hpp"

namespace needleforce::online {

/// What is known of a layer. Depths in the stream's zero; `pierced` is false until its puncture.
struct LayerLearnt {
  Learnt modulus{}, cutting{}, friction{};
  double top = 0.0, puncture_depth = 0.0, puncture_force = 0.0, remaining = 0.0, probability = 0.0;
  bool touched = false, pierced = false;
};

/// The layered law with the hypotheses on its parameters. Wait-free.
class TissueLearnt {
 public:
  explicit TissueLearnt(const OnlinePrior& expected) noexcept : prior(expected), law(expected) {}

  OnlinePrior prior;
  LayeredForce law;
  Hypotheses bank{};

  /// Nothing is touched.
  void begin() noexcept {
    law.pierced = 0;
    law.outwards = law.zero_moved = inside_ = false;
    layers_ = {};
    surface_ = {};
    bool known = false;
    for (const LayerPrior& each : prior.layer) known = known || each.modulus.known() || each.friction.known();
    bank.begin(known);
    expect_contact();
    for (std::size_t at : {slot::cutting, slot::friction}) bank.set_aside(at);
  }
  /// The tissue begins here, as exactly as readings are apart.
  void touch(double depth, double spacing) noexcept {
    inside_ = true;
    law.tops[0] = law.intact_from = depth;
    surface_ = {depth, spacing, 0.0};
    layers_[0].touched = true;
    layers_[0].top = depth;
  }
  /// The contact has shown all that it will.
  void keep_surface(double depth) noexcept { surface_ = surface_seen(depth); }
  /// The layer is pierced: its contact is kept as it was learnt, and the next one begins there. False
  /// where no further layer is kept.
  bool pierce(const LayerLearnt& puncture, double from, double depth, double spacing) noexcept {
    const std::size_t k = std::min(law.pierced, most_layers - 1);
    const double top = layers_[k].top;
    const bool touched = layers_[k].touched;
    layers_[k] = puncture;
    layers_[k].top = top;
    layers_[k].touched = touched;
    layers_[k].pierced = true;
    layers_[k].modulus = bank.learnt(slot::modulus, modulus_prior(k));
    if (k == 0) law.tops[0] = surface_.value;
    if (law.pierced == most_layers) return false;
    if (k > 0) {
      law.tops[k] = layers_[k].top = puncture.puncture_depth;
      bank.another_layer();
    }
    ++law.pierced;
    law.intact_from = from;
    expect_anew(depth, spacing);
    if (law.pierced < most_layers) layers_[law.pierced].touched = law.another(prior);
    return true;
  }
  /// What was learnt of this layer is forgotten.
  void expect_anew(double depth, double spacing) noexcept {
    expect_contact();
    if (law.pierced > 0) expect_sliding(std::max(depth - law.tops[0], spacing));
  }
  /// Before the first puncture nothing is cut, so its parameter stands for a zero that has moved [N].
  void doubt_zero(double size) noexcept {
    law.zero_moved = true;
    bank.expect(slot::cutting, {0.0, size});
  }
  /// The needle is out: what is known stays.
  void leave() noexcept {
    for (std::size_t k = 0; k < most_layers; ++k) layers_[k] = layer(k);
    inside_ = law.outwards = false;
  }

  /// Layer `k` from the surface, 0 the first.
  LayerLearnt layer(std::size_t k) const noexcept {
    LayerLearnt known = layers_[std::min(k, most_layers - 1)];
    if (!inside_) return known;
    if (k == law.pierced && known.touched) known.modulus = bank.learnt(slot::modulus, modulus_prior(k));
    if (k < law.pierced) {
      const std::size_t at = slot::cutting + 2 * (law.pierced - 1 - k);
      known.cutting = bank.learnt(at, prior.layer[k].cutting);
      known.friction = bank.learnt(at + 1, prior.layer[k].friction);
    }
    return known;
  }
  const Learnt& surface() const noexcept { return surface_; }
  /// The depth of the contact, moved by what it has shown before any puncture.
  Learnt surface_seen(double depth) const noexcept {
    const Learnt modulus = bank.learnt(slot::modulus, modulus_prior(0)), shift = bank.learnt(slot::shift, {});
    const double stiff = std::max(std::abs(modulus.value), 1e-9),
                 most = 0.5 * std::max(depth - law.tops[0], 0.0);
    return {law.tops[0] - std::clamp(shift.value / stiff, -most, most), std::min(shift.sd / stiff, most),
            0.0};
  }
  double top() const noexcept { return layers_[0].top; }
  bool touched() const noexcept { return layers_[0].touched; }
  void reset() noexcept {
    begin();
    law.tops = {};
    law.intact_from = 0.0;
  }

 private:
  Expected modulus_prior(std::size_t k) const noexcept {
    if (k < most_layers && prior.layer[k].modulus.known()) return prior.layer[k].modulus;
    if (k == 0) return {0.0, 1e8};
    const Learnt& above = layers_[k - 1].modulus;
    return {0.0, 3.0 * std::abs(above.value) + 1e3};
  }
  Expected or_size(Expected expected, double size) const noexcept {
    return expected.known() ? expected : Expected{0.0, size};
  }
  void expect_contact() noexcept {
    const Expected modulus = modulus_prior(law.pierced);
    bank.expect_stiffening(modulus.sd / 2e-3);
    bank.expect(slot::modulus, modulus);
    bank.expect(slot::shift, {0.0, 5e-4 * std::max(std::abs(modulus.mean), modulus.sd)});
  }
  void expect_sliding(double length) noexcept {
    const std::size_t k = law.pierced - 1;
    const double size = 2.0 * std::abs(layers_[k].puncture_force);
    bank.expect(slot::cutting, or_size(prior.layer[k].cutting, size));
    bank.expect(slot::friction, or_size(prior.layer[k].friction, size / length));
  }

  std::array<LayerLearnt, most_layers> layers_{};
  Learnt surface_{};
  bool inside_ = false;
};

}  // namespace needleforce::online
