// SPDX-License-Identifier: Apache-2.0
// Parameters of a tissue while the needle moves, and the force ahead of it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "../events/event_detector.hpp"
#include "../laws/tip_contact.hpp"
#include "force_ahead.hpp"
#include "online_prior.hpp"
#include "online_settings.hpp"
#include "tissue_estimate.hpp"

namespace needleforce::online {

/// What the needle does, as far as a force is expected of it.
enum class Regime { unknown, free, contact, rupture, sliding, reversing, withdrawal, rest };
inline constexpr std::array<const char*, 8> regime_names{"unknown", "free",      "contact",    "rupture",
                                                         "sliding", "reversing", "withdrawal", "rest"};

/// A value with its standard deviation, and that of the prior.
struct Learnt {
  double value = 0.0, sd = 0.0, before = 0.0;
};

/// What is known of a layer. Depths in the stream's zero; `pierced` is false until its puncture.
struct LayerLearnt {
  Learnt modulus{}, cutting{}, friction{};
  double top = 0.0, puncture_depth = 0.0, puncture_force = 0.0, remaining = 0.0, probability = 0.0;
  bool touched = false, pierced = false;
};

/// One sample in; parameters with covariance, and the force ahead, out. Within a regime the force is linear
/// in the parameters; events open and close regimes; a bank of hypotheses on texture and prior is weighted by
/// what each foresaw. Trivially copyable, without heap; the work of a step is bounded.
class OnlineIdentifier {
 public:
  explicit OnlineIdentifier(const OnlinePrior& prior = {}, const OnlineSettings& settings = {},
                            const events::EventSettings& watched = {}) noexcept
      : settings_(settings),
        prior_(prior),
        contact_(laws::TipContact{1.0, prior.radius, prior.tip}.prepare()),
        watch_(watched) {
    begin_anew();
  }

  /// One sample: force [N], depth [m], time since the one before [s]. Wait-free, allocates nothing.
  events::Detection step(double force, double depth, double dt) noexcept {
    const events::Detection event = watch_.step(force, depth, dt);
    if (status() != events::StreamStatus::not_finite && status() != events::StreamStatus::bad_time)
      read(event, force, depth, dt);
    return event;
  }
  /// Back to before the first sample. Wait-free.
  void reset() noexcept {
    watch_.reset();
    begin_anew();
    started_ = false;
    depth_ = force_ = time_ = speed_ = 0.0;
    changes_ = 0;
    tops_ = {};
    deepest_ = -1e9;
    lowest_ = 1e9;
    rest_depth_ = lowest_depth_ = intact_from_ = rupture_depth_ = rupture_force_ = rupture_probability_ = 0.0;
    interrupt();
  }
  OnlineIdentifier snapshot() const noexcept { return *this; }

  events::StreamStatus status() const noexcept { return watch_.status(); }
  Regime regime() const noexcept {
    if (resting_) return Regime::rest;
    if (!outwards_ || regime_ == Regime::free || regime_ == Regime::unknown) return regime_;
    return withdraws_ ? Regime::withdrawal : Regime::reversing;
  }
  const events::EventDetector& detector() const noexcept { return watch_; }
  const OnlineSettings& settings() const noexcept { return settings_; }
  const OnlinePrior& prior() const noexcept { return prior_; }
  double depth() const noexcept { return depth_; }
  double force() const noexcept { return force_; }
  double speed() const noexcept { return speed_; }
  /// Where the tissue begins [m]: the event's depth, moved by what the contact has shown.
  Learnt surface() const noexcept {
    if (regime_ != Regime::contact) return surface_;
    const Learnt modulus = learnt(slot::modulus, modulus_prior(0)), shift = learnt(slot::shift, {});
    const double stiff = std::max(std::abs(modulus.value), 1e-9),
                 most = 0.5 * std::max(depth_ - tops_[0], 0.0);
    return {tops_[0] - std::clamp(shift.value / stiff, -most, most), std::min(shift.sd / stiff, most), 0.0};
  }
  std::size_t pierced() const noexcept { return pierced_; }
  /// Normalised innovation squared of the last readings: 1 where the intervals keep what they promise.
  double innovation() const noexcept { return surprise_count_ > 0.0 ? surprise_ / surprise_count_ : 1.0; }
  /// Changes of the tissue that were taken for such, apart from punctures.
  std::size_t changes() const noexcept { return changes_; }

