// SPDX-License-Identifier: Apache-2.0
// Expected values: the project's independent reference values (tests/reference_values.json), by their names.
#include "needleforce/contact.hpp"

#include <gtest/gtest.h>

#include "paper.hpp"

using needleforce::contact_at_depth;
using needleforce::tips::Cone;

namespace {

constexpr double radius = 0.35e-3;
const Cone cone{paper::half_angle};

void expect_relative(double value, double expected, double tolerance = 1e-12) {
  EXPECT_NEAR(value, expected, tolerance * std::abs(expected));
}

TEST(Contact, cone_F_paper_Er116) {
  const auto contact = contact_at_depth(cone, paper::puncture, 116e3);
  expect_relative(contact.force, 0.2073365956887147);
  expect_relative(contact.contact_radius, 0.0005521731373470399);
  expect_relative(contact.energy, 0.00022371618674812315);
}

TEST(Contact, conecyl_F_paper_Er116) {
  expect_relative(contact_at_depth(cone, paper::puncture, 116e3, radius).force, 0.17954123494383667);
  expect_relative(cone.depth(radius), 0.002051802094979392);
  expect_relative(cone.force(radius) * 116e3, 0.08330316505616331);
}

TEST(Contact, EnergyIsTheIntegralOfTheForce) {
  constexpr int n = 200000;
  double energy = 0.0;
  for (int i = 0; i < n; ++i)
    energy += contact_at_depth(cone, (i + 0.5) * 4e-3 / n, 116e3, radius).force * 4e-3 / n;
  expect_relative(contact_at_depth(cone, 4e-3, 116e3, radius).energy, energy, 1e-9);
}

TEST(Contact, SlopeIsTwiceModulusTimesRadiusBeforeAndAfterSaturation) {
  for (const double h : {1e-3, 2e-3, 2.2e-3, 5e-3}) {
    const double step = 1e-8;
    const double rise = contact_at_depth(cone, h + step, 1e5, radius).force -
                        contact_at_depth(cone, h - step, 1e5, radius).force;
    expect_relative(rise / (2 * step), 2e5 * contact_at_depth(cone, h, 1e5, radius).contact_radius, 1e-6);
  }
}

TEST(Contact, ForceIsZeroAboveTheSurface) {
  EXPECT_EQ(contact_at_depth(cone, -1e-3, 1e5).force, 0.0);
  EXPECT_EQ(contact_at_depth(cone, 0.0, 1e5).contact_radius, 0.0);
}

}  // namespace
