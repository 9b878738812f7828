// SPDX-License-Identifier: Apache-2.0
// A contact and friction that relax, through a whole insertion: ramp, hold, retreat and puncture.
#include "every_model.hpp"

namespace {

Model relaxing(const Relaxation& relaxation) {
  Model model = paper::model();
  model.relaxation = relaxation;
  return model;
}
const laws::Prony two_times{0.31, 0.7, 0.26, 5.0};

TEST(RelaxingContact, ForceRelaxesInAHoldToTheLastingShare) {
  for (const Stiffness& stiffness : each<Stiffness>())
    for (const Relaxation& relaxation :
         {Relaxation{two_times}, Relaxation{laws::PronyAtRest{0.31, 0.7, 0.26, 5.0}}}) {
      Model model = relaxing(relaxation);
      model.stiffness = stiffness;
      Insertion insertion(model);
      paper::move(insertion, -1e-3, 2e-3);
      for (int i = 0; i < 100; ++i) insertion.step(2e-3, no_velocity, 1.0);
      const auto contact = prepare(stiffness);
      const double elastic = std::visit([](const auto& law) { return law.force(2e-3); }, contact);
      EXPECT_NEAR(insertion.step(2e-3, no_velocity, 1.0).force, 0.43 * elastic, 1e-7) << name_of(model);
    }
}

TEST(RelaxingContact, ConeAtConstantSpeedIsTheHereditaryIntegral) {
  // F = C v^2 int_0^t G(t - s) 2 s ds; the closed form of one term is 2 g tau (t - tau (1 - exp(-t / tau)))
  const double v = 1e-3, t = 3.0, c = usual<laws::Cone>().prepare().coefficient;
  double expected = 0.43 * t * t;
  for (const auto& [g, tau] : {std::pair{0.31, 0.7}, std::pair{0.26, 5.0}})
    expected += 2.0 * g * tau * (t - tau * (1.0 - std::exp(-t / tau)));
  const auto error = [&](int n) {
    Insertion insertion(relaxing(two_times));
    insertion.step(0.0, no_velocity, 1e-3);
    Sample sample;
    for (int i = 1; i <= n; ++i) sample = insertion.step(v * t * i / n, no_velocity, t / n);
    return sample.force - c * v * v * expected;
  };
  EXPECT_LT(std::abs(error(3000)), 1e-8);
  EXPECT_NEAR(error(10) / error(20), 4.0, 0.2);  // a load that is not even is exact to second order
}

TEST(RelaxingContact, NeverPulls) {
  for (const Relaxation& relaxation : each<Relaxation>()) {
    Insertion insertion(relaxing(relaxation));
    double least = 1.0;
    const auto watch = [&](const Sample& sample) { least = std::min(least, sample.force); };
    paper::move(insertion, -1e-3, 3e-3, 1e-5, watch);
    for (int i = 0; i < 100; ++i) watch(insertion.step(3e-3, no_velocity, 1.0));
    paper::move(insertion, 3e-3, -1e-3, 1e-5, watch);
    for (int i = 0; i < 100; ++i) watch(insertion.step(-1e-3, no_velocity, 1.0));
    EXPECT_EQ(least, 0.0) << name_of(relaxation);
    EXPECT_EQ(insertion.pierced_layers(), 0u);
  }
}

TEST(RelaxingContact, PuncturesDeeperAtLowerSpeed) {
  for (const Puncture& puncture :
       {Puncture{laws::PunctureForce{0.15}}, Puncture{laws::PunctureEnergy{1.5e-4}}}) {
    const auto depth = [&](double dt) {
      Model model = relaxing(two_times);
      model.puncture = puncture;
      Insertion insertion(model);
      double depth = -1e-3;
      for (int i = 0; insertion.pierced_layers() == 0 && i < 20000; ++i)
        insertion.step(depth += 1e-6, no_velocity, dt);
      return depth;
    };
    Model elastic = paper::model();
    elastic.puncture = puncture;
    EXPECT_NEAR(depth(2e-6), Insertion(elastic).puncture_depth_in_model(), 5e-6);  // too fast to relax
    EXPECT_GT(depth(1e-3), depth(1e-4));
    EXPECT_GT(depth(1e-2), depth(1e-3));
  }
}

TEST(RelaxingContact, FrictionRelaxesInAHoldAndCuttingDoesNot) {
  Insertion insertion(relaxing(two_times));
  paper::move(insertion, -1e-3, 10e-3);
  for (int i = 0; i < 100; ++i) insertion.step(10e-3, no_velocity, 1.0);
  const Sample held = insertion.step(10e-3, no_velocity, 1.0);
  EXPECT_EQ(held.cutting, paper::cutting);
  EXPECT_LT(held.friction, 18.6 * 10e-3);
  EXPECT_GE(held.friction, 0.0);
}

}  // namespace