  /// Layer `k` from the surface, 0 the first. Wait-free.
  LayerLearnt layer(std::size_t k) const noexcept {
    LayerLearnt known = layers_[std::min(k, most_layers - 1)];
    if (regime_ == Regime::unknown || regime_ == Regime::free) return known;
    if (k == pierced_ && known.touched) known.modulus = learnt(slot::modulus, modulus_prior(k));
    if (k < pierced_) {
      const std::size_t at = slot::cutting + 2 * (pierced_ - 1 - k);
      known.cutting = learnt(at, prior_.layer[k].cutting);
      known.friction = learnt(at + 1, prior_.layer[k].friction);
    }
    return known;
  }

  /// The force over the next `travel` [m] in the direction of the last motion. Allocates nothing.
  ForceAhead ahead(double travel) const noexcept {
    ForceAhead result;
    const NextPuncture next = next_puncture();
    const Bank bank = this->bank();
    for (std::size_t i = 0; i < ForceAhead::points; ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(ForceAhead::points - 1);
      const double depth = depth_ + (outwards_ ? -1.0 : 1.0) * share * travel;
      Forces forces;
      const double like = like_earlier(depth) ? likely() : 0.0;
      forces.add(1.0 - like, by_law(bank, next, depth));
      add_likeness(forces, like, depth);
      result.at[i] = {depth, forces.quantile(0.5), forces.quantile(0.025), forces.quantile(0.975)};
    }
    if (!cuts()) return result;
    result.puncture_probability = next.between(depth_, depth_ + travel);
    result.earliest = next.quantile(depth_, 0.025);
    result.puncture_depth = next.quantile(depth_, 0.5);
    result.latest = next.quantile(depth_, 0.975);
    return result;
  }

 private:
  static constexpr std::size_t lengths = 8, members = 2 * lengths, waiting = 16;
  static constexpr std::array<double, 2> correlation_lengths{1e-4, 1e-3};
  static constexpr std::array<double, 4> held{1.5e-3, 6e-3, 1e9, 1e9};
  static constexpr double leap = 5e-3, fastest = 1.0;  // as the detector has it
  using Weights = std::array<double, members>;
  using Forces = Mixture<members + 2>;

  // ---- what is expected before a layer is touched

  Expected modulus_prior(std::size_t k) const noexcept {
    if (k < most_layers && prior_.layer[k].modulus.known()) return prior_.layer[k].modulus;
    if (k == 0) return {0.0, 1e8};
    const Learnt& above = layers_[k - 1].modulus;
    return {0.0, 3.0 * std::abs(above.value) + 1e3};
  }
  Expected or_size(Expected expected, double size) const noexcept {
    return expected.known() ? expected : Expected{0.0, size};
  }
  bool another_layer() const noexcept {
    return pierced_ < most_layers &&
           (prior_.layers == 0 || pierced_ < prior_.layers || prior_.layer[pierced_].modulus.known());
  }
  static void set(TissueEstimate& each, std::size_t slot, Expected expected) noexcept {
    each.information.set(slot, expected.mean, each.doubt * expected.sd);
  }
  void expect_contact() noexcept {
    const Expected modulus = modulus_prior(pierced_);
    const double shift = 5e-4 * std::max(std::abs(modulus.mean), modulus.sd);
    for (std::size_t m = 0; m < count_; ++m) {
      set(bank_[m], slot::stiffening, {0.0, bank_[m].stiffens ? modulus.sd / 2e-3 : 1e-9});
      set(bank_[m], slot::modulus, modulus);
      set(bank_[m], slot::shift, {0.0, shift});
    }
  }
  void expect_sliding() noexcept {
    const std::size_t k = pierced_ - 1;
    const double size = 2.0 * std::abs(layers_[k].puncture_force);
    const double length = std::max(depth_ - tops_[0], settings_.spacing);
    for (std::size_t m = 0; m < count_; ++m) {
      set(bank_[m], slot::cutting, or_size(prior_.layer[k].cutting, size));
      set(bank_[m], slot::friction, or_size(prior_.layer[k].friction, size / length));
    }
  }

