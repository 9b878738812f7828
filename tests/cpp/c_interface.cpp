// SPDX-License-Identifier: Apache-2.0
// The C face: what it takes, what it refuses, and that it is the same insertion.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "../../bindings/c/needleforce_guard.h"
#include "paper.hpp"

namespace {

nf_layer paper_layer() {
  nf_layer layer{};
  layer.stiffness = {"cone", {{"reduced_modulus", 116e3}, {"half_angle", paper::half_angle}}, nullptr};
  layer.puncture = {"puncture_depth", {{"depth", paper::puncture}}, nullptr};
  layer.friction = {"coulomb", {{"per_length", paper::friction}, {"presliding", 20e-6}}, nullptr};
  layer.cutting = {"constant_cutting", {{"force", paper::cutting}, {"unloading", 20e-6}}, nullptr};
  return layer;
}

/// Memory of an insertion, and what was said when it was asked for.
struct Made {
  std::vector<double> memory = std::vector<double>(nf_size() / sizeof(double) + 1);
  nf_fault why{};
  nf_insertion* insertion = nullptr;
  explicit Made(const nf_layer& layer, const nf_settings* settings = nullptr) : Made(&layer, 1, settings) {}
  Made(const nf_layer* layers, std::size_t count, const nf_settings* settings = nullptr)
      : insertion(nf_init(memory.data(), memory.size() * sizeof(double), layers, count, settings, &why)) {}
};

nf_sample step(nf_insertion* insertion, double depth) {
  nf_sample sample;
  nf_step(insertion, depth, NF_NO_VELOCITY, 1e-3, &sample);
  return sample;
}

TEST(CInterface, EqualsTheCppInsertion) {
  Made made(paper_layer());
  ASSERT_TRUE(made.insertion) << made.why.quantity << made.why.reason;
  needleforce::Insertion insertion(paper::model());
  for (int k = -100; k < 3000; ++k) {
    const double depth = 3e-6 * (k < 2000 ? k : 4000 - k);
    const auto ours = insertion.step(depth, needleforce::no_velocity, 1e-3);
    const nf_sample theirs = step(made.insertion, depth);
    EXPECT_EQ(theirs.force, ours.force);
    EXPECT_EQ(theirs.punctured, ours.punctured);
    EXPECT_STREQ(nf_phase_name(theirs.phase), needleforce::phase_names[int(ours.phase)]);
  }
}

/// What nf_init says when one thing of the paper's layer is changed.
template <class Change>
std::string refusal(Change change) {
  nf_layer layer = paper_layer();
  change(layer);
  const Made made(layer);
  EXPECT_EQ(made.insertion, nullptr);
  return std::string(made.why.law) + "." + made.why.quantity + " " + made.why.reason;
}

TEST(CInterface, InvalidModelIsRefusedWithTheReason) {
  EXPECT_EQ(refusal([](nf_layer& l) { l.stiffness.name = "spring"; }),
            "spring.stiffness is of no known name");
  EXPECT_EQ(refusal([](nf_layer& l) { l.cutting.name = nullptr; }), "layer.cutting is missing");
  EXPECT_EQ(refusal([](nf_layer& l) { l.friction.parameters[0].name = "mu"; }),
            "coulomb.mu is no parameter of it");
  EXPECT_EQ(refusal([](nf_layer& l) { l.friction.parameters[0].value = -1; }),
            "coulomb.per_length is outside its range");
  EXPECT_EQ(refusal([](nf_layer& l) { l.stiffness.parameters[1] = {}; }),
            "cone.half_angle is missing or not a number");
  EXPECT_EQ(refusal([](nf_layer& l) { l.friction.parameters[2] = l.friction.parameters[0]; }),
            "coulomb.per_length is given twice");
  EXPECT_EQ(refusal([](nf_layer& l) { l.stiffness.name = "tip_contact"; }),
            "tip_contact.half_angle is no parameter of it");
  EXPECT_EQ(refusal([](nf_layer& l) { l.top = 1e-3; }),
            "layer.top the first layer's top is the undeformed surface, depth 0");
}

TEST(CInterface, RefusesMemoryThatIsTooSmallOrMissing) {
  const nf_layer layer = paper_layer();
  std::vector<double> memory(nf_size() / sizeof(double) + 1);
  nf_fault why;
  EXPECT_EQ(nf_init(memory.data(), nf_size() - 1, &layer, 1, nullptr, &why), nullptr);
  EXPECT_STREQ(why.reason, "is less than what it needs");
  EXPECT_EQ(nf_init(nullptr, 1 << 20, &layer, 1, nullptr, nullptr), nullptr);
  EXPECT_EQ(nf_init(reinterpret_cast<char*>(memory.data()) + 1, nf_size(), &layer, 1, nullptr, &why),
            nullptr);
  EXPECT_EQ(nf_init(memory.data(), nf_size(), &layer, 9, nullptr, &why), nullptr);
  EXPECT_EQ(nf_init(memory.data(), nf_size(), nullptr, 1, nullptr, &why), nullptr);
  EXPECT_STREQ(why.reason, "are missing");
}

TEST(CInterface, TipsAreChosenByName) {
  nf_layer layer = paper_layer();
  nf_tip tip{"lancet_bevel", {{"half_angle", 0.2617993877991494}}, "equal_length", nullptr, nullptr, 0};
  layer.stiffness = {"tip_contact", {{"reduced_modulus", 116e3}, {"radius", 0.35e-3}}, &tip};
  EXPECT_TRUE(Made(layer).insertion);
  tip.equivalence = "equal_weight";
  EXPECT_FALSE(Made(layer).insertion);
  tip.equivalence = nullptr;
  tip.knots = 2;
  EXPECT_STREQ(Made(layer).why.reason, "are for a profile alone");
  const double radii[] = {0.0, 0.35e-3}, heights[] = {0.0, 1.3e-3}, falling[] = {0.0, -1.3e-3};
  tip = {"profile", {}, nullptr, radii, heights, 2};
  EXPECT_TRUE(Made(layer).insertion);
  tip.parameters[0] = {"radius", 1e-3};
  EXPECT_STREQ(Made(layer).why.quantity, "radius");
  tip.parameters[0] = {};
  tip.heights = falling;
  EXPECT_STREQ(Made(layer).why.reason, "below the one before: the profile is not monotone");
  tip.knots = 33;
  EXPECT_STREQ(Made(layer).why.quantity, "knots");
  tip.name = "spoon";
  EXPECT_STREQ(Made(layer).why.quantity, "tip");
}

TEST(CInterface, SettingsAreCheckedAndGiveALateralForce) {
  nf_settings settings = nf_default_settings();
  settings.bevel_half_angle = 15.0 * paper::degree;
  settings.bevel_face_share = 1.0;
  Made made(paper_layer(), &settings);
  ASSERT_TRUE(made.insertion);
  step(made.insertion, 0.0);
  for (int k = 1; k <= 2000; ++k) step(made.insertion, 3e-6 * k);
  // all of the paper's cutting force on a face without friction: MODEL's 0.290 N
  EXPECT_NEAR(step(made.insertion, 6.003e-3).lateral, 0.290, 5e-4);
  settings.bevel_friction_coefficient = -1.0;
  EXPECT_STREQ(Made(paper_layer(), &settings).why.quantity, "friction_coefficient");
  settings = nf_default_settings();
  settings.max_speed = std::nan("");
  EXPECT_STREQ(Made(paper_layer(), &settings).why.quantity, "max_speed");
  settings = nf_default_settings();
  settings.hold_time = 2.0;
  EXPECT_STREQ(Made(paper_layer(), &settings).why.quantity, "hold_time");
  EXPECT_EQ(Made(paper_layer(), &settings).why.high, 1.0);
}

TEST(CInterface, SnapshotsAreRestoredOrRefused) {
  Made made(paper_layer());
  step(made.insertion, 0.0);
  for (int k = 1; k <= 2000; ++k) step(made.insertion, 3e-6 * k);
  std::vector<char> bytes(nf_snapshot_size());
  EXPECT_EQ(nf_snapshot(made.insertion, bytes.data(), bytes.size() - 1), 0);
  ASSERT_EQ(nf_snapshot(made.insertion, bytes.data(), bytes.size()), 1);
  const double next = step(made.insertion, 6.01e-3).force;
  nf_reset(made.insertion);
  EXPECT_EQ(step(made.insertion, -1e-3).phase, NF_FREE);
  ASSERT_EQ(nf_restore(made.insertion, bytes.data(), bytes.size()), 1);
  EXPECT_EQ(step(made.insertion, 6.01e-3).force, next);
  EXPECT_EQ(nf_restore(made.insertion, bytes.data(), bytes.size() - 1), 0);
  nf_layer other = paper_layer();
  other.friction.parameters[0].value = 18.7;
  EXPECT_EQ(nf_restore(Made(other).insertion, bytes.data(), bytes.size()), 0);
  for (std::size_t i = 0; i < bytes.size(); i += 7) {
    std::vector<char> altered = bytes;
    altered[i] ^= 0x10;
    EXPECT_EQ(nf_restore(made.insertion, altered.data(), altered.size()), 0) << i;
  }
}

/// A guard around an insertion of the paper's, or what was said against it.
struct Guarded {
  Made made = Made(paper_layer());
  std::vector<double> memory = std::vector<double>(nf_guard_size() / sizeof(double) + 1);
  nf_fault why{};
  nf_guard* guard = nullptr;
  explicit Guarded(std::vector<nf_parameter> settings)
      : guard(nf_guard_init(memory.data(), memory.size() * sizeof(double), made.insertion, settings.data(),
                            settings.size(), &why)) {}
};

TEST(CInterface, GuardClampsRejectsAndFallsToZero) {
  Guarded guarded({{"max_force", 0.1}, {"stale_after", 2e-3}, {"fall_time", 5e-3}});
  ASSERT_TRUE(guarded.guard) << guarded.why.quantity << guarded.why.reason;
  nf_output output{};
  for (int k = 0; k <= 2000; ++k) nf_guard_step(guarded.guard, 3e-6 * k, NF_NO_VELOCITY, 1e-3, &output);
  EXPECT_EQ(output.force, 0.1);
  EXPECT_EQ(output.did, NF_CLAMPED);
  EXPECT_NEAR(output.sample.force, paper::friction * 6e-3 + paper::cutting, 1e-3);
  nf_guard_step(guarded.guard, std::nan(""), NF_NO_VELOCITY, 1e-3, &output);
  EXPECT_TRUE(output.did & NF_REJECTED);
  for (int k = 0; k < 10; ++k) nf_guard_miss(guarded.guard, 1e-3, &output);
  EXPECT_EQ(output.force, 0.0);
  EXPECT_TRUE(output.did & NF_STALE);
  nf_guard_reset(guarded.guard);
  nf_guard_step(guarded.guard, -1e-3, NF_NO_VELOCITY, 1e-3, &output);
  EXPECT_EQ(output.sample.phase, NF_FREE);
}

TEST(CInterface, GuardRefusesInvalidSettings) {
  EXPECT_STREQ(Guarded({{"max_furce", 1.0}}).why.reason, "is no parameter of it");
  EXPECT_STREQ(Guarded({{nullptr, 1.0}}).why.quantity, "name");
  EXPECT_STREQ(Guarded({{"max_force", std::nan("")}}).why.quantity, "max_force");
  EXPECT_STREQ(Guarded({{"delay", 1.5}}).why.reason, "delay is no whole number of cycles");
  EXPECT_EQ(Guarded({{"delay", 1.5}}).guard, nullptr);
  nf_fault why{};
  double small[4];
  EXPECT_EQ(nf_guard_init(small, sizeof small, Made(paper_layer()).insertion, nullptr, 0, &why), nullptr);
  EXPECT_STREQ(why.law, "memory");
  EXPECT_EQ(nf_guard_init(small, sizeof small, nullptr, nullptr, 0, nullptr), nullptr);
}

}  // namespace
