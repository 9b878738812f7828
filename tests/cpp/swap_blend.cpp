// SPDX-License-Identifier: Apache-2.0
// What a replaced model does to the force, against closed forms: the blend, what is kept, what is kept out.
#include <gtest/gtest.h>

#include "every_model.hpp"
#include "needleforce/live.hpp"

namespace {

/// Moves the tip in steps of 10 um, or rests, and returns the last sample.
Sample go(LiveInsertion& live, double from, double to) {
  Sample sample;
  const int n = std::max(1, static_cast<int>(std::lround(std::abs(to - from) / 1e-5)));
  for (int i = 1; i <= n; ++i) sample = live.step(from + (to - from) * i / n, no_velocity, 1e-3);
  return sample;
}
Sample rest(LiveInsertion& live, double depth, double time) {
  Sample sample;
  for (int i = 0; i < std::lround(time / 1e-3); ++i) sample = live.step(depth, no_velocity, 1e-3);
  return sample;
}

const double pressed = 2.0 / std::numbers::pi * std::tan(paper::half_angle) * 2e-3 * 2e-3;

TEST(Blend, ForceRisesLinearlyFromTheOldToTheNewModel) {
  for (const double blend : {5e-3, 10e-3, 80e-3}) {
    LiveInsertion live(paper::one(paper::model(100e3)), blend);
    EXPECT_NEAR(go(live, -1e-3, 2e-3).force, 100e3 * pressed, 1e-12);
    live.replace(paper::one(paper::model(160e3)));
    for (int i = 1; i < 100; ++i) {
      const double share = std::min(1.0, i * 1e-3 / blend);
      const Sample sample = live.step(2e-3, no_velocity, 1e-3);
      EXPECT_NEAR(sample.force, (100e3 + 60e3 * share) * pressed, 1e-12) << i;
      EXPECT_NEAR(sample.stiffness, sample.force, 1e-12);
      EXPECT_NEAR(sample.force_by_depth, 2.0 * sample.force / 2e-3, 1e-9);
      EXPECT_EQ(live.blending(), i < std::lround(blend / 1e-3));
    }
    EXPECT_EQ(live.taken(), 1u);
  }
}

TEST(Blend, ZeroBlendTimeSwitchesAtOnce) {
  for (const double blend : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    LiveInsertion live(paper::one(paper::model(100e3)), blend);
    go(live, -1e-3, 2e-3);
    live.replace(paper::one(paper::model(160e3)));
    EXPECT_NEAR(live.step(2e-3, no_velocity, 1e-3).force, 160e3 * pressed, 1e-12);
  }
}

TEST(Blend, NewestWaitingModelFollowsTheBlend) {
  LiveInsertion live(paper::one(paper::model(100e3)), 10e-3);
  go(live, -1e-3, 2e-3);
  live.replace(paper::one(paper::model(110e3)));
  rest(live, 2e-3, 4e-3);
  live.replace(paper::one(paper::model(900e3)));
  live.replace(paper::one(paper::model(120e3)));
  EXPECT_NEAR(rest(live, 2e-3, 6e-3).force, 110e3 * pressed, 1e-12);
  EXPECT_NEAR(rest(live, 2e-3, 5e-3).force, 115e3 * pressed, 1e-12);
  EXPECT_NEAR(rest(live, 2e-3, 9.0).force, 120e3 * pressed, 1e-12);
  EXPECT_EQ(live.taken(), 2u);
}

TEST(Blend, RefusedStepDoesNotAdvanceTheBlend) {
  LiveInsertion live(paper::one(paper::model(100e3)), 10e-3, Limits{.hold_time = 1.0});
  const double before = go(live, -1e-3, 2e-3).force;
  live.replace(paper::one(paper::model(160e3)));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -1.0, 0.0}) {
    const Sample sample = live.step(2e-3, 0.0, bad);
    EXPECT_NE(sample.status, Status::ok);
    EXPECT_TRUE(sample.force == 0.0 || sample.force == before);
  }
  EXPECT_NEAR(live.step(2e-3, 0.0, 1e-3).force, 106e3 * pressed, 1e-12);
  EXPECT_EQ(live.step(0.3, no_velocity, 1e-3).status, Status::outside_range);
  EXPECT_NEAR(live.step(2e-3, 0.0, 7e-3).force, 154e3 * pressed,
              1e-12);  // the refused time counts, as it passed
}

