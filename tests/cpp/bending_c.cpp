// SPDX-License-Identifier: Apache-2.0
// The C face of a needle that bends: the values of the C++ engine, and what it refuses.
#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "../../bindings/c/needleforce_guard.h"
#include "../proof/c_layers.hpp"
#include "bending.hpp"
#include "needleforce/base_guard.hpp"

namespace {

using namespace bending_tests;

/// Memory and the insertion in it.
struct CNeedle {
  std::vector<double> axial_memory = std::vector<double>(nf_size() / sizeof(double) + 1);
  std::vector<double> memory = std::vector<double>(nf_bend_size() / sizeof(double) + 1);
  nf_fault why{};
  nf_bend* needle = nullptr;

  explicit CNeedle(const nf_bending& bending) {
    const std::array layers{Layer{0.0, paper::model()}};
    CLayers named(layers);
    nf_settings settings = nf_default_settings();
    settings.max_speed = 1e9;
    nf_insertion* axial = nf_init(axial_memory.data(), nf_size(), named.data(), 1, &settings, nullptr);
    needle = nf_bend_init(memory.data(), nf_bend_size(), axial, &bending, &why);
  }
};

const nf_parameter support[] = {{"needle_length", 1.0}, {"guide_distance", 0.03}, {"bevel_length", 0.002612}};
const nf_section section{1.0, 0.0206517998, 0.0};
const nf_lateral_layer layer{{{"modulus", 20e3}, {"tip_force", 0.2}}, nullptr};
const nf_bending usual{&layer, 1, &section, 1, support, 3, 0};

TEST(BendingC, GivesTheValuesOfTheEngine) {
  CNeedle c(usual);
  ASSERT_NE(c.needle, nullptr) << c.why.quantity;
  FlexibleSettings settings = guided();
  settings.small_slopes = false;
  SpatialInsertion needle(Insertion(paper::model(), {.max_speed = 1e9}), settings);
  nf_bent out{};
  for (int i = 0; i <= 60; ++i) {
    const Base base{.depth = 1e-3 * (i - 1), .lateral = {1e-5 * i, 0.0}, .roll = 0.02 * i};
    const nf_base plain{base.depth, {base.lateral[0], 0.0}, {0.0, 0.0}, base.roll};
    nf_bend_step(c.needle, &plain, 0.1, &out);
    const BentSample expected = needle.step(base, 0.1);
    EXPECT_EQ(std::memcmp(out.tip, expected.tip.data(), sizeof out.tip), 0);
    EXPECT_EQ(std::memcmp(out.wrench, expected.wrench.data(), sizeof out.wrench), 0);
    EXPECT_EQ(out.force, expected.force);
    EXPECT_EQ(out.status, NF_OK);
  }
  std::vector<double> points(3 * 200);
  const std::size_t n = nf_bend_shape(c.needle, points.data(), 200);
  EXPECT_EQ(n, needle.shape_points());
  EXPECT_EQ(points[3 * (n - 1)], out.tip[0]);
  nf_bend_reset(c.needle);
  const nf_base above{-1e-3, {0.0, 0.0}, {0.0, 0.0}, 0.0};
  nf_bend_step(c.needle, &above, 0.1, &out);
  EXPECT_EQ(out.force, 0.0);
}

TEST(BendingC, SnapshotsAreRestoredOrRefused) {
  CNeedle c(usual), other(usual);
  nf_bent out{}, expected{};
  const auto go_to = [](CNeedle& needle, int i, nf_bent& sample) {
    const nf_base base{1e-3 * i, {0.0, 1e-5 * i}, {0.0, 0.0}, 0.02 * i};
    nf_bend_step(needle.needle, &base, 0.1, &sample);
  };
  for (int i = 0; i <= 30; ++i) go_to(c, i, expected);
  std::vector<unsigned char> bytes(nf_bend_snapshot_size());
  EXPECT_EQ(nf_bend_snapshot(c.needle, bytes.data(), bytes.size() - 1), 0);
  EXPECT_EQ(nf_bend_snapshot(c.needle, nullptr, bytes.size()), 0);
  ASSERT_EQ(nf_bend_snapshot(c.needle, bytes.data(), bytes.size()), 1);
  go_to(c, 31, expected);
  ASSERT_EQ(nf_bend_restore(other.needle, bytes.data(), bytes.size()), 1);
  go_to(other, 31, out);
  EXPECT_EQ(std::memcmp(&out, &expected, offsetof(nf_bent, buckled)), 0);
  std::vector<unsigned char> altered = bytes;
  altered[bytes.size() / 2] ^= 1;
  EXPECT_EQ(nf_bend_restore(other.needle, altered.data(), bytes.size()), 0);
  EXPECT_EQ(nf_bend_restore(other.needle, bytes.data(), bytes.size() - 1), 0);
  nf_bending fewer = usual;
  fewer.elements = 20;
  EXPECT_EQ(nf_bend_restore(CNeedle(fewer).needle, bytes.data(), bytes.size()), 0);
}

TEST(BendingC, NamesWhatItRefuses) {
  const auto refused = [](nf_bending bending, const char* quantity) {
    CNeedle c(bending);
    EXPECT_EQ(c.needle, nullptr) << quantity;
    ASSERT_NE(c.why.quantity, nullptr);
    EXPECT_STREQ(c.why.quantity, quantity);
  };
  nf_bending bad = usual;
  bad.layer_count = 9;
  refused(bad, "layer_count");
  bad = usual;
  const nf_lateral_layer soft{{{"modulus", 20e3}}, "soft"}, negative{{{"modulus", -1.0}}, nullptr};
  bad.layers = &soft;
  refused(bad, "form");
  bad.layers = &negative;
  refused(bad, "modulus");
  bad = usual;
  bad.section_count = 0;
  refused(bad, "section_count");
  const nf_section weak{1.0, 0.0, 0.0};
  bad = usual;
  bad.sections = &weak;
  refused(bad, "sections");
  const nf_parameter unknown[] = {{"needle_length", 0.2}, {"guide", 0.03}};
  bad = usual;
  bad.parameters = unknown, bad.parameter_count = 2;
  refused(bad, "guide");
  bad.parameter_count = 0;
  refused(bad, "needle_length");
  bad = usual;
  bad.elements = 1000;
  refused(bad, "elements");
  std::vector<double> small(4);
  nf_fault why{};
  EXPECT_EQ(nf_bend_init(small.data(), 32, nullptr, &usual, &why), nullptr);
  EXPECT_STREQ(why.quantity, "axial");
}

/// Memory and the guard in it.
struct CGuard {
  std::vector<double> memory = std::vector<double>(nf_base_guard_size() / sizeof(double) + 1);
  nf_fault why{};
  nf_base_guard* guard = nullptr;
  CGuard(nf_bend* needle, std::vector<nf_parameter> limits)
      : guard(nf_base_guard_init(memory.data(), nf_base_guard_size(), needle, limits.data(), limits.size(),
                                 &why)) {}
};

TEST(BendingC, GuardGivesTheValuesOfTheOneInCpp) {
  CNeedle c(usual);
  const CGuard guarded(c.needle, {{"max_force", 0.3},
                                  {"max_lateral_force", 0.02},
                                  {"longest_cycle", 1e-3},
                                  {"max_speed", 0.5},
                                  {"max_angular_speed", 50.0},
                                  {"max_moment", 1e-3}});
  ASSERT_NE(guarded.guard, nullptr) << guarded.why.quantity << guarded.why.reason;
  FlexibleSettings settings = guided();
  settings.small_slopes = false;
  Guard guard(SpatialInsertion(Insertion(paper::model(), {.max_speed = 1e9}), settings),
              {.max_force = 0.3,
               .longest_cycle = 1e-3,
               .max_speed = 0.5,
               .max_lateral_force = 0.02,
               .max_moment = 1e-3,
               .max_angular_speed = 50.0});
  nf_base_output out{};
  int did = 0;
  for (int i = 0; i <= 300; ++i) {
    const Base base{
        .depth = 2e-4 * (i - 5), .lateral = {4e-6 * i, -2e-6 * i}, .tilt = {0.0, 1e-5 * i}, .roll = 0.02 * i};
    const nf_base plain{
        base.depth, {base.lateral[0], base.lateral[1]}, {base.tilt[0], base.tilt[1]}, base.roll};
    nf_base_guard_step(guarded.guard, &plain, 1e-3, &out);
    const BaseOutput expected = guard.step(base, 1e-3);
    ASSERT_EQ(std::memcmp(&out.force, &expected.force, sizeof out.force), 0) << i;
    ASSERT_EQ(out.energy, expected.energy);
    ASSERT_EQ(out.reserve, expected.reserve);
    ASSERT_EQ(std::memcmp(out.sample.wrench, expected.sample.wrench.data(), sizeof out.sample.wrench), 0);
    did |= out.did;
  }
  EXPECT_TRUE(did & NF_CLAMPED);
  nf_base_guard_miss(guarded.guard, 1e-3, &out);
  EXPECT_EQ(out.force.depth, 0.0);
  EXPECT_EQ(out.force.lateral[0], 0.0);
  EXPECT_EQ(out.did & NF_STALE, NF_STALE);
  nf_base_guard_reset(guarded.guard);
  const nf_base above{-1e-3, {0.0, 0.0}, {0.0, 0.0}, 0.0};
  nf_base_guard_step(guarded.guard, &above, 1e-3, &out);
  EXPECT_EQ(out.sample.axial.phase, NF_FREE);
}

TEST(BendingC, GuardNamesWhatItRefuses) {
  CNeedle c(usual);
  const CGuard guarded(c.needle, {{"max_speed", 0.5}, {"longest_cycle", 1e-3}});
  EXPECT_EQ(guarded.guard, nullptr);
  EXPECT_NE(std::string(guarded.why.reason).find("max_angular_speed"), std::string::npos);
  EXPECT_STREQ(CGuard(c.needle, {{"max_moment", -1.0}}).why.quantity, "max_moment");
  EXPECT_STREQ(CGuard(nullptr, {}).why.quantity, "needle");
}

}  // namespace
