// SPDX-License-Identifier: Apache-2.0
// Gauss-Newton on the samples themselves, the puncture held: the last digits that running sums lose.
#pragma once

#include <algorithm>
#include <cstddef>

#include "normal.hpp"
#include "stroke.hpp"

namespace needleforce::fit {

/// Which samples count: the insertion's from the contact up to `deformation_end`, those from
/// `insertion_begin` on, and the withdrawal's.
struct Segments {
  std::size_t deformation_end = 0, insertion_begin = 0;
};

/// The share of a straight line F = sign f' h + f_c + b over samples with moments m: insertion (+1) or
/// withdrawal (-1, no f_c); h is the embedded length. A line loses no digits in moments, unlike the fourth
/// powers of a short deformation.
inline Normal line_normal(const Moments& m, const Scale& scale, const Vector& x, double sign) noexcept {
  const double half = scale.half, u0 = scale.scaled(x[contact]), slope = sign * x[friction], dz = -slope;
  const double level = (sign > 0 ? x[cutting] : 0) + x[offset];
  const double h = half * (m.u1 - u0 * m.count), hh = half * half * (m.u2 - u0 * (2 * m.u1 - u0 * m.count));
  const double fh = half * (m.f1 - u0 * m.f0), r = m.f0 - slope * h - level * m.count;
  const double rh = fh - slope * hh - level * h;
  Normal n;
  n.sse = m.ff - slope * (fh + rh) - level * (m.f0 + r), n.count = m.count;
  n.gram[contact][contact] = dz * dz * m.count;
  n.gram[friction][contact] = sign * dz * h;
  n.gram[friction][friction] = hh;
  n.gram[offset][contact] = dz * m.count, n.gram[offset][friction] = sign * h,
  n.gram[offset][offset] = m.count;
  n.gradient[contact] = dz * r, n.gradient[friction] = sign * rh, n.gradient[offset] = r;
  if (sign < 0) return n;
  n.gram[cutting][contact] = dz * m.count, n.gram[cutting][friction] = h, n.gram[cutting][cutting] = m.count;
  n.gram[offset][cutting] = m.count, n.gradient[cutting] = r;
  return n;
}

/// The share of samples without contact, where the sensor shows its zero b.
inline Normal free_normal(const Moments& m, double b) noexcept {
  Normal n;
  n.sse = m.ff - b * (2 * m.f0 - b * m.count), n.count = m.count;
  n.gram[offset][offset] = m.count, n.gradient[offset] = m.f0 - b * m.count;
  return n;
}

/// Stiffness g(h) and dg/dh: the cone h² up to the saturation depth s, then 2 s h - s².
struct Stiffness {
  double g, slope;
};
inline Stiffness stiffness_at(double h, double s) noexcept {
  const double cone = std::min(std::max(h, 0.0), s);
  return {cone * (2 * std::max(h, 0.0) - cone), 2 * cone};
}

/// The share of the deformation, sample by sample: samples [first, last), `first` being the first in contact.
inline Normal deformation_normal(const Stroke& in, const Vector& x, std::size_t first,
                                 std::size_t last) noexcept {
  Normal n;
  n.count = static_cast<double>(last - first);
  Matrix& a = n.gram;
  for (std::size_t i = first; i < last; ++i) {
    const double h = in.depth[i] - x[contact];
    const auto [g, slope] = stiffness_at(h, x[saturation]);
    const double dz = -x[stiffness] * slope, r = in.force[i] - x[offset] - x[stiffness] * g;
    n.sse += r * r;
    a[stiffness][stiffness] += g * g, a[contact][stiffness] += g * dz, a[contact][contact] += dz * dz;
    a[offset][stiffness] += g, a[offset][contact] += dz;
    n.gradient[stiffness] += g * r, n.gradient[contact] += dz * r, n.gradient[offset] += r;
    if (h <= x[saturation]) continue;
    const double ds = 2 * x[stiffness] * (h - x[saturation]);
    a[saturation][stiffness] += g * ds, a[saturation][contact] += dz * ds,
        a[saturation][saturation] += ds * ds;
    a[offset][saturation] += ds;
    n.gradient[saturation] += ds * r;
  }
  a[offset][offset] = n.count;
  return n;
}

/// A point, and the normal equations of each stroke there.
struct Polished {
  Vector x{};
  Normal insertion, withdrawal;

  Normal both() const noexcept {
    Normal n = insertion;
    return n += withdrawal;
  }
};

inline Polished evaluate(const Series& in, const Series& out, const Segments& s, const Vector& x) noexcept {
  const Scale& scale = in.scale();
  const std::size_t start = std::min(in.passing(scale.scaled(x[contact])), s.deformation_end);
  Polished p{x, deformation_normal(in.stroke(), x, start, s.deformation_end), {}};
  p.insertion += free_normal(in.before(start), x[offset]);
  p.insertion += line_normal(in.total() - in.before(s.insertion_begin), scale, x, 1);
  const Moments below = out.before(out.passing(scale.scaled(x[contact])));
  p.withdrawal = line_normal(below, scale, x, -1);
  p.withdrawal += free_normal(out.total() - below, x[offset]);
  return p;
}

/// Gauss-Newton with step halving, until a step would gain less than a rounding error is worth.
inline Polished polish(const Series& in, const Series& out, const Segments& s, const Vector& start,
                       const Free& free) noexcept {
  Polished best = evaluate(in, out, s, start);
  for (int round = 0; round < 20; ++round) {
    const Normal normal = best.both();
    const Vector step = solve(normal, free);
    double promise = 0;
    for (std::size_t i = 0; i < unknowns; ++i) promise += step[i] * normal.gradient[i];
    if (!(promise > 1e-11 * normal.sse)) break;
    Polished next = best;
    for (double share = 1; share > 1e-3 && !(next.both().sse < normal.sse); share *= 0.5) {
      Vector x = best.x;
      for (std::size_t i = 0; i < unknowns; ++i) x[i] += step[i] == 0 ? 0 : share * step[i];
      next = evaluate(in, out, s, x);
    }
    if (!(next.both().sse < normal.sse)) break;
    best = next;
  }
  return best;
}

}  // namespace needleforce::fit
