// SPDX-License-Identifier: Apache-2.0
// Search of the smallest sum of squares of a layered problem: Levenberg-Marquardt within bounds, in turn with
// scans of the values at which the force jumps.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "layered_problem.hpp"

namespace needleforce::fit {

struct LayeredBounds {
  std::vector<double> low, high;
};

/// A search of the values that are `free`, within `bounds`; the problem outlives it.
class LayeredSearch {
 public:
  using X = LayeredProblem::X;
  using Flags = std::vector<std::uint8_t>;

  LayeredSearch(const LayeredProblem& problem, Flags free, LayeredBounds bounds)
      : problem_(problem), free_(std::move(free)), bounds_(std::move(bounds)) {}

  struct Found {
    X x;
    double cost;
  };

  /// The x with the smallest cost after at most `max_steps` steps. Marquardt's damping (1963), scaled by the
  /// diagonal. Tops and punctures move as distances from those of the layer above, which are never negative:
  /// layers stay in the order of depth.
  Found descend(X x, std::size_t max_steps) const {
    x = admitted(std::move(x));
    Evaluation now = problem_.evaluate(x);
    double damping = 1e-3;
    std::size_t idle = 0;
    Equations system = as_distances(problem_.equations(x, now, free_));
    for (std::size_t k = 0; k < max_steps; ++k) {
      X tried = stepped(x, system, damping);
      Evaluation then = problem_.evaluate(tried);
      if (!(then.cost < now.cost)) {
        damping *= 4.0;
        if (damping > 1e8) break;
        continue;
      }
      idle = now.cost - then.cost < min_step_gain * now.cost ? idle + 1 : 0;
      x = std::move(tried);
      now = std::move(then);
      damping = std::max(0.2 * damping, 1e-12);
      if (idle == max_idle_steps || k + 1 == max_steps) break;
      system = as_distances(problem_.equations(x, now, free_));
    }
    return {std::move(x), now.cost};
  }

  /// `descend` and scans of the parameters at which the force jumps, in turn, as long as the cost decreases.
  Found settle(X x, std::size_t max_steps) const {
    Found best = descend(std::move(x), max_steps);
    for (int round = 0; round < 3; ++round) {
      X scanned = best.x;
      scan_punctures(scanned);
      scan_surfaces(scanned);
      Found tried = descend(std::move(scanned), max_steps);
      const double gain = best.cost - tried.cost;
      if (gain > 0.0) best = std::move(tried);
      if (gain < 1e-3 * best.cost) break;
    }
    return best;
  }

 private:
  using Equations = LayeredProblem::Equations;
  using Evaluation = LayeredProblem::Evaluation;
  static constexpr double min_step_gain = 1e-5;
  static constexpr std::size_t max_idle_steps = 3;
  static constexpr double scan_step = 0.2, surface_step = 0.1;  // [mm]

  /// Calls visit(k, above) for every top and puncture that has one above it, from the bottom up.
  template <class Visit>
  void each_below(Visit visit) const {
    for (std::size_t layer = problem_.layers(); layer-- > 1;) {
      visit(per_layer * layer + top_x, per_layer * (layer - 1) + top_x);
      for (std::size_t r = 0; r < problem_.runs(); ++r)
        visit(problem_.puncture(r, layer), problem_.puncture(r, layer - 1));
    }
  }

  /// The equations for distances instead of depths: a depth is the sum of the distances down to it.
  Equations as_distances(Equations system) const {
    const std::size_t p = problem_.size();
    each_below([&](std::size_t k, std::size_t above) {
      for (std::size_t i = 0; i < p; ++i) system.gram[above * p + i] += system.gram[k * p + i];
      for (std::size_t i = 0; i < p; ++i) system.gram[i * p + above] += system.gram[i * p + k];
      system.slope[above] += system.slope[k];
    });
    return system;
  }
  X to_distances(X x) const {
    each_below([&](std::size_t k, std::size_t above) { x[k] -= x[above]; });
    return x;
  }
  X to_depths(X y) const {
    for (std::size_t layer = 1; layer < problem_.layers(); ++layer) {
      y[per_layer * layer + top_x] += y[per_layer * (layer - 1) + top_x];
      for (std::size_t r = 0; r < problem_.runs(); ++r)
        y[problem_.puncture(r, layer)] += y[problem_.puncture(r, layer - 1)];
    }
    return y;
  }
  /// x within its bounds and in the order of depth.
  X admitted(X x) const {
    for (std::size_t layer = 1; layer < problem_.layers(); ++layer) {
      double* top = x.data() + per_layer * layer + top_x;
      *top = std::max(*top, *(top - per_layer));
      for (std::size_t r = 0; r < problem_.runs(); ++r)
        x[problem_.puncture(r, layer)] =
            std::max(x[problem_.puncture(r, layer)], x[problem_.puncture(r, layer - 1)]);
    }
    for (std::size_t k = 0; k < problem_.size(); ++k)
      x[k] = std::clamp(x[k], bounds_.low[k], bounds_.high[k]);
    return x;
  }

