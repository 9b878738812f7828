// SPDX-License-Identifier: Apache-2.0
// The layered law over several repeats: its vector of values, the residuals, their derivatives and normal
// equations.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "layered.hpp"
#include "pair.hpp"

namespace needleforce::fit {

/// Places of a layer's values in the vector x; behind all layers the logits of the relaxing share and of its
/// short part, the exponent of the speed, the logarithm of the friction outwards over that inwards, those of
/// the time constants of relaxation over the ones of the settings, and the punctures [mm] run by run.
enum LayerPlace : std::size_t {
  coefficient_x,
  saturation_x,
  top_x,
  ratio_x,
  stiffness_x,
  length_x,
  surface_x,
  per_layer
};

/// One repeat: its motion, the measured mean forces, the weight [1/N] of each residual, the logarithm of its
/// speed over that to which the parameters refer, and columns (each as long as the motion) of the force zero,
/// which is profiled out.
struct LayeredRun {
  std::vector<LayerStep> steps;
  std::vector<double> force, weight;
  double log_speed = 0.0;
  std::vector<double> zero;

  std::size_t size() const noexcept { return steps.size(); }
  std::size_t zeros() const noexcept { return steps.empty() ? 0 : zero.size() / steps.size(); }
};

/// What is known beforehand of the value at a `place` in x: a row of the least squares as of a measurement,
/// with the square `weight` (x - value)^2.
struct LayeredPrior {
  std::size_t place;
  double value, weight;
};

/// What does not change with x. `ridge` [1/mm] is the residual per distance of a puncture from the runs'
/// mean.
struct LayeredSettings {
  LayeredForm form;
  std::size_t layers;
  double time_1, time_2, brittleness, ridge;
  std::vector<LayeredPrior> priors;
};

/// The sum of squares as a function of the vector x of all values, and what a search of its minimum needs.
class LayeredProblem {
 public:
  using X = std::vector<double>;
  static constexpr double refused = 1e3;  ///< residual of values that the engine refuses

  LayeredProblem(const LayeredSettings& settings, std::vector<LayeredRun> runs)
      : settings_(settings), runs_(std::move(runs)) {}

  std::size_t layers() const noexcept { return settings_.layers; }
  std::size_t runs() const noexcept { return runs_.size(); }
  const LayeredRun& run(std::size_t r) const noexcept { return runs_[r]; }
  std::size_t shared() const noexcept { return times() + 2; }
  std::size_t relaxing() const noexcept { return per_layer * layers(); }
  std::size_t speed() const noexcept { return per_layer * layers() + 2; }
  std::size_t withdrawal() const noexcept { return per_layer * layers() + 3; }
  std::size_t times() const noexcept { return withdrawal() + 1; }
  std::size_t size() const noexcept { return shared() + layers() * runs(); }
  std::size_t puncture(std::size_t r, std::size_t layer) const noexcept {
    return shared() + r * layers() + layer;
  }

  static double logistic(double x) noexcept { return 0.5 * (1.0 + std::tanh(0.5 * x)); }

  /// The parameters of a layer that ruptures at `puncture` [mm]. Its dimple stays above its rupture: a
  /// resting surface outside the layer would be none.
  LayerNumbers numbers(const double* x, std::size_t layer, double puncture) const noexcept {
    constexpr double mm = 1e-3, min_indentation = 1e-6;
    const double* own = x + per_layer * layer;
    const double top = mm * own[top_x], stiffness = std::exp(own[stiffness_x]);
    const double ratio = std::exp(x[withdrawal()]);
    const double at = std::max(mm * puncture, top + min_indentation);
    return {std::exp(own[coefficient_x]),
            std::exp(own[saturation_x]),
            top,
            at,
            stiffness * logistic(own[ratio_x]) / ratio,
            stiffness,
            std::exp(own[length_x]),
            std::min(mm * own[surface_x], at - top),
            settings_.brittleness,
            ratio};
  }
  RelaxationNumbers relaxation(const double* x) const noexcept {
    const double share = logistic(x[relaxing()]), part = logistic(x[relaxing() + 1]);
    return {share * part, settings_.time_1 * std::exp(x[times()]), share * (1.0 - part),
            settings_.time_2 * std::exp(x[times() + 1])};
  }
  double factor(const double* x, std::size_t r) const noexcept {
    return runs_[r].log_speed == 0.0 ? 1.0 : std::exp(runs_[r].log_speed * x[speed()]);
  }

