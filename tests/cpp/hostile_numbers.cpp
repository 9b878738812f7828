// SPDX-License-Identifier: Apache-2.0
// Each number that enters by the C face, and settings of C++, set to what is no number, is absurd or is next
// to none: refused with the quantity named, or every number of every sample is finite, whatever its status.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "../../bindings/c/needleforce_bend.h"
#include "../../bindings/c/needleforce_guard.h"
#include "../proof/c_layers.hpp"
#include "bending.hpp"
#include "every_law.hpp"
#include "needleforce/bending/tip_estimator.hpp"
#include "needleforce/guard.hpp"
#include "solid.hpp"

namespace {

using namespace needleforce;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double none = std::numeric_limits<double>::quiet_NaN();
constexpr double usual_number = 7.0;  // of an attempt in which none is hostile, which is to be taken
constexpr double hostile[] = {none, infinity, -infinity, -1.0, 0.0, 1e300, -1e300, 1e-310};

/// Memory of the caller, and what was answered.
struct Place {
  explicit Place(std::size_t size) : memory(size / sizeof(double) + 1) {}
  std::vector<double> memory;
  std::size_t size() const { return memory.size() * sizeof(double); }
  nf_fault why{};
};
/// A refusal names law and quantity.
void expect_named(const void* made, const nf_fault& why, double number) {
  EXPECT_TRUE(made || (why.law && why.quantity && why.reason)) << number;
}

void expect_finite(const nf_sample& s, const char* what, double number) {
  for (const double each : {s.depth, s.velocity, s.force, s.stiffness, s.friction, s.cutting, s.lateral,
                            s.force_by_depth, s.force_by_velocity})
    EXPECT_TRUE(std::isfinite(each)) << what << " = " << number;
}

/// Calls `visit` with each hostile value of a number, which is put back.
template <class Visit>
void with_each(double& number, Visit visit) {
  const double before = number;
  for (const double each : hostile) visit(number = each);
  number = before;
}

/// In, a hold, and out; the tip goes through a layer or two.
constexpr double stroke[] = {-1e-3, 1e-4, 2e-3, 8e-3, 2.5e-2, 2.5e-2, 2.4e-2, 5e-3, -1e-3};

void try_layers(const std::vector<nf_layer>& layers, const nf_settings& settings, const char* what,
                double number) {
  Place place(nf_size());
  nf_insertion* made =
      nf_init(place.memory.data(), place.size(), layers.data(), layers.size(), &settings, &place.why);
  expect_named(made, place.why, number);
  if (!made) return;
  nf_sample sample;
  for (const double depth : stroke) {
    nf_step(made, depth, NF_NO_VELOCITY, 0.1, &sample);
    expect_finite(sample, what, number);
  }
}

/// Each number of each law, and of its tip, in the layer of the paper.
template <class Laws>
void try_each_law(nf_law nf_layer::* place, Laws Model::* laws) {
  ::with_each<Laws>([&](const auto& law) {
    Model model = paper::model();
    model.*laws = law;
    CLayers named(paper::one(model));
    nf_layer& layer = named.data()[0];
    const nf_settings settings = nf_default_settings();
    nf_tip tip = (layer.*place).tip ? *(layer.*place).tip : nf_tip{};
    if ((layer.*place).tip) (layer.*place).tip = &tip;
    for (nf_parameter* parameters : {(layer.*place).parameters, tip.parameters})
      for (nf_parameter* each = parameters; each->name; ++each)
        with_each(each->value, [&](double number) { try_layers({layer}, settings, each->name, number); });
  });
}

TEST(HostileNumbers, OfLawsAndTips) {
  try_each_law<Stiffness>(&nf_layer::stiffness, &Model::stiffness);
  try_each_law<Puncture>(&nf_layer::puncture, &Model::puncture);
  try_each_law<Friction>(&nf_layer::friction, &Model::friction);
  try_each_law<Cutting>(&nf_layer::cutting, &Model::cutting);
  try_each_law<Relaxation>(&nf_layer::relaxation, &Model::relaxation);
}

TEST(HostileNumbers, OfAProfileTopsSettingsAndSteps) {
  CLayers named(std::array{Layer{0.0, paper::model()}, Layer{0.02, paper::model()}});
  std::vector<nf_layer> layers{named.data(), named.data() + 2};
  nf_settings settings = nf_default_settings();
  double radii[] = {0.0, 1e-4, 3e-4}, heights[] = {0.0, 1e-4, 1e-3};
  nf_tip tip{"profile", {}, nullptr, radii, heights, 3};
  layers[0].stiffness = {"tip_contact", {{"reduced_modulus", 1e5}, {"radius", 3e-4}}, &tip};
  for (double* table : {radii, heights})
    for (std::size_t i = 0; i < 3; ++i)
      with_each(table[i], [&](double number) { try_layers(layers, settings, "profile", number); });
  for (nf_layer& layer : layers)
    with_each(layer.top, [&](double number) { try_layers(layers, settings, "top", number); });
  auto* all = reinterpret_cast<double*>(&settings);
  for (std::size_t i = 0; i < sizeof settings / sizeof(double); ++i)
    with_each(all[i], [&](double number) { try_layers(layers, settings, "settings", number); });
  Place place(nf_size());
  nf_insertion* made = nf_init(place.memory.data(), place.size(), layers.data(), 2, &settings, &place.why);
  ASSERT_TRUE(made);
  double motion[] = {1e-3, 1e-2, 0.1};
  nf_sample sample;
  nf_step(made, 0.0, 1e-2, 0.1, &sample);
  for (double& number : motion)
    with_each(number, [&](double each) {
      nf_step(made, motion[0], motion[1], motion[2], &sample);
      expect_finite(sample, "motion", each);
      EXPECT_FALSE(!std::isfinite(each) && sample.status == NF_OK) << each;
    });
}

TEST(HostileNumbers, OfACondensedSolid) {
  const solid::CondensedTissue tissue = solid_tests::tissue(2e-3, 8);
  std::vector<double> rows;
  for (std::size_t i = 0; i < 8; ++i) rows.insert(rows.end(), tissue.row(i), tissue.row(i) + 8);
  CLayers named(paper::one(paper::model()));
  double spacing = 5e-3;
  const auto attempt = [&](const char* what, double number) {
    Place place(nf_solid_size());
    nf_solid* made = nf_solid_init(place.memory.data(), place.size(), named.data(), 1, nullptr, spacing, 8,
                                   rows.data(), &place.why);
    expect_named(made, place.why, number);
    nf_sample sample;
    double values[8];
    for (const double depth : stroke) {
      if (!made) return;
      nf_solid_step(made, depth, NF_NO_VELOCITY, 0.1, &sample);
      expect_finite(sample, what, number);
      nf_solid_forces(made, values, 8);
      for (const double value : values) EXPECT_TRUE(std::isfinite(value)) << what << " = " << number;
      nf_solid_displacements(made, values, 8);
      for (const double value : values) EXPECT_TRUE(std::isfinite(value)) << what << " = " << number;
    }
  };
  with_each(spacing, [&](double number) { attempt("spacing", number); });
  for (double& each : rows) with_each(each, [&](double number) { attempt("compliance", number); });
}

/// What nf_bend_init takes, in one place.
struct Bent {
  nf_lateral_layer layers[2]{};
  nf_section sections[2]{{0.01, 0.01, 0.0}, {1.0, 0.02, 0.0}};
  std::vector<nf_parameter> parameters;
  nf_bending bending{};
  CLayers named{paper::one(paper::model())};

