// SPDX-License-Identifier: Apache-2.0
// The complete model over whole insertions, holds, reversals, exits and re-insertions.
#include "needleforce/insertion.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "paper.hpp"

using namespace needleforce;

namespace {

TEST(Insertion, ForceAfterPunctureWithUndeformedOrigin) {
  Insertion insertion(paper::model());
  paper::move(insertion, -1e-3, paper::puncture);
  const Sample before = insertion.step(paper::puncture, no_velocity, 1e-3);
  EXPECT_EQ(before.phase, Phase::deformation);
  EXPECT_NEAR(before.force, 0.2073365956887147, 1e-12);
  const Sample after = insertion.step(paper::puncture + 1e-9, no_velocity, 1e-3);
  EXPECT_TRUE(after.punctured);
  EXPECT_NEAR(after.force, 0.1378082, 1e-6);
}

TEST(Insertion, ForceAfterPunctureWithDeformedOrigin) {
  Insertion insertion(paper::model(116e3, 1.0));
  paper::move(insertion, -1e-3, paper::puncture + 1e-9);
  EXPECT_NEAR(insertion.step(paper::puncture + 2e-9, no_velocity, 1e-3).force, 0.0776, 1e-6);
}

TEST(Insertion, PunctureForceAndDepthAreTheSameCriterion) {
  Model by_force = paper::model();
  by_force.puncture = laws::PunctureForce{0.2073365956887147};
  EXPECT_NEAR(Insertion(by_force).puncture_depth_in_model(), paper::puncture, 1e-12);
}

TEST(Insertion, WithdrawalIsFrictionOnlyAndNegative) {
  Insertion insertion(paper::model());
  paper::move(insertion, -1e-3, 12e-3);
  paper::move(insertion, 12e-3, 8e-3, 1e-5);
  const Sample sample = insertion.step(8e-3 - 1e-6, no_velocity, 1e-3);
  EXPECT_EQ(sample.phase, Phase::extraction);
  EXPECT_NEAR(sample.force, -paper::friction * 8e-3, 1e-4);
  EXPECT_EQ(sample.cutting, 0.0);
}

TEST(Insertion, HoldKeepsItsForceAndNoiseDoesNotChatter) {
  Insertion insertion(paper::model());
  paper::move(insertion, -1e-3, 12e-3);
  const double held = paper::friction * 12e-3 + paper::cutting;
  double lowest = 1.0, highest = -1.0;
  for (int i = 0; i < 3600000 / 100; ++i) {
    const double noise = 1e-7 * ((i * 7919) % 11 - 5) / 5.0;
    const Sample sample = insertion.step(12e-3 + noise, no_velocity, 0.1);
    lowest = std::fmin(lowest, sample.force);
    highest = std::fmax(highest, sample.force);
  }
  // 0.2 um of noise over 20 um of elastic travel: a hundredth of friction and cutting, where a switch would
  // give all of it
  EXPECT_LT(highest - lowest, 0.012 * held);
  EXPECT_NEAR(highest, held, 1e-4);
}

TEST(Insertion, ReinsertionNeitherDeformsNorCuts) {
  Insertion insertion(paper::model());
  paper::move(insertion, -1e-3, 12e-3);
  paper::move(insertion, 12e-3, -1e-3);
  paper::move(insertion, -1e-3, 11e-3, 1e-5, [](const Sample& sample) {
    EXPECT_EQ(sample.stiffness, 0.0);
    EXPECT_EQ(sample.cutting, 0.0);
    EXPECT_FALSE(sample.punctured);
    // the shaft takes hold over its elastic travel of 20 um as it enters
    const double depth = std::max(0.0, sample.depth), hold = std::min(1.0, depth / 20e-6);
    EXPECT_NEAR(sample.force, paper::friction * depth * hold, 1e-12);
  });
  paper::move(insertion, 11e-3, 13e-3);
  EXPECT_NEAR(insertion.step(13.001e-3, no_velocity, 1e-3).cutting, paper::cutting, 1e-12);
}

TEST(Insertion, TravelAboveTheTissueLoadsNothing) {
  Model model = paper::model();
  model.friction = laws::Coulomb{paper::friction, 1e-2, 0.0};  // dragged along over a centimetre
  for (const double start : {0.0, -1e-3, -20e-3}) {
    Insertion insertion(model);
    insertion.step(start, no_velocity, 1e-3);
    paper::move(insertion, start, 5e-3);
    EXPECT_NEAR(insertion.step(5e-3, no_velocity, 1e-3).friction, paper::friction * 5e-3 * 0.5, 1e-12)
        << start;
  }
}

TEST(Insertion, RetreatFromTheEntryReturnsNoMoreThanTheContactEnergy) {
  for (const double puncture : {0.0, 1e-6, 1e-3, 3e-3}) {
    const Model model{laws::Cone{116e3, paper::half_angle}, laws::PunctureDepth{puncture},
                      laws::Coulomb{0.0, 20e-6, 0.0}, laws::ConstantCutting{0.2, 5e-3}};
    Insertion insertion(model);
    double work = 0.0, last = 0.0, depth = -1e-3;
    const auto walk = [&](const Sample& sample) {
      work += 0.5 * (last + sample.force) * (sample.depth - depth);
      last = sample.force, depth = sample.depth;
      EXPECT_TRUE(sample.depth > 0.0 || sample.force == 0.0) << puncture;
    };
    paper::move(insertion, -1e-3, puncture + 1e-6, 1e-7, walk);
    paper::move(insertion, puncture + 1e-6, puncture - 1e-6, 1e-7, walk);
    paper::move(insertion, puncture - 1e-6, -6e-3, 1e-6, walk);
    EXPECT_GE(work, -1e-9) << puncture;
  }
}

TEST(Insertion, RetreatBeforePunctureIsElastic) {
  Insertion insertion(paper::model());
  paper::move(insertion, -1e-3, 3e-3);
  paper::move(insertion, 3e-3, 1e-3, 1e-5, [](const Sample& sample) {
    EXPECT_NEAR(sample.force, 0.2073365956887147 * std::pow(sample.depth / paper::puncture, 2), 1e-12);
  });
}

double cycle_work(Model model, double step) {
  Insertion insertion(model);
  double work = 0.0, last_depth = -1e-3, last_force = 0.0;
  const auto add = [&](const Sample& sample) {
    work += 0.5 * (sample.force + last_force) * (sample.depth - last_depth);
    last_depth = sample.depth;
    last_force = sample.force;
  };
  paper::move(insertion, -1e-3, 12e-3, step, add);
  paper::move(insertion, 12e-3, -1e-3, step, add);
  return work;
}

TEST(Insertion, CycleWorkIsTheItemisedDissipation) {
  // cycle_work_total_undeformed; the elastic travel at the reversal rounds off its two corners
  Model model = paper::model();
  model.friction = laws::Coulomb{paper::friction, 1e-8, 0.0};
  model.cutting = laws::ConstantCutting{paper::cutting, 1e-8};
  EXPECT_NEAR(cycle_work(model, 1e-6), 0.003484678015048123, 1e-6);
}

TEST(Insertion, StepSizeDoesNotChangeTheForce) {
  for (const double step : {1e-6, 1e-5, 1e-4, 9e-4}) {
    Insertion insertion(paper::model());
    paper::move(insertion, -1e-3, 7e-3, step);
    EXPECT_NEAR(insertion.step(7.1e-3, no_velocity, 1e-3).force, paper::friction * 7.1e-3 + paper::cutting,
                1e-12);
  }
}

TEST(Insertion, DerivativeByDepthIsTheFiniteDifference) {
  Insertion insertion(paper::model());
  paper::move(insertion, -1e-3, 12e-3);
  std::vector<double> depths{2e-3, 8e-3, 12e-3, 12e-3 - 5e-6, 12e-3 - 1.5e-5, 12e-3 - 3e-5, 9e-3};
  for (const double depth : depths) {
    insertion.step(depth, no_velocity, 1.0);
    const Sample here = insertion.snapshot().step(depth, no_velocity, 1.0);
    Insertion deeper = insertion, shallower = insertion;
    const double step = 1e-10;
    const double rise = (deeper.step(depth + step, no_velocity, 1.0).force -
                         shallower.step(depth - step, no_velocity, 1.0).force) /
                        (2 * step);
    const double one_sided =
        (here.force - insertion.snapshot().step(depth - step, no_velocity, 1.0).force) / step;
    const double other =
        (insertion.snapshot().step(depth + step, no_velocity, 1.0).force - here.force) / step;
    const double slack = 1e-3 * std::abs(here.force_by_depth) + 1e-3;
    // at the ends of the elastic travel the two sides differ; the derivative is one of them
    EXPECT_TRUE(std::abs(rise - here.force_by_depth) < slack ||
                std::abs(one_sided - here.force_by_depth) < slack ||
                std::abs(other - here.force_by_depth) < slack)
        << depth;
  }
}

TEST(Insertion, PartsAddUp) {
  Insertion insertion(paper::model());
  paper::move(insertion, -1e-3, 12e-3, 1e-4, [](const Sample& sample) {
    EXPECT_DOUBLE_EQ(sample.force, sample.stiffness + sample.friction + sample.cutting);
  });
}

TEST(Insertion, SnapshotRestoresToTheBit) {
  Insertion insertion(paper::model());
  paper::move(insertion, -1e-3, 6e-3);
  Insertion saved = insertion.snapshot();
  const Sample first = insertion.step(6.2e-3, no_velocity, 1e-3);
  paper::move(insertion, 6.2e-3, -1e-3);
  insertion = saved;
  const Sample again = insertion.step(6.2e-3, no_velocity, 1e-3);
  EXPECT_EQ(std::memcmp(&first.force, &again.force, sizeof(double)), 0);
}

TEST(Insertion, ResetRemovesTheHole) {
  Insertion insertion(paper::model());
  paper::move(insertion, -1e-3, 6e-3);
  insertion.reset();
  paper::move(insertion, -1e-3, 2e-3);
  EXPECT_EQ(insertion.step(2e-3, no_velocity, 1e-3).phase, Phase::deformation);
}

struct BadStep {
  double depth, velocity, dt;
  Status status;
};

TEST(Insertion, InvalidInputGivesZeroForceAndAStatus) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  const BadStep bad[] = {{nan, 0, 1e-3, Status::not_finite},
                         {infinite, 0, 1e-3, Status::not_finite},
                         {6e-3, nan, 1e-3, Status::not_finite},
                         {6e-3, -infinite, 1e-3, Status::not_finite},
                         {6.001e-3, infinite, 1e-3, Status::not_finite},
                         {6e-3, 0, nan, Status::not_finite},
                         {6e-3, 0, 0.0, Status::outside_range},
                         {6e-3, 0, -1e-3, Status::outside_range},
                         {0.5, no_velocity, 1e-3, Status::outside_range},
                         {6.003e-3, -3e-3, 1e-3, Status::outside_range}};
  for (const BadStep& step : bad) {
    Insertion insertion(paper::model());
    paper::move(insertion, -1e-3, 6e-3);
    const Sample sample = insertion.step(step.depth, step.velocity, step.dt);
    EXPECT_EQ(sample.status, step.status);
    EXPECT_EQ(sample.force, 0.0);
    const Sample next = insertion.step(6.001e-3, no_velocity, 1e-3);
    EXPECT_EQ(next.status, Status::ok);
    EXPECT_NEAR(next.force, paper::friction * 6.001e-3 + paper::cutting, 1e-12);
  }
}

