// SPDX-License-Identifier: Apache-2.0
// The step with derivatives: the forces of the step without them, and derivatives in closed form.
#include <bit>

#include "every_model.hpp"
#include "needleforce/gradient/gradient_insertion.hpp"

namespace {

using namespace needleforce;
using Steps = GradientInsertion<4>;

/// In, out, at rest and again, with a leap and numbers that are none.
std::vector<double> walk() {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<double> depths;
  double depth = -1e-3, speed = 0.0;
  for (int i = 0; i < 4000; ++i) {
    if (i % 250 == 0) speed = 4e-5 * (unit(random) + 0.4) * (i % 1000 != 750);
    depths.push_back(i % 1777 == 5 ? NAN : i % 1999 == 7 ? 0.9 : depth += speed);
  }
  return depths;
}

TEST(GradientInsertion, HasTheForcesOfAnInsertionToTheBitForEveryLaw) {
  for (const Model& model : every_model()) {
    const auto layers = paper::one(model);
    Insertion insertion(layers);
    Steps steps(layers,
                std::array{Direction{0, 2, 0}, Direction{0, 1, 0}, Direction{0, 0, 0}, Direction{0, 5, 0}});
    ASSERT_TRUE(steps.accepted());
    for (const double depth : walk()) {
      const Sample sample = insertion.step(depth, no_velocity, 1e-3);
      const auto found = steps.step(depth, no_velocity, 1e-3);
      ASSERT_EQ(std::bit_cast<std::uint64_t>(sample.force), std::bit_cast<std::uint64_t>(found.force.value))
          << name_of(model) << " " << depth;
      ASSERT_EQ(sample.status, found.status);
      for (const double by : found.force.derivatives()) ASSERT_TRUE(std::isfinite(by)) << name_of(model);
    }
  }
}

/// f' l + c while it slides: by f' the embedded length, by c 1, by the puncture and the modulus nothing.
TEST(GradientInsertion, OfThePaperIsInClosedForm) {
  const auto layers = paper::one(paper::model());
  Steps steps(layers,
              std::array{Direction{0, 2, 0}, Direction{0, 3, 0}, Direction{0, 1, 0}, Direction{0, 0, 0}});
  for (int round = 0; round < 2; ++round) {
    Steps::Number force;
    std::vector<double> punctures;
    for (int i = 0; i <= 2000; ++i) {
      force = steps.step(1e-5 * i, no_velocity, 1e-3).force;
      for (const auto& event : steps.events())
        if (event.kind == ForceEventKind::puncture) {
          punctures.push_back(event.depth);
          EXPECT_EQ(event.by_depth, (std::array{0.0, 0.0, 1.0, 0.0}));
        }
    }
    EXPECT_EQ(punctures, std::vector{paper::puncture});
    EXPECT_NEAR(force.derivatives()[0], 2e-2, 1e-12);
    EXPECT_NEAR(force.derivatives()[1], 1.0, 1e-12);
    EXPECT_NEAR(force.derivatives()[2], 0.0, 1e-12);
    EXPECT_NEAR(force.derivatives()[3], 0.0, 1e-12);
    steps.reset();  // the second time as the first
  }
}

}  // namespace
