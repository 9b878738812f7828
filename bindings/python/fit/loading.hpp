// SPDX-License-Identifier: Apache-2.0
// The fit of a loading curve F(z - z0; s) + b up to the puncture: contact depth z0 and shape s by a global
// search on block means, then Gauss-Newton on all samples. Amplitudes, none below 0, and the sensor's zero b
// are projected out (Golub & Pereyra 1973). Allocates nothing, throws nothing.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "loading_curves.hpp"
#include "normal.hpp"
#include "stroke.hpp"

namespace needleforce::fit {

inline constexpr std::size_t search_blocks = 256;         // the search works on means of so many blocks
inline constexpr std::size_t starts_along = 32;           // contact depths to start from, at most
inline constexpr int kink_steps = 6, steps_a_sample = 2;  // to each side of a minimum between samples
inline constexpr double rough_gain = 1e-3, search_gain = 1e-7,
                        full_gain = 1e-13;  // [of the sum of squares] a last step's

/// Starts and range of one nonlinear parameter, in units of the indentation; held where low == high.
struct LoadingRange {
  std::span<const double> starts;
  double low = 0, high = 0;
};

/// Where the search begins: depths are contact + indentation * x [m], `place` and `shape` are ranges of x and
/// of the shape in units of the indentation.
struct LoadingSearch {
  double contact = 0, indentation = 1;
  LoadingRange place, shape;
};

/// The curve of least squares in SI, and its sum of squares [N²]; infinite where no start is finite.
struct LoadingResult {
  std::array<double, 2> amplitudes{};
  double contact_depth = 0, shape = 0, offset = 0;
  double sse = std::numeric_limits<double>::infinity();
};

/// Workspace of `fit_loading` for n samples, in numbers.
constexpr std::size_t loading_workspace(std::size_t n) noexcept {
  return n > search_blocks ? 2 * search_blocks : 0;
}

/// Order of the unknowns in the normal equations of a loading curve.
enum LoadingUnknown : std::size_t { first_amplitude, second_amplitude, zero, place, shape };

/// One point of the search, with its normal equations. The offset is that of the force from `mean`.
struct LoadingPoint {
  std::array<double, 2> amplitude{}, x{};  // x: place and shape
  double offset = 0;
  Normal normal;
  double sse() const noexcept { return normal.sse; }
};

template <class Curve>
class LoadingProblem {
 public:
  LoadingProblem(const LoadingSearch& search) noexcept : search_(search), inverse_(1 / search.indentation) {}

  /// Amplitudes and offset of least squares at x, and the normal equations there. Residuals are taken from
  /// those of `near` first, so that sums of their squares keep their digits.
  LoadingPoint at(const Stroke& samples, const LoadingPoint& near,
                  const std::array<double, 2>& x) const noexcept {
    const Gram gram = gram_of<columns>(samples, near, x);
    LoadingPoint point = projected(gram, near);
    point.x = x;
    point.normal = normal_of(gram, near, point);
    return point;
  }

  /// The local minimum near a point, by Gauss-Newton with Marquardt's damping within the ranges. It ends with
  /// the step that is expected to gain less than `gain` of the sum of squares.
  LoadingPoint minimum(const Stroke& samples, LoadingPoint best, double gain) const noexcept {
    double damping = 1e-3;
    for (int round = 0; round < 100 && damping < 1e9; ++round) {
      const Free free = free_at(best);
      const double promise = promised(best, solve(best.normal, free));
      if (!(promise > 1e-20 * best.sse())) break;
      const bool last = promise < gain * best.sse();
      const LoadingPoint next =
          at(samples, best, moved(best, solve(damped(best.normal, last ? 0 : damping), free)));
      const bool better = next.sse() < best.sse();
      if (better) best = next;
      if (last) break;
      damping *= better ? 0.05 : 10;
    }
    return best;
  }

  /// The minima reached on block means from every start; the best of them on all samples.
  LoadingPoint best(const Stroke& samples, const Stroke& means) const noexcept {
    const double mean = mean_of(samples);
    Finalists finalists;
    const std::size_t count = followed(means, mean, finalists);
    double least = unreached;
    for (std::size_t k = 0; k < count; ++k) least = std::min(least, finalists[k].sse());
    for (std::size_t k = 0; k < count; ++k)
      if (finalists[k].sse() <= near_best * least) finalists[k] = minimum(means, finalists[k], search_gain);
    LoadingPoint best;
    best.normal.sse = unreached;
    for (std::size_t k = 0; k < count; ++k) {
      if (!(finalists[k].sse() <= near_best * least) || is_one_of(finalists, k)) continue;
      const LoadingPoint found =
          least_kink(samples, minimum(samples, at(samples, finalists[k], finalists[k].x), full_gain));
      if (found.sse() < best.sse()) best = found;
    }
    return best;
  }

