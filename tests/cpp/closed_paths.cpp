// SPDX-License-Identifier: Apache-2.0
// No closed path returns energy, over the whole ranges of the parameter tables; the cases that once did.
#include "closed_paths.hpp"

namespace {

TEST(ClosedPaths, RandomModelsOverTheirWholeRangesReturnNoEnergy) {
  int worked = 0;
  for (std::uint64_t seed = 0; seed < 4000; ++seed) {
    closed_paths::Generator generator{seed};
    const std::vector<Layer> layers = closed_paths::drawn_stack(generator);
    const closed_paths::Work work = closed_paths::work_of(generator, layers);
    worked += work.turned > 0.0;
    if (work.share() >= -1e-6) continue;
    ADD_FAILURE() << "seed " << seed << ": " << closed_paths::name_of_stack(layers) << " returns "
                  << -work.most << " J of " << work.turned << " J turned over";
  }
  EXPECT_GT(worked, 3000);
}

/// The upper bound of the work of going in to a depth at a speed [m/s] and out again.
closed_paths::Work in_and_out(const Model& model, double deepest, double speed) {
  Insertion insertion(model);
  closed_paths::Work work;
  double at = -1e-3;
  for (const double target : {deepest, -4e-3}) {
    const double from = at;
    constexpr int n = 20000;
    for (int i = 1; i <= n; ++i) {
      const double next = from + (target - from) * i / n;
      work.add(insertion.step(next, no_velocity, std::abs(next - at) / speed).force, next - at);
      at = next;
    }
  }
  return work;
}

TEST(ClosedPaths, LongPreslidingIsNotStrainedForNothingAtThePuncture) {
  const Model base{laws::PowerLaw{0.1, 2.0, 3e-3}, laws::PunctureDepth{3e-3}, laws::Coulomb{140.0, 3e-3, 0.0},
                   laws::ConstantCutting{0.05, 20e-6}};
  for (const Friction& friction :
       {base.friction, Friction{laws::Karnopp{140.0, -140.0, 0.0, 0.0, 140.0, -140.0, 1e-4, 3e-3}},
        Friction{laws::LuGre{140.0 / 3e-3, 0.0, 0.0, 140.0, 140.0, 1e-3, 2.0}},
        Friction{laws::RelaxingSurface{140.0, 3e-3, 2.0, 1e3, 0.05}}}) {
    Model model = base;
    model.friction = friction;
    EXPECT_GE(in_and_out(model, 3.1e-3, 3e-3).most, 0.0) << name_of(friction);
    Insertion insertion(model);
    double before = 0.0, after = 0.0;
    for (int i = 0; i <= 3001; ++i) before = after, after = insertion.step(1e-6 * i, no_velocity, 1e-3).force;
    ASSERT_EQ(insertion.pierced_layers(), 1u);
    // the micrometre after the puncture strains 3 mm of tissue: f' / s_0 l dz
    EXPECT_LE(after, before + 1.01 * 140.0 / 3e-3 * 3e-3 * 1e-6) << name_of(friction) << " at the puncture";
  }
}

TEST(ClosedPaths, RelaxedContactLoadsTheCutWithNoMoreThanItHolds) {
  const Model model{laws::PowerLaw{0.2, 2.0, 3e-3}, laws::PunctureDepth{3e-3}, laws::Coulomb{0.1, 20e-6, 0.0},
                    laws::ConstantCutting{0.1, 3e-3}, laws::Prony{0.9, 0.2, 0.05, 1.0}};
  EXPECT_GE(in_and_out(model, 3.002e-3, 1e-4).most, 0.0);
}

TEST(ClosedPaths, RelaxedContactLoadsTheShaftWithNoMoreThanItHolds) {
  // the tissue along the shaft has relaxed to a twentieth, as the contact: at that stiffness it returns all
  const Model model{laws::Cone{1e4, 0.26}, laws::PunctureDepth{50e-3}, laws::Coulomb{20.0, 39e-3, 0.0},
                    laws::NoCutting{}, laws::Prony{0.95, 1e-4, 0.0, 1.0}};
  EXPECT_GE(in_and_out(model, 50.1e-3, 1e-3).most, 0.0);
}

TEST(ClosedPaths, BristleDampingThatReturnsEnergyIsRefused) {
  // Barabanov & Ortega 2000: sigma_2 >= sigma_1 (F_s - F_c) / F_c
  const laws::LuGre passive{1e6, 100.0, 40.0, 20.0, 28.0, 1e-3, 2.0};
  EXPECT_EQ(passive.min_passive_viscous(), 40.0);
  Model model = paper::model();
  model.friction = passive;
  EXPECT_TRUE(valid(model));
  laws::LuGre active = passive;
  active.viscous = 39.9;
  model.friction = active;
  EXPECT_FALSE(valid(model));
  const Fault fault = first_fault(std::vector<Layer>{{0.0, model}});
  EXPECT_STREQ(fault.quantity, "viscous");
  EXPECT_NE(std::string(fault.reason).find("return energy"), std::string::npos);
}

}  // namespace