  // ---- regimes

  void begin_anew() noexcept {
    regime_ = Regime::unknown;
    pierced_ = 0;
    layers_ = {};
    surface_ = {};
    likeness_ = {};
    check_ = {};
    surprise_ = surprise_count_ = 0.0;
    outwards_ = withdraws_ = resting_ = false;
    waiting_ = 0;
    last_ = {};
    bool known = false;
    for (const LayerPrior& each : prior_.layer)
      known = known || each.modulus.known() || each.friction.known();
    count_ = known ? members : lengths;
    for (std::size_t m = 0; m < count_; ++m) {
      bank_[m] = {};
      bank_[m].correlation_length = correlation_lengths[m % lengths % 2];
      bank_[m].holds_over = held[m % lengths / 2];
      bank_[m].stiffens = m % lengths / 2 == 3;
      bank_[m].doubt = m < lengths ? 1.0 : 10.0;
      bank_[m].log_weight = m < lengths ? 0.0 : -2.0;
    }
    expect_contact();
    set_sliding_aside();
    open_ = {};
  }
  void set_sliding_aside() noexcept {
    for (std::size_t m = 0; m < count_; ++m)
      for (std::size_t at : {slot::cutting, slot::friction}) set(bank_[m], at, {0.0, 1.0});
  }

  void take(const events::Detection& event) noexcept {
    using events::EventKind;
    switch (event.kind) {
      case EventKind::contact:
        return begin_contact(event);
      case EventKind::puncture:
        return begin_rupture(event);
      case EventKind::sliding:
        return end_rupture(event.depth);
      case EventKind::stop:
        resting_ = true;
        rest_depth_ = depth_;
        return interrupt();
      case EventKind::reversal:
        return turn(event.depth);
      case EventKind::exit:
        return leave();
      case EventKind::none:
        return;
    }
  }
  void begin_contact(const events::Detection& event) noexcept {
    begin_anew();
    regime_ = Regime::contact;
    tops_[0] = intact_from_ = deepest_ = event.depth;
    surface_ = {event.depth, settings_.spacing, 0.0};
    layers_[0].touched = true;
    layers_[0].top = event.depth;
  }
  void leave() noexcept {
    settle(-1e9, 1e9);
    for (std::size_t k = 0; k < most_layers; ++k) layers_[k] = layer(k);
    regime_ = Regime::free;
    outwards_ = withdraws_ = false;
    interrupt();
  }
  void begin_rupture(const events::Detection& event) noexcept {
    if (regime_ != Regime::contact && regime_ != Regime::sliding) return;
    settle(-1e9, event.depth);
    interrupt();
    surface_ = surface();
    whole_ = regime_;
    rupture_probability_ = event.probability;
    regime_ = Regime::rupture;
    rupture_depth_ = event.depth;
    rupture_force_ = last_.force;
  }
  /// The layer is pierced: its contact is kept as it was learnt, and the next one begins.
  void end_rupture(double depth) noexcept {
    if (regime_ != Regime::rupture) return;
    regime_ = Regime::sliding;
    const std::size_t k = std::min(pierced_, most_layers - 1);
    layers_[k].modulus = learnt(slot::modulus, modulus_prior(k));
    layers_[k].pierced = true;
    layers_[k].puncture_depth = rupture_depth_;
    layers_[k].puncture_force = rupture_force_;
    layers_[k].probability = rupture_probability_;
    layers_[k].remaining = rupture_force_ > 0.0 ? std::clamp(force_ / rupture_force_, 0.0, 1.0) : 0.0;
    if (k == 0) tops_[0] = surface_.value;
    if (pierced_ == most_layers) return change();
    if (k > 0) {
      tops_[k] = rupture_depth_;
      layers_[k].top = rupture_depth_;
      for (std::size_t m = 0; m < count_; ++m) bank_[m].information.shift(2);
    }
    ++pierced_;
    intact_from_ = depth;
    expect_contact();
    expect_sliding();
    if (pierced_ < most_layers) layers_[pierced_].touched = another_layer();
    interrupt();
  }
  /// Outwards, or inwards again.
  void turn(double depth) noexcept {
    settle(-1e9, 1e9);
    outwards_ = depth_ < depth;
    withdraws_ = false;
    lowest_ = 1e9;
    interrupt();
  }
  /// The tissue is another one: what was learnt of this layer is forgotten.
  void change() noexcept {
    ++changes_;
    expect_contact();
    if (pierced_ > 0) expect_sliding();
    surprise_ = surprise_count_ = 0.0;
  }

