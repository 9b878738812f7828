// SPDX-License-Identifier: Apache-2.0
// What every law must keep. A law on the list in laws/all.hpp earns these tests by standing there.
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "needleforce/model.hpp"

using namespace needleforce;

namespace {

template <class V>
struct AsTypes;
template <class... L>
struct AsTypes<std::variant<L...>> {
  using type = ::testing::Types<L...>;
};
template <class... V>
struct Joined;
template <class... A>
struct Joined<std::variant<A...>> {
  using type = std::variant<A...>;
};
template <class... A, class... B, class... Rest>
struct Joined<std::variant<A...>, std::variant<B...>, Rest...> : Joined<std::variant<A..., B...>, Rest...> {};

/// A law with every number in the middle of its range, in the sense of a logarithm where the range spans
/// decades.
template <Parameterised L>
L middle() {
  L law{};
  for (const auto& parameter : L::table) {
    const bool wide = parameter.low > 0.0 && parameter.high > 100.0 * parameter.low;
    law.*parameter.member =
        wide ? std::sqrt(parameter.low * parameter.high) : 0.5 * (parameter.low + parameter.high);
  }
  return law;
}

template <class L>
struct EveryLaw : ::testing::Test {};
using AllLaws = AsTypes<Joined<Stiffness, Puncture, Friction, Cutting>::type>::type;
TYPED_TEST_SUITE(EveryLaw, AllLaws);

TYPED_TEST(EveryLaw, IsALawWithATableInOrder) {
  static_assert(Law<TypeParam>);
  for (const auto& parameter : TypeParam::table) {
    EXPECT_LT(parameter.low, parameter.high) << parameter.name;
    EXPECT_GT(std::string(parameter.meaning).size(), 10u) << parameter.name;
    EXPECT_GT(std::string(parameter.source).size(), 2u) << parameter.name;
    if (!std::isnan(parameter.initial)) {
      EXPECT_GE(parameter.initial, parameter.low) << parameter.name;
      EXPECT_LE(parameter.initial, parameter.high) << parameter.name;
    }
  }
}

TYPED_TEST(EveryLaw, RefusesWhatIsOutsideItsRange) {
  EXPECT_EQ(first_invalid(middle<TypeParam>()), nullptr);
  for (const auto& parameter : TypeParam::table) {
    for (const double bad :
         {std::nextafter(parameter.low, -1e300), std::nextafter(parameter.high, 1e300),
          std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      TypeParam law = middle<TypeParam>();
      law.*parameter.member = bad;
      EXPECT_EQ(first_invalid(law), &parameter) << parameter.name;
    }
  }
}

template <class L>
struct EveryStiffness : ::testing::Test {};
using StiffnessLaws = AsTypes<Stiffness>::type;
TYPED_TEST_SUITE(EveryStiffness, StiffnessLaws);

TYPED_TEST(EveryStiffness, StartsAtZeroAndRisesConvexly) {
  const auto law = middle<TypeParam>().prepare();
  EXPECT_EQ(law.force(0.0), 0.0);
  for (double h = 1e-5; h < 0.1; h *= 1.5) {
    EXPECT_GT(law.force(1.5 * h), law.force(h));
    EXPECT_GE(law.slope(1.5 * h), law.slope(h));
  }
}

TYPED_TEST(EveryStiffness, SlopeEnergyAndInverseBelongToTheForce) {
  const auto law = middle<TypeParam>().prepare();
  for (double h = 1e-5; h < 0.1; h *= 1.7) {
    const double step = 1e-6 * h;
    EXPECT_NEAR((law.force(h + step) - law.force(h - step)) / (2 * step), law.slope(h), 1e-6 * law.slope(h));
    EXPECT_NEAR((law.energy(h + step) - law.energy(h - step)) / (2 * step), law.force(h),
                1e-6 * law.force(h));
    EXPECT_NEAR(law.indentation(law.force(h)), h, 1e-12 * h);
  }
}

TYPED_TEST(EveryStiffness, IsProportionalToItsModulus) {
  TypeParam soft = middle<TypeParam>(), stiff = soft;
  stiff.reduced_modulus *= 3.0;
  EXPECT_NEAR(stiff.prepare().force(2e-3), 3.0 * soft.prepare().force(2e-3),
              1e-12 * stiff.prepare().force(2e-3));
}

TEST(ConeCylinder, NeverExceedsTheConeAndEqualsItBeforeSaturation) {
  const double angle = 15.0 * tips::degree;
  const auto cone = laws::Cone{1e5, angle}.prepare();
  const auto shank = laws::ConeCylinder{1e5, angle, 0.35e-3}.prepare();
  for (double h = 0.0; h < 8e-3; h += 1e-5) {
    if (h <= shank.saturation)
      EXPECT_DOUBLE_EQ(shank.force(h), cone.force(h));
    else
      EXPECT_LT(shank.force(h), cone.force(h));
  }
  const auto wide = laws::ConeCylinder{1e5, angle, 0.1}.prepare();
  EXPECT_DOUBLE_EQ(wide.force(8e-3), cone.force(8e-3));
}

TEST(Friction, IsOddInTheDirectionAndDissipates) {
  const auto law = laws::Coulomb{18.6, 20e-6, 0.0}.prepare();
  double bristle = 0.0, work = 0.0;
  for (int i = 0; i < 4000; ++i) {
    const double travel = i / 1000 % 2 == 0 ? 1e-6 : -1e-6;
    const double before = law.force(bristle, 5e-3);
    bristle = law.advance(bristle, travel);
    EXPECT_LE(std::abs(bristle), 1.0);
    work += 0.5 * (before + law.force(bristle, 5e-3)) * travel;
  }
  EXPECT_GT(work, 0.0);
  EXPECT_DOUBLE_EQ(law.force(-1.0, 5e-3), -law.force(1.0, 5e-3));
  EXPECT_EQ(law.force(1.0, 0.0), 0.0);
}

}  // namespace
