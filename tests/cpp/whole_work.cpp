// SPDX-License-Identifier: Apache-2.0
// The work of whole insertions: itemised against closed forms, and over random closed paths.
#include <random>

#include "every_model.hpp"

namespace {

struct Work {
  double stiffness = 0.0, friction = 0.0, cutting = 0.0, crack = 0.0;
};

/// From 1 mm above the tissue to `deepest` and back to 8 mm above it, in steps of 1 um, and of ds at the
/// crack.
Work cycle(const Model& model, double deepest) {
  Insertion insertion(model);
  Work work;
  Sample last;
  double front = 0.0;
  const auto add = [&](const Sample& sample) {
    const double dz = sample.depth - last.depth;
    work.stiffness += 0.5 * (sample.stiffness + last.stiffness) * dz;
    work.friction += 0.5 * (sample.friction + last.friction) * dz;
    work.cutting += 0.5 * (sample.cutting + last.cutting) * dz;
    if (insertion.pierced_layers() > 0 && front != 0.0)
      work.crack += 0.5 * (sample.cutting + last.cutting) * (insertion.deepest_cut() - front);
    front = insertion.deepest_cut();
    last = sample;
  };
  last.depth = -1e-3;
  paper::move(insertion, -1e-3, deepest, 1e-6, add);
  paper::move(insertion, deepest, -8e-3, 1e-6, add);
  return work;
}

constexpr double z1 = paper::puncture, z2 = 10e-3;
constexpr double rounding = 2e-7;  // [J] half a step of 1 um at each jump of at most 0.4 N

TEST(Work, DeformationWorkIsTheContactEnergyAtThePuncture) {
  for (const Stiffness& stiffness : each<Stiffness>())
    for (const Puncture& puncture : each<Puncture>()) {
      Model model = paper::model();
      model.stiffness = stiffness;
      model.puncture = puncture;
      const double depth = Insertion(model).puncture_depth_in_model();
      const auto contact = prepare(stiffness);
      const double energy = std::visit([&](const auto& law) { return law.energy(depth); }, contact);
      EXPECT_NEAR(cycle(model, z2).stiffness, energy, rounding) << name_of(model);
    }
}

TEST(Work, ConeWorkIsTheClosedForm) {
  EXPECT_NEAR(cycle(paper::model(), z2).stiffness, 0.2073365956887147 * z1 / 3.0, rounding);
}

TEST(Work, FrictionWorkIsThatOfBothStrokes) {
  Model model = paper::model();
  model.friction = laws::Coulomb{18.6, 1e-8, 0.0};
  const double both = 0.5 * 18.6 * (z2 * z2 - z1 * z1) + 0.5 * 18.6 * z2 * z2;
  EXPECT_NEAR(cycle(model, z2).friction, both, 4e-7);
  // rates count: 1 um in 1 ms is 1 mm/s
  model.friction = laws::Karnopp{10.0, -12.0, 200.0, 300.0, 18.0, -18.0, 1e-4, 1e-8};
  const double rated = 0.5 * 10.2 * (z2 * z2 - z1 * z1) + 0.5 * 12.3 * z2 * z2;
  EXPECT_NEAR(cycle(model, z2).friction, rated, 4e-7);
}

TEST(Work, CuttingWorkIsThatOfTheAdvance) {
  Model model = paper::model();
  model.cutting = laws::ConstantCutting{0.0776, 1e-8};
  EXPECT_NEAR(cycle(model, z2).cutting, 0.0776 * (z2 - z1), rounding);
  model.cutting = laws::NoCutting{};
  EXPECT_EQ(cycle(model, z2).cutting, 0.0);
}

TEST(Work, FractureWorkIsToughnessTimesAreaPlusUnrecoveredSpreading) {
  Model model = paper::model();
  for (const double recovered : {0.0, 0.4, 1.0}) {
    model.cutting = laws::Fracture{110.9, 0.7e-3, 154667.0, 0.35e-3, recovered, 1e-8};
    const double spreading = 0.25 * std::numbers::pi * 154667.0 * 0.35e-3 * 0.35e-3;
    const double work = (110.9 * 0.7e-3 + (1.0 - recovered) * spreading) * (z2 - z1);
    EXPECT_NEAR(cycle(model, z2).cutting, work, rounding) << recovered;
  }
}

TEST(Work, StickSlipWorkIsTheIntegralOverTheCrackTravel) {
  for (const Cutting& cutting :
       {Cutting{usual<laws::StickSlip>()}, Cutting{usual<laws::StribeckCutting>()}}) {
    Model model = paper::model();
    model.cutting = cutting;
    const Work work = cycle(model, z2);
    // the crack starts with F_a on its spring, or with nothing, and ends with nothing
    const double held = std::holds_alternative<laws::StickSlip>(cutting) ? 0.04 * 0.04 / 400.0 : 0.0;
    // steps of 1 um see the 20 mm/s of a slip as its ends: the two sums share the error but for its middle
    EXPECT_NEAR(work.cutting, work.crack - held, 5e-6) << name_of(model);
    EXPECT_GT(work.crack, 0.04 * 6e-3);
  }
}

/// The work over a random path from above the tissue back to there, over the work turned over.
double random_cycle(const Model& model, unsigned seed) {
  std::mt19937_64 generator{seed};
  std::uniform_real_distribution<double> depth{-2e-3, 14e-3}, decade{-3.0, 0.0};
  Insertion insertion(model);
  double at = -1e-3, force = 0.0, work = 0.0, turned = 0.0;
  for (int leg = 0; leg < 8; ++leg) {
    const double target = leg == 7 ? -20e-3 : depth(generator), dt = std::pow(10.0, decade(generator));
    const double from = at;
    for (int i = 1; i <= 200; ++i) {
      const double before = at;
      at = from + (target - from) * i / 200;
      const Sample sample = insertion.step(at, no_velocity, dt);
      const double part = 0.5 * (force + sample.force) * (at - before);
      work += part;
      turned += std::abs(part);
      force = sample.force;
    }
    for (int i = 0; i < static_cast<int>(generator() % 3); ++i)
      force = insertion.step(at, no_velocity, 1.0).force;
  }
  EXPECT_EQ(force, 0.0) << name_of(model);
  return turned > 0.0 ? work / turned : 0.0;
}

TEST(Work, RandomClosedPathsReturnNoEnergy) {
  const auto passive = [](const Model& model) {
    return std::visit([]<class F, class R>(const F&, const R&) { return is_passive<F> && is_passive<R>; },
                      model.friction, model.relaxation);
  };
  for (const Model& model : every_model()) {
    if (!passive(model)) continue;
    const bool remembers =
        stands_alone(model.friction) || std::holds_alternative<laws::Prony>(model.relaxation);
    double least = 1.0;
    for (unsigned seed = 0; seed < (remembers ? 200 : 20); ++seed)
      least = std::min(least, random_cycle(model, seed));
    EXPECT_GE(least, -1e-3) << name_of(model);
    EXPECT_LT(least, 1.0) << name_of(model);
  }
}

/// The work [J] of a way in to just past the puncture and out, on a spring: as soft as between 64 and 96 N/m
/// its F_p^2 / 2 k_t is more than the cone held, and its surface still below the tip.
template <class Dragged>
double work_past_the_puncture(double spring, const Relaxation& relaxation, double dt) {
  const Dragged dragged{18.6, spring, 20e-3, 0.0};
  const Model model{usual<laws::Cone>(), usual<laws::PunctureDepth>(), dragged, laws::NoCutting{},
                    relaxation};
  Insertion insertion(model);
  double work = 0.0, at = -1e-3, force = 0.0;
  for (const auto& [target, n] : {std::pair{z1 + 5e-6, 5000}, std::pair{-10e-3, 14000}}) {
    const double from = at;
    for (int i = 1; i <= n; ++i) {
      const double before = at;
      at = from + (target - from) * i / n;
      const double now = insertion.step(at, no_velocity, dt).force;
      work += 0.5 * (force + now) * (at - before);
      force = now;
    }
  }
  EXPECT_EQ(insertion.pierced_layers(), 1u);
  EXPECT_EQ(force, 0.0);
  return work;
}

TEST(Work, SoftSpringReturnsEnergyOnlyInTheFittedForm) {
  for (const double spring : {70.0, 75.0, 80.0}) {
    const Relaxation none = laws::NoRelaxation{};
    const double peak = 0.2073365956887147, over = 0.5 * peak * peak / spring - peak * z1 / 3.0;
    EXPECT_GE(work_past_the_puncture<laws::DraggedTissuePassive>(spring, none, 1e-5), -1e-6);
    const double fitted = work_past_the_puncture<laws::DraggedTissueAsFitted>(spring, none, 1e-5);
    ASSERT_GT(over, 5e-6);
    EXPECT_LT(fitted, -0.5 * over) << spring;
    for (const double dt : {1e-5, 1e-3, 1e-1})
      EXPECT_GE(work_past_the_puncture<laws::DraggedTissuePassive>(spring, usual<laws::Prony>(), dt), -1e-6);
  }
}

}  // namespace
