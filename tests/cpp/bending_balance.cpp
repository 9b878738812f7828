// SPDX-License-Identifier: Apache-2.0
// Forces on a needle that bends: reciprocity, energy, base wrench, buckling.
#include <gtest/gtest.h>

#include <vector>

#include "bending.hpp"

namespace {

using namespace bending_tests;

using Beam = BeamEquilibrium<1>;

/// A straight channel to a depth.
TissuePath<1> channel(double depth) {
  TissuePath<1> path;
  while (path.empty() || path.next_node() <= depth) path.write(path.next_node(), {0.0});
  path.write(depth, {0.0});
  return path;
}
BeamLoad<1> at(double embedded, double free_length) {
  BeamLoad<1> load;
  load.embedded = embedded;
  load.free_length = free_length;
  return load;
}

TEST(BendingBalance, BettisReciprocityBetweenBaseAndTip) {
  const BeamProperties properties = guided().beam;
  const TissuePath<1> path = channel(0.06);
  BeamLoad<1> pushed = at(0.06, 0.03), moved = pushed, tilted = pushed;
  pushed.tip_force = {0.7};
  moved.lateral = {1e-3};
  tilted.tilt = {1e-2};
  Beam a, b, c;
  a.solve(properties, path, pushed);
  b.solve(properties, path, moved);
  c.solve(properties, path, tilted);
  // work of each load on the other's displacement
  EXPECT_NEAR(0.7 * b.mesh().tip().place[0], a.force()[0] * 1e-3, 1e-12);
  EXPECT_NEAR(0.7 * c.mesh().tip().place[0], a.moment()[0] * 1e-2, 1e-12);
  EXPECT_NEAR(b.moment()[0] * 1e-2, c.force()[0] * 1e-3, 1e-9 * std::abs(b.moment()[0] * 1e-2));
}

TEST(BendingBalance, TipLoadMeetsTheClosedFormOfAClampedBeam) {
  // winkler_clamped_base_tip_L50mm and its force at the clamp
  BeamProperties properties = thin().beam;
  properties.elements = 100;
  const TissuePath<1> path = channel(0.05);
  BeamLoad<1> load = at(0.05, 0.0);
  load.tip_force = {0.0776};
  Beam beam;
  beam.solve(properties, path, load);
  EXPECT_NEAR(beam.mesh().tip().place[0] / 0.00022138802728458655, 1.0, 1e-6);
  EXPECT_NEAR(beam.force()[0] / 0.0007038055192336586, 1.0, 1e-4);
}

TEST(BendingBalance, CubicFoundationMeetsTheCollocationSolution) {
  BeamProperties properties = thin().beam;
  properties.elements = 100;
  properties.layers[0].form = FoundationForm::cubic;
  properties.layers[0].scale = std::sqrt(71350.0 / 5e10);
  const TissuePath<1> path = channel(0.12);
  BeamLoad<1> load = at(0.12, 0.0);
  load.tip_force = {0.0776};
  Beam beam;
  const Beam::Outcome outcome = beam.solve(properties, path, load);
  EXPECT_TRUE(outcome.converged);
  EXPECT_LT(outcome.iterations, 12u);
  EXPECT_NEAR(beam.mesh().tip().place[0] / 0.00021834895111897114, 1.0, 2e-5);  // cubic_tip_L120mm
}

TEST(BendingBalance, SofteningFoundationsConvergeFarBeyondTheirScale) {
  for (const FoundationForm form :
       {FoundationForm::hyperbolic, FoundationForm::tanh, FoundationForm::cubic}) {
    BeamProperties properties = guided().beam;
    properties.layers[0].form = form;
    properties.layers[0].scale = 1e-4;
    const TissuePath<1> path = channel(0.04);
    BeamLoad<1> load = at(0.04, 0.02);
    load.lateral = {6e-3};
    Beam beam;
    EXPECT_TRUE(beam.solve(properties, path, load).converged)
        << foundation_form_names[static_cast<int>(form)];
  }
}

TEST(BendingBalance, WorkOfTheBaseIsTheStoredEnergy) {
  // a needle in its hole, moved aside: the reaction grows in proportion to the displacement
  const BeamProperties properties = guided().beam;
  const TissuePath<1> path = channel(0.05);
  BeamLoad<1> load = at(0.05, 0.03);
  load.lateral = {2e-3};
  load.tilt = {-5e-3};
  Beam beam;
  beam.solve(properties, path, load);
  const double work = -0.5 * (beam.force()[0] * 2e-3 + beam.moment()[0] * -5e-3);
  double stored = 0.0;
  const auto nodes = beam.mesh().nodes();
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    const double length = nodes[i + 1].travel - nodes[i].travel;
    for (int k = 0; k < 200; ++k) {
      const double xi = (k + 0.5) / 200.0;
      const auto n = hermite(xi);
      const double y = n[0] * nodes[i].place[0] + n[1] * length * nodes[i].slope[0] +
                       n[2] * nodes[i + 1].place[0] + n[3] * length * nodes[i + 1].slope[0];
      const double bend = ((12.0 * xi - 6.0) * (nodes[i].place[0] - nodes[i + 1].place[0]) / length +
                           (6.0 * xi - 4.0) * nodes[i].slope[0] + (6.0 * xi - 2.0) * nodes[i + 1].slope[0]) /
                          length;
      const double modulus = nodes[i].travel < 0.0 ? 0.0 : 20e3;
      stored += 0.5 * (0.0206517998 * bend * bend + modulus * y * y) * length / 200.0;
    }
  }
  EXPECT_NEAR(work / stored, 1.0, 1e-5);
}

