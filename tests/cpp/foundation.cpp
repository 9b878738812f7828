// SPDX-License-Identifier: Apache-2.0
#include "needleforce/foundation.hpp"

#include <gtest/gtest.h>

using namespace needleforce;

namespace {

const Needle paper_needle{0.7e-3, 0.0, 0.08, 14.1e9, 0.3};

constexpr FrictionReading consistent[] = {FrictionReading::paper_width, FrictionReading::projected_width,
                                          FrictionReading::beam_width, FrictionReading::lame};

/// Friction per length after lengths are scaled by s and moduli by m, over the original.
double friction_ratio(FrictionReading reading, double s, double m) {
  Needle needle = paper_needle;
  const Tissue tissue{116e3, 0.45};
  const double before = friction_per_length(reading, needle, tissue);
  needle.outer_diameter *= s;
  needle.young_modulus *= m;
  return friction_per_length(reading, needle, Tissue{m * 116e3, 0.45}) / before;
}

TEST(Foundation, ForcesPerLengthScaleWithLengthAndModulus) {
  for (const auto reading : consistent) EXPECT_NEAR(friction_ratio(reading, 3.0, 7.0), 21.0, 1e-11);
}

TEST(Foundation, PrintedFormulaDoesNotScale) {
  EXPECT_NEAR(friction_ratio(FrictionReading::literal_mm, 3.0, 7.0), 63.0, 1e-10);
}

TEST(Foundation, TissueModulusEntersToThePowerThirteenTwelfths) {
  const Needle needle = paper_needle;
  const double ratio = vesic_modulus(needle, {232e3, 0.5}, 1e-3) / vesic_modulus(needle, {116e3, 0.5}, 1e-3);
  EXPECT_NEAR(ratio, 2.1189261887185906, 1e-12);
}

TEST(Foundation, EmbedmentMultipliesTheModulus) {
  const Needle needle = paper_needle;
  EXPECT_DOUBLE_EQ(vesic_modulus(needle, {116e3, 0.5}, 1e-3, 2.0),
                   2.0 * vesic_modulus(needle, {116e3, 0.5}, 1e-3));
}

TEST(ReducedModulus, IsSymmetricAndBelowEitherBody) {
  const Needle needle = paper_needle;
  const Tissue tissue{116e3, 0.5};
  EXPECT_DOUBLE_EQ(reduced_modulus(needle, tissue), reduced_modulus(tissue, needle));
  EXPECT_LT(reduced_modulus(needle, tissue), plane_strain_modulus(tissue));
}

}  // namespace