  // ---- readings

  void read(const events::Detection& event, double force, double depth, double dt) noexcept {
    if (status() == events::StreamStatus::gap) interrupt();
    if (std::abs(depth - depth_) > leap + fastest * dt && started_) begin_anew();
    if (dt > 0.0 && started_)
      speed_ += std::min(1.0, dt / watch_.settings().within) * ((depth - depth_) / dt - speed_);
    started_ = true;
    depth_ = depth;
    force_ = force;
    time_ += dt;
    take(event);
    if (regime_ == Regime::unknown && status() == events::StreamStatus::ok) regime_ = Regime::free;
    if (resting_ && std::abs(depth - rest_depth_) > settings_.spacing) resting_ = false;
    if (regime_ == Regime::rupture) watch_rupture();
    compare();
    if (status() == events::StreamStatus::stuck) return interrupt();
    if (!measures()) return;
    lately_.add(force, depth);
    collect(force, depth);
    settle_older(time_ - watch_.settings().within);
  }
  /// A fall that came back was none; one that stays without having been confirmed is one after a millimetre.
  void watch_rupture() noexcept {
    if (force_ > 0.95 * rupture_force_)
      regime_ = whole_;
    else if (depth_ - rupture_depth_ > 1e-3)
      end_rupture(depth_);
  }
  /// Whether a force is expected here that depends on the parameters.
  bool measures() noexcept {
    if (resting_) return false;
    if (outwards_) return follows_withdrawal();
    if (regime_ != Regime::contact && regime_ != Regime::sliding) return false;
    const bool onwards = depth_ > deepest_ - 4.0 * watch_.settings().depth_noise;
    deepest_ = std::max(deepest_, depth_);
    return onwards;
  }
  /// Friction has turned once the force has passed its lowest by half a millimetre.
  bool follows_withdrawal() noexcept {
    if (pierced_ == 0 || regime_ != Regime::sliding) return false;
    if (force_ < lowest_) {
      lowest_ = force_;
      lowest_depth_ = depth_;
    }
    withdraws_ = withdraws_ || (force_ < 0.0 && lowest_depth_ - depth_ > 5e-4);
    return withdraws_ && depth_ > tops_[0];
  }
  void interrupt() noexcept {
    lately_.restart();
    open_ = {};
    broken_ = true;
  }

  struct Open {
    double count = 0.0, force = 0.0, depth = 0.0, from = 0.0;
  };
  void collect(double force, double depth) noexcept {
    if (open_.count == 0.0) open_.from = depth;
    open_.count += 1.0;
    open_.force += force;
    open_.depth += depth;
    const double spacing = std::max(settings_.spacing, std::abs(speed_) * watch_.settings().within / 8.0);
    if (std::abs(depth - open_.from) + 0.5 * std::abs(depth - open_.from) / open_.count < spacing) return;
    if (waiting_ == waiting) settle_first();
    Waiting& last = queue_[waiting_++];
    last.time = time_;
    last.reading = reading(open_.depth / open_.count, open_.force / open_.count);
    last.reading.continues = !broken_;
    broken_ = false;
    open_ = {};
  }
  Reading reading(double depth, double force) const noexcept {
    Reading result;
    result.depth = depth;
    result.force = force;
    result.size = std::hypot(watch_.noise(), settings_.roughness * force);
    result.by = by_parameters(depth);
    return result;
  }
  Slots by_parameters(double depth) const noexcept {
    Slots by{};
    if (!outwards_ && (pierced_ == 0 || another_layer())) {
      const double h = depth - contact_from();
      if (h > 0.0) {
        by[slot::modulus] = contact_.force(h);
        by[slot::stiffening] = by[slot::modulus] * h;
        if (pierced_ == 0) by[slot::shift] = contact_.slope(h);
      }
    }
    if (pierced_ == 0) return by;
    if (!outwards_) by[slot::cutting] = 1.0;
    const double sign = outwards_ ? -1.0 : 1.0;
    double bottom = depth;
    for (std::size_t j = pierced_; j-- > 0;) {
      by[slot::friction + 2 * (pierced_ - 1 - j)] = sign * std::max(bottom - tops_[j], 0.0);
      bottom = std::min(bottom, tops_[j]);
    }
    return by;
  }
  double contact_from() const noexcept {
    if (pierced_ == 0) return tops_[0];
    const Expected& top = prior_.layer[std::min(pierced_, most_layers - 1)].top;
    return top.known() ? tops_[0] + top.mean : intact_from_;
  }