  X stepped(const X& x, const Equations& system, double damping) const {
    const std::size_t p = problem_.size();
    X y = to_distances(x);
    std::vector<std::uint8_t> distance(p, 0);
    each_below([&](std::size_t k, std::size_t) { distance[k] = 1; });
    std::vector<std::size_t> in;
    for (std::size_t k = 0; k < p; ++k) {
      const bool low = distance[k] ? y[k] <= 0.0 : x[k] <= bounds_.low[k], high = x[k] >= bounds_.high[k];
      const bool held = (low && system.slope[k] > 0.0) || (high && system.slope[k] < 0.0);
      if (free_[k] && !held && system.gram[k * p + k] > 0.0) in.push_back(k);
    }
    const std::vector<double> step = solved(system, in, damping);
    for (std::size_t i = 0; i < in.size(); ++i) {
      y[in[i]] -= step[i];
      if (distance[in[i]]) y[in[i]] = std::max(0.0, y[in[i]]);
    }
    return admitted(to_depths(std::move(y)));
  }

  /// The damped step at the places `in`, by Cholesky on the equations scaled by their diagonal.
  std::vector<double> solved(const Equations& system, const std::vector<std::size_t>& in,
                             double damping) const {
    const std::size_t p = problem_.size(), m = in.size();
    std::vector<double> scale(m), lower(m * m), step(m);
    for (std::size_t i = 0; i < m; ++i) scale[i] = 1.0 / std::sqrt(system.gram[in[i] * p + in[i]]);
    const double shift = std::max(damping, 1e-10);  // keeps directions without data finite
    for (std::size_t i = 0; i < m; ++i) {
      for (std::size_t k = 0; k <= i; ++k) {
        double value = system.gram[in[i] * p + in[k]] * scale[i] * scale[k] + (i == k ? shift : 0.0);
        value -= LayeredProblem::dot(lower.data() + i * m, lower.data() + k * m, k);
        lower[i * m + k] = i == k ? std::sqrt(std::max(value, 1e-12)) : value / lower[k * m + k];
      }
      step[i] = (system.slope[in[i]] * scale[i] - LayeredProblem::dot(lower.data() + i * m, step.data(), i)) /
                lower[i * m + i];
    }
    for (std::size_t i = m; i-- > 0;) {
      for (std::size_t k = i + 1; k < m; ++k) step[i] -= lower[k * m + i] * step[k];
      step[i] /= lower[i * m + i];
    }
    for (std::size_t i = 0; i < m; ++i) step[i] *= scale[i];
    return step;
  }

  /// Every run's punctures, one by one, at the best of many depths between those of the layers above and
  /// below.
  void scan_punctures(X& x) const {
    for (std::size_t r = 0; r < problem_.runs(); ++r) {
      const auto [low, high] = reach(r);
      for (std::size_t layer = 0; layer < problem_.layers(); ++layer) {
        const double own = x[problem_.puncture(r, layer)];
        const double above =
            layer > 0 ? x[problem_.puncture(r, layer - 1)] : -std::numeric_limits<double>::infinity();
        const double below = layer + 1 < problem_.layers() ? x[problem_.puncture(r, layer + 1)]
                                                           : std::numeric_limits<double>::infinity();
        std::vector<double> depths{own};
        for (double depth = std::max(low, x[top_x]) + scan_step; depth < high + 2.0 * scan_step;
             depth += scan_step)
          if (depth >= above && depth <= below) depths.push_back(depth);
        const std::vector<double> found = problem_.squares_by_puncture(x, r, layer, depths);
        const auto best = std::min_element(found.begin(), found.end());
        if (*best == *best) x[problem_.puncture(r, layer)] = depths[best - found.begin()];
      }
    }
  }
  /// Smallest and largest depth [mm] of a run.
  std::pair<double, double> reach(std::size_t r) const noexcept {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const LayerStep& step : problem_.run(r).steps) {
      low = std::min(low, 1e3 * step.depth);
      high = std::max(high, 1e3 * step.depth);
    }
    return {low, high};
  }

  /// Every layer's resting surface at the best of many depths.
  void scan_surfaces(X& x) const {
    const Evaluation now = problem_.evaluate(x);
    for (std::size_t layer = 0; layer < problem_.layers(); ++layer) {
      const std::size_t place = per_layer * layer + surface_x;
      if (!free_[place]) continue;
      double best = std::numeric_limits<double>::infinity(), at = x[place];
      const double own = x[place];
      for (int k = -10; k <= 10; ++k) {
        const double tried = std::clamp(own + surface_step * k, bounds_.low[place], bounds_.high[place]);
        x[place] = tried;
        const double found = problem_.squares_of_layer(x, layer, now);
        if (found < best || (found == best && k == 0)) best = found, at = tried;
      }
      x[place] = at;
    }
  }

  const LayeredProblem& problem_;
  Flags free_;
  LayeredBounds bounds_;
};

}  // namespace needleforce::fit