 private:
  static constexpr std::size_t amplitudes = Curve::amplitudes, columns = Curve::columns;
  static constexpr std::size_t ones = columns, target = columns + 1, size = columns + 2;
  static constexpr double unreached = std::numeric_limits<double>::infinity();
  static constexpr double near_best = 1.05;   // block means rank two minima to about this
  static constexpr double same_place = 1e-2;  // [of the indentation] two minima nearer than this are one,
  static constexpr double same_sse = 1e-6;    // if their sums of squares agree too
  using Finalists = std::array<LoadingPoint, starts_along>;
  using Gram = std::array<std::array<double, size>, size>;  // upper triangle
  using Combination = std::array<double, size>;

  /// A curve with a kink at contact has a minimum between some neighbouring samples each: the least of those
  /// near one, the shape following the contact depth along the valley.
  LoadingPoint least_kink(const Stroke& samples, const LoadingPoint& minimum_here) const noexcept {
    if (!Curve::kinked(minimum_here.x[1]) || !(search_.place.low < search_.place.high)) return minimum_here;
    LoadingPoint best = minimum_here;
    const Free shape_alone{best.amplitude[0] > 0, best.amplitude[1] > 0, true, false, free_at(best)[shape]};
    Normal valley = best.normal;
    for (std::size_t i = 0; i < unknowns; ++i)
      valley.gradient[i] = -valley.gram[std::max<std::size_t>(i, place)][std::min<std::size_t>(i, place)];
    const double turn = solve(valley, shape_alone)[shape];
    const double step = (1 - best.x[0]) / (steps_a_sample * static_cast<double>(samples.size()));
    for (int k = -kink_steps; k <= kink_steps; ++k) {
      Vector by{};
      by[place] = k * step, by[shape] = turn * by[place];
      const LoadingPoint found = at(samples, minimum_here, moved(minimum_here, by));
      if (k != 0 && found.sse() < best.sse()) best = found;
    }
    return best.sse() < minimum_here.sse() ? minimum(samples, best, full_gain) : best;
  }

  static double mean_of(const Stroke& samples) noexcept {
    double sum = 0;
    for (const double force : samples.force) sum += force;
    return sum / static_cast<double>(samples.size());
  }

  /// The sum of squares at x alone, for which the derivatives' columns are not needed.
  double sse_at(const Stroke& samples, const LoadingPoint& near,
                const std::array<double, 2>& x) const noexcept {
    return projected(gram_of<amplitudes>(samples, near, x), near).sse();
  }

  /// Sums of products of the first `used` of the curve's columns, 1, and the residual from `near`'s
  /// amplitudes.
  template <std::size_t used>
  Gram gram_of(const Stroke& samples, const LoadingPoint& near,
               const std::array<double, 2>& x) const noexcept {
    std::array<std::array<Pair, size>, size> sums{};
    const Pair origin = Pair{} + (search_.contact + search_.indentation * x[0]), unit = Pair{} + inverse_;
    const std::size_t n = samples.size();
    double free_f = 0, free_ff = 0;
    const auto add = [&](Pair depth, Pair force, Pair one) {
      const Pair raw = (depth - origin) * unit, h = chosen(raw > 0.0, raw, Pair{});
      std::array<Pair, size> v;
      Curve::at(h, x[1], v.data());
      Pair residual = force - near.offset;
      for (std::size_t k = 0; k < amplitudes; ++k) residual -= near.amplitude[k] * v[k];
      v[target] = residual * one;
      v[ones] = one;
      for (std::size_t i = 0; i < used; ++i) {
        sums[i][ones] += v[i];
        for (std::size_t k = i; k < used; ++k) sums[i][k] += v[i] * v[k];
        sums[i][target] += v[i] * v[target];
      }
      sums[ones][target] += v[target];
      sums[target][target] += v[target] * v[target];
    };
    for (std::size_t i = 0; i + 1 < n; i += 2) {
      const Pair depth = pair_at(&samples.depth[i]);
      if (!(depth[0] > origin[0]) && !(depth[1] > origin[0])) {  // free travel shows the zero only
        const Pair residual = pair_at(&samples.force[i]) - near.offset;
        free_f += residual[0] + residual[1], free_ff += residual[0] * residual[0] + residual[1] * residual[1];
      } else {
        add(depth, pair_at(&samples.force[i]), Pair{1, 1});
      }
    }
    if (n % 2 == 1) add(Pair{samples.depth[n - 1], origin[0]}, Pair{samples.force[n - 1], 0}, Pair{1, 0});
    Gram gram;
    for (std::size_t i = 0; i < size; ++i)
      for (std::size_t k = i; k < size; ++k) gram[i][k] = sums[i][k][0] + sums[i][k][1];
    gram[ones][ones] = static_cast<double>(n), gram[ones][target] += free_f, gram[target][target] += free_ff;
    return gram;
  }

