// SPDX-License-Identifier: Apache-2.0
// Parameters of a tissue while the needle moves, and the force ahead of it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "../events/event_detector.hpp"
#include "../state_bytes.hpp"
#include "../state_check.hpp"
#include "breaking_layer.hpp"
#include "expected_force.hpp"
#include "force_ahead.hpp"
#include "likeness.hpp"
#include "online_prior.hpp"
#include "online_settings.hpp"
#include "prior_fingerprint.hpp"
#include "regime.hpp"
#include "tissue_learnt.hpp"
#include "waiting_readings.hpp"

namespace needleforce::online {

/// One sample in; parameters with covariance, and the force ahead, out. Within a regime the force is linear
/// in the parameters; events open and close regimes; a bank of hypotheses on texture and prior is weighted by
/// what each foresaw. Trivially copyable, without heap; the work of a step is bounded.
class OnlineIdentifier {
 public:
  explicit OnlineIdentifier(const OnlinePrior& prior = {}, const OnlineSettings& settings = {},
                            const events::EventSettings& watched = {}) noexcept
      : settings_(settings), tissue_(prior), watch_(watched) {
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
    depth_ = force_ = time_ = speed_ = rest_depth_ = lowest_depth_ = 0.0;
    changes_ = 0;
    deepest_ = -1e9;
    lowest_ = 1e9;
    interrupt();
  }
  OnlineIdentifier snapshot() const noexcept { return *this; }

  /// What it has seen, as bytes that may leave the process. Wait-free.
  using Saved = StateBytes<OnlineIdentifier>;
  Saved save() const noexcept { return state_bytes(*this, made_with()); }
  /// Takes it back, or returns false and changes nothing, as an `EventDetector`. Wait-free.
  bool restore(const Saved& bytes) noexcept {
    if (restore_fault(bytes)) return false;
    *this = with_own_prior(bytes);
    return true;
  }
  /// Why `restore` refuses it, as the part that is at fault, or nullptr. Wait-free.
  const char* restore_fault(const Saved& bytes) const noexcept {
    if (const char* foreign = foreign_part(bytes, made_with())) return foreign;
    StateCheck check;
    with_own_prior(bytes).look_at(check, events::EventDetector(watch_.settings()));
    return check.fault();
  }

  events::StreamStatus status() const noexcept { return watch_.status(); }
  Regime regime() const noexcept {
    if (resting_) return Regime::rest;
    if (!tissue_.law.outwards || regime_ == Regime::free || regime_ == Regime::unknown) return regime_;
    return withdraws_ ? Regime::withdrawal : Regime::reversing;
  }
  const events::EventDetector& detector() const noexcept { return watch_; }
  const OnlineSettings& settings() const noexcept { return settings_; }
  const OnlinePrior& prior() const noexcept { return tissue_.prior; }
  double depth() const noexcept { return depth_; }
  double force() const noexcept { return force_ + watch_.zero(); }
  /// What the sensor reads without a force [N].
  double zero() const noexcept { return watch_.zero(); }
  double speed() const noexcept { return speed_; }
  /// Where the tissue begins [m]: the event's depth, moved by what the contact has shown.
  Learnt surface() const noexcept {
    return regime_ == Regime::contact ? tissue_.surface_seen(depth_) : tissue_.surface();
  }
  std::size_t pierced() const noexcept { return tissue_.law.pierced; }
  /// Normalised innovation squared of the last readings: 1 where the intervals keep what they promise.
  double innovation() const noexcept { return surprise_.mean(); }
  /// Changes of the tissue that were taken for such, apart from punctures.
  std::size_t changes() const noexcept { return changes_; }

  /// Layer `k` from the surface, 0 the first. Wait-free.
  LayerLearnt layer(std::size_t k) const noexcept {
    if (regime_ == Regime::rupture && k == pierced())
      return tissue_.breaking(breaking_.layer(force_), {depth_, force_});
    return tissue_.layer(k);
  }

