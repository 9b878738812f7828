// SPDX-License-Identifier: Apache-2.0
// Random models over the whole ranges of the parameter tables, and the work of random closed paths through
// them.
#pragma once

#include <array>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "every_model.hpp"
#include "needleforce/insertion.hpp"

namespace closed_paths {

using Generator = std::mt19937_64;

inline double uniform(Generator& generator, double low = 0.0, double high = 1.0) {
  return std::uniform_real_distribution<double>{low, high}(generator);
}

/// A law with every parameter drawn over its whole range, every tenth at an end of it.
template <Parameterised L>
L drawn(Generator& generator) {
  L law{};
  if constexpr (requires { law.tip; }) {
    const std::vector<Tip> tips = every_tip();
    law.tip = tips[generator() % tips.size()];
  }
  for (const auto& parameter : L::table) {
    const unsigned end = generator() % 20;
    const double place = end < 2 ? end : uniform(generator);
    law.*parameter.member = along(parameter.low, parameter.high, place);
  }
  return law;
}

/// A law of a family, any of them.
template <class Laws>
Laws drawn_of(Generator& generator) {
  return [&]<class... L>(std::variant<L...>*) {
    using Draw = Laws (*)(Generator&);
    constexpr std::array<Draw, sizeof...(L)> draws{[](Generator& g) { return Laws{drawn<L>(g)}; }...};
    return draws[generator() % draws.size()](generator);
  }(static_cast<Laws*>(nullptr));
}

/// Whether a model states that it may return energy.
inline bool says_it_may_return_energy(const Model& model) {
  return !std::visit([]<class F, class R>(const F&, const R&) { return is_passive<F> && is_passive<R>; },
                     model.friction, model.relaxation);
}

/// A model that states to be passive.
inline Model drawn_model(Generator& generator) {
  for (;;) {
    const Model model{drawn_of<Stiffness>(generator), drawn_of<Puncture>(generator),
                      drawn_of<Friction>(generator), drawn_of<Cutting>(generator),
                      drawn_of<Relaxation>(generator)};
    if (!says_it_may_return_energy(model) && valid(model)) return model;
  }
}

/// Gives the last layer the tip of the first that has one: a needle has one.
inline void share_tip(std::vector<Layer>& layers) {
  auto* last = std::get_if<laws::TipContact>(&layers.back().laws.stiffness);
  const auto* first = detail::first_tip(layers);
  if (last) last->tip = first->tip, last->radius = first->radius;
}

/// The depth [m] at which a layer punctures.
inline double puncture_of(const Layer& layer) {
  return layer.top + puncture_depth(layer.laws.puncture, prepare(layer.laws.stiffness));
}

/// One to three layers that the engine accepts.
inline std::vector<Layer> drawn_stack(Generator& generator) {
  std::vector<Layer> layers{{0.0, drawn_model(generator)}};
  const std::size_t count = generator() % 2 ? 1 : 2 + generator() % 2;
  double above = puncture_of(layers.back());  // a tip takes time to tabulate: once a layer
  for (int attempt = 0; attempt < 200 && layers.size() < count; ++attempt) {
    const double top = above + std::pow(10.0, uniform(generator, -5.0, -2.0));
    layers.push_back({top, drawn_model(generator)});
    share_tip(layers);
    if (generator() % 2) layers.back().laws.puncture = laws::PunctureDepth{0.0};  // no interface
    if (generator() % 4 == 0) layers.back().laws.friction = layers.front().laws.friction;
    if (first_fault(layers).reason)
      layers.pop_back();
    else if (layers.size() < count)
      above = puncture_of(layers.back());
  }
  return layers;
}

/// The work of a path, as much as the samples allow: of each step the larger of the works of its two ends, so
/// that a negative sum is energy returned and not an error of the integral.
struct Work {
  double most = 0.0;    ///< [J]
  double turned = 0.0;  ///< sum of the magnitudes [J]
  double last = 0.0;    ///< the last force [N]
  void add(double force, double travel) {
    most += std::max(last * travel, force * travel);
    turned += std::max(std::abs(last * travel), std::abs(force * travel));
    last = force;
  }
  double share() const { return turned > 0.0 ? most / turned : 0.0; }
};

/// Depths [m] at which something happens: tops and punctures of the layers that can be reached.
inline std::vector<double> events_of(std::span<const Layer> layers) {
  std::vector<double> events;
  for (const Layer& layer : layers) {
    const double puncture = puncture_of(layer);
    for (const double depth : {layer.top, puncture})
      if (depth < 0.3) events.push_back(depth);
  }
  return events;
}

/// A path from above the tissue back to there: legs between depths near events, holds, reversals of any size.
template <class Step>
void closed_path(Generator& generator, std::span<const Layer> layers, int legs, int fine, Step step) {
  const std::vector<double> events = events_of(layers);
  const double reach = std::max(1e-4, *std::max_element(events.begin(), events.end()));
  double at = -0.1 * reach;
  step(at, 0.0, 1e-3);
  for (int leg = 0; leg <= legs; ++leg) {
    const double near = events[generator() % events.size()];
    const double aside =
        reach * std::pow(10.0, uniform(generator, -4.0, 0.3)) * (generator() % 2 ? 1.0 : -1.0);
    const double from = at, target = leg == legs ? -3.0 * reach : std::max(-0.2 * reach, near + aside);
    const double speed = std::pow(10.0, uniform(generator, -5.0, 0.0));
    const double dt = std::abs(target - from) / (fine * speed);
    for (int i = 1; i <= fine && dt > 0.0; ++i) {
      const double next = from + (target - from) * i / fine;
      step(next, next - at, dt);
      at = next;
    }
    if (generator() % 3 == 0) step(at, 0.0, std::pow(10.0, uniform(generator, -3.0, 1.0)));
  }
}

inline Work work_of(Generator& generator, std::span<const Layer> layers, int fine = 400) {
  Insertion insertion(layers, {.max_speed = 1e9});
  Work work;
  closed_path(generator, layers, 6, fine, [&](double depth, double travel, double dt) {
    work.add(insertion.step(depth, no_velocity, dt).force, travel);
  });
  return work;
}

/// The same for a depth with noise of a random size, of which the insertion knows a random size.
inline Work work_in_noise(Generator& generator, std::span<const Layer> layers, int fine = 400) {
  const double known = std::pow(10.0, uniform(generator, -8.0, -3.0));
  const double size = known * std::pow(10.0, uniform(generator, -1.5, 0.5));
  Insertion insertion(layers, {.max_speed = 1e9, .depth_noise = known});
  Work work;
  double last = 0.0;
  const auto step = [&](double depth, double dt) {
    const double shown = depth + size * uniform(generator, -1.0, 1.0);
    work.add(insertion.step(shown, no_velocity, dt).force, shown - last);
    last = shown;
  };
  closed_path(generator, layers, 4, fine, [&](double depth, double, double dt) {
    step(depth, dt);
    for (int i = 0; i < 3 && generator() % 8 == 0; ++i) step(depth, dt);
  });
  step(-1.0, 1.0);
  return work;
}

/// The names of the laws of a stack.
inline std::string name_of_stack(std::span<const Layer> layers) {
  std::string names;
  for (const Layer& layer : layers) names += (names.empty() ? "" : " / ") + name_of(layer.laws);
  return names;
}

}  // namespace closed_paths