  Bent() {
    for (const double top : {0.0, 0.02}) {
      bending::LateralLayer layer{.top = top, .modulus = 2e4, .tip_force = 0.2};
      nf_parameter* each = layers[top > 0.0].parameters;
      for (const auto& parameter : bending::LateralLayer::table)
        *each++ = {parameter.name, layer.*parameter.member};
    }
    add(bending::Support{.guide_distance = 0.03});
    add(bending::Bending{.pressure_friction = 0.1});
    bending = {layers, 2, sections, 2, parameters.data(), parameters.size(), 0};
  }
  template <class T>
  void add(const T& value) {
    for (const auto& parameter : T::table) parameters.push_back({parameter.name, value.*parameter.member});
  }
  nf_bend* made(Place& axial, Place& place) {
    nf_settings settings = nf_default_settings();
    settings.max_speed = infinity;
    nf_insertion* insertion = nf_init(axial.memory.data(), axial.size(), named.data(), 1, &settings, nullptr);
    return nf_bend_init(place.memory.data(), place.size(), insertion, &bending, &place.why);
  }
};
void expect_finite(const nf_bent& s, const char* what, double number) {
  expect_finite(s.axial, what, number);
  double sum = s.force + s.lateral + s.unsupported;
  for (std::size_t i = 0; i < 3; ++i) sum += s.tip[i] + s.tangent[i] + s.wrench[i] + s.wrench[3 + i];
  EXPECT_TRUE(std::isfinite(sum)) << what << " = " << number;
}

TEST(HostileNumbers, OfANeedleThatBends) {
  Bent bent;
  const auto attempt = [&](const char* what, double number) {
    Place axial(nf_size()), place(nf_bend_size());
    nf_bend* made = bent.made(axial, place);
    expect_named(made, place.why, number);
    EXPECT_TRUE(made || number != usual_number) << place.why.reason;
    nf_bent sample;
    for (const double depth : {-1e-3, 1e-3, 8e-3, 1.2e-2, 1.1e-2, -1e-3}) {
      if (!made) return;
      const nf_base base{depth, {1e-2 * depth, 0.0}, {0.0, 0.0}, 10.0 * depth};
      nf_bend_step(made, &base, 0.1, &sample);
      expect_finite(sample, what, number);
    }
  };
  attempt("nothing", usual_number);
  for (nf_lateral_layer& layer : bent.layers)
    for (nf_parameter* each = layer.parameters; each->name; ++each)
      with_each(each->value, [&](double number) { attempt(each->name, number); });
  for (nf_section& section : bent.sections)
    for (double* each : {&section.end, &section.stiffness, &section.curvature})
      with_each(*each, [&](double number) { attempt("section", number); });
  for (nf_parameter& each : bent.parameters)
    with_each(each.value, [&](double number) { attempt(each.name, number); });
  for (const int elements : {-1, 101, 1 << 30, -(1 << 30)}) {
    bent.bending.elements = elements;
    Place axial(nf_size()), place(nf_bend_size());
    EXPECT_EQ(bent.made(axial, place), nullptr) << elements;
  }
}

TEST(HostileNumbers, OfTheMotionOfABase) {
  Bent bent;
  Place axial(nf_size()), place(nf_bend_size());
  nf_bend* made = bent.made(axial, place);
  ASSERT_TRUE(made);
  nf_base base{};
  double dt = 0.1;
  nf_bent sample;
  for (double* number :
       {&base.depth, &base.lateral[0], &base.lateral[1], &base.tilt[0], &base.tilt[1], &base.roll, &dt})
    with_each(*number, [&](double each) {
      nf_bend_step(made, &base, dt, &sample);
      expect_finite(sample, "motion of the base", each);
      EXPECT_FALSE(!std::isfinite(each) && sample.status == NF_OK) << each;
    });
}

TEST(HostileNumbers, OfAGuard) {
  CLayers named(paper::one(paper::model()));
  std::vector<nf_parameter> settings;
  const GuardSettings usual{.max_force = 2.0, .max_slew = 100.0, .longest_cycle = 0.2, .max_speed = 1.0};
  for (const auto& parameter : GuardSettings::table)
    settings.push_back({parameter.name, usual.*parameter.member});
  EXPECT_TRUE(valid(usual));
  for (nf_parameter& each : settings)
    with_each(each.value, [&](double number) {
      Place place(nf_size()), around(nf_guard_size());
      nf_insertion* insertion = nf_init(place.memory.data(), place.size(), named.data(), 1, nullptr, nullptr);
      nf_guard* guard = nf_guard_init(around.memory.data(), around.size(), insertion, settings.data(),
                                      settings.size(), &around.why);
      expect_named(guard, around.why, number);
      nf_output out;
      for (const double depth : stroke) {
        if (!guard) return;
        nf_guard_step(guard, depth, NF_NO_VELOCITY, 0.1, &out);
        expect_finite(out.sample, each.name, number);
        EXPECT_TRUE(std::isfinite(out.force + out.energy + out.reserve)) << each.name << " = " << number;
      }
    });
}

TEST(HostileNumbers, OfAGuardOfABase) {
  Bent bent;
  std::vector<nf_parameter> settings;
  const GuardSettings usual{
      .max_force = 2.0, .longest_cycle = 0.2, .max_speed = 1.0, .max_angular_speed = 1.0};
  for (const auto& parameter : GuardSettings::table)
    settings.push_back({parameter.name, usual.*parameter.member});
  nf_base base{};
  const auto attempt = [&](const char* what, double number) {
    Place axial(nf_size()), place(nf_bend_size()), around(nf_base_guard_size());
    nf_base_guard* guard = nf_base_guard_init(around.memory.data(), around.size(), bent.made(axial, place),
                                              settings.data(), settings.size(), &around.why);
    expect_named(guard, around.why, number);
    EXPECT_TRUE(guard || number != usual_number) << around.why.reason;
    nf_base_output out;
    for (int i = -1; guard && i < 4; ++i) {
      const nf_base to{
          base.depth + 2e-3 * i, {base.lateral[0], base.lateral[1]}, {base.tilt[0], base.tilt[1]}, base.roll};
      nf_base_guard_step(guard, &to, 0.1, &out);
      expect_finite(out.sample, what, number);
      const nf_base_force& f = out.force;
      EXPECT_TRUE(std::isfinite(f.depth + f.lateral[0] + f.lateral[1] + f.tilt[0] + f.tilt[1] + f.roll +
                                out.energy + out.reserve))
          << what << " = " << number;
    }
  };
  attempt("nothing", usual_number);
  for (nf_parameter& each : settings)
    with_each(each.value, [&](double number) { attempt(each.name, number); });
  for (double* number :
       {&base.depth, &base.lateral[0], &base.lateral[1], &base.tilt[0], &base.tilt[1], &base.roll})
    with_each(*number, [&](double each) { attempt("motion of the base", each); });
}

// counts beyond their arrays were read before they were refused
TEST(HostileNumbers, OfSettingsInCpp) {
  const auto status = [](const auto& change) {
    bending::FlexibleSettings settings = bending_tests::guided();
    change(settings);
    bending::SpatialInsertion needle(Insertion(paper::model()), settings);
    return needle.step({}, 0.1).status;
  };
  using Settings = bending::FlexibleSettings;
  EXPECT_EQ(status([](Settings&) {}), Status::ok);
  EXPECT_EQ(status([](Settings& s) { s.beam.layer_count = 1ul << 40; }), Status::invalid_parameter);
  EXPECT_EQ(status([](Settings& s) { s.beam.sections.count = 1ul << 40; }), Status::invalid_parameter);
  EXPECT_EQ(status([](Settings& s) { s.beam.max_iterations = 1ul << 40; }), Status::invalid_parameter);
  for (const double each : {none, infinity, -1.0, 0.0})
    EXPECT_EQ(status([=](Settings& s) { s.beam.tolerance = each; }), Status::invalid_parameter) << each;
}

TEST(HostileNumbers, OfAnEstimator) {
  const bending::SpatialInsertion needle(Insertion(paper::model()), bending_tests::guided());
  for (const auto& parameter : bending::PathUncertainty::table)
    for (const double each : hostile) {
      bending::PathUncertainty uncertainty;
      uncertainty.*parameter.member = each;
      const bool possible = !first_invalid(uncertainty);
      auto estimator = std::make_unique<bending::TipEstimator>(needle, std::span(&needle, 1), uncertainty);
      for (const double depth : {0.0, 1e-3, 2e-3}) {
        const bending::TipEstimate out = estimator->step({.depth = depth}, 0.1);
        estimator->tip({1e-4, 0.0}, 0.0);
        EXPECT_TRUE(std::isfinite(out.tip[0] + out.slope[1] + out.covariance[0] + out.covariance[2]))
            << parameter.name;
        EXPECT_EQ(out.sample.status == Status::invalid_parameter, !possible) << parameter.name << each;
      }
    }
  auto estimator =
      std::make_unique<bending::TipEstimator>(needle, std::span(&needle, 1), bending::PathUncertainty{});
  std::array<bending::TipEstimator::Plane, 3> errors{};
  for (const double each : {none, infinity, -1.0, 0.0, 1e300}) EXPECT_FALSE(estimator->expect(errors, each));
  EXPECT_TRUE(estimator->expect(errors, 1e-3));
  errors[1][0] = infinity;
  EXPECT_FALSE(estimator->expect(errors, 1e-3));
}

}  // namespace