TEST(BendingBalance, ClosedLoopOfTheBaseInAHoleTakesNoWork) {
  PlanarInsertion needle = forceless_insertion<1>(guided());
  insert(needle, 0.05, 50);
  needle.step({.depth = 0.045}, 1.0);
  double work = 0.0, largest = 0.0, before = needle.step({.depth = 0.045}, 1.0).wrench[0], x = 0.0;
  for (int i = 1; i <= 2000; ++i) {
    const double next = 3e-3 * std::sin(2.0 * std::numbers::pi * i / 2000.0);
    const double force = needle.step({.depth = 0.045, .lateral = {next, 0.0}}, 1.0).wrench[0];
    work -= 0.5 * (force + before) * (next - x);
    largest = std::max(largest, std::abs(work));
    before = force, x = next;
  }
  EXPECT_GT(largest, 1e-6);
  EXPECT_LT(std::abs(work), 1e-9 * largest + 1e-15);
}

TEST(BendingBalance, FollowerForceDoesNotBendAStraightNeedle) {
  // 0.5 N, 240 mm of free needle: as a dead load far beyond Euler's force, along the tangent it is not
  const BeamProperties properties = guided().beam;
  const TissuePath<1> path = channel(0.05);
  BeamLoad<1> load = at(0.05, 0.01);
  load.tip_force = {0.2};
  Beam free_of_force, compressed;
  free_of_force.solve(properties, path, load);
  load.compression = {5.0, 5.0, 5.0};
  EXPECT_TRUE(compressed.solve(properties, path, load).stable);
  const double ratio = compressed.mesh().tip().place[0] / free_of_force.mesh().tip().place[0];
  EXPECT_GT(ratio, 0.8);
  EXPECT_LT(ratio, 1.3);
}

TEST(BendingBalance, WrenchIsTheMomentOfTheTissueAboutTheBase) {
  // outside the tissue nothing acts; a moment comes from forces in the tissue, so that its lever reaches
  // there
  PlanarInsertion needle = forceless_insertion<1>(guided());
  EXPECT_NEAR(needle.step({.depth = -0.02, .lateral = {1e-3, 0.0}}, 1.0).wrench[0], 0.0, 1e-12);
  const BentSample sample = insert(needle, 0.06, 60);
  EXPECT_GT(sample.wrench[0], 0.0);  // the bevel pushes towards +x
  const double lever = sample.wrench[4] / sample.wrench[0];
  EXPECT_GT(lever, -0.2);
  EXPECT_LT(std::abs(sample.wrench[0]), 0.2);
}

