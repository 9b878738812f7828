// SPDX-License-Identifier: Apache-2.0
// The global search: a coarse grid, then a 1-D maximisation of the contact depth in turn with every puncture.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "gain.hpp"

namespace needleforce::fit {

inline constexpr std::size_t contact_steps = 64, puncture_steps = 128;
inline constexpr double contact_step = 2.0 / contact_steps;

/// Both strokes, and the punctures admitted, counted in samples before them.
struct Problem {
  Series insertion, withdrawal;
  std::size_t first = 0, last = 0;
  std::size_t shortest = 1;  // samples a segment needs: shorter ones cancel to a negative sum of squares
  std::array<std::size_t, puncture_steps> puncture{};  // the punctures tried first, even over first .. last
  std::array<MomentsOf<Pair>, puncture_steps / 2> moments{};  // before each two of them

  void spread_punctures() noexcept {
    for (std::size_t k = 0; k < puncture_steps; ++k)
      puncture[k] = first + (last - first) * k / (puncture_steps - 1);
    for (std::size_t k = 0; k < puncture_steps; k += 2)
      moments[k / 2] = side_by_side(insertion.before(puncture[k]), insertion.before(puncture[k + 1]));
  }
};

/// A contact depth and a saturation depth (both scaled), the samples before the puncture, and the gain
/// reached.
struct Candidate {
  double u0 = 0, saturation = unlimited;
  std::size_t puncture = 0;
  double gain = -1;
};

/// Saturation depths tried first, in scaled depth (the whole insertion is 2 long). The last is the bare cone.
inline constexpr std::array saturation_steps = {0.02, 0.04, 0.07, 0.11, 0.17, 0.26, 0.4, 0.7, unlimited};

/// The best of the spread punctures for one contact depth, two at a time. Of two with the saturation between
/// them both count as cone, which just there is as good.
inline Candidate best_spread(const Problem& p, double u0, double saturation) noexcept {
  const Trial trial = trial_at(p.insertion, p.withdrawal, u0, saturation);
  Candidate best{u0, saturation, p.last, -1};
  for (std::size_t k = puncture_steps; k > 0 && p.puncture[k - 2] >= trial.start + p.shortest; k -= 2) {
    const Pair gain = gain_of(trial, trial.form(p.puncture[k - 2]), p.moments[k / 2 - 1]);
    for (std::size_t lane = 0; lane < 2; ++lane)
      if (gain[lane] > best.gain) best.gain = gain[lane], best.puncture = p.puncture[k - 2 + lane];
  }
  return best;
}

/// The best of a grid of contact depths (and saturation depths) times the spread punctures.
inline Candidate best_of_grid(const Problem& p, std::span<const double> saturations) noexcept {
  Candidate best{0, saturations.back(), p.last, -1};
  for (const double saturation : saturations)
    for (std::size_t k = 0; k < contact_steps; ++k) {
      const Candidate next = best_spread(p, -1 + contact_step * static_cast<double>(k), saturation);
      if (next.gain > best.gain) best = next;
    }
  return best;
}

/// Where f is largest in [low, high], by golden section (Kiefer 1953).
template <class Function>
double golden(double low, double high, double tolerance, const Function& f) noexcept {
  constexpr double ratio = 0.6180339887498949;
  double a = high - ratio * (high - low), b = low + ratio * (high - low), fa = f(a), fb = f(b);
  while (high - low > tolerance) {
    if (fa > fb) {
      high = b, b = a, fb = fa, a = high - ratio * (high - low), fa = f(a);
    } else {
      low = a, a = b, fa = fb, b = low + ratio * (high - low), fb = f(b);
    }
  }
  return fa > fb ? a : b;
}

/// The best contact depth near `start`, its puncture and saturation held.
inline Candidate best_contact(const Problem& p, Candidate start) noexcept {
  const Moments m = p.insertion.before(start.puncture);
  const auto gain = [&](double u0) {
    const Trial trial = trial_at(p.insertion, p.withdrawal, u0, start.saturation);
    return start.puncture >= trial.start + p.shortest ? gain_of(trial, trial.form(start.puncture), m) : -1.0;
  };
  start.u0 = golden(start.u0 - 2 * contact_step, start.u0 + 2 * contact_step, 1e-7, gain);
  start.gain = gain(start.u0);
  return start;
}

/// The best saturation depth, with the best contact depth for each: the two compensate one another, and
/// moving one at a time would creep along a valley.
inline Candidate best_saturation(const Problem& p, Candidate start) noexcept {
  const auto contact = [&](double log_saturation) {
    Candidate trial = start;
    trial.saturation = std::exp(log_saturation);
    return best_contact(p, trial);
  };
  const double centre = std::log(std::min(start.saturation, 1.0));
  const auto gain = [&](double log_saturation) { return contact(log_saturation).gain; };
  const Candidate saturated = contact(golden(centre - 0.7, centre + 0.7, 1e-4, gain));
  start.saturation = unlimited;
  const Candidate bare = best_contact(p, start);
  return saturated.gain > bare.gain ? saturated : bare;
}

}  // namespace needleforce::fit
