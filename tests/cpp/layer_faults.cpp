// SPDX-License-Identifier: Apache-2.0
// What first_fault says about stacks that cannot be.
#include <cstring>

#include "every_model.hpp"
#include "needleforce/batch/insertion_batch.hpp"

namespace {

Layer at(double top, double puncture = 1e-3) {
  Model model = paper::model();
  model.puncture = laws::PunctureDepth{puncture};
  return {top, model};
}
void expect_fault(const std::vector<Layer>& layers, std::size_t layer, const char* quantity) {
  const Fault fault = first_fault(layers);
  ASSERT_NE(fault.reason, nullptr);
  EXPECT_EQ(fault.layer, layer);
  EXPECT_STREQ(fault.quantity, quantity);
  Insertion insertion(layers);
  EXPECT_EQ(insertion.step(1e-3, no_velocity, 1e-3).status, Status::invalid_parameter);
  EXPECT_EQ(insertion.step(1e-3, no_velocity, 1e-3).force, 0.0);
}

TEST(FirstFault, ValidStackHasNoFault) {
  EXPECT_EQ(first_fault(std::vector{at(0.0), at(5e-3), at(9e-3)}).reason, nullptr);
}

TEST(FirstFault, RefusesZeroAndNineLayers) {
  expect_fault({}, 0, "layers");
  std::vector<Layer> nine;
  for (int i = 0; i < 9; ++i) nine.push_back(at(5e-3 * i));
  expect_fault(nine, 0, "layers");
}

TEST(FirstFault, RefusesTopsOutOfOrder) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_fault({at(1e-3)}, 0, "top");
  expect_fault({at(nan)}, 0, "top");
  expect_fault({at(0.0), at(5e-3), at(4e-3)}, 2, "top");
  expect_fault({at(0.0), at(5e-3), at(5e-3)}, 2, "top");
  expect_fault({at(0.0), at(nan)}, 1, "top");
  expect_fault({at(0.0), at(1.5)}, 1, "top");
}

TEST(FirstFault, RefusesASecondTipOrRadius) {
  std::vector<Layer> layers{at(0.0), at(5e-3), at(9e-3)};
  laws::TipContact tip{1e5, 0.35e-3, tips::Sphere{0.35e-3}};
  layers[0].laws.stiffness = tip;
  tip.reduced_modulus = 2e4;
  layers[2].laws.stiffness = tip;
  EXPECT_EQ(first_fault(layers).reason, nullptr);
  tip.radius = 0.3e-3;
  layers[2].laws.stiffness = tip;
  expect_fault(layers, 2, "tip");
  layers[2].laws.stiffness = laws::TipContact{1e5, 0.35e-3, tips::Paraboloid{0.35e-3}};
  expect_fault(layers, 2, "tip");
}

TEST(FirstFault, RefusesPunctureBelowTheNextTopUnlessLayersAddUp) {
  expect_fault({at(0.0, 6e-3), at(5e-3)}, 1, "top");
  std::vector<Layer> alone{at(0.0, 6e-3), at(5e-3)};
  for (Layer& layer : alone) {
    layer.laws.friction = usual<laws::DraggedTissuePassive>();
    layer.laws.cutting = laws::NoCutting{};
  }
  EXPECT_EQ(first_fault(alone).reason, nullptr);
  alone[1].laws.friction = usual<laws::Coulomb>();
  expect_fault(alone, 1, "top");
}

TEST(FirstFault, RefusesMixingLayersThatAddUpWithLayersThatEnd) {
  for (const int dragged : {0, 1}) {
    std::vector<Layer> layers{at(0.0), at(5e-3)};
    layers[dragged].laws.friction = usual<laws::DraggedTissuePassive>();
    layers[dragged].laws.cutting = laws::NoCutting{};
    expect_fault(layers, 1, "top");
  }
}

TEST(FirstFault, RefusesSurfaceCreepBelowTheSurfaceOrCountedTwice) {
  std::vector<Layer> layers{at(0.0), at(5e-3)};
  layers[0].laws.friction = usual<laws::RelaxingSurface>();
  EXPECT_EQ(first_fault(layers).reason, nullptr);
  layers[1].laws.friction = usual<laws::RelaxingSurface>();
  expect_fault(layers, 1, "top");
  layers[1].laws.friction = usual<laws::Coulomb>();
  layers[0].laws.relaxation = usual<laws::Prony>();
  expect_fault(layers, 0, "relaxation");
}

TEST(FirstFault, RefusesCuttingForceCountedTwice) {
  for (const Friction& friction :
       {Friction{usual<laws::DraggedTissuePassive>()}, Friction{usual<laws::DraggedTissueAsFitted>()}})
    for (const Cutting& cutting : each<Cutting>()) {
      std::vector<Layer> layers{at(0.0), at(5e-3)};
      for (Layer& layer : layers) layer.laws.friction = friction, layer.laws.cutting = laws::NoCutting{};
      layers[1].laws.cutting = cutting;
      if (std::holds_alternative<laws::NoCutting>(cutting))
        EXPECT_EQ(first_fault(layers).reason, nullptr);
      else
        expect_fault(layers, 1, "cutting");
    }
}

TEST(FirstFault, RefusesParametersOutOfRangeOrContradictory) {
  std::vector<Layer> layers{at(0.0), at(5e-3)};
  layers[1].laws.friction = laws::Coulomb{-1.0, 20e-6, 0.0};
  expect_fault(layers, 1, "per_length");
  layers[1] = at(5e-3);
  layers[1].laws.relaxation = laws::Prony{0.6, 1.0, 0.6, 5.0};
  expect_fault(layers, 1, "prony");
  layers[1] = at(5e-3);
  layers[1].laws.cutting = laws::StickSlip{0.04, 0.10, 1.5e-3, 25.0, 200.0};
  expect_fault(layers, 1, "stick_slip");
}

TEST(FirstFault, AnInvalidMemberOfABatchIsRefusedAndTheOthersContinue) {
  InsertionBatch batch({{at(0.0)}, {at(-1.0)}, {at(0.0)}});
  Insertion alone(std::vector{at(0.0)});
  std::array<double, 3 * batch_rows> rows;
  const double dt = 1e-3;
  for (int i = 1; i <= 40; ++i) {
    const std::array<double, 3> depth{1e-4 * i, 1e-4 * i, 1e-4 * i};
    batch.step({depth.data(), nullptr, &dt, true}, {rows.data(), 3});
    const double force = alone.step(depth[0], no_velocity, dt).force;
    const double* forces = BatchSamples{rows.data(), 3}.row(BatchRow::force);
    const double* statuses = BatchSamples{rows.data(), 3}.row(BatchRow::status);
    EXPECT_EQ(forces[0], force);
    EXPECT_EQ(forces[1], 0.0);
    EXPECT_EQ(forces[2], force);
    EXPECT_EQ(statuses[1], static_cast<double>(Status::invalid_parameter));
  }
}

}  // namespace
