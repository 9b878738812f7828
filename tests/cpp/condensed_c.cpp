// SPDX-License-Identifier: Apache-2.0
// The C face of a condensed solid: the same numbers as in C++, and what it refuses.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "../../bindings/c/needleforce_guard.h"
#include "bending.hpp"
#include "needleforce/base_guard.hpp"
#include "needleforce/solid/bent_in_solid.hpp"
#include "solid.hpp"

using namespace solid_tests;

namespace {

nf_layer paper_layer() {
  nf_layer layer{};
  layer.stiffness = {"polynomial", {{"linear", 100.0}, {"quadratic", 0.0}}, nullptr};
  layer.puncture = {"puncture_force", {{"force", 0.2}}, nullptr};
  layer.friction = {"coulomb", {{"per_length", 20.0}, {"presliding", 1e-6}}, nullptr};
  layer.cutting = {"constant_cutting", {{"force", 0.1}, {"unloading", 1e-6}}, nullptr};
  return layer;
}

/// Row by row without the gaps of the table in C++.
std::vector<double> rows(const CondensedTissue& tissue) {
  std::vector<double> result;
  for (std::size_t i = 0; i < tissue.nodes; ++i)
    for (std::size_t j = 0; j < tissue.nodes; ++j) result.push_back(tissue.at(i, j));
  return result;
}

struct Solid {
  std::vector<double> memory = std::vector<double>(nf_solid_size() / sizeof(double) + 1);
  nf_layer layer = paper_layer();
  nf_fault why{};
  nf_solid* made(double spacing, std::size_t nodes, const double* compliance,
                 std::size_t size = nf_solid_size()) {
    return nf_solid_init(memory.data(), size, &layer, 1, nullptr, spacing, nodes, compliance, &why);
  }
};

/// Moves both; the C face's solid, to be looked at.
nf_solid* moved(Solid& given, const CondensedTissue& table, CondensedInsertion& same) {
  const std::vector<double> compliance = rows(table);
  nf_solid* solid = given.made(table.spacing, table.nodes, compliance.data());
  EXPECT_NE(solid, nullptr) << given.why.reason;
  for (int i = 0; solid && i < 12000; ++i) {
    const double depth = -1e-3 + 5e-6 * (i < 7000 ? i : i < 8000 ? 14000 - i : i - 2000);
    nf_sample sample;
    nf_solid_step(solid, depth, NF_NO_VELOCITY, 1e-3, &sample);
    EXPECT_EQ(sample.force, same.step(depth, no_velocity, 1e-3).force) << i;
  }
  return solid;
}

TEST(CondensedSolidInC, StepsToTheBitAsInCpp) {
  for (bool relaxes : {false, true}) {
    Model laws = laws_of(20.0, 0.1, 0.2);
    Solid given;
    if (relaxes) {
      laws.relaxation = laws::Prony{0.4, 0.5, 0.0, 5.0};
      given.layer.relaxation = {"prony", {{"share_1", 0.4}, {"time_1", 0.5}}, nullptr};
    }
    CondensedInsertion same = insertion(2e-3, laws);
    nf_solid* solid = moved(given, tissue(2e-3), same);
    ASSERT_NE(solid, nullptr);
    double values[64];
    EXPECT_EQ(nf_solid_tip(solid), same.state().tip);
    EXPECT_EQ(nf_solid_forces(solid, values, 64), same.tissue().nodes);
    EXPECT_EQ(values[3], same.node_force(3));
    EXPECT_EQ(nf_solid_displacements(solid, values, 5), same.tissue().nodes);
    EXPECT_EQ(values[4], same.displacement(4));
  }
}

TEST(CondensedSolidInC, SavesAndRestores) {
  const CondensedTissue table = tissue(2e-3);
  const std::vector<double> compliance = rows(table);
  Solid given;
  nf_solid* solid = given.made(table.spacing, table.nodes, compliance.data());
  nf_sample sample, again;
  for (int i = 0; i < 3000; ++i) nf_solid_step(solid, 5e-6 * i, NF_NO_VELOCITY, 1e-3, &sample);
  std::vector<char> bytes(nf_solid_snapshot_size());
  EXPECT_EQ(nf_solid_snapshot(solid, bytes.data(), bytes.size() - 1), 0);
  ASSERT_EQ(nf_solid_snapshot(solid, bytes.data(), bytes.size()), 1);
  nf_solid_step(solid, 15.005e-3, NF_NO_VELOCITY, 1e-3, &sample);
  nf_solid_reset(solid);
  EXPECT_EQ(nf_solid_tip(solid), 0.0);
  ASSERT_EQ(nf_solid_restore(solid, bytes.data(), bytes.size()), 1);
  nf_solid_step(solid, 15.005e-3, NF_NO_VELOCITY, 1e-3, &again);
  EXPECT_EQ(sample.force, again.force);
  bytes[9] ^= 1;
  EXPECT_EQ(nf_solid_restore(solid, bytes.data(), bytes.size()), 0);
}

TEST(CondensedSolidInC, NamesWhatItRefuses) {
  const CondensedTissue table = tissue(2e-3);
  std::vector<double> compliance = rows(table);
  Solid given;
  EXPECT_EQ(given.made(1e-3, 61, compliance.data(), 100), nullptr);
  EXPECT_STREQ(given.why.quantity, "size");
  EXPECT_EQ(given.made(1e-3, 65, compliance.data()), nullptr);
  EXPECT_STREQ(given.why.quantity, "nodes");
  EXPECT_EQ(given.made(1e-3, 61, nullptr), nullptr);
  EXPECT_STREQ(given.why.reason, "is missing");
  EXPECT_EQ(given.made(0.0, 61, compliance.data()), nullptr);
  EXPECT_STREQ(given.why.reason, "the spacing is not 1e-6 to 0.1 m");
  compliance[1] = 0.0;
  EXPECT_EQ(given.made(1e-3, 61, compliance.data()), nullptr);
  EXPECT_STREQ(given.why.reason, "the compliance is not symmetric");
  given.layer.friction.name = "glue";
  EXPECT_EQ(given.made(1e-3, 61, compliance.data()), nullptr);
  EXPECT_NE(given.why.reason, nullptr);
}

TEST(CondensedSolidInC, BendsToTheBitAsInCpp) {
  const CondensedTissue table = tissue(2e-3);
  const std::vector<double> compliance = rows(table);
  Solid given;
  nf_solid* solid = given.made(table.spacing, table.nodes, compliance.data());
  ASSERT_NE(solid, nullptr) << given.why.reason;
  const nf_parameter lengths[] = {
      {"needle_length", 1.0}, {"guide_distance", 0.03}, {"bevel_length", 0.002612}};
  const nf_section section{1.0, 0.0206517998, 0.0};
  const nf_lateral_layer layer{{{"modulus", 20e3}, {"tip_force", 0.2}}, nullptr};
  const nf_bending bending{&layer, 1, &section, 1, lengths, 3, 0};
  std::vector<double> memory(nf_bend_size() / sizeof(double) + 1), kept(nf_bend_snapshot_size() / 8 + 1);
  nf_bend* needle = nf_bend_init_in_solid(memory.data(), nf_bend_size(), solid, &bending, &given.why);
  ASSERT_NE(needle, nullptr) << given.why.reason;
  EXPECT_EQ(nf_bend_init_in_solid(memory.data(), nf_bend_size(), nullptr, &bending, &given.why), nullptr);
  needle = nf_bend_init_in_solid(memory.data(), nf_bend_size(), solid, &bending, &given.why);
  bending::FlexibleSettings settings = bending_tests::guided();
  settings.small_slopes = false;
  solid::BentInSolid<2> same(insertion(2e-3, laws_of(20.0, 0.1, 0.2)), settings);
  for (int i = 0; i < 400; ++i) {
    const double depth = -1e-3 + 1e-4 * (i < 300 ? i : 600 - i);
    const nf_base base{depth, {1e-5 * i, 0.0}, {}, 0.01 * i};
    nf_bent sample;
    nf_bend_step(needle, &base, 1e-2, &sample);
    const auto expected = same.step({.depth = depth, .lateral = {1e-5 * i, 0.0}, .roll = 0.01 * i}, 1e-2);
    ASSERT_EQ(sample.tip[0], expected.tip[0]) << i;
    ASSERT_EQ(sample.force, expected.force) << i;
    ASSERT_EQ(sample.status, 0) << i;
    if (i == 350) nf_bend_snapshot(needle, kept.data(), nf_bend_snapshot_size());
  }
  EXPECT_EQ(nf_bend_restore(needle, kept.data(), nf_bend_snapshot_size()), 1);
  reinterpret_cast<unsigned char*>(kept.data())[nf_bend_snapshot_size() - 1] ^= 1;
  EXPECT_EQ(nf_bend_restore(needle, kept.data(), nf_bend_snapshot_size()), 0);
}

TEST(CondensedSolidInC, GuardGivesTheValuesOfTheOneInCpp) {
  const CondensedTissue table = tissue(2e-3);
  const std::vector<double> compliance = rows(table);
  Solid given;
  nf_solid* solid = given.made(table.spacing, table.nodes, compliance.data());
  ASSERT_NE(solid, nullptr);
  std::vector<double> memory(nf_guard_size() / sizeof(double) + 1);
  const nf_parameter limits[] = {
      {"max_force", 0.3}, {"longest_cycle", 1e-3}, {"max_speed", 0.5}, {"max_moment", 1.0}};
  EXPECT_EQ(nf_guard_init_in_solid(memory.data(), nf_guard_size(), solid, limits, 4, &given.why), nullptr);
  EXPECT_NE(std::string(given.why.reason).find("needle that bends"), std::string::npos);
  nf_guard* guarded = nf_guard_init_in_solid(memory.data(), nf_guard_size(), solid, limits, 3, &given.why);
  ASSERT_NE(guarded, nullptr) << given.why.reason;
  Guard guard(insertion(2e-3, laws_of(20.0, 0.1, 0.2)),
              {.max_force = 0.3, .longest_cycle = 1e-3, .max_speed = 0.5});
  for (int i = 0; i < 800; ++i) {
    const double depth = 5e-5 * (i < 500 ? i : 1000 - i);
    nf_output output;
    nf_guard_step(guarded, depth, NF_NO_VELOCITY, 1e-3, &output);
    const Output expected = guard.step(depth, no_velocity, 1e-3);
    ASSERT_EQ(output.force, expected.force) << i;
    ASSERT_EQ(output.reserve, expected.reserve) << i;
    ASSERT_EQ(output.sample.force, expected.sample.force) << i;
  }
}

}  // namespace
