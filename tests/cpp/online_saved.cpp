// SPDX-License-Identifier: Apache-2.0
// What is learnt, through the C face and from saved bytes: the same bits, and what is refused.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "../../bindings/c/needleforce_online.h"
#include "needleforce/online/online_identifier.hpp"
#include "timed_readings.hpp"

namespace {

using namespace needleforce;
using online::OnlineIdentifier;
using online::OnlinePrior;

/// Through two layers and out.
std::vector<TimedReading> learner_stream() {
  return timed_readings(1400, 1.2e-5, [](int i, double depth) {
    const double past = std::max(depth - 2e-3, 0.0);
    return i >= 1400 ? -30.0 * past : past < 4e-3 ? 8e4 * past * past : 0.3 + 60.0 * past;
  });
}

OnlinePrior prior() {
  OnlinePrior prior;
  prior.layers = 1;
  prior.tip = tips::Cone{0.5};
  prior.layer[0].modulus = {2e5, 1e5};
  prior.layer[0].puncture = {4e-3, 5e-4};
  return prior;
}

struct InC {
  std::vector<double> memory = std::vector<double>(nf_online_size() / sizeof(double) + 1);
  nf_fault why{};
  nf_layer_prior layer{{2e5, 1e5}, {}, {}, {}, {4e-3, 5e-4}, {}};
  nf_tip tip{"cone", {{"half_angle", 0.5}}, nullptr, nullptr, nullptr, 0};
  nf_prior prior{&layer, 1, 1, 0, 0.0, &tip, nullptr, nullptr, 0.0};

