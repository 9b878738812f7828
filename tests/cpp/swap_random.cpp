// SPDX-License-Identifier: Apache-2.0
// Random stacks of random laws in place of one another, under a hand that nothing surprises.
#include <gtest/gtest.h>

#include <vector>

#include "every_model.hpp"
#include "needleforce/live.hpp"

namespace {

/// Draws among the laws of a family, each with its usual numbers, with those at the ends of their ranges, or
/// with numbers between, evenly by decades.
class Draw {
 public:
  explicit Draw(unsigned seed, bool extreme) : generator_(seed), extreme_(extreme) {}

  std::vector<Layer> stack() {
    for (;;) {
      std::vector<Layer> layers{{0.0, model()}};
      for (std::size_t more = generator_() % max_layers; more > 0; --more)
        layers.push_back({layers.back().top + 10e-3 * unit(), model()});
      while (!layers.empty() && first_fault(layers).reason) layers.pop_back();
      if (!layers.empty()) return layers;
    }
  }
  double unit() { return std::uniform_real_distribution<double>{0.0, 1.0}(generator_); }
  std::size_t among(std::size_t n) { return generator_() % n; }

 private:
  Model model() {
    return {one<Stiffness>(), one<Puncture>(), one<Friction>(), one<Cutting>(), one<Relaxation>()};
  }
  template <class Laws>
  Laws one() {
    static const std::vector<Laws> all = each<Laws>();
    Laws law = all[among(all.size())];
    std::visit(
        [&](auto& chosen) {
          if (extreme_) renumber(chosen);
        },
        law);
    return law;
  }
  template <class L>
  void renumber(L& law) {
    for (const auto& row : L::table)
      if (among(3) == 0) law.*row.member = number(row.low, row.high);
  }
  double number(double low, double high) {
    if (among(4) == 0) return among(2) ? low : high;
    if (!(low > 0.0)) return low + (high - low) * std::pow(10.0, -6.0 * unit());
    return low * std::pow(high / low, unit());
  }
  std::mt19937_64 generator_;
  bool extreme_;
};

/// A random walk in and out with leaps, rests and what no sensor should give.
struct Hand {
  double depth = -1e-3, target = 5e-3, dt = 1e-3;
  void move(Draw& draw, bool leaps) {
    if (draw.among(100) == 0) target = -3e-3 + 30e-3 * draw.unit();
    if (leaps && draw.among(500) == 0) depth = target;
    depth += std::clamp(target - depth, -5e-5, 5e-5);
    constexpr double lengths[] = {1e-300, 1e-9, 1e-3, 1.0, 1e6};
    dt = draw.among(50) ? 1e-3 : lengths[draw.among(5)];
  }
};

struct StacksSeen {
  bool finite = true;
  double largest = 0.0;
  std::uint32_t taken = 0;
};

StacksSeen run(unsigned seed, bool extreme, int steps) {
  Draw draw(seed, extreme);
  LiveInsertion live(draw.stack(), seed % 3 ? 10e-3 : 0.0);
  Hand hand;
  StacksSeen seen;
  for (int i = 0; i < steps; ++i) {
    if (draw.among(30) == 0) live.replace(draw.stack());
    hand.move(draw, extreme);
    const bool spoiled = draw.among(200) == 0;
    const Sample sample =
        live.step(spoiled ? std::numeric_limits<double>::quiet_NaN() : hand.depth, no_velocity, hand.dt);
    seen.finite &= std::isfinite(sample.force) && std::isfinite(sample.force_by_depth) &&
                   std::isfinite(sample.force_by_velocity);
    seen.largest = std::max(seen.largest, std::abs(sample.force));
  }
  seen.taken = live.taken();
  return seen;
}

TEST(RandomStacks, TypicalParametersGiveTypicalForces) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    const StacksSeen seen = run(seed, false, 5000);
    EXPECT_TRUE(seen.finite) << seed;
    // over 27 mm of 40 N/m, dragged, in some layers, which add up; a cut of 0.1 N and a contact of some
    // tenths
    EXPECT_LT(seen.largest, 3.0) << seed;
    EXPECT_GT(seen.taken, 50u);
  }
}

TEST(RandomStacks, ParametersAtTheEndsOfTheirRangesGiveFiniteForces) {
  for (unsigned seed = 0; seed < 80; ++seed) {
    const StacksSeen seen = run(seed, true, 5000);
    EXPECT_TRUE(seen.finite) << seed;
    EXPECT_GT(seen.taken, 50u);
  }
}

}  // namespace