  /// The force over the next travel [m], 0 to 1, in the direction of the last motion. Allocates nothing.
  ForceAhead ahead(double asked) const noexcept {
    const double travel = asked > 0.0 ? std::min(asked, 1.0) : 0.0;
    ForceAhead result;
    const NextPuncture next = tissue_.next_puncture();
    const ExpectedForce expected = this->expected(next);
    for (std::size_t i = 0; i < ForceAhead::points; ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(ForceAhead::points - 1);
      const double depth = depth_ + (tissue_.law.outwards ? -1.0 : 1.0) * share * travel;
      Forces forces;
      const double like = like_earlier(depth) ? check_.likely(share * travel) : 0.0;
      forces.add(1.0 - like, expected.at(depth));
      add_likeness(forces, like, depth);
      const auto read = [&](double p) { return zero() + forces.quantile(p); };
      result.at[i] = {depth, read(0.5), read(0.025), read(0.975)};
    }
    if (!follows_law() || tissue_.law.outwards) return result;
    result.puncture_probability = next.between(depth_, depth_ + travel);
    result.earliest = next.quantile(depth_, 0.025);
    result.puncture_depth = next.quantile(depth_, 0.5);
    result.latest = next.quantile(depth_, 0.975);
    return result;
  }

 private:
  static constexpr double leap = 5e-3, fastest = 1.0;  // as the detector has it
  // square of one innovation that no texture has: the sensor was re-zeroed, or a fall was too small to be one
  static constexpr double leap_of_level = 64.0;

  void begin_anew() noexcept {
    regime_ = Regime::unknown;
    tissue_.begin();
    check_ = {};
    surprise_ = {};
    withdraws_ = resting_ = leapt_ = false;
    readings_.forget();
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
    deepest_ = event.depth;
    tissue_.touch(event.depth, settings_.spacing, watch_.noise());
  }
  void leave() noexcept {
    settle(1e9);
    tissue_.leave();
    regime_ = Regime::free;
    withdraws_ = false;
    interrupt();
  }
  void begin_rupture(const events::Detection& event) noexcept {
    if (regime_ != Regime::contact && regime_ != Regime::sliding) return;
    settle(event.depth);
    interrupt();
    if (regime_ == Regime::contact) tissue_.keep_surface(depth_);
    breaking_.begin(event, force_, regime_);
    regime_ = Regime::rupture;
  }
  void end_rupture(double depth) noexcept {
    if (regime_ != Regime::rupture) return;
    regime_ = Regime::sliding;
    if (!tissue_.pierce(breaking_.layer(force_), depth, {depth_, force_})) return change();
    interrupt();
  }
  /// Outwards, or inwards again.
  void turn(double depth) noexcept {
    settle(1e9);
    if (regime_ == Regime::rupture && breaking_.likely()) end_rupture(depth);
    if (regime_ == Regime::rupture) regime_ = breaking_.whole();  // the force fell because the needle turned
    tissue_.law.outwards = depth_ < depth;
    tissue_.go_in();
    turned_at_ = depth;
    withdraws_ = false;
    lowest_ = 1e9;
    interrupt();
  }
  /// The tissue is another one: what was learnt of this layer is forgotten.
  void change() noexcept {
    ++changes_;
    tissue_.expect_anew({depth_, force_});
    surprise_ = {};
  }

  // ---- readings