  static double entry(const Gram& gram, std::size_t i, std::size_t k) noexcept {
    return gram[std::min(i, k)][std::max(i, k)];
  }

  /// Amplitudes and offset of least squares with some amplitudes held at 0.
  static LoadingPoint with(const Gram& gram, const LoadingPoint& near,
                           const std::array<bool, 2>& held) noexcept {
    LoadingPoint point;
    Normal normal;
    Free free{held[0] ? false : true, amplitudes > 1 && !held[1], true};
    const std::array<std::size_t, 3> column{0, amplitudes > 1 ? std::size_t{1} : 0, ones};
    for (const std::size_t i : {first_amplitude, second_amplitude, zero}) {
      normal.gradient[i] = entry(gram, column[i], target);  // what is held changes by its old amount
      for (std::size_t k = 0; k <= i; ++k) normal.gram[i][k] = entry(gram, column[i], column[k]);
      for (std::size_t k = 0; k < amplitudes; ++k)
        if (held[k]) normal.gradient[i] += near.amplitude[k] * entry(gram, column[i], k);
    }
    const Vector change = solve(normal, free);
    for (std::size_t k = 0; k < amplitudes; ++k)
      point.amplitude[k] = held[k] ? 0 : near.amplitude[k] + change[k];
    point.offset = near.offset + change[zero];
    point.normal.sse = quadratic(gram, residual_of(near, point), residual_of(near, point));
    return point;
  }

  /// Amplitudes, none below 0, and offset of least squares.
  static LoadingPoint projected(const Gram& gram, const LoadingPoint& near) noexcept {
    LoadingPoint best = with(gram, near, {});
    if (best.amplitude[0] >= 0 && best.amplitude[1] >= 0) return best;
    best = with(gram, near, {true, true});
    if constexpr (amplitudes > 1)
      for (const std::array<bool, 2> held : {std::array{true, false}, std::array{false, true}}) {
        const LoadingPoint found = with(gram, near, held);
        if (found.amplitude[0] >= 0 && found.amplitude[1] >= 0 && found.sse() < best.sse()) best = found;
      }
    return best;
  }

  /// The residual at a point as a combination of the columns.
  static Combination residual_of(const LoadingPoint& near, const LoadingPoint& point) noexcept {
    Combination sum{};
    for (std::size_t k = 0; k < amplitudes; ++k) sum[k] = near.amplitude[k] - point.amplitude[k];
    sum[ones] = near.offset - point.offset, sum[target] = 1;
    return sum;
  }

  static double quadratic(const Gram& gram, const Combination& a, const Combination& b) noexcept {
    double sum = 0;
    for (std::size_t i = 0; i < size; ++i)
      for (std::size_t k = 0; k < size; ++k) sum += a[i] * b[k] * entry(gram, i, k);
    return sum;
  }

  static Normal normal_of(const Gram& gram, const LoadingPoint& near, const LoadingPoint& point) noexcept {
    std::array<Combination, 5> slope{};
    for (std::size_t k = 0; k < amplitudes; ++k) {
      slope[k][k] = 1;
      slope[place][amplitudes + k] = -point.amplitude[k];
      if constexpr (Curve::shaped) slope[shape][2 * amplitudes + k] = point.amplitude[k];
    }
    slope[zero][ones] = 1;
    const Combination residual = residual_of(near, point);
    Normal normal;
    for (std::size_t i = 0; i < slope.size(); ++i) {
      for (std::size_t k = 0; k <= i; ++k) normal.gram[i][k] = quadratic(gram, slope[i], slope[k]);
      normal.gradient[i] = quadratic(gram, slope[i], residual);
    }
    normal.sse = point.normal.sse, normal.count = gram[ones][ones];
    return normal;
  }