  /// The steps of a run with the time constants of x; `own` holds them where they are not those of the
  /// settings.
  std::span<const LayerStep> steps_of(const double* x, std::size_t r, std::vector<LayerStep>& own) const {
    if (x[times()] == 0.0 && x[times() + 1] == 0.0) return runs_[r].steps;
    own = runs_[r].steps;
    relax_steps(relaxation(x), own);
    return own;
  }

  /// Force (n,) [N] of one layer along the steps of a run with a puncture [mm], from what is `pressed`
  /// already on.
  void force_of_layer(const double* x, std::size_t r, std::span<const LayerStep> steps, std::size_t layer,
                      double puncture, PressedLayer& pressed, double* force) const {
    const std::size_t first = pressed.steps;
    layer_force(numbers(x, layer, puncture), relaxation(x), settings_.form, steps, pressed, force);
    if (const double scale = factor(x, r); scale != 1.0)
      for (std::size_t i = first; i < steps.size(); ++i) force[i] *= scale;
  }

  /// The layers' forces of every run, what their punctures began from, the weighted residuals, and half the
  /// sum of squares.
  struct Evaluation {
    std::vector<std::vector<double>> forces, residuals;
    std::vector<std::vector<PressedLayer>> pressed;
    double cost = 0.0;
  };

  void residuals(std::size_t r, const std::vector<double>& forces, std::vector<double>& residual) const {
    const LayeredRun& run = runs_[r];
    const std::size_t n = run.size();
    residual.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      double sum = 0.0;
      for (std::size_t layer = 0; layer < layers(); ++layer) sum += forces[layer * n + i];
      const double value = (sum - run.force[i]) * run.weight[i];
      residual[i] = value == value ? value : refused;
    }
  }

  /// Sum of squares of a residual without the part that the force zero explains.
  double squares(std::size_t r, const double* residual) const noexcept {
    const LayeredRun& run = runs_[r];
    const std::size_t n = run.size();
    double sum = dot(residual, residual, n);
    for (std::size_t q = 0; q < run.zeros(); ++q) {
      const double part = dot(residual, run.zero.data() + q * n, n);
      sum -= part * part;
    }
    return sum;
  }

  Evaluation evaluate(const X& x) const {
    Evaluation found;
    std::vector<LayerStep> own;
    found.forces.resize(runs());
    found.residuals.resize(runs());
    found.pressed.assign(runs(), std::vector<PressedLayer>(layers()));
    for (std::size_t r = 0; r < runs(); ++r) {
      const std::size_t n = runs_[r].size();
      const std::span<const LayerStep> steps = steps_of(x.data(), r, own);
      found.forces[r].resize(layers() * n);
      for (std::size_t layer = 0; layer < layers(); ++layer)
        force_of_layer(x.data(), r, steps, layer, x[puncture(r, layer)], found.pressed[r][layer],
                       found.forces[r].data() + layer * n);
      residuals(r, found.forces[r], found.residuals[r]);
      found.cost += 0.5 * squares(r, found.residuals[r].data());
    }
    for (std::size_t layer = 0; layer < layers(); ++layer) {
      const double mean = mean_puncture(x, layer);
      for (std::size_t r = 0; r < runs(); ++r) {
        const double distance = settings_.ridge * (x[puncture(r, layer)] - mean);
        found.cost += 0.5 * distance * distance;
      }
    }
    for (const auto& [place, value, weight] : settings_.priors)
      found.cost += 0.5 * weight * (x[place] - value) * (x[place] - value);
    return found;
  }
  double cost(const X& x) const { return evaluate(x).cost; }

  /// Places in x of the free values on which the residuals of a run depend.
  std::vector<std::size_t> places(std::size_t r, const std::vector<std::uint8_t>& free) const {
    std::vector<std::size_t> found;
    for (std::size_t k = 0; k < shared(); ++k)
      if (free[k]) found.push_back(k);
    for (std::size_t layer = 0; layer < layers(); ++layer)
      if (free[puncture(r, layer)]) found.push_back(puncture(r, layer));
    return found;
  }

