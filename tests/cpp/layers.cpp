// SPDX-License-Identifier: Apache-2.0
// A stack of layers: the numbers of the specification, and one layer cut into many that stays one layer.
#include <array>
#include <random>

#include "every_model.hpp"

namespace {

Layer layer(double top, double friction, double cutting, double puncture) {
  Model model = paper::model();
  model.puncture = laws::PunctureDepth{puncture};
  model.friction = laws::Coulomb{friction, 20e-6, 0.0};
  model.cutting = laws::ConstantCutting{cutting, 20e-6};
  return {top, model};
}
const std::array two_layers{layer(0.0, 18.6, 0.0776, 3.237e-3), layer(5e-3, 30.0, 0.12, 1e-3)};

TEST(Layers, ForcesAreThoseOfTheSpecification) {
  Insertion insertion(two_layers);
  paper::move(insertion, -1e-3, 4e-3);
  EXPECT_NEAR(insertion.step(4e-3, no_velocity, 1e-3).force, 0.152, 1e-4);
  paper::move(insertion, 4e-3, 8e-3);
  const Sample sample = insertion.step(8e-3, no_velocity, 1e-3);
  EXPECT_NEAR(sample.force, 18.6 * 5e-3 + 30.0 * 3e-3 + 0.12, 1e-12);
  EXPECT_NEAR(sample.force, 0.303, 1e-4);
  EXPECT_EQ(insertion.pierced_layers(), 2u);
}

TEST(Layers, ForceIsTheLargerOfCutAndNextContact) {
  Insertion insertion(two_layers);
  const auto contact = usual<laws::Cone>().prepare();
  // 0.0776 N of contact lie below the interface where it punctures: both sides of the maximum are met
  Model stiff = two_layers[1].laws;
  stiff.stiffness = laws::Cone{2e6, paper::half_angle};
  const auto hard = laws::Cone{2e6, paper::half_angle}.prepare();
  ASSERT_LT(contact.force(1e-3), 0.0776);
  ASSERT_GT(hard.force(1e-3), 0.0776);
  for (const auto& [second, law] : {std::pair{two_layers[1], contact}, std::pair{Layer{5e-3, stiff}, hard}}) {
    Insertion pushed(std::array{two_layers[0], second});
    paper::move(pushed, -1e-3, 5e-3);
    paper::move(pushed, 5e-3, 6e-3, 1e-5, [&](const Sample& sample) {
      const double expected = 18.6 * 5e-3 + std::max(0.0776, law.force(sample.depth - 5e-3));
      ASSERT_NEAR(sample.force, expected, 1e-12) << sample.depth;
      ASSERT_FALSE(sample.punctured);
    });
  }
}

TEST(Layers, EachPunctureIsReportedOnce) {
  Insertion insertion(two_layers);
  std::vector<double> punctures;
  paper::move(insertion, -1e-3, 9e-3, 1e-6, [&](const Sample& sample) {
    if (sample.punctured) punctures.push_back(sample.depth);
  });
  paper::move(insertion, 9e-3, -1e-3);
  paper::move(insertion, -1e-3, 9e-3, 1e-5, [](const Sample& sample) { ASSERT_FALSE(sample.punctured); });
  ASSERT_EQ(punctures.size(), 2u);
  EXPECT_NEAR(punctures[0], 3.237e-3, 1.1e-6);
  EXPECT_NEAR(punctures[1], 6e-3, 1.1e-6);
}

TEST(Layers, LayersReleaseOneAfterAnotherOnWithdrawal) {
  Insertion insertion(two_layers);
  paper::move(insertion, -1e-3, 9e-3);
  paper::move(insertion, 9e-3, 8.9e-3);  // over the elastic travel
  paper::move(insertion, 8.9e-3, -1e-3, 1e-5, [](const Sample& sample) {
    const double first = std::clamp(sample.depth, 0.0, 5e-3), second = std::max(0.0, sample.depth - 5e-3);
    ASSERT_NEAR(sample.force, -18.6 * first - 30.0 * second, 1e-12);
    ASSERT_EQ(sample.phase, sample.depth > 0.0 ? Phase::extraction : Phase::free);
  });
}

TEST(Layers, EightLayersAreValidAndNineAreNot) {
  std::vector<Layer> stack;
  for (int i = 0; i < 9; ++i) stack.push_back(layer(5e-3 * i, 10.0 + i, 0.01 * (i + 1), 4e-3));
  Insertion nine(stack);
  EXPECT_EQ(nine.step(1e-3, no_velocity, 1e-3).status, Status::invalid_parameter);
  stack.pop_back();
  Insertion eight(stack);
  paper::move(eight, -1e-3, 40e-3);
  double friction = 10.0 * 40e-3;
  for (int i = 1; i < 8; ++i) friction += 1.0 * (40e-3 - 5e-3 * i);  // f' grows by 1 N/m at each top
  EXPECT_NEAR(eight.step(40e-3, no_velocity, 1e-3).force, friction + 0.08, 1e-12);
  EXPECT_EQ(eight.pierced_layers(), 8u);
}

/// Depths and steps with holds, reversals, an exit and a re-insertion.
struct Leg {
  double target;
  int steps;
  double dt;
};
std::vector<Leg> wander() {
  std::vector<Leg> legs{{3e-3, 400, 1e-3}, {4.5e-3, 200, 1e-3}};
  std::mt19937_64 generator{11};
  std::uniform_real_distribution<double> depth{1e-3, 15e-3};
  for (int i = 0; i < 12; ++i) {
    legs.push_back({depth(generator), 100 + static_cast<int>(generator() % 200), 2e-2});
    legs.push_back({legs.back().target, 5, 0.3});
  }
  legs.insert(legs.end(), {{-5e-3, 300, 1e-2}, {-5e-3, 3, 1.0}, {17e-3, 900, 1e-2}, {-5e-3, 900, 5e-3}});
  return legs;
}

double largest_difference(Insertion one, Insertion many, double& peak) {
  double depth = -1e-3, largest = 0.0;
  for (const Leg& leg : wander()) {
    const double from = depth;
    for (int i = 1; i <= leg.steps; ++i) {
      depth = from + (leg.target - from) * i / leg.steps;
      const Sample single = one.step(depth, no_velocity, leg.dt),
                   stack = many.step(depth, no_velocity, leg.dt);
      EXPECT_EQ(single.punctured, stack.punctured);
      EXPECT_EQ(single.phase, stack.phase);
      largest = std::max(largest, std::abs(single.force - stack.force));
      peak = std::max(peak, std::abs(single.force));
    }
  }
  EXPECT_EQ(many.pierced_layers(), many.layers());
  return largest;
}

TEST(Layers, SplitTissueWithoutThresholdsEqualsOneLayerForEveryLaw) {
  for (const Model& model : every_combination()) {
    // their surfaces are their own
    if (stands_alone(model.friction) || std::holds_alternative<laws::RelaxingSurface>(model.friction))
      continue;
    std::vector<Layer> stack{{0.0, model}};
    for (const double top : {5e-3, 5.5e-3, 9e-3, 12.3e-3}) {
      stack.push_back({top, model});
      stack.back().laws.puncture = laws::PunctureDepth{0.0};
    }
    double peak = 0.0;
    EXPECT_LT(largest_difference(Insertion(model), Insertion(stack), peak), 1e-9 * 0.1) << name_of(model);
    EXPECT_GT(peak, 0.1) << name_of(model);
  }
}

}  // namespace