TEST(Insertion, FaultHoldsTheForceForAtMostHoldTime) {
  Insertion insertion(paper::model(), Limits{.hold_time = 3.5e-3});
  paper::move(insertion, -1e-3, 6e-3);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  int held = 0;
  for (int i = 0; i < 10; ++i) held += insertion.step(nan, 0.0, 1e-3).force > 0.0;
  EXPECT_EQ(held, 3);
}

TEST(Insertion, FaultOfTheClockHoldsNothing) {
  // a step without a length has no time for which it could hold
  for (const double dt : {0.0, -1e-3, std::numeric_limits<double>::infinity()}) {
    Insertion insertion(paper::model(), Limits{.hold_time = 3.5e-3});
    paper::move(insertion, -1e-3, 6e-3);
    EXPECT_EQ(insertion.step(6e-3, no_velocity, dt).force, 0.0) << dt;
  }
}

TEST(Insertion, VelocityAfterAFaultUsesTheElapsedTime) {
  Insertion insertion(paper::model());
  paper::move(insertion, -1e-3, 6e-3);
  for (int i = 0; i < 9; ++i) insertion.step(std::numeric_limits<double>::quiet_NaN(), 0.0, 1e-3);
  EXPECT_NEAR(insertion.step(6.03e-3, no_velocity, 1e-3).velocity, 3e-3, 1e-12);
}