  /// Derivatives of the residuals of a run by the values at `places`, a column (n,) each, by differences. A
  /// value of one layer changes the force of that layer only.
  void jacobian(const X& x, std::size_t r, const std::vector<std::size_t>& at, const Evaluation& now,
                std::vector<double>& columns) const {
    const LayeredRun& run = runs_[r];
    const std::size_t n = run.size();
    columns.assign(at.size() * n, 0.0);
    std::vector<double> force(n);
    std::vector<LayerStep> own, other;
    const std::span<const LayerStep> same = steps_of(x.data(), r, own);
    X moved = x;
    for (std::size_t c = 0; c < at.size(); ++c) {
      double* column = columns.data() + c * n;
      const std::size_t k = at[c];
      const double step = step_of(k);
      moved[k] = x[k] + step;
      const bool retimed = k >= times() && k < shared();
      const std::span<const LayerStep> steps = retimed ? steps_of(moved.data(), r, other) : same;
      for (std::size_t layer = 0; layer < layers(); ++layer) {
        const double* base = now.forces[r].data() + layer * n;
        if (k == speed()) {
          for (std::size_t i = 0; i < n; ++i) column[i] += base[i] * run.log_speed * step;
        } else if (affects(k, layer)) {
          PressedLayer pressed = presses(k) ? PressedLayer{} : now.pressed[r][layer];
          const std::size_t first = pressed.steps;
          force_of_layer(moved.data(), r, steps, layer, moved[puncture(r, layer)], pressed, force.data());
          for (std::size_t i = first; i < n; ++i) column[i] += force[i] - base[i];
        }
      }
      moved[k] = x[k];
      for (std::size_t i = 0; i < n; ++i) {
        const double slope = column[i] / step * run.weight[i];
        column[i] = slope == slope ? slope : 0.0;
      }
    }
  }

  /// J'J (size, size) and J'r (size,) of the cost.
  struct Equations {
    std::vector<double> gram, slope;
  };
  Equations equations(const X& x, const Evaluation& now, const std::vector<std::uint8_t>& free) const {
    const std::size_t p = size();
    Equations sum{std::vector<double>(p * p, 0.0), std::vector<double>(p, 0.0)};
    std::vector<double> columns;
    for (std::size_t r = 0; r < runs(); ++r) {
      const std::vector<std::size_t> at = places(r, free);
      jacobian(x, r, at, now, columns);
      add(r, at, columns, now.residuals[r], sum);
    }
    add_ridge(x, sum);
    add_priors(x, sum);
    return sum;
  }

  /// The sum of squares of a run for each of `depths` [mm] as the puncture of a layer.
  std::vector<double> squares_by_puncture(const X& x, std::size_t r, std::size_t layer,
                                          std::span<const double> depths) const {
    const std::size_t n = runs_[r].size();
    std::vector<double> forces(layers() * n), residual, found;
    std::vector<LayerStep> own;
    const std::span<const LayerStep> steps = steps_of(x.data(), r, own);
    PressedLayer pressed;
    for (std::size_t k = 0; k < layers(); ++k, pressed = {})
      force_of_layer(x.data(), r, steps, k, x[puncture(r, k)], pressed, forces.data() + k * n);
    double shallower = depths.empty() ? 0.0 : depths.front();
    for (const double depth : depths) {
      if (depth < shallower) pressed = {};
      shallower = depth;
      force_of_layer(x.data(), r, steps, layer, depth, pressed, forces.data() + layer * n);
      residuals(r, forces, residual);
      found.push_back(squares(r, residual.data()));
    }
    return found;
  }
  /// The sum of squares of all runs where the resting surface of one layer differs from `now`.
  double squares_of_layer(const X& x, std::size_t layer, const Evaluation& now) const {
    double sum = 0.0;
    std::vector<double> residual;
    std::vector<LayerStep> own;
    for (std::size_t r = 0; r < runs(); ++r) {
      std::vector<double> forces = now.forces[r];
      PressedLayer pressed = now.pressed[r][layer];
      force_of_layer(x.data(), r, steps_of(x.data(), r, own), layer, x[puncture(r, layer)], pressed,
                     forces.data() + layer * runs_[r].size());
      residuals(r, forces, residual);
      sum += squares(r, residual.data());
    }
    return sum;
  }