  // ---- what was read becomes known once no event can date from before it

  struct Waiting {
    double time = 0.0;
    Reading reading{};
  };
  void settle_first() noexcept {
    learn(queue_[0].reading);
    for (std::size_t i = 1; i < waiting_; ++i) queue_[i - 1] = queue_[i];
    --waiting_;
  }
  void settle_older(double time) noexcept {
    for (int i = 0; i < 2 && waiting_ > 0 && queue_[0].time < time; ++i) settle_first();
  }
  /// Everything between two depths now, and the rest never.
  void settle(double from, double to) noexcept {
    for (; waiting_ > 0;)
      if (queue_[0].reading.depth >= from && queue_[0].reading.depth <= to)
        settle_first();
      else
        --waiting_;
  }
  void learn(const Reading& now) noexcept {
    const Weights before = weights();
    double squared = 0.0, worth = 0.0;
    for (std::size_t m = 0; m < count_; ++m) {
      const Innovation found = bank_[m].add(now, last_, settings_.memory);
      squared += before[m] * found.squared;
      worth += before[m] / found.widening;
    }
    last_ = now;
    normalise();
    watch_surprise(squared, worth);
  }
  void normalise() noexcept {
    double most = bank_[0].log_weight;
    for (std::size_t m = 1; m < count_; ++m) most = std::max(most, bank_[m].log_weight);
    for (std::size_t m = 0; m < count_; ++m)
      bank_[m].log_weight = std::max(bank_[m].log_weight - most, least_log_weight);
  }
  static constexpr double least_log_weight = -30.0;
  Weights weights() const noexcept {
    Weights result{};
    double sum = 0.0;
    for (std::size_t m = 0; m < count_; ++m) sum += result[m] = std::exp(bank_[m].log_weight);
    for (double& each : result) each /= sum;
    return result;
  }
  /// Innovations over the last readings that are larger than the stated rate allows are another tissue.
  void watch_surprise(double squared, double worth) noexcept {
    constexpr double window = 10.0;
    surprise_ = (1.0 - 1.0 / window) * surprise_ + squared;
    surprise_count_ = (1.0 - 1.0 / window) * surprise_count_ + 1.0;
    // a friction that is another outwards contradicts the law, but is no other tissue
    if (outwards_ || worth < 0.5 || surprise_count_ < 0.8 * window) return;
    const double rate = settings_.false_changes * std::max(settings_.spacing, 1e-6);
    const double n = surprise_count_, spread = 2.0 / (9.0 * n);  // Wilson and Hilferty
    const double root = 1.0 - spread + events::upper_quantile(rate) * std::sqrt(spread);
    if (surprise_ > n * root * root * root) change();
  }

  // ---- what is known

