// SPDX-License-Identifier: Apache-2.0
// One identifier next to a second one, one that continues from what was kept, one given planted bytes, and
// the same through the C face. Whatever comes: numbers are finite, intervals hold their median, standard
// deviations are none below zero, and a sample that is refused teaches nothing.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <vector>

#include "../../bindings/c/needleforce_online.h"
#include "needleforce/online/online_identifier.hpp"
#include "needleforce/online/prior_flaw.hpp"
#include "planted.hpp"

namespace needleforce::proof {

/// All numbers that one shows.
struct Shown {
  std::vector<double> numbers;
  bool operator==(const Shown& other) const {
    return std::ranges::equal(numbers, other.numbers, {}, std::bit_cast<std::uint64_t, double>,
                              std::bit_cast<std::uint64_t, double>);
  }
};

inline void add(Shown& shown, const auto& known) {
  shown.numbers.insert(shown.numbers.end(), {known.value, known.sd, known.before});
}
inline void add_layer(Shown& shown, const auto& layer) {
  add(shown, layer.modulus), add(shown, layer.cutting), add(shown, layer.friction);
  shown.numbers.insert(shown.numbers.end(),
                       {layer.top, layer.puncture_depth, layer.puncture_force, layer.remaining,
                        layer.probability, double(layer.touched), double(layer.pierced)});
}
inline Shown parameters(const online::OnlineIdentifier& online) {
  Shown shown;
  for (std::size_t k = 0; k < online.pierced() + 2; ++k) add_layer(shown, online.layer(k));
  add(shown, online.surface());
  shown.numbers.insert(shown.numbers.end(),
                       {online.innovation(), double(online.regime()), double(online.pierced())});
  return shown;
}
inline Shown parameters(const nf_online* online) {
  Shown shown;
  nf_layer_learnt layer;
  nf_learnt surface;
  for (std::size_t k = 0; k < nf_online_pierced(online) + 2; ++k)
    nf_online_layer(online, k, &layer), add_layer(shown, layer);
  nf_online_surface(online, &surface);
  add(shown, surface);
  shown.numbers.insert(shown.numbers.end(), {nf_online_innovation(online), double(nf_online_regime(online)),
                                             double(nf_online_pierced(online))});
  return shown;
}
inline Shown foreseen(const online::ForceAhead& ahead) {
  Shown shown;
  for (const auto& at : ahead.at)
    shown.numbers.insert(shown.numbers.end(), {at.depth, at.force, at.low, at.high});
  shown.numbers.insert(shown.numbers.end(),
                       {ahead.puncture_probability, ahead.puncture_depth, ahead.earliest, ahead.latest});
  return shown;
}
inline Shown foreseen(const nf_online* online, double travel) {
  Shown shown;
  nf_ahead ahead;
  nf_online_ahead(online, travel, &ahead);
  for (std::size_t i = 0; i < NF_AHEAD_POINTS; ++i)
    shown.numbers.insert(shown.numbers.end(), {ahead.depth[i], ahead.force[i], ahead.low[i], ahead.high[i]});
  shown.numbers.insert(shown.numbers.end(),
                       {ahead.puncture_probability, ahead.puncture_depth, ahead.earliest, ahead.latest});
  return shown;
}

class LearnTrial {
 public:
  using OnlineIdentifier = online::OnlineIdentifier;

  LearnTrial(const online::OnlinePrior& prior, const online::OnlineSettings& settings,
             const events::EventSettings& watched, nf_online* c)
      : online_(prior, settings, watched), twin_(online_), shadow_(online_), c_(c) {
    keep();
  }

  void keep() { *kept_ = online_.save(); }
  void restore(std::size_t where, std::uint64_t change) {
    require(online_.restore(*kept_) && twin_.restore(*kept_), "what was kept is taken back");
    require(!c_ || nf_online_restore(c_, kept_.get(), sizeof *kept_), "by the C face too");
    shadow_ = online_.snapshot();
    planted_.restore(online_, [&](auto& saved) { plant(saved, where, change); });
  }
  void reset() {
    online_.reset(), twin_.reset(), shadow_.reset();
    if (c_) nf_online_reset(c_);
  }

  void step(double force, double depth, double dt) {
    const bool bad = !(std::abs(force) <= 1e6) || !(std::abs(depth) <= 1e3) || !(dt >= 0.0 && dt <= 1e9);
    const Shown before = bad ? parameters(online_) : Shown{};
    online_.step(force, depth, dt), twin_.step(force, depth, dt), shadow_.step(force, depth, dt);
    nf_event event;
    if (c_) nf_online_step(c_, force, depth, dt, &event);
    const auto status = online_.status();
    const bool refused =
        status == events::StreamStatus::bad_time || status == events::StreamStatus::not_finite;
    require(!bad || refused, "bad input is reported");
    require(!bad || before == parameters(online_), "a sample that is refused teaches nothing");
    planted_.step([](const events::Detection& made) { return std::array{made.time, made.depth}; }, force,
                  depth, dt);
  }
  /// What it knows now, and over the next travel.
  void look(double travel) const {
    const Shown shown = parameters(online_), ahead = foreseen(online_.ahead(travel));
    require(shown == parameters(twin_) && ahead == foreseen(twin_.ahead(travel)),
            "the same stream teaches the same");
    require(shown == parameters(shadow_) && ahead == foreseen(shadow_.ahead(travel)),
            "what was taken back continues as before");
    if (c_) require(shown == parameters(c_) && ahead == foreseen(c_, travel), "the C face learns to the bit");
    check(online_, travel);
    if (planted_.engine()) check(*planted_.engine(), travel);
  }

 private:
  static void check(const OnlineIdentifier& online, double travel) {
    for (const double number : parameters(online).numbers)
      require(std::isfinite(number), "every number is finite");
    require(online.surface().sd >= 0.0 && online.innovation() >= 0.0, "no spread is below zero");
    for (std::size_t k = 0; k <= online.pierced(); ++k) {
      const auto layer = online.layer(k);
      for (const auto& known : {layer.modulus, layer.cutting, layer.friction})
        require(known.sd >= 0.0, "no standard deviation is below zero");
      require(layer.remaining >= 0.0 && layer.remaining <= 1.0, "a share is one");
      require(layer.probability >= 0.0 && layer.probability <= 1.0, "a probability is one");
    }
    check(online.ahead(travel));
  }
  static void check(const online::ForceAhead& ahead) {
    for (const double number : foreseen(ahead).numbers)
      require(std::isfinite(number), "what is foreseen is finite");
    for (const auto& at : ahead.at)
      require(at.low <= at.force && at.force <= at.high, "an interval holds its median");
    require(ahead.puncture_probability >= 0.0 && ahead.puncture_probability <= 1.0, "a probability is one");
    require(ahead.earliest <= ahead.puncture_depth && ahead.puncture_depth <= ahead.latest,
            "quantiles have an order");
  }

  OnlineIdentifier online_, twin_, shadow_;
  nf_online* c_;
  std::unique_ptr<OnlineIdentifier::Saved> kept_ = std::make_unique<OnlineIdentifier::Saved>();
  Planted<OnlineIdentifier> planted_;
};

}  // namespace needleforce::proof