  /// What may move: no amplitude at 0, no parameter at its limit whose optimum is beyond.
  Free free_at(const LoadingPoint& p) const noexcept {
    const auto inside = [&](const LoadingRange& range, double x, double slope) {
      return range.low < range.high && !(x <= range.low && slope < 0) && !(x >= range.high && slope > 0);
    };
    return {p.amplitude[0] > 0, p.amplitude[1] > 0, true,
            inside(search_.place, p.x[0], p.normal.gradient[place]),
            Curve::shaped && inside(search_.shape, p.x[1], p.normal.gradient[shape])};
  }

  static double promised(const LoadingPoint& p, const Vector& step) noexcept {
    return step[place] * p.normal.gradient[place] + step[shape] * p.normal.gradient[shape];
  }

  static Normal damped(Normal normal, double damping) noexcept {
    normal.gram[place][place] *= 1 + damping, normal.gram[shape][shape] *= 1 + damping;
    return normal;
  }

  std::array<double, 2> moved(const LoadingPoint& p, const Vector& step) const noexcept {
    return {
        std::clamp(p.x[0] + step[place], search_.place.low, search_.place.high),
        step[shape] == 0 ? p.x[1] : std::clamp(p.x[1] + step[shape], search_.shape.low, search_.shape.high)};
  }

  /// For each contact depth to start from, the minimum reached from its best shape; their number.
  std::size_t followed(const Stroke& means, double mean, Finalists& found) const noexcept {
    const std::size_t places = std::min(search_.place.starts.size(), starts_along);
    LoadingPoint none;
    none.offset = mean;
    for (std::size_t i = 0; i < places; ++i) {
      found[i].normal.sse = unreached;
      for (const double s : search_.shape.starts) {
        const double sse = sse_at(means, none, {search_.place.starts[i], s});
        if (sse < found[i].sse()) found[i].normal.sse = sse, found[i].x = {search_.place.starts[i], s};
      }
      if (found[i].sse() < unreached) found[i] = at(means, none, found[i].x);
      found[i] = minimum(means, found[i], rough_gain);
    }
    return places;
  }

  static bool is_one_of(const Finalists& found, std::size_t count) noexcept {
    for (std::size_t k = 0; k < count; ++k)
      if (std::abs(found[k].x[0] - found[count].x[0]) < same_place &&
          std::abs(found[k].sse() - found[count].sse()) <= same_sse * found[k].sse())
        return true;
    return false;
  }

  const LoadingSearch& search_;
  double inverse_;
};

/// Means of blocks of consecutive samples, whose sizes differ by 1 at most; the samples where they are few.
inline Stroke block_means(const Stroke& samples, std::span<double> workspace) noexcept {
  const std::size_t n = samples.size(), blocks = workspace.size() / 2;
  if (blocks == 0 || n <= blocks) return samples;
  for (std::size_t k = 0; k < blocks; ++k) {
    const std::size_t first = k * n / blocks, last = (k + 1) * n / blocks;
    double depth = 0, force = 0;
    for (std::size_t i = first; i < last; ++i) depth += samples.depth[i], force += samples.force[i];
    workspace[k] = depth / static_cast<double>(last - first);
    workspace[blocks + k] = force / static_cast<double>(last - first);
  }
  return {workspace.first(blocks), workspace.subspan(blocks, blocks)};
}

/// The loading curve of least squares through samples in order of time; `workspace` takes
/// loading_workspace(n) numbers.
template <class Curve>
LoadingResult fit_loading(const Stroke& samples, const LoadingSearch& search,
                          std::span<double> workspace) noexcept {
  const LoadingProblem<Curve> problem(search);
  const LoadingPoint best = problem.best(samples, block_means(samples, workspace));
  LoadingResult result{{}, search.contact + search.indentation * best.x[0], 0, best.offset, best.sse()};
  result.shape = Curve::shape_of(best.x[1], search.indentation);
  for (std::size_t k = 0; k < Curve::amplitudes; ++k)
    result.amplitudes[k] = best.amplitude[k] * Curve::unit(k, best.x[1], search.indentation);
  return result;
}

}  // namespace needleforce::fit
