// SPDX-License-Identifier: Apache-2.0
// What is known of each layer, and what is expected of the next one.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "force_ahead.hpp"
#include "hypotheses.hpp"
#include "layered_force.hpp"

namespace needleforce::online {

/// What is known of a layer. Depths in the stream's zero; `pierced` is false until its puncture.
struct LayerLearnt {
  Learnt modulus{}, cutting{}, friction{};
  double top = 0.0, puncture_depth = 0.0, puncture_force = 0.0, remaining = 0.0, probability = 0.0;
  bool touched = false, pierced = false;

  void check(StateCheck& check) const noexcept {
    for (const Learnt& known : {modulus, cutting, friction}) known.check(check, "layers");
    check.numbers("layers", std::array{top, puncture_depth, puncture_force}, 1e9);
    check.number("layers", remaining, 0.0, 1.0);
    check.number("layers", probability, 0.0, 1.0);
    for (const bool* flag : {&touched, &pierced}) check.flag("layers", *flag);
  }
};

/// A place and the force there.
struct Moved {
  double depth = 0.0, force = 0.0;
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
    law.begin();
    left_ = most_layers;
    inside_ = power_known_ = false;
    layers_ = {};
    surface_ = {};
    bank.begin(prior_known());
    expect_contact();
    for (std::size_t at : {slot::cutting, slot::friction}) bank.set_aside(at);
  }
  /// The force has left its noise here, as exactly as readings are apart.
  void touch(double depth, double spacing, double noise) noexcept {
    noise_ = noise;
    inside_ = true;
    law.tops[0] = law.intact_from = depth;
    surface_ = {depth, spacing, 0.0};
    layers_[0].touched = true;
    layers_[0].top = depth;
  }

  Innovation learn(const Reading& now, double memory) noexcept {
    Reading reading = now;
    reading.late = law.of_late_contact(prior, now.depth);
    const Innovation found = bank.learn(reading, memory);
    if (law.outwards) return found;
    if (law.pierced == 0)
      know_power(reading);
    else if (law.late_from == LayeredForce::nowhere)
      watch_late(reading.depth, found.residual);
    return found;
  }

  /// The contact has shown all that it will.
  void keep_surface(double depth) noexcept { surface_ = surface_seen(depth); }
  /// The layer is pierced, which leaves this force: its contact is kept as it was learnt, and the next one
  /// begins there. False where no further layer is kept.
  bool pierce(const LayerLearnt& puncture, double from, Moved now) noexcept {
    const std::size_t k = std::min(law.pierced, most_layers - 1);
    const LayerLearnt before = layers_[k];
    layers_[k] = puncture;
    layers_[k].top = before.top;
    layers_[k].touched = before.touched;
    layers_[k].pierced = true;
    layers_[k].modulus = modulus(k);
    if (k == 0) law.tops[0] = surface_.value;
    if (law.pierced == most_layers) return false;
    if (k > 0) {
      layers_[k].top = law.pierce(puncture.puncture_depth);
      bank.doubt(1.5);  // contact and friction may have been taken for each other
      bank.another_layer();
    }
    law.next(from);
    expect_anew(now);
    if (law.pierced < most_layers) layers_[law.pierced].touched = law.another(prior);
    return true;
  }
  /// What was learnt of this layer is forgotten.
  void expect_anew(Moved now) noexcept {
    expect_contact();
    if (law.pierced == 0) return;
    expect_sliding(now);
    rise_ = 0.0;
    law.late_from = LayeredForce::nowhere;
    late_since_ = now.depth;
    bank.keep_late();
  }
  /// Before the first puncture nothing is cut, so its parameter stands for a zero that has moved [N].
  void doubt_zero(double size) noexcept {
    law.zero_moved = true;
    bank.expect(slot::cutting, {0.0, size});
  }
  /// The friction has turned: outwards it may be another one, and where the tissue begins is not known
  /// exactly.
  void withdraw() noexcept {
    const double friction = std::abs(layer(0).friction.value) + layer(0).friction.sd;
    bank.doubt(3.0);
    bank.expect(slot::shift, {0.0, friction * std::max(surface_.sd, 1e-4)});
  }
  /// Outwards: what the layers that the tip has left have shown is kept. Of those above the friction may be
  /// another one than while they all held the needle.
  void go_out(double depth) noexcept {
    std::size_t left = std::min(left_, law.pierced);
    for (; left > 1 && depth < law.whole_from[left - 1]; --left) {
      layers_[left - 1] = layer(left - 1);
      bank.doubt(5.0);
    }
    left_ = left;
  }
  void go_in() noexcept { left_ = most_layers; }
  /// The needle is out: what is known stays.
  void leave() noexcept {
    for (std::size_t k = 0; k < most_layers; ++k) layers_[k] = layer(k);
    inside_ = law.outwards = false;
  }

