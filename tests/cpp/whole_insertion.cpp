// SPDX-License-Identifier: Apache-2.0
// Every law through whole insertions: in, hold, out and clear of the tissue, in again and out again.
#include "every_model.hpp"

namespace {

constexpr double above = -8e-3, deepest = 10e-3, speed = 2e-3, dt = 2e-3;

/// Steps at one speed to a depth, calling `visit` with each sample.
template <class Visit>
void stroke(Insertion& insertion, double from, double target, Visit visit) {
  const int n = static_cast<int>(std::round(std::abs(target - from) / (speed * dt)));
  for (int i = 1; i <= n; ++i) visit(insertion.step(from + (target - from) * i / n, no_velocity, dt));
}

bool finite(const Sample& sample) {
  return std::isfinite(sample.force) && std::isfinite(sample.stiffness) && std::isfinite(sample.friction) &&
         std::isfinite(sample.cutting) && std::isfinite(sample.force_by_depth) &&
         std::isfinite(sample.force_by_velocity);
}

struct WholeInsertion : ::testing::TestWithParam<Model> {
  Insertion insertion{GetParam()};
  double work = 0.0, last = 0.0;
  int punctures = 0;

  void see(const Sample& sample, double dz) {
    ASSERT_TRUE(finite(sample)) << sample.depth;
    ASSERT_EQ(sample.status, Status::ok) << sample.depth;
    ASSERT_DOUBLE_EQ(sample.force, sample.stiffness + sample.friction + sample.cutting);
    work += 0.5 * (last + sample.force) * dz;
    last = sample.force;
    punctures += sample.punctured;
  }
  void in(double target) {
    stroke(insertion, above, target, [&](const Sample& sample) {
      see(sample, speed * dt);
      if (punctures == 0) {
        ASSERT_EQ(sample.phase, sample.depth > 0.0 ? Phase::deformation : Phase::free) << sample.depth;
        ASSERT_EQ(sample.friction + sample.cutting, 0.0) << sample.depth;
        if (sample.depth <= 0.0) {
          ASSERT_EQ(sample.force, 0.0);
        }
      } else if (sample.depth > paper::puncture) {
        ASSERT_EQ(sample.phase, Phase::insertion) << sample.depth;
        ASSERT_EQ(sample.stiffness, 0.0) << sample.depth;
        ASSERT_GE(sample.force, 0.0) << sample.depth;
      }
    });
  }
  void out(double from) {
    stroke(insertion, from, above, [&](const Sample& sample) {
      see(sample, -speed * dt);
      ASSERT_EQ(sample.stiffness, 0.0) << sample.depth;
      ASSERT_TRUE(sample.phase == Phase::extraction || sample.phase == Phase::free);
      if (sample.phase == Phase::free) {
        ASSERT_EQ(sample.friction, 0.0) << sample.depth;
      }
    });
    EXPECT_EQ(last, 0.0);
  }
};

TEST_P(WholeInsertion, PuncturesOnceHoldsReleasesAndReturnsNoEnergy) {
  in(deepest);
  ASSERT_EQ(punctures, 1);
  for (int i = 0; i < 200; ++i) {
    see(insertion.step(deepest, no_velocity, 1e-2), 0.0);
    ASSERT_EQ(insertion.snapshot().step(deepest, no_velocity, 1e-2).phase, Phase::hold);
  }
  out(deepest);
  const bool passive =
      std::visit([]<class F, class R>(const F&, const R&) { return is_passive<F> && is_passive<R>; },
                 GetParam().friction, GetParam().relaxation);
  if (passive) {
    EXPECT_GT(work, 0.0);
  }
  const double first = work;
  in(0.9 * deepest);
  out(0.9 * deepest);
  EXPECT_EQ(punctures, 1);
  if (passive) {
    EXPECT_GE(work, first);
  }
}

std::string index_of(const ::testing::TestParamInfo<Model>& info) {
  std::string name = std::to_string(info.index) + "_" + name_of(info.param);
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(EveryModel, WholeInsertion, ::testing::ValuesIn(every_model()), index_of);

}  // namespace
