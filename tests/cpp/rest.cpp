// SPDX-License-Identifier: Apache-2.0
// A needle at rest under noise of its measured depth keeps its force, and no closed path returns energy for
// it.
#include <gtest/gtest.h>

#include "closed_paths.hpp"
#include "paper.hpp"

namespace {

constexpr double noise = 30e-6;  // six standard deviations of 5 um

/// Smallest and largest force of a hold, and the last.
struct Hold {
  double least = 1e9, most = -1e9, last = 0.0;
};

/// An insertion at 2 mm/s, then a hold of n steps of 1 ms, with normal noise of the depth.
Hold hold(const Model& model, double deviation, double known, long n, double depth = 12e-3) {
  Insertion insertion(model, {.depth_noise = known});
  std::mt19937_64 generator{11};
  std::normal_distribution<double> normal;
  const auto shown = [&](double at) { return at + deviation * std::clamp(normal(generator), -6.0, 6.0); };
  for (double at = -1e-3; at < depth; at += 2e-6) insertion.step(shown(at), no_velocity, 1e-3);
  Hold result;
  for (long i = 0; i < n; ++i) {
    result.last = insertion.step(shown(depth), no_velocity, 1e-3).force;
    result.least = std::min(result.least, result.last);
    result.most = std::max(result.most, result.last);
  }
  return result;
}

// an hour; the force is f' l + f_c with the length between the lowest and the highest depth shown
TEST(Rest, PaperKeepsItsForceForAnHour) {
  const Hold in_noise = hold(paper::model(), 5e-6, noise, 3600000);
  const double there = 18.6 * 12e-3 + 0.0776;
  EXPECT_GE(in_noise.least, there - 18.6 * (noise + 2e-6));
  EXPECT_LE(in_noise.most, there + 18.6 * (noise + 2e-6));
}

TEST(Rest, WithoutItsSizeTheSameNoiseDrainsTheForce) {
  EXPECT_LT(hold(paper::model(), 5e-6, 0.0, 10000).last, 0.5 * (18.6 * 12e-3 + 0.0776));
}

/// Force [N] that noise of a range may add to each law's force at rest, from its parameters: the length that
/// the range adds, and for a law that has no steady force of its own the slip on the way in.
double bound(const Model& model, double range, const Hold& still) {
  return std::visit(
      [&]<class F>(const F&) {
        if constexpr (std::is_same_v<F, laws::LuGre>)
          return 0.5 * std::abs(still.last);  // damping of the noise's speed
        return 0.12 * std::abs(still.last) + range * 200.0;
      },
      model.friction);
}

TEST(Rest, EveryModelKeepsItsForce) {
  for (const Model& model : every_model()) {
    const Hold still = hold(model, 0.0, 0.0, 10000), in_noise = hold(model, 5e-6, noise, 10000);
    EXPECT_NEAR(in_noise.last, still.last, bound(model, 2.0 * noise, still)) << name_of(model);
  }
}

// what one stroke loses would empty the account in an hour of noise, though not in a hold of some seconds
TEST(Rest, StrokesOfTheWholeRangeLoseNothing) {
  for (const Model& model : every_model()) {
    Insertion insertion(model, {.depth_noise = noise});
    for (double at = -1e-3; at < 12e-3; at += 2e-6) insertion.step(at, no_velocity, 1e-3);
    const auto after = [&](int strokes) {
      for (int i = 0; i < strokes; ++i)
        insertion.step(12e-3 + (i % 2 ? 0.9 : -0.9) * noise, no_velocity, 0.01);
      return insertion.step(12e-3, no_velocity, 0.01).force;
    };
    const double first = after(10000), last = after(20000);
    EXPECT_NEAR(last, first, 1e-3 * first) << name_of(model);
  }
}

/// A hold of 5 s at a depth without noise, its last step without velocity; the velocity in between with noise
/// [m/s].
double after_noise_of_velocity(const Model& model, double deviation) {
  Insertion insertion(model);
  std::mt19937_64 generator{5};
  std::normal_distribution<double> normal;
  for (double at = -1e-3; at < 12e-3; at += 2e-6) insertion.step(at, no_velocity, 1e-3);
  const double depth = 12e-3;
  insertion.step(depth, no_velocity, 1e-3);
  for (int i = 0; i < 5000; ++i)
    insertion.step(depth, deviation * std::clamp(normal(generator), -3.0, 3.0), 1e-3);
  return insertion.step(depth, 0.0, 1e-3).force;
}

// no law moves by a velocity without travel; a friction that slides faster with more force falls to that of
// no speed
TEST(Rest, NoiseOfTheVelocityAloneChangesNothing) {
  for (const Model& model : every_model()) {
    const double still = after_noise_of_velocity(model, 0.0), noisy = after_noise_of_velocity(model, 1e-3);
    const auto* karnopp = std::get_if<laws::Karnopp>(&model.friction);
    const double falls = karnopp ? karnopp->viscous_in * 2e-3 * 12e-3 : 0.0;  // of the speed of the insertion
    EXPECT_LE(noisy, still + 1e-9) << name_of(model);
    EXPECT_GE(noisy, still - falls - 1e-9) << name_of(model);
  }
}

/// Forces [N] of a stroke in, a hold, half way out, in again and out.
std::vector<double> forces_of(const Model& model, double known) {
  Insertion insertion(model, {.depth_noise = known});
  std::vector<double> forces;
  const auto keep = [&](const Sample& sample) { forces.push_back(sample.force); };
  paper::move(insertion, -1e-3, 10e-3, 2e-6, keep);
  for (int i = 0; i < 500; ++i) keep(insertion.step(10e-3, no_velocity, 1e-3));
  paper::move(insertion, 10e-3, 5e-3, 2e-6, keep);
  paper::move(insertion, 5e-3, 9e-3, 2e-6, keep);
  paper::move(insertion, 9e-3, -1e-3, 2e-6, keep);
  return forces;
}

// a reversal is felt later by some nanometres, no more
TEST(Rest, NoiseOfNoSizeChangesNoForce) {
  for (const Model& model : every_model()) {
    const std::vector<double> without = forces_of(model, 0.0), with = forces_of(model, 1e-9);
    const double largest = *std::max_element(without.begin(), without.end());
    for (std::size_t i = 0; i < with.size(); ++i)
      ASSERT_NEAR(with[i], without[i], 2e-3 * largest) << name_of(model) << " at step " << i;
  }
}

// slip of a stroke 2 w is returned at the force at which it slipped, then the tissue unloads over its own
// travel
TEST(Rest, ReversalIsFeltLaterByTheRangeOfTheNoise) {
  for (const double w : {0.0, 20e-6}) {
    Insertion insertion(Model{laws::Cone{116e3, paper::half_angle}, laws::PunctureDepth{paper::puncture},
                              laws::Coulomb{18.6, 20e-6, 0.0}, laws::NoCutting{}},
                        {.depth_noise = w});
    paper::move(insertion, -1e-3, 10e-3, 1e-6);
    double felt = 0.0, last = 0.0;
    paper::move(insertion, 10e-3, 9.9e-3, 1e-6, [&](const Sample& sample) {
      if (felt == 0.0 && sample.force < 18.6 * sample.depth - 1e-6) felt = 10e-3 - sample.depth;
      last = sample.force;
    });
    EXPECT_NEAR(felt, 2.0 * w, 1.5e-6) << w;
    EXPECT_NEAR(last, -18.6 * 9.9e-3, 1e-12) << w;  // sliding outwards
  }
}

TEST(Rest, NoClosedPathReturnsEnergyInNoise) {
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
    closed_paths::Generator generator{seed};
    const std::vector<Layer> layers = closed_paths::drawn_stack(generator);
    const closed_paths::Work work = closed_paths::work_in_noise(generator, layers, 200);
    ASSERT_GE(work.share(), -1e-9) << seed;
  }
}