  static double dot(const double* a, const double* b, std::size_t n) noexcept {
    const auto products = [&](std::size_t i) { return Pair{a[i], a[i + 1]} * Pair{b[i], b[i + 1]}; };
    Pair one{}, two{};  // apart, so that the additions do not wait for one another
    std::size_t i = 0;
    for (; i + 4 <= n; i += 4) one += products(i), two += products(i + 2);
    for (; i < n; ++i) one[0] += a[i] * b[i];
    return (one[0] + one[1]) + (two[0] + two[1]);
  }

 private:
  double mean_puncture(const X& x, std::size_t layer) const noexcept {
    double sum = 0.0;
    for (std::size_t r = 0; r < runs(); ++r) sum += x[puncture(r, layer)];
    return sum / static_cast<double>(runs());
  }

  double step_of(std::size_t k) const noexcept {
    if (k >= shared()) return 0.03;  // a third of a bin: a smaller step leaves the rupture in its bin
    if (k >= relaxing()) return 1e-4;
    const std::size_t place = k % per_layer;
    return place == top_x || place == surface_x ? 1e-3 : 1e-4;
  }
  /// Whether a layer depends on a value up to its puncture.
  bool presses(std::size_t k) const noexcept {
    const std::size_t place = k % per_layer;
    return k < relaxing() ? place <= top_x : k < speed() || (k >= times() && k < shared());
  }
  bool affects(std::size_t k, std::size_t layer) const noexcept {
    if (k < relaxing()) return k / per_layer == layer;
    return k < shared() || (k - shared()) % layers() == layer;
  }

  void add(std::size_t r, const std::vector<std::size_t>& at, const std::vector<double>& columns,
           const std::vector<double>& residual, Equations& sum) const {
    const LayeredRun& run = runs_[r];
    const std::size_t n = run.size(), q = run.zeros(), p = size();
    std::vector<double> along(at.size() * q), off(q);
    for (std::size_t z = 0; z < q; ++z) {
      const double* zero = run.zero.data() + z * n;
      off[z] = dot(residual.data(), zero, n);
      for (std::size_t c = 0; c < at.size(); ++c) along[c * q + z] = dot(columns.data() + c * n, zero, n);
    }
    for (std::size_t c = 0; c < at.size(); ++c) {
      const double* column = columns.data() + c * n;
      sum.slope[at[c]] += dot(column, residual.data(), n) - dot(along.data() + c * q, off.data(), q);
      for (std::size_t d = 0; d <= c; ++d) {
        const double value =
            dot(column, columns.data() + d * n, n) - dot(along.data() + c * q, along.data() + d * q, q);
        sum.gram[at[c] * p + at[d]] += value;
        if (d != c) sum.gram[at[d] * p + at[c]] += value;
      }
    }
  }

  void add_ridge(const X& x, Equations& sum) const {
    const double square = settings_.ridge * settings_.ridge, share = 1.0 / static_cast<double>(runs());
    for (std::size_t layer = 0; layer < layers(); ++layer) {
      const double mean = mean_puncture(x, layer);
      for (std::size_t r = 0; r < runs(); ++r) {
        const std::size_t k = puncture(r, layer);
        sum.slope[k] += square * (x[k] - mean);
        for (std::size_t s = 0; s < runs(); ++s)
          sum.gram[k * size() + puncture(s, layer)] += square * ((r == s ? 1.0 : 0.0) - share);
      }
    }
  }

  void add_priors(const X& x, Equations& sum) const {
    for (const auto& [place, value, weight] : settings_.priors) {
      sum.slope[place] += weight * (x[place] - value);
      sum.gram[place * size() + place] += weight;
    }
  }

  LayeredSettings settings_;
  std::vector<LayeredRun> runs_;
};

}  // namespace needleforce::fit
