// SPDX-License-Identifier: Apache-2.0
// One stroke of a recording, and moments of any of its segments in O(1): running sums every `block` samples.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>

#include "pair.hpp"

namespace needleforce::fit {

/// Depth [m] and force [N] of one stroke in the order of time; equal lengths.
struct Stroke {
  std::span<const double> depth;
  std::span<const double> force;

  std::size_t size() const noexcept { return depth.size(); }
  Stroke part(std::size_t first, std::size_t count) const noexcept {
    return {depth.subspan(first, count), force.subspan(first, count)};
  }
};

/// u = (depth - centre) / half is in [-1, 1] over the insertion: fourth powers then keep their digits.
struct Scale {
  double centre = 0, half = 1;

  double scaled(double depth) const noexcept { return (depth - centre) / half; }
  double depth(double u) const noexcept { return centre + half * u; }
};

inline Scale scale_of(std::span<const double> depth) noexcept {
  Pair low{depth.back(), depth.back()}, high = low;
  for (std::size_t i = 0; i + 1 < depth.size(); i += 2) {
    const Pair z = pair_at(&depth[i]);
    low = chosen(z < low, z, low), high = chosen(z > high, z, high);
  }
  const double from = std::min(low[0], low[1]), to = std::max(high[0], high[1]);
  return {0.5 * (from + to), std::max(0.5 * (to - from), std::numeric_limits<double>::min())};
}

/// Sums over samples: their number, powers of u, and the force times powers of u. T is double or Pair.
template <class T>
struct MomentsOf {
  T count{}, u1{}, u2{}, u3{}, u4{}, f0{}, f1{}, f2{}, ff{};

  void add(T u, T f) noexcept {
    const T uu = u * u;
    count += 1.0, u1 += u, u2 += uu, u3 += uu * u, u4 += uu * uu;
    f0 += f, f1 += f * u, f2 += f * uu, ff += f * f;
  }
  /// Calls with(member of this, same member of others ...) for each member.
  template <class Function, class... Others>
  void each(const Function& with, const Others&... o) noexcept {
    with(count, o.count...), with(u1, o.u1...), with(u2, o.u2...), with(u3, o.u3...), with(u4, o.u4...);
    with(f0, o.f0...), with(f1, o.f1...), with(f2, o.f2...), with(ff, o.ff...);
  }
};
using Moments = MomentsOf<double>;

inline Moments operator+(Moments a, const Moments& b) noexcept {
  a.each([](double& x, double y) { x += y; }, b);
  return a;
}
inline Moments operator-(Moments a, const Moments& b) noexcept {
  a.each([](double& x, double y) { x -= y; }, b);
  return a;
}
inline Moments sum(const MomentsOf<Pair>& pair) noexcept {
  Moments m;
  m.each([](double& x, Pair y) { x = y[0] + y[1]; }, pair);
  return m;
}
inline MomentsOf<Pair> side_by_side(const Moments& a, const Moments& b) noexcept {
  MomentsOf<Pair> pair;
  pair.each([](Pair& x, double y, double z) { x = Pair{y, z}; }, a, b);
  return pair;
}

inline constexpr std::size_t block = 32;
constexpr std::size_t blocks_of(std::size_t samples) noexcept { return (samples + block - 1) / block; }

/// What is kept of a block's start: the moments of all samples before it, and the deepest u so far (in a
/// withdrawal the shallowest, both with the sign of the direction). The order of time is never disturbed, the
/// puncture being an event in time; `reach` is monotonic all the same, so that a depth can be searched for.
struct Row {
  Moments before;
  double reach = -std::numeric_limits<double>::infinity();
};

/// A stroke with its rows; direction +1 for insertion, -1 for withdrawal.
class Series {
 public:
  Series() = default;
  /// `rows` takes blocks_of(stroke.size()) + 1 values.
  Series(const Stroke& stroke, const Scale& scale, double direction, std::span<Row> rows) noexcept
      : stroke_(stroke), scale_(scale), direction_(direction), rows_(rows) {
    Row row;
    for (std::size_t k = 0; k + 1 < rows.size(); ++k) rows[k] = row, row = after(row, k);
    rows.back() = row;
  }

  std::size_t size() const noexcept { return stroke_.size(); }
  const Stroke& stroke() const noexcept { return stroke_; }
  const Scale& scale() const noexcept { return scale_; }
  std::span<const Row> rows() const noexcept { return rows_; }
  const Moments& total() const noexcept { return rows_.back().before; }
  double u(std::size_t i) const noexcept { return (stroke_.depth[i] - scale_.centre) * inverse_; }
  double force(std::size_t i) const noexcept { return stroke_.force[i]; }

  /// Moments of the samples before sample i.
  Moments before(std::size_t i) const noexcept {
    Moments sum = rows_[i / block].before;
    for (std::size_t k = i / block * block; k < i; ++k) sum.add(u(k), force(k));
    return sum;
  }

  /// Number of samples before the stroke first passes u.
  std::size_t passing(double u0) const noexcept {
    const double goal = direction_ * u0;
    const auto row = std::upper_bound(rows_.begin(), rows_.end(), goal,
                                      [](double value, const Row& r) { return value < r.reach; });
    std::size_t i = row == rows_.begin() ? 0 : static_cast<std::size_t>(row - rows_.begin() - 1) * block;
    while (i < size() && !(direction_ * u(i) > goal)) ++i;
    return i;
  }

 private:
  /// The row after block k.
  Row after(const Row& row, std::size_t k) noexcept {
    const std::size_t first = k * block, last = std::min(first + block, size());
    MomentsOf<Pair> pairs;
    Pair far{row.reach, row.reach};
    for (std::size_t i = first; i + 1 < last; i += 2) {
      const Pair v = (pair_at(&stroke_.depth[i]) - scale_.centre) * inverse_, along = direction_ * v;
      far = chosen(along > far, along, far);
      pairs.add(v, pair_at(&stroke_.force[i]));
    }
    Moments sums = sum(pairs);
    if ((last - first) % 2 == 1) sums.add(u(last - 1), force(last - 1));
    return {row.before + sums, std::max({far[0], far[1], direction_ * u(last - 1)})};
  }

  Stroke stroke_;
  Scale scale_;
  double direction_ = 1, inverse_ = 1 / scale_.half;
  std::span<Row> rows_;
};

}  // namespace needleforce::fit