TEST(Blend, LateralForceFollowsTheCuttingForce) {
  const Bevel bevel{20.0 * tips::degree, 0.1, 0.5};
  Model stronger = paper::model();
  stronger.cutting = laws::ConstantCutting{0.2, 20e-6};
  LiveInsertion live(paper::one(paper::model()), 10e-3, {}, bevel);
  const double before = go(live, -1e-3, 6e-3).lateral;
  live.replace(paper::one(stronger));
  EXPECT_NEAR(rest(live, 6e-3, 5e-3).lateral, before * (1.0 + 0.5 * (0.2 / paper::cutting - 1.0)), 1e-12);
}

TEST(Kept, IdenticalModelKeepsEveryBit) {
  for (const Model& model : every_model()) {
    LiveInsertion live(paper::one(model));
    Insertion alone(model);
    std::mt19937_64 generator{1};
    double depth = -1e-3, target = 10e-3;
    for (int i = 0; i < 3000; ++i) {
      if (generator() % 200 == 0) target = -2e-3 + 14e-6 * static_cast<double>(generator() % 1000);
      depth += std::clamp(target - depth, -2e-5, 2e-5);
      if (generator() % 20 == 0) live.replace(paper::one(model));
      const Sample swapped = live.step(depth, no_velocity, 1e-3),
                   plain = alone.step(depth, no_velocity, 1e-3);
      ASSERT_EQ(swapped.force, plain.force) << name_of(model) << " step " << i;
      ASSERT_EQ(swapped.force_by_depth, plain.force_by_depth) << name_of(model);
      ASSERT_EQ(swapped.phase, plain.phase);
      ASSERT_EQ(swapped.punctured, plain.punctured);
      ASSERT_EQ(swapped.contact, plain.contact);
      ASSERT_EQ(swapped.exit, plain.exit);
    }
    EXPECT_GT(live.taken(), 50u);
  }
}

TEST(Kept, RelaxedShareIsKept) {
  Model model = paper::model(100e3);
  model.relaxation = laws::Prony{0.4, 0.5, 0.0, 5.0};
  LiveInsertion live(paper::one(model), 0.0);
  go(live, -1e-3, 2e-3);
  const double before = rest(live, 2e-3, 1.0).force;
  model.stiffness = laws::Cone{250e3, paper::half_angle};
  live.replace(paper::one(model));
  const double left = std::exp(-1e-3 / 0.5), lasting = 0.6 * 100e3 * pressed;
  EXPECT_NEAR(rest(live, 2e-3, 1e-3).force, 2.5 * (lasting + (before - lasting) * left), 1e-9);
  EXPECT_NEAR(rest(live, 2e-3, 20.0).force, 2.5 * lasting, 1e-9);
  // a slower or smaller fading goes on from there too, and none at all is the whole contact again
  model.relaxation = laws::Prony{0.2, 3.0, 0.0, 5.0};
  live.replace(paper::one(model));
  EXPECT_NEAR(rest(live, 2e-3, 1.0).force, 0.8 * 250e3 * pressed, 1e-9);
  model.relaxation = laws::NoRelaxation{};
  live.replace(paper::one(model));
  EXPECT_NEAR(rest(live, 2e-3, 1.0).force, 250e3 * pressed, 1e-9);
}