  Learnt learnt(std::size_t slot, Expected expected) const noexcept {
    const Weights weight = weights();
    std::array<double, members> mean{};
    Learnt result;
    for (std::size_t m = 0; m < count_; ++m) {
      mean[m] = bank_[m].information.mean()[slot];
      result.value += weight[m] * mean[m];
    }
    double variance = 0.0;
    for (std::size_t m = 0; m < count_; ++m) {
      const double off = mean[m] - result.value;
      variance += weight[m] * (bank_[m].information.variance(slot) + off * off);
    }
    result.sd = std::sqrt(variance);
    result.before = expected.sd;
    return result;
  }
  NextPuncture next_puncture() const noexcept {
    NextPuncture next;
    next.since = intact_from_;
    next.none = prior_.layers > 0 && pierced_ >= prior_.layers;
    if (pierced_ >= most_layers) return next;
    const Expected& puncture = prior_.layer[pierced_].puncture;
    if (puncture.known()) next.expected = {layers_[0].top + puncture.mean, puncture.sd};
    return next;
  }
  /// What one hypothesis expects at a depth: its parameters, and of the residual now what is still
  /// correlated.
  void add_forces(Forces& forces, double weight, std::size_t m, const Slots& theta,
                  double depth) const noexcept {
    const TissueEstimate& each = bank_[m];
    const double travel = std::abs(depth - depth_), noise = watch_.noise();
    if (regime_ == Regime::free) return forces.add(weight, 0.0, noise * noise);
    const bool follows =
        (regime_ == Regime::contact || regime_ == Regime::sliding) && (!outwards_ || withdraws_);
    if (!follows) {
      const double walk = std::abs(force_) * std::min(1.0, travel / 2e-3);
      return forces.add(weight, force_, walk * walk + noise * noise);
    }
    const Reading now = reading(depth_, open_.count > 0.0 ? open_.force / open_.count : force_);
    const double rho = each.kept(travel);
    const Slots there = by_parameters(depth);
    Slots apart{};
    double mean = rho * now.force;
    for (std::size_t i = 0; i < each.information.size(); ++i) {
      apart[i] = there[i] - rho * now.by[i];
      mean += apart[i] * theta[i];
    }
    const double size =
        std::hypot(noise, settings_.roughness * std::max(std::abs(mean), std::abs(now.force)));
    const double texture =
        each.scale * size * size * (1.0 - rho * rho) * (each.seen + 5.0) / (each.seen + 3.0);
    double law = mean * error_of_law(each, depth);
    if (lately_.known() && !outwards_ && travel > 0.0) {
      // where the force does not grow as the law has it, it may continue as it did lately
      const double near = std::min(travel, 3e-4);
      double grows = 0.0;
      const Slots close = by_parameters(depth_ + near);
      for (std::size_t i = 0; i < each.information.size(); ++i) grows += (close[i] - now.by[i]) * theta[i];
      law = std::hypot(law, (lately_.value() * near - grows) * std::min(travel, 2e-3) / near);
    }
    forces.add(weight, mean, each.information.variance(apart) + texture + law * law + noise * noise);
  }
  /// Share of the force by which a contact of unknown law may be off beyond what was seen: its exponent is
  /// known to 0.8 after a millimetre, and better with the root of what was seen.
  double error_of_law(const TissueEstimate& each, double depth) const noexcept {
    // recordings of the tissue were of this law, unless they are doubted
    const bool known = prior_.same_tissue && each.doubt < 2.0 &&
                       prior_.layer[std::min(pierced_, most_layers - 1)].modulus.known();
    if (outwards_ || known) return 0.0;
    const double seen = std::max(depth_ - intact_from_, settings_.spacing);
    const double exponent = std::min(1.5, 0.8 * std::sqrt(1e-3 / seen));
    return std::pow(1.0 + std::max(depth - depth_, 0.0) / std::max(depth_ - contact_from(), seen), exponent) -
           1.0;
  }
  /// Somewhere in this travel tissue may begin, of the prior's modulus or one of a soft tissue.
  void add_contact(Forces& forces, double travel) const noexcept {
    if (outwards_ || !(travel > 0.0)) return;
    const Expected& prior = prior_.layer[0].modulus;
    const double force = (prior.known() ? prior.mean + prior.sd : 1e5) * contact_.force(0.5 * travel);
    forces.add(travel / (travel + 5e-3), force, force * force);
  }
  /// Weights and means of all hypotheses.
  struct Bank {
    Weights weight{};
    std::array<Slots, members> theta{};
  };
  Bank bank() const noexcept {
    Bank result{weights(), {}};
    for (std::size_t m = 0; m < count_; ++m) result.theta[m] = bank_[m].information.mean();
    return result;
  }
  bool cuts() const noexcept {
    return !outwards_ && (regime_ == Regime::contact || regime_ == Regime::sliding);
  }
  Forces by_law(const Bank& bank, const NextPuncture& next, double depth) const noexcept {
    const double whole = cuts() ? 1.0 - next.between(depth_, depth) : 1.0;
    Forces forces;
    for (std::size_t m = 0; m < count_; ++m)
      add_forces(forces, whole * bank.weight[m], m, bank.theta[m], depth);
    if (regime_ == Regime::free)
      add_contact(forces, std::abs(depth - depth_));
    else
      add_after_puncture(forces, 1.0 - whole, forces.mean());
    return forces;
  }