TEST(Insertion, LimitsAreChecked) {
  Insertion insertion(paper::model(), Limits{.max_speed = std::numeric_limits<double>::quiet_NaN()});
  EXPECT_EQ(insertion.step(1e-3, no_velocity, 1e-3).status, Status::invalid_parameter);
}

TEST(Insertion, FirstStepRespectsMaxSpeed) {
  Insertion insertion(paper::model(), Limits{.max_speed = 0.1});
  EXPECT_EQ(insertion.step(8e-3, 0.2, 1e-3).status, Status::outside_range);
  EXPECT_EQ(insertion.step(8e-3, -0.2, 1e-3).force, 0.0);
  EXPECT_EQ(insertion.step(8e-3, 0.05, 1e-3).status, Status::ok);
}

TEST(Insertion, InvalidModelGivesZeroForce) {
  Insertion insertion(paper::model(-1.0));
  paper::move(insertion, -1e-3, 6e-3, 1e-4, [](const Sample& sample) {
    EXPECT_EQ(sample.status, Status::invalid_parameter);
    EXPECT_EQ(sample.force, 0.0);
  });
}

TEST(Insertion, EventsAreReportedInOneStepOnly) {
  Insertion insertion(paper::model());
  std::vector<std::pair<char, double>> events;
  const auto see = [&](const Sample& sample) {
    if (sample.contact) events.emplace_back('c', sample.depth);
    if (sample.punctured) events.emplace_back('p', sample.depth);
    if (sample.exit) events.emplace_back('x', sample.depth);
  };
  for (int stroke = 0; stroke < 2; ++stroke) {
    paper::move(insertion, -1e-3, 5e-3, 1e-5, see);
    paper::move(insertion, 5e-3, -1e-3, 1e-5, see);
  }
  std::string kinds;
  for (const auto& [kind, depth] : events) kinds += kind;
  EXPECT_EQ(kinds, "cpxcx");  // the hole of the first stroke is not pierced again
  EXPECT_NEAR(events[0].second, 0.0, 1.1e-5);
  EXPECT_NEAR(events[1].second, paper::puncture, 1.1e-5);
  EXPECT_NEAR(events[2].second, 0.0, 1.1e-5);
}

