// SPDX-License-Identifier: Apache-2.0
// What every tip must keep: its closed forms are Sneddon's integrals, and its contact follows dF/dh = 2 E_r
// a.
#include <gtest/gtest.h>

#include <set>

#include "every_law.hpp"
#include "needleforce/contact.hpp"

namespace {

/// A tip without its closed forms.
template <class T>
struct Bare {
  T tip;
  static constexpr bool tangent = sneddon::is_tangent<T>();
  double slope(double r) const noexcept { return tip.slope(r); }
  double end() const noexcept { return tip.end(); }
  auto breaks() const noexcept { return tip.breaks(); }
};

/// Calls `visit` with every tip by its own type and radii within it.
template <class Visit>
void with_every_tip(Visit visit) {
  for (const Tip& tip : every_tip())
    std::visit(
        [&](const auto& shape) {
          for (const double x : {0.001, 0.01, 0.1, 0.3, 0.5, 0.8, 0.95, 0.999})
            if (x * 3.1e-4 > shape.flat()) visit(shape, x * 3.1e-4);
        },
        tip);
}

TEST(EveryTip, EveryShapeIsInTheTestedList) {
  std::set<std::size_t> shapes;
  for (const Tip& tip : every_tip()) {
    EXPECT_TRUE(valid(tip));
    shapes.insert(tip.index());
  }
  EXPECT_EQ(shapes.size(), std::variant_size_v<Tip>);
}

TEST(EveryTip, ClosedFormsAreSneddonsIntegrals) {
  with_every_tip([]<class T>(const T& tip, double a) {
    // r^(1/2) is no polynomial at the apex, so quadrature is no judge of it: its Gamma functions are, in
    // Python
    const double tolerance = std::is_same_v<T, tips::PowerProfile> ? 1e-4 : 1e-12;
    const sneddon::Touch touch = sneddon::touch(Bare<T>{tip}, a);
    EXPECT_NEAR(tip.depth(a), touch.depth, tolerance * touch.depth) << T::name << a;
    EXPECT_NEAR(tip.force(a), touch.force, tolerance * touch.force) << T::name << a;
  });
}

TEST(EveryTip, HeightIsTheIntegralOfTheSlope) {
  with_every_tip([]<class T>(const T& tip, double r) {
    double sum = 0.0;
    const int n = 20000;
    for (int i = 0; i < n; ++i) sum += tip.slope((i + 0.5) * r / n) * r / n;
    EXPECT_NEAR(tip.height(r), sum, 1e-4 * sum) << T::name << r;
  });
}

TEST(EveryTip, ContactRadiusIsTheInverseOfDepth) {
  with_every_tip([]<class T>(const T& tip, double a) {
    EXPECT_NEAR(tip.contact_radius(tip.depth(a)), a, 1e-12 * a) << T::name;
  });
}

TEST(EveryTip, SlopeIsTwiceTheRadiusAndTheEnergyIsTheIntegralOnAShank) {
  for (const Tip& tip : every_tip())
    for (const double h : {1e-4, 5e-4, 2e-3})
      std::visit(
          [&]<class T>(const T& shape) {
            const double step = 1e-4 * h;
            const Contact low = contact_at_depth(shape, h - step, 1e5, 3e-4);
            const Contact at = contact_at_depth(shape, h, 1e5, 3e-4);
            const Contact high = contact_at_depth(shape, h + step, 1e5, 3e-4);
            const double slope = 2e5 * at.contact_radius;
            EXPECT_NEAR((high.force - low.force) / (2.0 * step), slope, 1e-4 * slope) << T::name << h;
            EXPECT_NEAR((high.energy - low.energy) / (2.0 * step), at.force, 1e-4 * at.force) << T::name << h;
            EXPECT_LE(at.contact_radius, 3e-4);
          },
          tip);
}

TEST(EveryTip, PressureIntegratesToTheForce) {
  for (const Tip& tip : every_tip())
    for (const double h : {1e-4, 4e-3})  // before saturation and, where there is one, after
      std::visit(
          [&]<class T>(const T& shape) {
            const Contact at = contact_at_depth(shape, h, 1e5, 3e-4);
            const double a = at.contact_radius;
            double force = 0.0;
            const int n = 2000;  // r = a sin(theta): the fixed edge's 1/sqrt falls away
            for (int i = 0; i < n; ++i) {
              const double theta = (i + 0.5) * std::numbers::pi / 2 / n, r = a * std::sin(theta);
              force += 2 * std::numbers::pi * r * a * std::cos(theta) *
                       contact_pressure(shape, h, a, 1e5, r) * std::numbers::pi / 2 / n;
            }
            EXPECT_NEAR(force, at.force, 2e-3 * at.force) << T::name << h;
          },
          tip);
}

TEST(Pressure, ConeParaboloidAndFlatAreTheClosedForms) {
  const tips::Cone cone{15.0 * tips::degree};
  const tips::Paraboloid paraboloid{1e-3};
  const tips::Flat flat{1e-3};
  for (const double x : {0.1, 0.5, 0.9}) {
    const double root = std::sqrt(1.0 - x * x), a = 1e-3;
    const double sharp = 0.5 * cone.cotangent() * std::acosh(1.0 / x);
    EXPECT_NEAR(contact_pressure(cone, cone.depth(a), a, 1.0, x * a), sharp, 1e-10 * sharp);
    EXPECT_NEAR(contact_pressure(paraboloid, paraboloid.depth(a), a, 1.0, x * a),
                2.0 / std::numbers::pi * root, 1e-10);
    EXPECT_NEAR(contact_pressure(flat, 1e-4, a, 1.0, x * a), 1e-4 / (std::numbers::pi * a * root), 1e-10);
  }
  EXPECT_TRUE(std::isinf(contact_pressure(cone, cone.depth(1e-3), 1e-3, 1.0, 0.0)));
  EXPECT_TRUE(std::isinf(contact_pressure(flat, 1e-4, 1e-3, 1.0, 1e-3)));
  EXPECT_EQ(contact_pressure(flat, 1e-4, 1e-3, 1.0, 1.1e-3), 0.0);
}

void expect_same(double value, double expected, double tolerance) {
  EXPECT_NEAR(value, expected, tolerance * std::abs(expected));
}

TEST(Limits, BluntTipsBecomeTheCone) {
  const tips::Cone cone{15.0 * tips::degree};
  for (const double a : {1e-5, 3e-4}) {
    expect_same(tips::TruncatedCone{15.0 * tips::degree, 1e-6 * a}.force(a), cone.force(a), 1e-5);
    expect_same(tips::TruncatedCone{15.0 * tips::degree, 1e-6 * a}.depth(a), cone.depth(a), 1e-5);
    expect_same(tips::BluntedCone{15.0 * tips::degree, 1e-7 * a, 0.0}.force(a), cone.force(a), 1e-5);
    expect_same(tips::BluntedCone{15.0 * tips::degree, 1e-7 * a, 0.0}.depth(a), cone.depth(a), 1e-5);
  }
}

TEST(Limits, SmallSphereContactEqualsParaboloidAndSmallOgiveContactItsApex) {
  const double R = 0.35e-3, a = 1e-5 * R;
  expect_same(tips::Sphere{R}.force(a), tips::Paraboloid{R}.force(a), 1e-9);
  expect_same(tips::Sphere{R}.depth(a), tips::Paraboloid{R}.depth(a), 1e-9);
  const tips::TangentOgive ogive{R, 1.3e-3};
  const tips::Cone apex{std::atan(ogive.length / ogive.offset())};
  expect_same(ogive.force(a), apex.force(a), 1e-4);
  expect_same(ogive.depth(a), apex.depth(a), 1e-4);
}

TEST(Limits, OgiveAsLongAsWideEqualsTheHemisphere) {
  const tips::TangentOgive ogive{1e-3, 1e-3};
  const tips::Sphere sphere{1e-3};
  for (const double gap : {0.9, 0.3, 0.1, 1e-2, 1e-3}) {
    const double a = 1e-3 * (1.0 - gap);
    expect_same(ogive.depth(a), sphere.depth(a), 1e-12);
    expect_same(ogive.force(a), sphere.force(a), 1e-12);
  }
  // deeper the contact closes in on the end: force by depth stays good where radius no longer tells depth
  for (const double h : {2e-3, 5e-3, 1e-2, 1e-1})
    expect_same(contact_at_depth(ogive, h, 1.0).force, contact_at_depth(sphere, h, 1.0).force, 1e-11);
}

TEST(Limits, ContainedTipNeedsLessForce) {
  const double R = 0.35e-3;
  const tips::Cone cone{15.0 * tips::degree};
  const tips::BluntedCone rounded{15.0 * tips::degree, 5e-5, 0.0};
  const tips::TruncatedCone cut{15.0 * tips::degree, 1e-4};
  const tips::Flat flat{R};
  for (const double h : {1e-4, 1e-3, 4e-3}) {
    const auto force = [&](const auto& tip) { return contact_at_depth(tip, h, 1e5, R).force; };
    EXPECT_LT(force(cone), force(rounded));  // the same slope behind an apex that lies deeper
    EXPECT_LT(force(rounded), force(cut));
    EXPECT_LT(force(cut), force(flat));
    EXPECT_DOUBLE_EQ(force(flat), 2e5 * R * h);
  }
}

TEST(Profile, InvalidKnotsAreRefusedByIndex) {
  tips::Profile profile{{0.0, 1e-4, 2e-4}, {0.0, 1e-4, 3e-4}, 3};
  EXPECT_EQ(profile.flaw().limit, nullptr);
  const auto flaw = [&](double& number, double value) {
    const double before = number;
    number = value;
    const tips::Flaw found = profile.flaw();
    number = before;
    return found;
  };
  EXPECT_EQ(flaw(profile.rise[2], 0.5e-4).index, 2);
  EXPECT_EQ(flaw(profile.rise[0], 1e-6).index, 0);
  EXPECT_EQ(flaw(profile.radius[2], 1e-4).index, 2);
  EXPECT_EQ(flaw(profile.rise[2], 1.5e-4).index, 2);
  EXPECT_EQ(flaw(profile.radius[1], std::numeric_limits<double>::quiet_NaN()).index, 1);
  EXPECT_EQ(flaw(profile.rise[2], 1.1).index, 2);
  EXPECT_EQ(flaw(profile.radius[2], 0.11).index, 2);
}

}  // namespace