TEST(BendingBalance, BucklesWhereAClampedPinnedColumnDoes) {
  // a tip that presses on the surface is held there: 20.19 EI / L^2, from both sides
  const double stiffness = 0.0001662, length = 0.08;
  const double critical = 0.524327982199704;  // buckling_clamped_pinned_80mm
  for (const double share : {0.97, 1.03}) {
    Model model = forceless();
    model.stiffness = laws::Polynomial{1e3, 0.0};
    model.puncture = laws::PunctureDepth{5e-3};
    FlexibleSettings settings = thin();
    settings.beam.sections.list[0].stiffness = stiffness;
    const double depth = share * critical / 1e3;
    settings.beam.support.guide_distance = length - depth;
    PlanarInsertion needle(Insertion(model, any_speed), settings);
    needle.step({.depth = 0.0}, 1.0);
    const BentSample sample = move(needle, {.depth = 0.0}, {.depth = depth}, 20);
    EXPECT_EQ(sample.buckled, share > 1.0) << share;
    EXPECT_EQ(sample.status == Status::ok, share < 1.0);
    EXPECT_NEAR(sample.unsupported, length, 1e-9);
    EXPECT_TRUE(std::isfinite(sample.tip[0]) && std::isfinite(sample.wrench[4]));
  }
}

/// A rigid needle that is moved aside in its hole, and the lateral force of the tissue on it.
struct RigidNeedle {
  static constexpr double depth = 0.04, modulus = 1e5, strength = 20.0;
  PlanarInsertion needle;
  static FlexibleSettings yielding() {
    FlexibleSettings settings = bending_tests::settings(1e4, 0.0, 0.0, 0.0, 0.01);
    settings.beam.layers[0].yielding_modulus = modulus;
    settings.beam.layers[0].yield_force = strength;
    return settings;
  }
  RigidNeedle() : needle(forceless_insertion<1>(yielding())) { needle.step({.depth = depth}, 1.0); }
  double force(double aside) { return needle.step({.depth = depth, .lateral = {aside, 0.0}}, 1.0).wrench[0]; }
};

TEST(BendingBalance, RigidNeedleMeetsElasticPerfectlyPlasticTissue) {
  RigidNeedle needle;
  const double stiffness = RigidNeedle::modulus * RigidNeedle::depth;
  const double strength = RigidNeedle::strength * RigidNeedle::depth, yields_at = strength / stiffness;
  // the newest 0.1 mm of the path moves with a tip at rest
  const double near = 0.01 * strength;
  EXPECT_NEAR(needle.force(0.5 * yields_at), -0.5 * strength, near);
  EXPECT_NEAR(needle.force(5.0 * yields_at), -strength, near);
  EXPECT_NEAR(needle.force(9.0 * yields_at), -strength, near);
  EXPECT_NEAR(needle.force(8.0 * yields_at), 0.0, near);  // the tissue stays where it was pushed
  EXPECT_NEAR(needle.force(7.5 * yields_at), 0.5 * strength, near);
  EXPECT_NEAR(needle.force(0.0), strength, near);
}

TEST(BendingBalance, TissueThatYieldsTakesWorkInEveryCycle) {
  RigidNeedle needle;
  double work = 0.0, before = 0.0, x = 0.0;
  for (int cycle = 0; cycle < 3; ++cycle) {
    const double start = work;
    for (int i = 1; i <= 400; ++i) {
      const double next = 1e-3 * std::sin(2.0 * std::numbers::pi * i / 400.0), now = needle.force(next);
      work -= 0.5 * (now + before) * (next - x);
      before = now, x = next;
    }
    EXPECT_GT(work - start, 0.0);
  }
}

TEST(BendingBalance, YieldingDoesNotDependOnTheNumberOfStepsOfTheBase) {
  FlexibleSettings settings = guided();
  settings.beam.layers[0].yielding_modulus = 1e5;
  settings.beam.layers[0].yield_force = 10.0;
  std::vector<double> tips;
  for (const int n : {1, 10, 200}) {
    PlanarInsertion needle = forceless_insertion<1>(settings);
    insert(needle, 0.03, 30);
    const Base from{.depth = 0.03}, to{.depth = 0.03, .lateral = {4e-3, 0.0}};
    move(needle, from, to, n);
    tips.push_back(move(needle, to, {.depth = 0.06, .lateral = {4e-3, 0.0}}, 30 * n).tip[0]);
  }
  EXPECT_NEAR(tips[0] / tips[2], 1.0, 1e-4);
  EXPECT_NEAR(tips[1] / tips[2], 1.0, 1e-4);
}