  /// Layer `k` from the surface, 0 the first.
  LayerLearnt layer(std::size_t k) const noexcept {
    LayerLearnt known = layers_[std::min(k, most_layers - 1)];
    if (!inside_ || k >= left_) return known;
    if (k == law.pierced && known.touched) known.modulus = modulus(k);
    if (k < law.pierced) {
      const std::size_t at = slot::cutting + 2 * (law.pierced - 1 - k);
      known.cutting = bank.learnt(at, prior.layer[k].cutting);
      known.friction = bank.learnt(at + 1, prior.layer[k].friction);
      known.friction.sd = std::hypot(known.friction.sd, along_shaft * known.friction.value);
    }
    return known;
  }
  /// The intact layer while it breaks.
  LayerLearnt breaking(const LayerLearnt& puncture, Moved now) const noexcept {
    const std::size_t k = std::min(law.pierced, most_layers - 1);
    LayerLearnt known = layer(k);
    known.puncture_depth = puncture.puncture_depth;
    known.puncture_force = puncture.puncture_force;
    known.probability = puncture.probability;
    known.remaining = puncture.remaining;
    known.pierced = true;
    return sliding(k, known, now);
  }
  const Learnt& surface() const noexcept { return surface_; }
  /// The depth at which the force left its noise, less what its modulus makes of that noise.
  Learnt surface_seen(double depth) const noexcept { return surface_by(modulus(0), depth); }
  NextPuncture next_puncture() const noexcept {
    NextPuncture next;
    next.since = law.contact_since();
    next.none = prior.layers > 0 && law.pierced >= prior.layers;
    if (law.pierced >= most_layers) return next;
    const Expected& puncture = prior.layer[law.pierced].puncture;
    if (puncture.known()) next.expected = {layers_[0].top + puncture.mean, puncture.sd};
    return next;
  }
  /// Force per depth that the next layer's contact may have: that of the one above at its puncture [N/m].
  double next_contact() const noexcept {
    if (law.pierced == 0) return 0.0;
    const LayerLearnt& above = layers_[law.pierced - 1];
    return std::abs(above.puncture_force) / std::max(above.puncture_depth - above.top, 5e-4);
  }
  double top() const noexcept { return layers_[0].top; }
  bool touched() const noexcept { return layers_[0].touched; }
  void take_prior(const TissueLearnt& other) noexcept {
    prior = other.prior;
    law.take_contact(other.law);
  }
  /// Looks at one from outside.
  void check(StateCheck& check) const noexcept {
    law.check(check);
    check.require("layers", left_ <= most_layers);
    for (const bool* flag : {&inside_, &power_known_}) check.flag("layers", *flag);
    surface_.check(check, "layers", 1e15);
    check.number("layers", noise_, 0.0, 1e9);
    check.numbers("layers", std::array{rise_, late_since_}, 1e15);
    for (const LayerLearnt& each : layers_) each.check(check);
    if (check.fault()) return;
    bank.check(check, prior_known(), law.pierced);
  }