TEST(Kept, FrictionAtRestStaysWithinTheNewLimits) {
  Model model = paper::model();
  LiveInsertion live(paper::one(model), 0.0);
  const double cut = paper::cutting, held = paper::friction * 8e-3;
  EXPECT_NEAR(go(live, -1e-3, 8e-3).force, held + cut, 1e-9);
  model.friction = laws::Coulomb{30.0, 20e-6, 0.0};  // more may be held, but nothing moved
  live.replace(paper::one(model));
  EXPECT_NEAR(rest(live, 8e-3, 1.0).force, held + cut, 1e-9);
  EXPECT_NEAR(go(live, 8e-3, 8.1e-3).force, 30.0 * 8.1e-3 + cut, 1e-9);
  model.friction = laws::LuGre{1e6, 0.0, 0.0, 5.0, 5.0, 1e-3, 2.0};  // less is held at once
  live.replace(paper::one(model));
  EXPECT_NEAR(rest(live, 8.1e-3, 1.0).force, 5.0 * 8.1e-3 + cut, 1e-9);
}

TEST(Kept, ExistingHoleIsNotCutAgain) {
  for (const Cutting& first : each<Cutting>())
    for (const Cutting& second : each<Cutting>()) {
      Model model = paper::model();
      model.friction = laws::Coulomb{0.0, 20e-6, 0.0};
      model.cutting = first;
      LiveInsertion live(paper::one(model), 0.0);
      go(live, -1e-3, 8e-3);
      rest(live, go(live, 8e-3, 5e-3).depth, 0.1);
      const double cut = live.deepest_cut();
      model.cutting = second;
      live.replace(paper::one(model));
      double most = 0.0;
      // a slit that stays spread pushes on the way; an edge does not before it is at the crack's tip
      const double spread =
          std::holds_alternative<laws::Fracture>(second) ? std::get<laws::Fracture>(second).spreading() : 0.0;
      for (int i = 0; i <= 200; ++i)
        most = std::max(most, live.step(5e-3 + 1e-5 * i, no_velocity, 1e-3).cutting);
      EXPECT_LE(most, spread + 1e-12) << name_of(first) << " then " << name_of(second);
      // a crack's tip trails by what its spring holds, at most 0.1 N over 200 N/m
      EXPECT_NEAR(live.deepest_cut(), cut, 0.5e-3) << name_of(first) << " then " << name_of(second);
    }
}

TEST(KeptOut, InvalidModelIsRefusedAndReportedAndTheOldOneKept) {
  Insertion alone(paper::model());
  LiveInsertion live(paper::one(paper::model()));
  for (int i = 0; i < 1000; ++i) {
    const Fault fault = live.replace(paper::one(paper::model(-1.0)));
    EXPECT_STREQ(fault.quantity, "reduced_modulus");
    EXPECT_STREQ(fault.reason, "outside its range");
    const Layer upside_down[] = {{0.0, paper::model()}, {-2e-3, paper::model()}};
    EXPECT_EQ(live.replace(upside_down).layer, 1u);
    EXPECT_NE(live.replace({}).reason, nullptr);
    ASSERT_EQ(live.step(1e-5 * i, no_velocity, 1e-3).force, alone.step(1e-5 * i, no_velocity, 1e-3).force);
    ASSERT_TRUE(live.last_refused());
  }
  EXPECT_EQ(live.refused(), 3000u);
  EXPECT_EQ(live.taken(), 0u);
  EXPECT_EQ(live.replace(paper::one(paper::model())).reason, nullptr);
  EXPECT_FALSE(live.last_refused());
}

TEST(KeptOut, ValidModelReplacesAnInvalidFirstOne) {
  LiveInsertion live(paper::one(paper::model(-1.0)), 10e-3);
  EXPECT_EQ(live.step(-1e-3, no_velocity, 1e-3).status, Status::invalid_parameter);
  live.replace(paper::one(paper::model(100e3)));
  EXPECT_EQ(live.step(2e-3, no_velocity, 1e-3).status, Status::ok);
  EXPECT_NEAR(rest(live, 2e-3, 1.0).force, 100e3 * pressed, 1e-12);
}

}  // namespace