  void read(const events::Detection& event, double force, double depth, double dt) noexcept {
    if (status() == events::StreamStatus::gap) interrupt();
    if (std::abs(depth - depth_) > leap + fastest * dt && started_) begin_anew();
    if (dt > 0.0 && started_)
      speed_ +=
          std::min(1.0, dt / watch_.settings().within) * ((depth - depth_) / std::max(dt, 1e-9) - speed_);
    started_ = true;
    force -= watch_.zero();
    depth_ = depth;
    force_ = force;
    time_ += dt;
    take(event);
    if (regime_ == Regime::unknown && status() == events::StreamStatus::ok) regime_ = Regime::free;
    if (regime_ == Regime::free && status() == events::StreamStatus::wrong_sign) regime_ = Regime::unknown;
    if (resting_ && std::abs(depth - rest_depth_) > settings_.spacing) resting_ = false;
    if (regime_ == Regime::rupture) watch_rupture();
    compare();
    if (status() == events::StreamStatus::stuck) return interrupt();
    if (!measures()) return;
    lately_.add(force, depth);
    collect(force, depth);
    settle_older(time_ - watch_.settings().within);
  }
  void watch_rupture() noexcept {
    if (breaking_.came_back(force_, watch_.noise()))
      regime_ = breaking_.whole();
    else if (breaking_.stays(depth_))
      end_rupture(depth_);
  }
  /// Whether a force is expected here that depends on the parameters.
  bool measures() noexcept {
    if (resting_) return false;
    if (tissue_.law.outwards) return follows_withdrawal();
    if (regime_ != Regime::contact && regime_ != Regime::sliding) return false;
    const bool onwards = depth_ > deepest_ - 4.0 * watch_.settings().depth_noise;
    deepest_ = std::max(deepest_, depth_);
    return onwards;
  }
  /// Friction has turned once the force has passed its lowest by half a millimetre.
  bool follows_withdrawal() noexcept {
    if (tissue_.law.pierced == 0 || regime_ != Regime::sliding) return false;
    if (force_ < lowest_) {
      lowest_ = force_;
      lowest_depth_ = depth_;
    }
    if (!withdraws_ && force_ < 0.0 && lowest_depth_ - depth_ > 5e-4) {
      withdraws_ = true;
      tissue_.withdraw();
    }
    if (!withdraws_) return false;
    tissue_.go_out(depth_);
    return depth_ > tissue_.law.tops[0] && !tissue_.law.between_layers(depth_);
  }
  void interrupt() noexcept {
    lately_.restart();
    readings_.interrupt();
  }

  void collect(double force, double depth) noexcept {
    readings_.add(force, depth);
    const double spacing = std::max(settings_.spacing, std::abs(speed_) * watch_.settings().within / 8.0);
    if (!readings_.complete(depth, spacing)) return;
    if (readings_.full()) settle_first();
    readings_.close(time_, reading(readings_.mean_depth(), readings_.mean_force(force)));
  }
  Reading reading(double depth, double force) const noexcept {
    Reading result;
    result.depth = depth;
    result.force = force;
    result.size = std::hypot(watch_.noise(), settings_.roughness * force);
    // what a hold has relaxed comes back on the way
    if (tissue_.law.outwards)
      result.size = std::hypot(result.size, 0.2 * force * std::exp(-(turned_at_ - depth) / 1e-3));
    result.by = tissue_.law.by_parameters(tissue_.prior, depth);
    return result;
  }

  // ---- what was read becomes known once no event can date from before it

  void settle_first() noexcept {
    if (leapt_) return pass_leap();
    const Innovation found = tissue_.learn(readings_.first(), settings_.memory);
    readings_.drop_first();
    surprise_.add(found.squared);
    // a friction that is another outwards contradicts the law, but is no other tissue
    if (tissue_.law.outwards) return;
    const double chance = settings_.false_changes * std::max(settings_.spacing, 1e-6);
    leapt_ = found.squared > leap_of_level;
    if (leapt_ || (found.widening <= 2.0 && surprise_.beyond(chance))) change();
  }
  /// A leap may be in the middle of a reading, so that the next one has its rest.
  void pass_leap() noexcept {
    leapt_ = false;
    readings_.drop_first();
    readings_.part();
    if (regime_ == Regime::contact)
      tissue_.doubt_zero(std::abs(force_) + std::abs(tissue_.bank.last().force));
  }
  void settle_older(double time) noexcept {
    for (int i = 0; i < 2 && readings_.any() && readings_.time_of_first() < time; ++i) settle_first();
  }
  /// Everything above a depth now, and the rest never.
  void settle(double to) noexcept {
    while (readings_.any() && readings_.first().depth <= to) settle_first();
    readings_.forget();
  }
  // ---- what is known

