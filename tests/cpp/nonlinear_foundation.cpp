// SPDX-License-Identifier: Apache-2.0
// Friction of a bent shaft on a nonlinear foundation: against quadrature of the pressure on both sides, the
// paper's line where the foundation is linear, the shaft straight or short, and the energy of closed paths.
#include "closed_paths.hpp"
#include "paper.hpp"

namespace {

template <class Law>
struct EveryFoundation : ::testing::Test {};
using Laws = ::testing::Types<laws::CubicFoundation, laws::HyperbolicFoundation, laws::TanhFoundation>;
TYPED_TEST_SUITE(EveryFoundation, Laws);

/// p(u) / k_1 of the three forms with p_u / k_1 = sqrt(k_1 / k_3) = 1, and of none below 0: no adhesion.
long double pressure(const char* name, long double u) {
  if (!(u > 0.0L)) return 0.0L;
  const std::string law = name;
  if (law == "cubic_foundation") return u + u * u * u;
  if (law == "hyperbolic_foundation") return u / (1.0L + u);
  return std::tanh(u);
}

/// The integral of f between two limits by Gauss's three points on n panels.
template <class F>
long double integral(F f, long double low, long double high, int n) {
  long double sum = 0.0L;
  const long double half = (high - low) / (2 * n), node = std::sqrt(0.6L);
  for (int i = 0; i < n; ++i) {
    const long double middle = low + (2 * i + 1) * half;
    sum += half * (8.0L * f(middle) + 5.0L * f(middle - node * half) + 5.0L * f(middle + node * half)) / 9.0L;
  }
  return sum;
}

/// f over f' of a shaft of a length, by quadrature along it; panels end where a side loses contact.
template <class Law>
long double by_quadrature(const Law& law, long double length) {
  const long double ratio = law.settlement_ratio, growth = ratio / law.deflection_length;
  const long double bent = std::min<long double>(length, law.bending_length);
  const auto both = [&](long double x) {
    return (pressure(Law::name, ratio + growth * x) + pressure(Law::name, ratio - growth * x)) /
           (2.0L * pressure(Law::name, ratio));
  };
  const long double edge = std::min<long double>(bent, law.deflection_length);
  return integral(both, 0.0L, edge, 4000) + integral(both, edge, bent, 4000) + length - bent;
}

TYPED_TEST(EveryFoundation, SlidingIsThePressureOnBothSidesAlongTheShaft) {
  for (const double ratio : {1e-6, 0.01, 0.3, 1.0, 3.0, 10.0})
    for (const double deflection : {3e-3, 12e-3, 0.1, 10.0})
      for (const double bending : {7e-3, 1.0})
        for (const double length : {1e-5, 2e-3, 11e-3, 40e-3}) {
          const TypeParam law{1.0, ratio, deflection, bending, 20e-6, 0.0};
          const auto expected = static_cast<double>(by_quadrature(law, length));
          EXPECT_NEAR(law.prepare().sliding(length, 1e-3), expected, 1e-9 * expected)
              << TypeParam::name << " " << ratio << " " << deflection << " " << length;
        }
}

TYPED_TEST(EveryFoundation, IsThePapersLineWhereItMustBe) {
  const double f = paper::friction;
  const TypeParam linear{f, 0.0, 12e-3, 1.0, 20e-6, 0.0}, straight{f, 1.0, 1e2, 1.0, 20e-6, 0.0};
  for (const double length : {1e-9, 1e-6, 1e-3, 5e-3, 11.9e-3}) {
    EXPECT_NEAR(linear.prepare().sliding(length, 1.0), f * length, 1e-11 * f * length);
    // the bend is of the order (l / L)^2
    EXPECT_NEAR(straight.prepare().sliding(length, 1.0), f * length, 1e-7 * f * length);
  }
  const TypeParam bent{f, 1.0, 12e-3, 1.0, 20e-6, 0.0};
  EXPECT_NEAR(bent.prepare().sliding(12e-6, 1.0), f * 12e-6, 1e-6 * f * 12e-6);
}

TYPED_TEST(EveryFoundation, LinearFoundationBendsTheLineWhereOneSideLosesContact) {
  const double f = paper::friction, L = 12e-3;
  const TypeParam law{f, 0.0, L, 1.0, 20e-6, 0.0};
  for (const double length : {13e-3, 20e-3, 60e-3}) {
    const double expected = 0.25 * f * L * (1.0 + length / L) * (1.0 + length / L);
    EXPECT_NEAR(law.prepare().sliding(length, 1.0), expected, 1e-10 * expected);
  }
}

TEST(CubicFoundation, IsACubeInTheDepth) {
  const double f = paper::friction, ratio = 0.8, L = 12e-3;
  const laws::CubicFoundation law{f, ratio, L, 1.0, 20e-6, 0.0};
  const double share = ratio * ratio / (1.0 + ratio * ratio);
  for (const double length : {1e-3, 6e-3, 12e-3})
    EXPECT_NEAR(law.prepare().sliding(length, 1.0), f * length * (1.0 + share * length * length / (L * L)),
                1e-13 * f * length);
}

TYPED_TEST(EveryFoundation, HardensOrSoftensWhileBothSidesAreInContact) {
  constexpr bool hardens = std::is_same_v<TypeParam, laws::CubicFoundation>;
  const TypeParam law{paper::friction, 1.0, 12e-3, 1.0, 20e-6, 0.0};
  for (const double length : {2e-3, 6e-3, 12e-3}) {
    const double line = paper::friction * length, force = law.prepare().sliding(length, 1.0);
    if (hardens)
      EXPECT_GT(force, line);
    else
      EXPECT_LT(force, line);
  }
}

TYPED_TEST(EveryFoundation, BehindTheBendingLengthTheLineContinues) {
  const TypeParam law{paper::friction, 1.0, 5e-3, 7e-3, 20e-6, 0.0};
  const auto prepared = law.prepare();
  EXPECT_NEAR(prepared.sliding(30e-3, 1.0) - prepared.sliding(20e-3, 1.0), paper::friction * 10e-3, 1e-14);
}

/// The force at each of n depths on the way in to `deepest` and out.
std::vector<double> in_and_out(std::span<const Layer> layers, double deepest, int n) {
  Insertion insertion(layers);
  std::vector<double> forces;
  for (int i = 0; i <= 2 * n; ++i)
    forces.push_back(insertion.step(deepest * (i <= n ? i : 2 * n - i) / n, no_velocity, 1e-2).force);
  return forces;
}

TYPED_TEST(EveryFoundation, LayerDividedInTwoRemainsTheSameTissue) {
  Model model = paper::model();
  model.friction = TypeParam{paper::friction, 1.0, 8e-3, 15e-3, 20e-6, 0.0};
  Model below = model;
  below.puncture = laws::PunctureDepth{0.0};
  const std::vector<Layer> whole{{0.0, model}}, divided{{0.0, model}, {9e-3, below}};
  const std::vector<double> one = in_and_out(whole, 30e-3, 3000), two = in_and_out(divided, 30e-3, 3000);
  for (std::size_t i = 0; i < one.size(); ++i) ASSERT_NEAR(one[i], two[i], 1e-12) << i;
}

TYPED_TEST(EveryFoundation, WholeInsertionSlidesAlongTheClosedForm) {
  Model model = paper::model();
  const TypeParam law{paper::friction, 1.5, 12e-3, 1.0, 20e-6, 0.0};
  model.friction = law;
  const std::vector<Layer> layers{{0.0, model}};
  const int n = 3000;
  const std::vector<double> forces = in_and_out(layers, 30e-3, n);
  EXPECT_NEAR(forces[n], law.prepare().sliding(30e-3, 1.0) + paper::cutting, 1e-12);
  EXPECT_NEAR(forces[n + 1000], law.prepare().sliding(20e-3, -1.0), 1e-12);
}

TYPED_TEST(EveryFoundation, LimitThatChangesSlowlyIsSteppedExactly) {
  Model model = paper::model();
  model.friction = TypeParam{paper::friction, 1.5, 12e-3, 1.0, 20e-6, 0.0};
  const std::vector<Layer> layers{{0.0, model}};
  const std::vector<double> coarse = in_and_out(layers, 30e-3, 30), fine = in_and_out(layers, 30e-3, 3000);
  for (int i = 4; i <= 60; ++i) EXPECT_NEAR(coarse[i], fine[100 * i], 1e-12) << i;
}

/// A stack of bent shafts: presliding, bend and nonlinearity of any size against each other.
std::vector<Layer> bent_stack(closed_paths::Generator& generator) {
  using closed_paths::uniform;
  std::vector<Layer> layers = closed_paths::drawn_stack(generator);
  const auto decade = [&](double low, double high) { return std::pow(10.0, uniform(generator, low, high)); };
  const auto bent = [&]<class L>(L law) -> Friction {
    law = {decade(0.0, 3.0),  decade(-1.0, 1.0),   decade(-3.0, -1.0),
           decade(-4.0, 0.0), decade(-5.0, -1.31), uniform(generator)};
    return law;
  };
  for (Layer& layer : layers) {
    const auto form = generator() % 3;
    layer.laws.friction = form == 0   ? bent(laws::CubicFoundation{})
                          : form == 1 ? bent(laws::HyperbolicFoundation{})
                                      : bent(laws::TanhFoundation{});
    if (generator() % 2) layer.laws.friction = layers.front().laws.friction;
  }
  // a surface that moves with a relaxed puncture returns energy under any friction: not this law's
  for (Layer& layer : layers)
    if (!std::holds_alternative<laws::NoRelaxation>(layer.laws.relaxation))
      std::visit(
          [](auto& law) {
            if constexpr (requires { law.dimple_ratio; }) law.dimple_ratio = 0.0;
          },
          layer.laws.friction);
  if (first_fault(layers).reason) layers.resize(1);
  return layers;
}

TEST(ClosedPaths, BentShaftsReturnNoEnergy) {
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    closed_paths::Generator generator{seed};
    const std::vector<Layer> layers = bent_stack(generator);
    Insertion insertion(layers, {.max_speed = 1e9});
    closed_paths::Work work;
    closed_paths::closed_path(generator, layers, 6, 200, [&](double depth, double travel, double dt) {
      work.add(insertion.step(depth, no_velocity, dt).force, travel);
    });
    EXPECT_GE(work.share(), -1e-6) << "seed " << seed << ": " << closed_paths::name_of_stack(layers);
  }
}

TEST(Foundation, EnergyIsTheIntegralOfThePressure) {
  for (const auto form :
       {FoundationForm::linear, FoundationForm::cubic, FoundationForm::hyperbolic, FoundationForm::tanh})
    for (const double settlement : {1e-7, 1e-5, 1e-4, 1e-3, -1e-3, 5e-3}) {
      const double stiffness = 3e7, scale = 0.4e-3;
      const auto p = [&](long double u) {
        return static_cast<long double>(foundation_pressure(form, static_cast<double>(u), stiffness, scale));
      };
      const auto expected = static_cast<double>(integral(p, 0.0L, settlement, 2000));
      EXPECT_NEAR(foundation_energy(form, settlement, stiffness, scale), expected, 1e-12 * expected);
      EXPECT_DOUBLE_EQ(foundation_pressure(form, -settlement, stiffness, scale),
                       -foundation_pressure(form, settlement, stiffness, scale));
    }
}

}  // namespace
