// SPDX-License-Identifier: Apache-2.0
// A contact that goes over to friction along the travel after the puncture: the force there, its curve, the
// energy of a rupture in closed form, withdrawal within it, and what relaxes.
#include <functional>

#include "closed_paths.hpp"

namespace {

using laws::YieldingTissue;

constexpr double coefficient = 2e4, h_p = 8e-3, delta = 0.4e-3;  // c h^2, pierced at h_p
constexpr double peak = coefficient * h_p * h_p, stored = peak * h_p / 3.0;

Model model_of(const YieldingTissue& friction, const Relaxation& relaxation = laws::NoRelaxation{}) {
  return {laws::PowerLaw{coefficient, 2.0, 1.0}, laws::PunctureDepth{h_p}, friction, laws::NoCutting{},
          relaxation};
}
/// A contact alone: no friction.
YieldingTissue frictionless(double brittleness = 0.0, double length = delta, double time = 0.0) {
  return {0.0, 220.0, length, 1e-3, brittleness, time};
}

/// An insertion at a speed, with the work done on it by the trapezoid rule.
struct Path {
  Insertion insertion;
  double at = -1e-3, force = 0.0, work = 0.0, speed = 1e-3;
  explicit Path(const Model& model) : insertion(model, {.max_speed = 1e3}) {
    insertion.step(at, no_velocity, 1e-3);
  }
  explicit Path(std::span<const Layer> layers) : insertion(layers) { insertion.step(at, no_velocity, 1e-3); }
  Path& to(double target, int n) {
    const double from = at;
    for (int i = 1; i <= n; ++i) {
      const double next = from + (target - from) * i / n;
      const Sample sample = insertion.step(next, no_velocity, std::abs(next - at) / speed);
      work += 0.5 * (force + sample.force) * (next - at);
      at = next, force = sample.force;
    }
    return *this;
  }
};

/// 1 - d after an advance, by Runge and Kutta's fourth order on Kachanov's equation.
double integrated(double brittleness, double advance) {
  double left = 1.0;
  constexpr int n = 20000;
  const double ds = advance / delta / n;
  const auto rate = [&](double x) { return x > 0.0 ? -std::pow(x, 1.0 - brittleness) : 0.0; };
  for (int i = 0; i < n; ++i) {
    const double a = rate(left), b = rate(left + 0.5 * ds * a), c = rate(left + 0.5 * ds * b);
    left += ds / 6.0 * (a + 2.0 * b + 2.0 * c + rate(left + ds * c));
  }
  return left;
}

TEST(YieldingTissue, ContactFollowsKachanovsEquation) {
  for (const double q : {0.0, 0.5, 1.0, 3.0, 10.0})
    for (const double share : {0.1, 0.5, 0.9}) {
      const double advance = share * delta / std::max(1.0, q);
      EXPECT_NEAR(Path(model_of(frictionless(q))).to(h_p + advance, 900).force, peak * integrated(q, advance),
                  1e-9 * peak)
          << q << " " << share;
    }
  // snapped, once the advance has passed delta / q
  EXPECT_EQ(Path(model_of(frictionless(4.0))).to(h_p + 1.001 * delta / 4.0, 900).force, 0.0);
}

TEST(YieldingTissue, ForceIsContinuousAtThePuncture) {
  // the smaller the step, the smaller its largest change, with friction, with relaxation, with a soft spring
  for (const auto& friction : {frictionless(), YieldingTissue{60.0, 220.0, delta, 1e-3, 0.0, 0.0},
                               YieldingTissue{60.0, 220.0, delta, 1e-3, 0.9, 0.0},
                               YieldingTissue{18.6, 20.0, delta, 0.0, 0.0, 1e-3}})
    for (const Relaxation& relaxation : {Relaxation{laws::NoRelaxation{}}, Relaxation{usual<laws::Prony>()},
                                         Relaxation{usual<laws::PronyLocked>()}}) {
      const auto largest = [&](double step) {
        Path path(model_of(friction, relaxation));
        path.to(h_p - 0.1e-3, 1000);
        double most = 0.0;
        for (double depth = path.at + step; depth < h_p + 0.1e-3; depth += step) {
          const double before = path.force;
          most = std::max(most, std::abs(path.to(depth, 1).force - before));
        }
        return most;
      };
      EXPECT_LT(largest(1e-7), 0.15 * largest(1e-6)) << friction.stiffness << " " << name_of(relaxation);
    }
}

TEST(YieldingTissue, ContactIsTheSameInOneStepOrInMany) {
  for (const double q : {0.0, 3.0}) {
    Path many(model_of(frictionless(q)));
    many.to(h_p + 0.3 * delta / std::max(1.0, q), 997).to(h_p - 1e-3, 613);
    Path few(model_of(frictionless(q)));
    few.to(h_p + 0.3 * delta / std::max(1.0, q), 1).to(h_p - 1e-3, 1);
    // one step from above the tissue to below the puncture finds no contact to begin with: two do
    Path two(model_of(frictionless(q)));
    two.to(1e-3, 1).to(h_p + 0.3 * delta / std::max(1.0, q), 1).to(h_p - 1e-3, 1);
    EXPECT_NEAR(two.force, many.force, 1e-12 * peak);
    EXPECT_EQ(few.force, 0.0);
  }
}

TEST(YieldingTissue, WorkOfARuptureIsTheContactEnergyAndTheTear) {
  // in, U; then F_p delta (1 - exp(-s / delta)) = what a constant indentation needs while its contact is lost
  Path path(model_of(frictionless()));
  path.to(h_p, 8000).to(h_p + 3.0 * delta, 60000);
  EXPECT_NEAR(path.work, stored + peak * delta * (1.0 - std::exp(-3.0)), 2e-6 * stored);
  // out again: of the stored energy returns what is intact, exp(-3)
  path.to(-1e-3, 40000);
  EXPECT_NEAR(path.work, stored * (1.0 - std::exp(-3.0)) + peak * delta * (1.0 - std::exp(-3.0)),
              2e-6 * stored);
  EXPECT_EQ(path.force, 0.0);
}

TEST(YieldingTissue, DissipationIsTheEnergyLostAndFriction) {
  // sliding from the puncture on: F = f' (z - z_r) / (1 + f'/k_t); contact as above, less what the shaft took
  const double f = 60.0, k = 220.0, z_r = 1e-3, slope = f / (1.0 + f / k), end = h_p + 5.0 * delta;
  Path path(model_of({f, k, delta, z_r, 0.0, 0.0}));
  path.to(end, 150000);
  const double taken = slope * (h_p - z_r), w = 1.0 - taken / peak;
  ASSERT_LT(taken, std::min(peak, 2.0 * k * stored / peak));
  const double shaft = 0.5 * slope * (end - h_p) * (end + h_p - 2.0 * z_r);
  const double contact = w * peak * delta * (1.0 - std::exp(-5.0));
  EXPECT_NEAR(path.work, stored + shaft + contact, 1e-5 * stored);
}

TEST(YieldingTissue, SoftSpringBeginsWithNoMoreThanTheContactPays) {
  // f' l and the peak are more than a soft spring may hold: F_e0 = 2 k_t U / F_p, its energy (1 - w) U
  const double k = 30.0, f = 29.0;
  Path path(model_of({f, k, 1e-6, -50e-3, 0.0, 0.0}));
  path.to(h_p, 8000).to(h_p + 20e-6, 200);
  const double taken = 2.0 * k * stored / peak;
  ASSERT_LT(taken, peak);
  EXPECT_NEAR(path.force, taken + k * 20e-6, 1e-3 * taken);
  EXPECT_LE(0.5 * taken * taken / k, stored * taken / peak * (1.0 + 1e-12));
}

TEST(YieldingTissue, WithdrawalWithinTheRuptureUnloadsWhatIsLeft) {
  const double s = 0.5 * delta, left = std::exp(-0.5);
  Path path(model_of(frictionless()));
  path.to(h_p + s, 2000);
  for (const double back : {1e-3, 4e-3, 7.9e-3}) {
    path.to(h_p + s - back, 1000);
    EXPECT_NEAR(path.force, left * coefficient * (h_p - back) * (h_p - back), 1e-9 * peak) << back;
  }
  path.to(s - 1e-4, 10);
  EXPECT_EQ(path.force, 0.0);
  // back in: the same curve to the deepest point, and on from there as if nothing had been
  path.to(h_p + s, 1000);
  EXPECT_NEAR(path.force, left * peak, 1e-9 * peak);
  path.to(h_p + 2.0 * s, 1000);
  EXPECT_NEAR(path.force, left * left * peak, 1e-9 * peak);
}

TEST(YieldingTissue, DerivativeIsThatOfTheNextStep) {
  const double dt = 1e-3;
  for (const double time : {0.0, 2e-3}) {  // behind the deepest point, along the contact that is left
    Path path(model_of(frictionless(3.0, delta, time)));
    path.to(h_p + 0.05e-3, 2000).to(h_p - 1e-3, 100);
    for (int i = 0; i < 100; ++i) path.insertion.step(path.at, no_velocity, dt);  // it has caught up
    const double slope = path.insertion.step(path.at, no_velocity, dt).force_by_depth;
    const auto after = [&](double dz) {
      Insertion next = path.insertion;
      return next.step(path.at + dz, no_velocity, dt).force;
    };
    EXPECT_NEAR((after(1e-8) - after(-1e-8)) / 2e-8, slope, 1e-6 * slope) << time;
  }
  // while it tears without a time constant, the slope of the curve
  for (const double q : {0.0, 3.0}) {
    Path path(model_of(frictionless(q)));
    path.to(h_p + 0.05e-3, 2000);
    const double slope = path.insertion.step(path.at, no_velocity, 1e-6).force_by_depth;
    const auto after = [&](double dz) {
      Insertion next = path.insertion;
      return next.step(path.at + dz, no_velocity, 1e-6).force;
    };
    EXPECT_NEAR((after(1e-10) - after(0.0)) / 1e-10, slope, 1e-4 * std::abs(slope)) << q;
    EXPECT_LT(slope, 0.0);
  }
}

TEST(YieldingTissue, FallsNoFasterThanItsRuptureTime) {
  // at any speed the contact loses no more than 1 - exp(-dt / tau) of itself in a step, snap or not
  constexpr double tau = 3e-3;
  for (const double q : {0.0, 10.0})
    for (const double speed : {1e-3, 20e-3, 1.0}) {
      Path path(model_of(frictionless(q, delta, tau)));
      path.speed = speed;
      path.to(h_p, 4000);
      double before = path.force;
      const double travel = speed * 1e-3;
      for (int i = 0; i < 400 && path.at + travel < 0.2; ++i) {
        path.to(path.at + travel, 1);
        EXPECT_GE(path.force, before * std::exp(-1e-3 / tau) - 1e-12) << q << " " << speed;
        before = path.force;
      }
    }
  // held at its peak's depth after a snap it goes on to fall, with the time constant
  Path path(model_of(frictionless(10.0, delta, tau)));
  path.speed = 1.0;
  path.to(h_p, 4000).to(h_p + 0.1e-3, 1);
  const double first = path.force, second = path.insertion.step(path.at, no_velocity, tau).force;
  EXPECT_NEAR(second, first * std::exp(-1.0), 1e-9 * peak);
}

TEST(YieldingTissue, HoldWithinTheRuptureRelaxesAndAnAdvanceRestoresNothing) {
  const laws::PronyLocked relaxation{0.31, 0.7, 0.26, 5.0};
  Path path(model_of(frictionless(), relaxation));
  const double s = 0.5 * delta;
  path.to(h_p + s, 2000);
  EXPECT_NEAR(path.force, std::exp(-0.5) * peak, 1e-6 * peak);  // nothing relaxes on the way in
  const double left = 0.43 + 0.31 * std::exp(-2.0 / 0.7) + 0.26 * std::exp(-2.0 / 5.0);
  EXPECT_NEAR(path.insertion.step(path.at, no_velocity, 2.0).force, left * std::exp(-0.5) * peak,
              1e-6 * peak);
  path.to(h_p + 2.0 * s, 500);
  EXPECT_NEAR(path.force, left * std::exp(-1.0) * peak, 1e-4 * peak);
}

TEST(YieldingTissue, RelaxedContactReturnsNoMoreThanWasPaid) {
  // slowly in, while most of the force relaxes, then fast through the puncture and back: the case that
  // returned 2 %
  Model model{usual<laws::Cone>(), laws::PunctureForce{0.3},
              YieldingTissue{1e-4, 1190.0, 1e-2, -3e-3, 40.0, 1.0}, laws::NoCutting{},
              laws::Prony{0.51, 76.0, 0.18, 2.7e-5}};
  Path path(model);
  path.speed = 1.6e-5;
  path.to(4.2e-3, 4000);
  path.speed = 10.0;
  for (int i = 0; i < 20000 && path.insertion.pierced_layers() == 0; ++i) path.to(path.at + 1e-6, 1);
  ASSERT_EQ(path.insertion.pierced_layers(), 1u);
  path.to(-1e-3, 200000);
  EXPECT_GE(path.work, -1e-6);
}

TEST(YieldingTissue, LayersAddUp) {
  const Layer first{0.0, model_of({40.0, 220.0, delta, 1e-3, 0.0, 0.0}, usual<laws::PronyLocked>())};
  const Layer second{5e-3, model_of({20.0, 110.0, 2.0 * delta, 0.0, 2.0, 1e-3}, usual<laws::PronyLocked>())};
  Path both(std::array{first, second}), one(first.laws), other(second.laws);
  for (const double target : {4e-3, 9e-3, 15e-3, 14e-3, 15.5e-3, 3e-3, -9e-3}) {
    both.to(target, 700), one.to(target, 700);
    Insertion& alone = other.insertion;
    const double from = other.at;
    for (int i = 1; i <= 700; ++i) {
      const double next = from + (target - from) * i / 700;
      other.force = alone.step(next - 5e-3, no_velocity, std::abs(target - from) / 700 / 1e-3).force;
      other.at = next;
    }
    EXPECT_NEAR(both.force, one.force + other.force, 1e-9 * peak) << target;
  }
}

TEST(YieldingTissue, RandomPathsNearTheRuptureReturnNoEnergy) {
  // as tests/cpp/closed_paths.cpp over whole ranges; here the numbers of tissue, so that every part counts
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    closed_paths::Generator g{seed};
    const auto draw = [&](double low, double high) {
      return std::exp(closed_paths::uniform(g, std::log(low), std::log(high)));
    };
    const double spring = draw(30.0, 2e3);
    const YieldingTissue friction{draw(1e-2, 0.9) * spring,
                                  spring,
                                  draw(1e-5, 5e-3),
                                  closed_paths::uniform(g, -3e-3, 5e-3),
                                  g() % 2 ? draw(0.1, 50.0) : 0.0,
                                  g() % 2 ? draw(1e-4, 0.1) : 0.0};
    const double share = closed_paths::uniform(g, 0.0, 0.9);
    const Relaxation relaxations[] = {laws::NoRelaxation{}, laws::Prony{share, draw(0.01, 100.0), 0.05, 5.0},
                                      laws::PronyLocked{share, draw(0.01, 100.0), 0.05, 5.0}};
    const std::vector<Layer> layers{{0.0, model_of(friction, relaxations[g() % 3])}};
    Insertion insertion(layers, {.max_speed = 1e9});
    closed_paths::Work work;
    closed_paths::closed_path(g, layers, 6, 400, [&](double depth, double travel, double dt) {
      work.add(insertion.step(depth, no_velocity, dt).force, travel);
    });
    EXPECT_GE(work.share(), -1e-6) << seed;
  }
}

}  // namespace
