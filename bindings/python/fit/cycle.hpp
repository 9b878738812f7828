// SPDX-License-Identifier: Apache-2.0
// The complete fit of one in-out cycle with the one-layer model; no starting values. Allocates nothing,
// throws nothing.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "polish.hpp"
#include "punctures.hpp"

namespace needleforce::fit {

struct Settings {
  double saturation = unlimited;                                // h_s [m]; infinite: the bare cone
  bool free_saturation = false;                                 // h_s is sought
  std::size_t leave_out = 0;                                    // samples left out on each side of a step
  double puncture_low = -unlimited, puncture_high = unlimited;  // admissible puncture depths [m]
  double margin =
      40;  // punctures are reported if their sum of squares is at most this many variances above the smallest
};

enum class Outcome { found, not_finite, no_room };

struct CycleResult {
  Outcome outcome = Outcome::not_finite;
  Polished polished;
  Free free{};
  std::size_t puncture = 0;         // samples of the insertion before it
  std::size_t first = 0, last = 0;  // the punctures that were admitted
  Profile profile;
  double unconstrained_friction = 0;
};

/// Rows of workspace that `fit_cycle` needs for n_in and n_out samples.
constexpr std::size_t workspace_rows(std::size_t n_in, std::size_t n_out) noexcept {
  return blocks_of(n_in) + blocks_of(n_out) + 2;
}

/// Samples a segment must have: a fiftieth of the insertion's.
inline std::size_t shortest_segment(std::size_t n, std::size_t leave_out) noexcept {
  return std::max<std::size_t>(n / 50, 8) + 2 * leave_out;
}

/// The strokes without what a filter has smeared over the reversal, and the punctures admitted.
inline Problem problem_of(const Stroke& in, const Stroke& out, const Scale& scale, const Settings& settings,
                          std::span<Row> workspace) noexcept {
  const std::size_t w = settings.leave_out, n_in = in.size() - std::min(w, in.size());
  const std::size_t skip = std::min(w, out.size()), rows = blocks_of(n_in) + 1;
  Problem p;
  p.insertion = {in.part(0, n_in), scale, 1, workspace.first(rows)};
  p.withdrawal = {out.part(skip, out.size() - skip), scale, -1,
                  workspace.subspan(rows, blocks_of(out.size() - skip) + 1)};
  p.shortest = shortest_segment(n_in, w);
  p.first = std::max(p.insertion.passing(scale.scaled(settings.puncture_low)), p.shortest);
  p.last =
      std::min(p.insertion.passing(scale.scaled(settings.puncture_high)), n_in - std::min(n_in, p.shortest));
  return p;
}

/// The closed form's unknowns at the optimum of the search, in SI.
inline Vector unknowns_of(const Problem& p, const Scale& scale, const Candidate& best) noexcept {
  const Trial trial = trial_at(p.insertion, p.withdrawal, best.u0, best.saturation);
  const Moments m = p.insertion.before(best.puncture);
  const auto found = coefficients(trial, trial.form(best.puncture), m, m);
  return {found.stiffness / (scale.half * scale.half),
          scale.depth(best.u0),
          found.friction / scale.half,
          found.cutting,
          best.saturation * scale.half,
          found.offset};
}

/// Polishes; an unknown that ends outside its physical range is held at its bound and the rest polished
/// again.
inline void polish_within_bounds(const Problem& p, const Segments& s, const Vector& start,
                                 CycleResult& r) noexcept {
  r.polished = polish(p.insertion, p.withdrawal, s, start, r.free);
  r.unconstrained_friction = r.polished.x[friction];
  Vector x = r.polished.x;
  const double deepest = p.insertion.stroke().depth[r.puncture - 1] - x[contact];
  if (x[friction] < 0) x[friction] = 0, r.free[friction] = false;
  if (r.free[saturation] && !(x[saturation] < deepest)) x[saturation] = unlimited, r.free[saturation] = false;
  if (x != r.polished.x) r.polished = polish(p.insertion, p.withdrawal, s, x, r.free);
}

/// Fits both strokes (`out` may be empty). `gain` takes one value a sample of `in`: see `profile`;
/// `workspace` takes workspace_rows() rows.
inline CycleResult fit_cycle(const Stroke& in, const Stroke& out, const Settings& settings,
                             std::span<double> gain, std::span<Row> workspace) noexcept {
  CycleResult r;
  const Scale scale = scale_of(in.depth);
  Problem p = problem_of(in, out, scale, settings, workspace);
  const Moments all = p.insertion.total() + p.withdrawal.total();
  if (!std::isfinite(all.ff + all.u4)) return r;
  r.first = p.first, r.last = p.last, r.outcome = Outcome::no_room;
  if (p.first > p.last || scale.half <= tiny) return r;
  p.spread_punctures();
  const Candidate best = search(p, settings.saturation / scale.half, settings.free_saturation);
  if (!(best.gain >= 0)) return r;
  r.puncture = best.puncture, r.outcome = Outcome::found;
  r.free = {true, true, true, true, settings.free_saturation && best.saturation < unlimited, true};
  const Segments segments{best.puncture - settings.leave_out, best.puncture + settings.leave_out};
  polish_within_bounds(p, segments, unknowns_of(p, scale, best), r);
  const Normal both = r.polished.both();
  r.profile = profile(p, best, settings.margin * both.sse / both.count, gain);
  return r;
}

/// Measured minus modelled force of whole strokes [N]: nothing is left out here.
inline void residuals(const Stroke& in, const Stroke& out, const CycleResult& r, double* __restrict of_in,
                      double* __restrict of_out) noexcept {
  const Vector x = r.polished.x;  // the embedded length is the depth below x[contact]
  for (std::size_t i = 0; i < r.puncture; ++i)
    of_in[i] =
        in.force[i] - x[offset] - x[stiffness] * stiffness_at(in.depth[i] - x[contact], x[saturation]).g;
  for (std::size_t i = r.puncture; i < in.size(); ++i)
    of_in[i] = in.force[i] - x[friction] * (in.depth[i] - x[contact]) - x[cutting] - x[offset];
  for (std::size_t i = 0; i < out.size(); ++i)
    of_out[i] = out.force[i] - x[offset] + x[friction] * std::max(out.depth[i] - x[contact], 0.0);
}

}  // namespace needleforce::fit