 private:
  bool prior_known() const noexcept {
    bool known = false;
    for (const LayerPrior& each : prior.layer) known = known || each.modulus.known() || each.friction.known();
    return known;
  }
  /// False above the contact, and so little below it that its force is lost in rounding.
  bool touches(double h) const noexcept { return h > 0.0 && law.contact().force(h) > 0.0; }
  /// The modulus by which the contact has its force now, whatever its power and its shift.
  Learnt modulus(std::size_t k) const noexcept {
    const double depth = bank.last().depth, h = depth - law.contact_from(prior);
    if (law.pierced == 0 && touches(h)) return from_surface(h);
    return bank.learnt(secant(h), secant(depth - law.late_from), modulus_prior(k));
  }
  /// The same from the surface, which is above the depth at which the force left its noise.
  Learnt from_surface(double h) const noexcept {
    const Slots by = secant(h);
    Slots unshifted = by;
    unshifted[slot::shift] = 0.0;
    const Learnt surface = surface_by(bank.learnt(unshifted, unshifted, {}), law.tops[0] + h);
    Learnt found = bank.learnt(by, by, modulus_prior(0));
    const double from = h + law.tops[0] - surface.value;
    const double share = law.contact().force(h) / law.contact().force(from);
    found.value *= share;
    found.sd = std::hypot(share * found.sd, 2.0 * surface.sd / from * found.value);
    return found;
  }
  /// How much deeper the force left its noise than the tissue begins, by the power that the contact has
  /// shown.
  Learnt surface_by(const Learnt& modulus, double depth) const noexcept {
    const double h = depth - law.tops[0], stiff = std::max(std::abs(modulus.value), 1e-9);
    if (!touches(h)) return surface_;
    const double unit = law.contact().force(h), by_law = h * law.contact().slope(h) / unit;
    const double power = std::clamp(by_law + bank.learnt(slot::power, {}).value / stiff, 0.8, 3.0);
    const double in_noise = 0.9 * h * std::min(std::pow(2.0 * noise_ / (stiff * unit), 1.0 / power), 1.0);
    // or the contact has the power of its law, and began higher
    const double higher = std::max(h * (by_law / power - 1.0) - in_noise, 0.0);
    return {law.tops[0] - in_noise, std::max(std::hypot(0.65 * in_noise, 0.55 * higher), surface_.sd), 0.0};
  }
  /// Force of the contact over that of its law with a modulus of 1; none before it begins.
  Slots secant(double h) const noexcept {
    Slots by{};
    if (!touches(h)) return by;
    by[slot::modulus] = 1.0;
    by[slot::power] = std::log(h / LayeredForce::unit_depth);
    by[slot::shift] = law.contact().slope(h) / law.contact().force(h);
    return by;
  }
  /// After half a millimetre the modulus is known well enough for what is expected of the power of the depth,
  /// and of the depth at which the force left its noise.
  void know_power(const Reading& reading) noexcept {
    const double unit = reading.by[slot::modulus], h = reading.depth - law.tops[0];
    if (power_known_ || h < 5e-4 || !(reading.force > 0.0)) return;
    power_known_ = true;
    const double modulus = std::max(reading.force / unit, 1.0);
    bank.know(slot::power, {0.0, power_sd * modulus});
    const double in_noise = std::min(law.contact().indentation(2.0 * noise_ / modulus), h);
    bank.know(slot::shift, {0.5 * in_noise * modulus, std::max(in_noise, 5e-5) * modulus});
  }
  /// A rise that friction does not explain: the next layer began where the sum of the residuals last was
  /// none.
  void watch_late(double depth, double residual) noexcept {
    constexpr double allowed = 0.5, enough = 8.0;
    rise_ = std::max(0.0, rise_ + residual - allowed);
    if (rise_ == 0.0) {
      late_since_ = depth;
      bank.keep_late();
    } else if (rise_ > enough && law.another(prior)) {
      law.late_from = late_since_;
      bank.take_back_late(law.of_late_contact(prior, depth));
    }
  }

  Expected modulus_prior(std::size_t k) const noexcept {
    if (k < most_layers && prior.layer[k].modulus.known()) return prior.layer[k].modulus;
    if (k == 0) return {0.0, 1e8};
    const Learnt& above = layers_[k - 1].modulus;
    return {0.0, 3.0 * std::abs(above.value) + 1e3};
  }
  void expect_contact() noexcept {
    Expected modulus = modulus_prior(law.pierced);
    // by another depth of the surface it is another one
    if (!law.top_known(prior)) modulus.sd = std::hypot(modulus.sd, modulus.mean);
    const double size = std::max(std::abs(modulus.mean), modulus.sd);
    bank.expect(slot::power, {0.0, power_sd * size});
    bank.expect(slot::modulus, modulus);
    bank.expect(slot::shift, {0.0, 5e-4 * size});
  }
  /// Neither cutting nor friction is larger than what is left of the force.
  void expect_sliding(Moved now) noexcept {
    const std::size_t k = law.pierced - 1;
    const LayerLearnt expected = sliding(k, layers_[k], now);
    bank.expect(slot::cutting, {expected.cutting.value, expected.cutting.sd});
    bank.expect(slot::friction, {expected.friction.value, expected.friction.sd});
  }
  LayerLearnt sliding(std::size_t k, LayerLearnt layer, Moved now) const noexcept {
    const double whole = std::max(std::abs(layer.puncture_force), 1e-3),
                 half = 0.5 * std::clamp(now.force, 0.1 * whole, whole);
    const double slope = half / std::max(now.depth - law.tops[0], 1e-4);
    const LayerPrior& known = prior.layer[k];
    layer.cutting = as_learnt(known.cutting.known() ? known.cutting : Expected{half, half});
    layer.friction = as_learnt(known.friction.known() ? known.friction : Expected{slope, slope});
    return layer;
  }
  static Learnt as_learnt(const Expected& expected) noexcept {
    return {expected.mean, expected.sd, expected.sd};
  }

  static constexpr double along_shaft = 0.03;  // share by which friction is not the same along the shaft
  static constexpr double power_sd = 0.4;      // of the depth in a contact of unknown law

  std::array<LayerLearnt, most_layers> layers_{};
  Learnt surface_{};
  double noise_ = 0.0, rise_ = 0.0, late_since_ = 0.0;
  std::size_t left_ = most_layers;  // by the tip, outwards
  bool inside_ = false, power_known_ = false;
};

}  // namespace needleforce::online