/// A skin of 2 mm, fifty times stronger than what is below.
FlexibleSettings with_skin(FlexibleSettings settings, double interface) {
  LateralLayer &skin = settings.beam.layers[0], &below = settings.beam.layers[1];
  skin.yielding_modulus = 8e5, skin.yield_force = 900.0;
  below = skin;
  below.top = interface, below.yielding_modulus = 8e4, below.yield_force = 18.0;
  settings.beam.layer_count = 2;
  return settings;
}

TEST(BendingBalance, EachLayerYieldsByItsOwnStrength) {
  // an interface inside an element, at a node of the path and between two
  for (const double interface : {2e-3, 2.05e-3}) {
    const FlexibleSettings settings = with_skin(bending_tests::settings(1e4, 0.0, 0.0, 0.0, 0.01), interface);
    PlanarInsertion needle = forceless_insertion<1>(settings);
    const double depth = RigidNeedle::depth;
    needle.step({.depth = depth}, 1.0);
    const auto force = [&](double aside) {
      return needle.step({.depth = depth, .lateral = {aside, 0.0}}, 1.0).wrench[0];
    };
    const double skin = 900.0 * interface, below = 18.0 * (depth - interface);
    EXPECT_NEAR(force(0.5e-3), -(8e5 * interface * 0.5e-3 + below), 0.01 * (skin + below));
    EXPECT_NEAR(force(6e-3), -(skin + below), 0.01 * (skin + below));
  }
}

TEST(BendingBalance, StrongSkinConvergesWithTheSpacingOfThePath) {
  std::vector<double> tips;
  for (const double spacing : {5e-5, 1e-4, 5e-4}) {
    FlexibleSettings settings = with_skin(guided(), 2e-3);
    settings.lengths.path_spacing = spacing;
    PlanarInsertion needle = forceless_insertion<1>(settings);
    insert(needle, 0.012, 12);
    // while it is pushed in: a tip that is moved aside at rest leaves a step in its path, of the width of a
    // spacing
    const Base aside{.depth = 0.02, .lateral = {3e-3, 0.0}};
    move(needle, {.depth = 0.012}, aside, 10);
    tips.push_back(move(needle, aside, {.depth = 0.06, .lateral = {3e-3, 0.0}}, 48).tip[0]);
  }
  EXPECT_NEAR(tips[1], tips[0], 2e-6);
  EXPECT_NEAR(tips[2], tips[0], 10e-6);
}

TEST(BendingBalance, TissueAheadHoldsATipAtRest) {
  for (const double stiffness : {0.0, 1e3}) {
    FlexibleSettings settings = bending_tests::settings(1e2, 0.0, 0.0, 0.0, 0.01);
    settings.beam.layers[0].tip_stiffness = stiffness;
    PlanarInsertion needle = forceless_insertion<1>(settings);
    insert(needle, 0.02, 20);
    const Base aside{.depth = 0.02, .lateral = {1e-3, 0.0}};
    EXPECT_NEAR(needle.step(aside, 1.0).wrench[0], -1e-3 * stiffness, 1e-4 * stiffness + 1e-4);
    const double later = move(needle, aside, {.depth = 0.03, .lateral = {1e-3, 0.0}}, 100).wrench[0];
    EXPECT_NEAR(later, 0.0, 1e-4 * stiffness + 1e-4);  // ten diameters on, nothing is left
  }
}

TEST(BendingBalance, FrictionFromLateralPressureOpposesTheMotionAndIsPassive) {
  FlexibleSettings settings = guided();
  settings.lengths.pressure_friction = 0.3;
  PlanarInsertion needle = forceless_insertion<1>(settings);
  double work = 0.0, force = 0.0;
  for (int i = 1; i <= 600; ++i) {
    const double now = needle.step({.depth = 1e-4 * i}, 1e-3).force;
    work += 0.5 * (force + now) * 1e-4;
    force = now;
  }
  EXPECT_GT(force, 0.0);
  for (int i = 599; i >= 300; --i) {
    const double now = needle.step({.depth = 1e-4 * i}, 1e-3).force;
    work -= 0.5 * (force + now) * 1e-4;
    force = now;
  }
  EXPECT_LT(force, 0.0);
  EXPECT_GT(work, 0.0);
}

}  // namespace