TEST(Insertion, LateralForceIsThatOfTheBevelsFace) {
  const Bevel bevel{15.0 * tips::degree, 0.3, 1.0};
  Insertion insertion(paper::model(), {}, bevel);
  paper::move(insertion, -1e-3, 8e-3);
  const Sample sample = insertion.step(8e-3 + 1e-5, no_velocity, 1e-3);
  EXPECT_NEAR(sample.lateral, 0.126, 5e-4);  // Misra et al. 2010 with the paper's cutting force and mu = 0.3
  EXPECT_EQ(Insertion(paper::model()).step(8e-3, no_velocity, 1e-3).lateral, 0.0);
  EXPECT_EQ(Insertion(paper::model(), {}, {0.3, 0.0, 1.5}).step(0.0, no_velocity, 1e-3).status,
            Status::invalid_parameter);
}

TEST(Insertion, MemoryIsRestoredOnlyByItsOwnModel) {
  Insertion insertion(paper::model()), other(paper::model(117e3));
  paper::move(insertion, -1e-3, 8e-3);
  Insertion::Saved saved = insertion.save();
  const double next = insertion.step(8e-3 + 1e-5, no_velocity, 1e-3).force;
  insertion.reset();
  ASSERT_TRUE(insertion.restore(saved));
  EXPECT_EQ(insertion.step(8e-3 + 1e-5, no_velocity, 1e-3).force, next);
  EXPECT_FALSE(other.restore(saved));
  saved.version += 1;
  saved.checksum = saved.sum();
  EXPECT_FALSE(insertion.restore(saved));
}

TEST(Insertion, LimitsMatchTheTableAndHoldTimeIsBounded) {
  for (const auto& row : Limits::table) EXPECT_EQ(Limits{}.*row.member, row.initial) << row.name;
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(Insertion(paper::model(), Limits{.hold_time = infinite}).step(1e-3, no_velocity, 1e-3).status,
            Status::invalid_parameter);
}

}  // namespace