// what a law of other authors may leave out, these have
template <class P>
concept Slips = requires(const P& law, const Shaft& shaft, const typename P::Memory& memory) {
  { law.slip(shaft, memory) } noexcept -> std::same_as<Slip>;
};
template <class... L>
constexpr bool all_slip(std::variant<L...>*) {
  return (Slips<typename L::Prepared> && ...);
}
static_assert(all_slip(static_cast<Friction*>(nullptr)));

TEST(Rest, MeasuredVelocityMayDifferByTheNoise) {
  Insertion insertion(paper::model(), {.depth_noise = noise});
  insertion.step(5e-3, 0.0, 1e-3);
  EXPECT_EQ(insertion.step(5e-3 + 2.0 * noise, 0.0, 1e-3).status, Status::ok);
  EXPECT_EQ(insertion.step(5e-3 + 20.0 * noise, 0.0, 1e-3).status, Status::outside_range);
  // in a short step noise makes any velocity agree, but none is accepted beyond the limits
  EXPECT_EQ(insertion.step(5e-3 + noise, 60.0, 1e-6).status, Status::outside_range);
}

TEST(Rest, NeedleWithinTheNoiseIsInAHold) {
  Insertion insertion(paper::model(), {.depth_noise = noise});
  paper::move(insertion, -1e-3, 8e-3, 1e-5);
  Sample sample;
  for (int i = 0; i < 700; ++i)
    sample = insertion.step(8e-3 + (i % 2 ? -1.0 : 1.0) * 10e-6, no_velocity, 1e-3);
  EXPECT_EQ(sample.phase, Phase::hold);
}

}  // namespace