  bool follows_law() const noexcept {
    return (regime_ == Regime::contact || regime_ == Regime::sliding) &&
           (!tissue_.law.outwards || withdraws_);
  }
  ExpectedForce expected(const NextPuncture& next) const noexcept {
    const double size =
        std::max(std::abs(force_), regime_ == Regime::rupture ? std::abs(breaking_.whole_force()) : 0.0);
    const Moment now{depth_,         force_,        readings_.mean_force(force_), size,
                     watch_.noise(), follows_law(), regime_ == Regime::free,      regime_ == Regime::unknown};
    return {tissue_.prior, settings_, tissue_.law, tissue_.bank, lately_, next, now, tissue_.next_contact()};
  }

  // ---- likeness to earlier insertions

  double indentation(double depth) const noexcept { return depth - tissue_.top(); }
  /// Whether earlier insertions have been at this depth.
  bool like_earlier(double depth) const noexcept {
    return tissue_.touched() && !tissue_.law.outwards && tissue_.prior.earlier.known(indentation(depth));
  }
  Likeness::Foreseen by_likeness(double depth) const noexcept {
    return check_.likeness().ahead(tissue_.prior.earlier, indentation(depth_), indentation(depth), force_);
  }
  void add_likeness(Forces& forces, double weight, double depth) const noexcept {
    if (!like_earlier(depth)) return;
    const Likeness::Foreseen foreseen = by_likeness(depth);
    const double noise = watch_.noise();
    forces.add(weight, foreseen.mean, foreseen.variance + noise * noise);
  }
  /// Once in each such travel: which of the two foresaw this force, and what they foresee now.
  void compare() noexcept {
    if (check_.waits(depth_)) return;
    check_.came(force_);
    const double depth = depth_ + LawOrLikeness<Forces>::compared_over;
    if (!like_earlier(depth) || resting_) return;
    Forces like;
    add_likeness(like, 1.0, depth);
    check_.foresee(depth, expected(tissue_.next_puncture()).at(depth), by_likeness(depth), like);
  }

  std::uint64_t made_with() const noexcept {
    return fingerprint(tissue_.prior, tissue_.law.contact(), settings_, watch_.settings());
  }
  /// What this one was made with is never taken from outside.
  OnlineIdentifier with_own_prior(const Saved& bytes) const noexcept {
    OnlineIdentifier made = bytes.state();
    made.settings_ = settings_;
    made.tissue_.take_prior(tissue_);
    return made;
  }
  void look_at(StateCheck& check, const events::EventDetector& fresh) const noexcept {
    watch_.look_at(check, fresh);
    tissue_.check(check);
    readings_.check(check);
    check_.check(check);
    lately_.check(check);
    surprise_.check(check);
    breaking_.check(check);
    check.word("regime", regime_, Regime::rest);
    for (const bool* flag : {&started_, &withdraws_, &resting_, &leapt_}) check.flag("flags", *flag);
    check.numbers(
        "numbers",
        std::array{depth_, force_, time_, speed_, deepest_, rest_depth_, lowest_, lowest_depth_, turned_at_},
        1e15);
  }

  OnlineSettings settings_;
  TissueLearnt tissue_;
  events::EventDetector watch_;
  WaitingReadings readings_{};
  LawOrLikeness<Forces> check_{};
  SlopeLately lately_{};
  Surprise surprise_{};
  BreakingLayer breaking_{};
  Regime regime_ = Regime::unknown;
  std::size_t changes_ = 0;
  bool started_ = false, withdraws_ = false, resting_ = false, leapt_ = false;
  double depth_ = 0.0, force_ = 0.0, time_ = 0.0, speed_ = 0.0, deepest_ = -1e9, rest_depth_ = 0.0;
  double turned_at_ = 0.0, lowest_ = 1e9, lowest_depth_ = 0.0;
};

}  // namespace needleforce::online