  // ---- likeness to earlier insertions

  double indentation(double depth) const noexcept { return depth - layers_[0].top; }
  /// Whether earlier insertions have been at this depth.
  bool like_earlier(double depth) const noexcept {
    return layers_[0].touched && !outwards_ && prior_.earlier.known(indentation(depth));
  }
  /// Probability that this insertion is like the earlier ones.
  double likely() const noexcept { return 1.0 / (1.0 + std::exp(-check_.weight)); }
  Likeness::Foreseen by_likeness(double depth) const noexcept {
    return likeness_.ahead(prior_.earlier, indentation(depth_), indentation(depth), force_);
  }
  void add_likeness(Forces& forces, double weight, double depth) const noexcept {
    if (!like_earlier(depth)) return;
    const Likeness::Foreseen foreseen = by_likeness(depth);
    const double noise = watch_.noise();
    forces.add(weight, foreseen.mean, foreseen.variance + noise * noise);
  }
  /// What law and likeness foresaw for a depth, and by how much likeness was the better one so far.
  struct Check {
    double weight = 2.0, depth = -1e9;
    Likeness::Foreseen like{};
    Forces by_law{}, by_likeness{};
  };
  static constexpr double compared_over = 1e-3;  // [m]
  /// Once in each such travel: which of the two foresaw this force, and what they foresee now.
  void compare() noexcept {
    Check& check = check_;
    const bool asked = check.depth > -1e8;
    if (asked && depth_ < check.depth) return;
    if (asked) {
      const double better =
          (check.by_likeness.density(force_) + 1e-3) / (check.by_law.density(force_) + 1e-3);
      check.weight = std::clamp(0.9 * check.weight + std::log(better), -8.0, 8.0);
      likeness_.came(check.like, force_);
    }
    check.depth = -1e9;
    const double depth = depth_ + compared_over;
    if (!like_earlier(depth) || resting_) return;
    check.depth = depth;
    check.by_law = by_law(bank(), next_puncture(), depth);
    check.like = by_likeness(depth);
    check.by_likeness = {};
    add_likeness(check.by_likeness, 1.0, depth);
  }

  void add_after_puncture(Forces& forces, double weight, double before) const noexcept {
    const Expected& prior = prior_.layer[std::min(pierced_, most_layers - 1)].remainder;
    const Expected left = prior.known() ? prior : Expected{0.55, 0.25};
    const double spread = left.sd * before;
    forces.add(weight, left.mean * before, spread * spread);
  }

  OnlineSettings settings_;
  OnlinePrior prior_;
  laws::TipContact::Prepared contact_;
  events::EventDetector watch_;
  std::array<TissueEstimate, members> bank_{};
  std::array<Waiting, waiting> queue_{};
  std::array<LayerLearnt, most_layers> layers_{};
  std::array<double, most_layers> tops_{};
  Learnt surface_{};
  Likeness likeness_{};
  Check check_{};
  SlopeLately lately_{};
  Reading last_{};
  Open open_{};
  Regime regime_ = Regime::unknown, whole_ = Regime::unknown;
  std::size_t count_ = lengths, waiting_ = 0, pierced_ = 0, changes_ = 0;
  bool started_ = false, outwards_ = false, withdraws_ = false, resting_ = false, broken_ = true;
  double depth_ = 0.0, force_ = 0.0, time_ = 0.0, speed_ = 0.0, deepest_ = -1e9, rest_depth_ = 0.0;
  double intact_from_ = 0.0, rupture_depth_ = 0.0, rupture_force_ = 0.0, rupture_probability_ = 0.0,
         lowest_ = 1e9, lowest_depth_ = 0.0;
  double surprise_ = 0.0, surprise_count_ = 0.0;
};

}  // namespace needleforce::online