  nf_online* made(const std::vector<nf_parameter>& settings = {}) {
    return nf_online_init(memory.data(), nf_online_size(), &prior, settings.data(), settings.size(), &why);
  }
};

TEST(OnlineInC, LearnsToTheBitAsInCpp) {
  OnlineIdentifier same(prior(), {.memory = 4e-3}, {.fall = 0.2});
  InC given;
  nf_online* online = given.made({{"fall", 0.2}, {"memory", 4e-3}});
  ASSERT_NE(online, nullptr);
  int punctures = 0;
  for (const auto& [force, depth, dt] : learner_stream()) {
    nf_event event;
    punctures += nf_online_step(online, force, depth, dt, &event) == NF_PUNCTURE;
    ASSERT_EQ(event.kind, int(same.step(force, depth, dt).kind));
    ASSERT_EQ(nf_online_regime(online), int(same.regime()));
    ASSERT_EQ(nf_online_status(online), int(same.status()));
  }
  EXPECT_EQ(punctures, 1);
  EXPECT_EQ(nf_online_pierced(online), same.pierced());
  EXPECT_EQ(nf_online_innovation(online), same.innovation());
  nf_layer_learnt layer;
  nf_online_layer(online, 0, &layer);
  EXPECT_EQ(layer.pierced, 1);
  EXPECT_EQ(layer.modulus.value, same.layer(0).modulus.value);
  EXPECT_EQ(layer.modulus.before, 1e5);
  EXPECT_EQ(layer.friction.sd, same.layer(0).friction.sd);
  EXPECT_NEAR(layer.puncture_depth, 6e-3, 1e-4);
  nf_learnt surface;
  nf_online_surface(online, &surface);
  EXPECT_EQ(surface.value, same.surface().value);
  nf_ahead ahead;
  nf_online_ahead(online, 2e-3, &ahead);
  for (std::size_t i = 0; i < NF_AHEAD_POINTS; ++i) EXPECT_EQ(ahead.high[i], same.ahead(2e-3).at[i].high);
  EXPECT_STREQ(nf_regime_name(NF_REGIME_WITHDRAWAL), "withdrawal");
  EXPECT_STREQ(nf_regime_name(99), "unknown");
}

TEST(OnlineInC, RefusedPriorsAndSettingsHaveAReason) {
  InC given;
  EXPECT_EQ(given.made({{"spacing", 0.0}}), nullptr);
  EXPECT_STREQ(given.why.quantity, "spacing");
  EXPECT_EQ(given.made({{"within", 0.0}}), nullptr);
  EXPECT_STREQ(given.why.quantity, "within");
  EXPECT_EQ(given.made({{"stiffness", 1.0}}), nullptr);
  EXPECT_STREQ(given.why.reason, "is no parameter of it");
  EXPECT_EQ(given.made({{"memory", 0.01}, {"memory", 0.01}}), nullptr);
  EXPECT_STREQ(given.why.reason, "is given twice");
  for (const double bad : {-1.0, double(NAN), 1e300, 1e-300}) {
    given.layer.puncture.sd = bad;
    EXPECT_EQ(given.made(), nullptr) << bad;
    EXPECT_STREQ(given.why.quantity, "puncture");
  }
  given.layer.puncture.sd = 0.0;
  given.prior.spacing = 1e-4;  // without forces
  EXPECT_EQ(given.made(), nullptr);
  given.prior.spacing = 0.0;
  given.prior.punctures = 9;
  EXPECT_EQ(given.made(), nullptr);
  EXPECT_STREQ(given.why.law, "prior");
  given.prior.punctures = 1;
  given.tip.name = "spoon";
  EXPECT_EQ(given.made(), nullptr);
  EXPECT_STREQ(given.why.quantity, "tip");
  EXPECT_EQ(nf_online_init(given.memory.data(), 8, nullptr, nullptr, 0, &given.why), nullptr);
  EXPECT_STREQ(given.why.law, "memory");
}

TEST(OnlineInC, SnapshotIsTakenBackAndOneOfAnotherPriorIsNot) {
  InC one, other;
  other.layer.modulus.mean = 3e5;
  nf_online *online = one.made(), *stiffer = other.made();
  std::vector<unsigned char> bytes(nf_online_snapshot_size());
  nf_event event;
  nf_layer_learnt before, after;
  const auto samples = learner_stream();
  for (std::size_t i = 0; i < 800; ++i)
    nf_online_step(online, samples[i].force, samples[i].depth, samples[i].dt, &event);
  nf_online_layer(online, 0, &before);
  ASSERT_EQ(nf_online_snapshot(online, bytes.data(), bytes.size()), 1);
  EXPECT_EQ(nf_online_snapshot(online, bytes.data(), bytes.size() - 1), 0);
  nf_online_reset(online);
  EXPECT_EQ(nf_online_restore(online, bytes.data(), bytes.size() - 1), 0);
  EXPECT_EQ(nf_online_restore(stiffer, bytes.data(), bytes.size()), 0);
  EXPECT_EQ(nf_online_restore(online, bytes.data(), bytes.size()), 1);
  nf_online_layer(online, 0, &after);
  EXPECT_EQ(before.modulus.value, after.modulus.value);
  EXPECT_EQ(before.modulus.sd, after.modulus.sd);
  bytes[20000] ^= 1;
  EXPECT_EQ(nf_online_restore(online, bytes.data(), bytes.size()), 0);
}

TEST(OnlineSaved, PlantedBytesAreRefusedOrGiveFiniteNumbers) {
  constexpr double infinite = std::numeric_limits<double>::infinity(), below_zero = -1e-105;
  const auto samples = learner_stream();
  OnlineIdentifier learner(prior());
  for (std::size_t i = 0; i < 800; ++i) learner.step(samples[i].force, samples[i].depth, samples[i].dt);
  const auto saved = std::make_unique<OnlineIdentifier::Saved>(learner.save());
  const auto made = std::make_unique<OnlineIdentifier>(learner);
  std::size_t refused = 0;
  for (std::size_t i = 0; i < saved->words.size(); ++i)
    for (const double number :
         {infinite - infinite, 1e300, -1e9, below_zero, std::bit_cast<double>(0x0202020202020202ull)}) {
      if (i % 7 != 0 && number != below_zero) continue;
      const auto word = std::bit_cast<std::uint64_t>(number);
      const std::uint64_t before = std::exchange(saved->words[i], word);
      saved->checksum = saved->sum();
      const bool taken = made->restore(*saved);
      saved->words[i] = before;
      if (!taken && ++refused) continue;
      made->step(0.5, 8.1e-3, 2.5e-3);
      const auto last = made->ahead(1e-3).at.back();
      ASSERT_TRUE(std::isfinite(last.low + last.force + last.high)) << i << " " << number;
      ASSERT_TRUE(std::isfinite(made->layer(0).modulus.sd)) << i;
      ASSERT_GE(made->layer(0).modulus.sd, 0.0) << i << " " << number;
      ASSERT_GE(made->surface().sd, 0.0) << i << " " << number;
    }
  EXPECT_GT(refused, saved->words.size() / 7);
}

}  // namespace
