// SPDX-License-Identifier: Apache-2.0
// What every law must keep, whatever its family.
#include "every_law.hpp"

namespace {

template <class L>
struct EveryLaw : ::testing::Test {};
using AllLaws = AsTypes<Joined<Stiffness, Puncture, Friction, Cutting, Relaxation>::type>::type;
TYPED_TEST_SUITE(EveryLaw, AllLaws);

TYPED_TEST(EveryLaw, TableIsComplete) {
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

TYPED_TEST(EveryLaw, HasUnitsThatFollowLengthsAndStresses) {
  for (const auto& parameter : TypeParam::table)
    EXPECT_TRUE(std::isfinite(unit_factor(parameter.unit, s, m))) << parameter.unit;
}

TYPED_TEST(EveryLaw, RefusesParametersOutsideTheirRanges) {
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

TYPED_TEST(EveryLaw, ContradictionNamesAParameter) {
  EXPECT_EQ(contradiction(middle<TypeParam>()), nullptr);
  if constexpr (requires(const TypeParam& law) { law.contradiction(); }) {
    // some numbers within their ranges do contradict each other, and the words name one of them
    int contradictory = 0;
    std::mt19937_64 generator{1};
    std::uniform_real_distribution<double> place{0.0, 1.0};
    for (int i = 0; i < 1000; ++i) {
      TypeParam law{};
      for (const auto& parameter : TypeParam::table)
        law.*parameter.member = along(parameter.low, parameter.high, place(generator));
      const char* words = law.contradiction();
      if (!words) continue;
      ++contradictory;
      const bool named =
          std::any_of(TypeParam::table.begin(), TypeParam::table.end(), [&](const auto& parameter) {
            return std::string(words).find(parameter.name) != std::string::npos;
          });
      EXPECT_TRUE(named) << words;
    }
    EXPECT_GT(contradictory, 0);
  }
}

TEST(Contradictions, ContradictionsAreThoseOfTheSources) {
  EXPECT_NE(contradiction(laws::StickSlip{0.04, 0.04, 1.5e-3, 25.0, 200.0}), nullptr);
  EXPECT_NE(contradiction(laws::StickSlip{0.10, 0.04, 1.5e-3, 27.0, 200.0}), nullptr);  // c v_a > F_a
  EXPECT_EQ(contradiction(laws::StickSlip{0.10, 0.04, 1.5e-3, 25.0, 200.0}), nullptr);
  EXPECT_NE(contradiction(laws::StribeckCutting{0.05, 0.05, 1e-3, 20.0, 200.0, 2e-3}), nullptr);
  EXPECT_NE(contradiction(laws::LuGre{1e6, 0.0, 0.0, 20.0, 19.0, 1e-3, 2.0}), nullptr);
  EXPECT_EQ(contradiction(laws::LuGre{1e6, 0.0, 0.0, 20.0, 20.0, 1e-3, 2.0}), nullptr);
  EXPECT_NE(contradiction(laws::Prony{0.5, 0.7, 0.5, 5.0}), nullptr);
  EXPECT_EQ(contradiction(laws::PronyAtRest{0.31, 0.7, 0.26, 5.0}), nullptr);
}

}  // namespace
