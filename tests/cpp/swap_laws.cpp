// SPDX-License-Identifier: Apache-2.0
// Every kind of law in place of every other, all along an insertion that holds, turns, leaves and comes
// again.
#include <gtest/gtest.h>

#include <vector>

#include "every_model.hpp"
#include "needleforce/live.hpp"

namespace {

constexpr double blend = 10e-3, dt = 1e-3;

/// In, hold, half out, on, out of the tissue, in again and far out [m]; free space at both ends.
const std::vector<double>& way() {
  static const std::vector<double> depths = [] {
    std::vector<double> result{-1e-3};
    for (const double target : {6e-3, 6e-3, 4e-3, 8e-3, -8e-3, -8e-3, 9e-3, -15e-3, -15e-3}) {
      const double from = result.back();
      const int n = from == target ? 60 : static_cast<int>(std::lround(std::abs(target - from) / 2e-5));
      for (int i = 1; i <= n; ++i) result.push_back(from + (target - from) * i / n);
    }
    return result;
  }();
  return depths;
}

/// The largest force [N] of a model by itself on the way.
double largest(const Model& model) {
  Insertion insertion(model);
  double most = 0.0;
  for (const double depth : way())
    most = std::max(most, std::abs(insertion.step(depth, no_velocity, dt).force));
  return most;
}

struct LawsSeen {
  bool finite = true, free = true, between = true, even = true;
  double largest = 0.0;
  int contacts = 0, punctures = 0;
};

/// One replacement as it should be: the old goes on by itself, the new from a copy of it, and the force goes
/// evenly from the one to the other.
struct Expected {
  Insertion old, now;
  double apart = 0.0, own = 0.0, last_old = 0.0, last_now = 0.0;
  int steps = 0;

  Expected(const Insertion& running, const Model& other, double force)
      : old(running), now(other), last_old(force) {
    now.continue_from(old);
  }
  /// Force [N] after one more step.
  double step(double depth) {
    const double before = old.step(depth, no_velocity, dt).force,
                 after = now.step(depth, no_velocity, dt).force;
    own = std::max(std::abs(before - last_old), steps ? std::abs(after - last_now) : 0.0);
    last_old = before, last_now = after;
    apart = std::max(apart, std::abs(after - before));
    const double share = std::min(1.0, ++steps * dt / blend);
    return before + share * (after - before);
  }
};

LawsSeen swapped(const Model& first, const Model& second, int every) {
  LiveInsertion live(paper::one(first), blend);
  LawsSeen seen;
  Expected expected(live.snapshot(), first, 0.0);
  double force = 0.0;
  int swaps = 0, step = 0;
  for (const double depth : way()) {
    if (step++ % every == every - 1) {
      const Model& other = swaps++ % 2 ? first : second;
      EXPECT_EQ(live.replace(paper::one(other)).reason, nullptr);
      expected = Expected(live.snapshot(), other, force);
    }
    const Sample sample = live.step(depth, no_velocity, dt);
    const double wanted = expected.step(depth), change = std::abs(sample.force - force);
    seen.finite &= std::isfinite(sample.force) && std::isfinite(sample.force_by_depth) &&
                   std::isfinite(sample.force_by_velocity) && sample.status == Status::ok;
    seen.between &= std::abs(sample.force - wanted) <= 1e-12;
    seen.even &= change <= expected.own + expected.apart * dt / blend + 1e-12;
    seen.free &= depth > -6e-3 || sample.force == 0.0;
    seen.largest = std::max(seen.largest, std::abs(sample.force));
    seen.contacts += sample.contact;
    seen.punctures += sample.punctured;
    force = sample.force;
  }
  return seen;
}

/// No more force than one of the two by itself, but for a quarter: what drags its tissue pulls on the way out
/// by up to f' (z - z_r) / (1 - f' / k_t), which by itself it no longer reaches, as it must turn from pushing
/// first.
void expect_sound(const Model& first, const Model& second, double most) {
  const std::string name = name_of(first) + " | " + name_of(second);
  const LawsSeen seen = swapped(first, second, 47);
  EXPECT_TRUE(seen.finite) << name;
  EXPECT_TRUE(seen.between) << name;
  EXPECT_TRUE(seen.even) << name;
  EXPECT_TRUE(seen.free) << name;
  EXPECT_LE(seen.largest, 1.25 * most) << name;
  EXPECT_EQ(seen.punctures, 1) << name;
}

/// Each of them in place of each other one.
void expect_sound(const std::vector<Model>& models) {
  std::vector<double> most;
  for (const Model& model : models) most.push_back(largest(model));
  for (std::size_t i = 0; i < models.size(); ++i)
    for (std::size_t k = 0; k < models.size(); ++k)
      expect_sound(models[i], models[k], std::max(most[i], most[k]));
}

std::vector<Model> only(std::vector<Model> models, auto wanted) {
  std::erase_if(models, [&](const Model& model) { return !wanted(model); });
  return models;
}

TEST(SwappedLaws, EveryFrictionWithEveryRelaxation) {
  expect_sound(only(every_combination(), [](const Model& model) {
    const bool counts = stands_alone(model.friction);
    return counts || std::holds_alternative<laws::ConstantCutting>(model.cutting);
  }));
}

TEST(SwappedLaws, EveryCuttingWithEveryRelaxation) {
  expect_sound(only(every_combination(), [](const Model& model) {
    return std::holds_alternative<laws::Coulomb>(model.friction);
  }));
}

TEST(SwappedLaws, EveryStiffnessAndPuncture) {
  for (const Relaxation& relaxation : each<Relaxation>()) {
    std::vector<Model> models;
    for (const auto& stiffness : each<Stiffness>())
      for (const auto& puncture : each<Puncture>())
        models.push_back(
            {stiffness, puncture, usual<laws::Coulomb>(), usual<laws::ConstantCutting>(), relaxation});
    expect_sound(models);
  }
}

}  // namespace
