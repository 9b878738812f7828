// SPDX-License-Identifier: Apache-2.0
// What every friction law must keep.
#include "every_law.hpp"

namespace {

template <class L>
struct EveryFriction : ::testing::Test {};
using FrictionLaws = AsTypes<Friction>::type;
TYPED_TEST_SUITE(EveryFriction, FrictionLaws);

constexpr double embedded = 5e-3, far = 1.0;

TYPED_TEST(EveryFriction, StaysWithinItsStateAndKeepsItAtRest) {
  for (const TypeParam& given : across<TypeParam>()) {
    const auto law = given.prepare();
    double state = 0.0;
    for (const double travel : random_travels(2000)) {
      state = law.advance(state, travel);
      ASSERT_LE(std::abs(state), 1.0);
      ASSERT_TRUE(std::isfinite(law.force(state, embedded)) && std::isfinite(law.by_depth(state, embedded)));
      ASSERT_NEAR(law.advance(state, 0.0), state, 1e-15);
    }
  }
}

TYPED_TEST(EveryFriction, IsNothingWithoutLengthAndOddInTheDirection) {
  const auto law = middle<TypeParam>().prepare();
  double state = 0.0, mirrored = 0.0;
  for (const double travel : random_travels(2000)) {
    state = law.advance(state, travel);
    mirrored = law.advance(mirrored, -travel);
    ASSERT_NEAR(mirrored, -state, 1e-15);
    ASSERT_NEAR(law.force(mirrored, embedded), -law.force(state, embedded), 1e-12 * law.sliding(embedded));
    ASSERT_EQ(law.force(state, 0.0), 0.0);
  }
  EXPECT_EQ(law.sliding(0.0), 0.0);
}

TYPED_TEST(EveryFriction, SlidesAfterLongTravelAgainstTheMotion) {
  const auto law = middle<TypeParam>().prepare();
  for (const double length : {1e-4, 1e-3, 1e-2}) {
    EXPECT_GT(law.sliding(length), 0.0);
    EXPECT_NEAR(law.force(law.advance(0.0, far), length), law.sliding(length), 1e-9 * law.sliding(length));
    EXPECT_NEAR(law.force(law.advance(1.0, -far), length), -law.sliding(length), 1e-9 * law.sliding(length));
  }
}

TYPED_TEST(EveryFriction, StartsBetweenTheUndeformedSurfaceAndThePuncture) {
  for (const TypeParam& law : across<TypeParam>()) {
    EXPECT_GE(law.prepare().surface(3e-3), 0.0);
    EXPECT_LE(law.prepare().surface(3e-3), 3e-3);
  }
}

TYPED_TEST(EveryFriction, DoesNotDependOnTheStep) {
  const auto law = middle<TypeParam>().prepare();
  double state = 0.0;
  for (const double travel : random_travels(500)) {
    double fine = state;
    for (int i = 0; i < 64; ++i) fine = law.advance(fine, travel / 64);
    state = law.advance(state, travel);
    ASSERT_NEAR(fine, state, 1e-12);
  }
}

TYPED_TEST(EveryFriction, DerivativeByDepthIsTheFiniteDifference) {
  const auto law = middle<TypeParam>().prepare();
  const auto moved = [&](double state, double dz) {
    return law.force(law.advance(state, dz), embedded + dz);
  };
  const auto rise = [&](double state, double dz) {
    return (moved(state, dz) - law.force(state, embedded)) / dz;
  };
  double state = 0.0;
  for (const double travel : random_travels(500)) {
    state = law.advance(state, travel);
    // where the two directions differ the derivative is that of one of them
    ASSERT_TRUE(is_one_of(law.by_depth(state, embedded), rise(state, 1e-10), rise(state, -1e-10))) << state;
  }
  // while it slides, that of going on
  const double in = law.advance(0.0, far), out = law.advance(0.0, -far);
  EXPECT_TRUE(is_one_of(law.by_depth(in, embedded), rise(in, 1e-10)));
  EXPECT_TRUE(is_one_of(law.by_depth(out, embedded), rise(out, -1e-10)));
}

TYPED_TEST(EveryFriction, DissipatesOverEveryClosedPath) {
  const auto law = middle<TypeParam>().prepare();
  const double scale = half_way([&](double travel) { return law.advance(0.0, travel); });
  const auto advance = [&](double state, double, double dz) { return law.advance(state, dz); };
  for (const double follows : {0.0, 1.0}) {  // the embedded length as it is, or following the depth
    const auto force = [&](double state, double z) { return law.force(state, 200.0 * scale + follows * z); };
    EXPECT_GE(least_closed_work(scale, advance, force), -1e-4);
  }
}

TYPED_TEST(EveryFriction, Scales) {
  const auto law = middle<TypeParam>().prepare(), large = scaled(middle<TypeParam>(), s, m).prepare();
  double state = 0.0, other = 0.0;
  for (const double travel : random_travels(500)) {
    state = law.advance(state, travel);
    other = large.advance(other, s * travel);
    const double force = m * s * s * law.force(state, embedded);
    ASSERT_NEAR(large.force(other, s * embedded), force, 1e-9 * large.sliding(s * embedded));
  }
  EXPECT_NEAR(large.surface(s * 3e-3), s * law.surface(3e-3), 1e-12);
}

TEST(Coulomb, TakesTheStatedTravelToSlide) {
  const auto law = laws::Coulomb{18.6, 20e-6, 0.25}.prepare();
  EXPECT_NEAR(law.advance(0.0, 5e-6), 0.25, 1e-12);
  EXPECT_NEAR(law.advance(-1.0, 20e-6), 0.0, 1e-12);
  EXPECT_EQ(law.advance(-1.0, 41e-6), 1.0);
  EXPECT_NEAR(law.sliding(12e-3), 18.6 * 12e-3, 1e-15);
  EXPECT_NEAR(law.surface(4e-3), 1e-3, 1e-15);
}

}  // namespace
