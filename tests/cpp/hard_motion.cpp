// SPDX-License-Identifier: Apache-2.0
// Motion and tissue that a loop meets and a test of random paths seldom does: corners of the tables, clocks
// from 1 us to 1 s, coarse sensors, reversals within the elastic travel, a surface that hardly recovers, thin
// layers. Every force is finite, and no path returns energy.
#include "closed_paths.hpp"

namespace {

using closed_paths::Generator;

/// A path that is followed as a sensor shows it.
struct Followed {
  Insertion insertion;
  closed_paths::Work work{};
  double shown = -1e-3;

  explicit Followed(std::span<const Layer> layers, const Limits& limits = {.max_speed = 1e9})
      : insertion(layers, limits) {
    insertion.step(shown, no_velocity, 1e-3);
  }
  Sample to(double depth, double dt) {
    const Sample sample = insertion.step(depth, no_velocity, dt);
    EXPECT_TRUE(std::isfinite(sample.force) && std::isfinite(sample.force_by_depth)) << depth;
    work.add(sample.force, depth - shown);
    shown = depth;
    return sample;
  }
  /// Legs between depths near events, out at the end; each step as `next` shows the depth and lasts.
  template <class Next>
  void legs(Generator& generator, std::span<const Layer> layers, Next next) {
    closed_paths::closed_path(generator, layers, 4, 300, [&](double depth, double, double dt) {
      const auto [at, time] = next(depth, dt);
      to(at, time);
    });
    to(-1.0, 1.0);
  }
};

/// A model with every number at an end of its range, as far as they do not contradict each other.
template <class Laws>
Laws corner_of(Generator& generator) {
  return [&]<class... L>(std::variant<L...>*) {
    using Draw = Laws (*)(Generator&);
    constexpr std::array<Draw, sizeof...(L)> draws{[](Generator& g) {
      L law{};
      if constexpr (requires { law.tip; }) law.tip = every_tip()[g() % every_tip().size()];
      for (const auto& parameter : L::table) law.*parameter.member = g() % 2 ? parameter.low : parameter.high;
      return Laws{law};
    }...};
    return draws[generator() % draws.size()](generator);
  }(static_cast<Laws*>(nullptr));
}

TEST(HardMotion, CornersOfEveryTable) {
  int worked = 0;
  for (std::uint64_t seed = 1; worked < 1500; ++seed) {
    Generator generator{seed};
    const Model model{corner_of<Stiffness>(generator), corner_of<Puncture>(generator),
                      corner_of<Friction>(generator), corner_of<Cutting>(generator),
                      corner_of<Relaxation>(generator)};
    if (!valid(model) || closed_paths::says_it_may_return_energy(model)) continue;
    const std::vector<Layer> layers{{0.0, model}};
    if (closed_paths::events_of(layers).empty()) continue;
    Followed path(layers);
    path.legs(generator, layers, [](double depth, double dt) { return std::pair{depth, dt}; });
    worked += path.work.turned > 0.0;
    EXPECT_GE(path.work.share(), -1e-6) << seed << " " << name_of(model);
  }
}

TEST(HardMotion, ClocksFromAMicrosecondToASecondMixed) {
  for (std::uint64_t seed = 1; seed <= 600; ++seed) {
    Generator generator{seed};
    const std::vector<Layer> layers = closed_paths::drawn_stack(generator);
    Followed path(layers);
    path.legs(generator, layers, [&](double depth, double) {
      return std::pair{depth, std::pow(10.0, closed_paths::uniform(generator, -6.0, 0.0))};
    });
    EXPECT_GE(path.work.share(), -1e-6) << seed << " " << closed_paths::name_of_stack(layers);
  }
}

TEST(HardMotion, DepthInQuantaOfTenMicrometres) {
  for (std::uint64_t seed = 1; seed <= 600; ++seed) {
    Generator generator{seed};
    const std::vector<Layer> layers = closed_paths::drawn_stack(generator);
    const double known = seed % 2 ? 0.0 : 5e-6;
    Followed path(layers, {.max_speed = 1e9, .depth_noise = known});
    path.legs(generator, layers,
              [](double depth, double dt) { return std::pair{1e-5 * std::round(1e5 * depth), dt}; });
    EXPECT_GE(path.work.share(), -1e-6) << seed << " " << closed_paths::name_of_stack(layers);
  }
}

// an elastic part of a cycle closes on itself: what is lost in ten thousand is what is lost in one, relaxed
TEST(HardMotion, TenThousandReversalsWithinTheStretch) {
  for (const Model& model : every_model()) {
    const std::vector<Layer> layers{{0.0, model}};
    Followed path(layers);
    for (double at = 0.0; at < 10e-3; at += 5e-6) path.to(at, 1e-3);
    const double top = path.shown, before = path.to(top, 1e-3).force;
    for (int i = 0; i < 10000; ++i) path.to(i % 2 ? top : top - 2e-6, 1e-3);
    const double after = path.to(top, 1e-3).force;
    EXPECT_LE(after, before * (1.0 + 1e-9)) << name_of(model);
    if (std::holds_alternative<laws::NoRelaxation>(model.relaxation) &&
        std::holds_alternative<laws::Coulomb>(model.friction) &&
        std::holds_alternative<laws::ConstantCutting>(model.cutting)) {
      EXPECT_NEAR(after, before, 1e-9 * before) << name_of(model);
    }
    path.to(-1e-2, 1.0);
    EXPECT_GE(path.work.share(), -1e-6) << name_of(model);
  }
}

TEST(HardMotion, SurfaceThatHardlyRecovers) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    Generator generator{seed};
    Model model = closed_paths::drawn_model(generator);
    const double per_length = std::pow(10.0, closed_paths::uniform(generator, 0.0, 3.0));
    const double excess = std::pow(10.0, closed_paths::uniform(generator, -9.0, -1.0));
    model.friction = laws::RelaxingSurface{per_length, 2e-5, 1.0, per_length * (1.0 + excess), 0.1};
    model.relaxation = laws::NoRelaxation{};
    const std::vector<Layer> layers{{0.0, model}};
    if (first_fault(layers).reason) continue;
    Followed path(layers);
    path.legs(generator, layers, [](double depth, double dt) { return std::pair{depth, dt}; });
    EXPECT_GE(path.work.share(), -1e-6) << seed << " " << name_of(model) << " " << excess;
  }
}

TEST(HardMotion, EightLayersOfTenMicrometres) {
  int worked = 0;
  for (std::uint64_t seed = 1; worked < 200 && seed < 20000; ++seed) {
    Generator generator{seed};
    std::vector<Layer> layers;
    for (int i = 0; i < 8; ++i) {
      layers.push_back({1e-5 * i, closed_paths::drawn_model(generator)});
      closed_paths::share_tip(layers);
      layers.back().laws.puncture = laws::PunctureDepth{closed_paths::uniform(generator, 0.0, 9e-6)};
      if (first_fault(layers).reason) layers.pop_back();
    }
    if (layers.size() < 4) continue;
    Followed path(layers);
    path.legs(generator, layers, [](double depth, double dt) { return std::pair{depth, dt}; });
    worked += path.work.turned > 0.0;
    EXPECT_GE(path.work.share(), -1e-6) << seed << " " << closed_paths::name_of_stack(layers);
  }
  EXPECT_EQ(worked, 200);
}

}  // namespace
