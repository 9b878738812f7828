// SPDX-License-Identifier: Apache-2.0
// What every law must keep, whatever its family.
#include "every_law.hpp"

namespace {

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

}  // namespace
