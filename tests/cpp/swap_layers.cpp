// SPDX-License-Identifier: Apache-2.0
// Layers that are added, removed or moved while the tip is in them.
#include <gtest/gtest.h>

#include <vector>

#include "every_model.hpp"
#include "needleforce/live.hpp"

namespace {

constexpr double no_blend = 0.0;

struct Told {
  int contacts = 0, punctures = 0, exits = 0;
  Sample last{};
};

/// Moves the tip in steps of 10 um and counts what was told.
void go(LiveInsertion& live, Told& told, double from, double to) {
  const int n = static_cast<int>(std::lround(std::abs(to - from) / 1e-5));
  for (int i = 1; i <= n; ++i) {
    told.last = live.step(from + (to - from) * i / n, no_velocity, 1e-3);
    told.contacts += told.last.contact;
    told.punctures += told.last.punctured;
    told.exits += told.last.exit;
  }
}

/// The paper's tissue; deeper, with an interface that gives way after `indentation` [m].
Layer at(double top, double indentation) {
  Model model = paper::model();
  if (top > 0.0) model.puncture = laws::PunctureDepth{indentation};
  return {top, model};
}

/// A tip that went 9 mm deep through `layers`, then `others`, then 4 mm on and out.
struct Replaced {
  Told in{}, on{};
  double force = 0.0, later = 0.0;  // at 9 mm, and 0.1 mm deeper
  Replaced(const std::vector<Layer>& layers, const std::vector<Layer>& others) {
    LiveInsertion live(layers, no_blend);
    go(live, in, -1e-3, 9e-3);
    live.replace(others);
    on.last = live.step(9e-3, no_velocity, 1e-3);
    on.punctures += on.last.punctured;
    force = on.last.force;
    go(live, on, 9e-3, 9.1e-3);
    later = on.last.force;
    go(live, on, 9.1e-3, 13e-3);
    Told out;
    go(live, out, 13e-3, -4e-3);
    EXPECT_EQ(out.exits, 1);
    EXPECT_EQ(out.last.force, 0.0);
  }
};

const double sliding = paper::friction * 9e-3 + paper::cutting;

TEST(Layers, InterfaceAddedAboveTheTipIsPiercedWithoutAnEvent) {
  for (const double indentation : {0.0, 1e-3, 5e-3}) {
    const Replaced replaced({at(0.0, 0.0)}, {at(0.0, 0.0), at(6e-3, indentation)});
    EXPECT_NEAR(replaced.force, sliding, 1e-12) << "the same tissue, in two layers";
    EXPECT_EQ(replaced.in.punctures, 1);
    EXPECT_EQ(replaced.on.punctures, 0);
  }
}

TEST(Layers, InterfaceAddedBelowTheTipIsPuncturedThere) {
  const Replaced replaced({at(0.0, 0.0)}, {at(0.0, 0.0), at(11e-3, 1e-3)});
  EXPECT_NEAR(replaced.force, sliding, 1e-12);
  EXPECT_EQ(replaced.on.punctures, 1);
}

TEST(Layers, RemovedLayerBecomesPartOfTheLayerAbove) {
  const Replaced replaced({at(0.0, 0.0), at(6e-3, 1e-3)}, {at(0.0, 0.0)});
  EXPECT_NEAR(replaced.force, sliding, 1e-12);
  EXPECT_EQ(replaced.in.punctures, 2);
  EXPECT_EQ(replaced.on.punctures, 0);
}

TEST(Layers, PiercedLayerMovedAboveTheTipStaysPierced) {
  for (const double top : {4e-3, 5.9e-3, 6.1e-3, 8.9e-3}) {
    const Replaced replaced({at(0.0, 0.0), at(6e-3, 1e-3)}, {at(0.0, 0.0), at(top, 1e-3)});
    EXPECT_NEAR(replaced.force, sliding, 1e-12) << top;
    EXPECT_EQ(replaced.on.punctures, 0) << top;
  }
}

TEST(Layers, PiercedLayerMovedBelowTheDeepestPointIsIntactAgain) {
  const Replaced replaced({at(0.0, 0.0), at(6e-3, 1e-3)}, {at(0.0, 0.0), at(11e-3, 1e-3)});
  EXPECT_NEAR(replaced.force, sliding, 1e-12);
  EXPECT_EQ(replaced.on.punctures, 1);
}

TEST(Layers, IntactLayerMovedFarAboveTheTipCountsAsPierced) {
  const Replaced replaced({at(0.0, 0.0), at(12e-3, 1e-3)}, {at(0.0, 0.0), at(6e-3, 1e-3)});
  EXPECT_NEAR(replaced.force, sliding, 1e-12);
  EXPECT_EQ(replaced.on.punctures, 0);
}

TEST(Layers, IntactLayerMovedJustAboveTheTipIsDeformed) {
  const Replaced replaced({at(0.0, 0.0), at(12e-3, 1e-3)}, {at(0.0, 0.0), at(8.5e-3, 1e-3)});
  const double contact = 2.0 / std::numbers::pi * 116e3 * std::tan(paper::half_angle) * 0.5e-3 * 0.5e-3;
  EXPECT_NEAR(replaced.force, paper::friction * 8.5e-3 + std::max(contact, paper::cutting), 1e-12);
  EXPECT_EQ(replaced.on.punctures, 1);
}

TEST(Layers, DeformedLayerWithAnEarlierPunctureReportsItOnce) {
  // pressed by 1 mm of 2 mm, then said to have given way after 0.5 mm
  const Replaced replaced({at(0.0, 0.0), at(8e-3, 2e-3)}, {at(0.0, 0.0), at(8e-3, 0.5e-3)});
  EXPECT_EQ(replaced.in.punctures, 1);
  EXPECT_EQ(replaced.on.punctures, 1);
  // a contact weaker than the cutting force leaves nothing that would strain the tissue along the shaft
  EXPECT_NEAR(replaced.force, paper::friction * 8e-3 + paper::cutting, 1e-12);
  EXPECT_NEAR(replaced.later, sliding + paper::friction * 0.1e-3, 1e-12);
}

TEST(Layers, LayersAreMatchedByNearestTopsWhenTheirNumberChanges) {
  // pressed by 0.5 mm when another comes above and one below, and its top moves by 0.1 mm
  const Replaced replaced({at(0.0, 0.0), at(8.5e-3, 2e-3)},
                          {at(0.0, 0.0), at(5e-3, 1e-3), at(8.4e-3, 2e-3), at(11e-3, 1e-3)});
  const double contact = 2.0 / std::numbers::pi * 116e3 * std::tan(paper::half_angle) * 0.6e-3 * 0.6e-3;
  EXPECT_NEAR(replaced.force, paper::friction * 8.4e-3 + std::max(contact, paper::cutting), 1e-12);
  EXPECT_EQ(replaced.on.punctures, 2);
}

TEST(Layers, RandomlyMovingLayersReportEventsOnceWithoutForceJumps) {
  std::mt19937_64 generator{1};
  std::uniform_real_distribution<double> noise{-0.2e-3, 0.2e-3};
  for (int trial = 0; trial < 50; ++trial) {
    const auto stack = [&] {
      return std::vector{at(0.0, 0.0), at(6e-3 + noise(generator), 1e-3), at(10e-3 + noise(generator), 1e-3)};
    };
    LiveInsertion live(stack(), 10e-3);
    Told told;
    double depth = -1e-3;
    while (depth < 14e-3) {
      const double travel = 1e-5 * static_cast<double>(2 + generator() % 5);
      go(live, told, depth, depth + travel);
      depth += travel;
      live.replace(stack());
      ASSERT_TRUE(std::isfinite(told.last.force));
      ASSERT_LE(told.last.force, paper::friction * depth + 0.25);
    }
    go(live, told, depth, -4e-3);
    EXPECT_EQ(told.punctures, 3) << trial;
    EXPECT_EQ(told.contacts, 1);
    EXPECT_EQ(told.exits, 1);
    EXPECT_EQ(told.last.force, 0.0);
  }
}

}  // namespace
