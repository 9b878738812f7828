// SPDX-License-Identifier: Apache-2.0
// How much of the sum of squares the model explains, for one contact depth and one puncture, in closed form.
//
// Given contact u0, saturation s and the number of samples before the puncture, the model is linear: c on the
// stiffness g between contact and puncture, and f', f_c on the insertion after it and on the withdrawal below
// u0. The two groups share no sample, hence
//   SSE = sum F² - gain,  gain = (Σ F g)² / Σ g²  +  gain of a straight line with a common slope.
// This is variable projection (Golub & Pereyra 1973) with the projection written out over running sums.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>

#include "stroke.hpp"

namespace needleforce::fit {

inline constexpr double unlimited = std::numeric_limits<double>::infinity();
inline constexpr double tiny = std::numeric_limits<double>::min();

/// Σ g² and Σ F g up to a puncture, as combinations of the moments before it.
struct StiffnessForm {
  double gg_sum = 0, gg_count = 0, gg_u1 = 0, gg_u2 = 0, gg_u3 = 0, gg_u4 = 0;
  double fg_sum = 0, fg_f0 = 0, fg_f1 = 0, fg_f2 = 0;

  template <class T>
  T gg(const MomentsOf<T>& m) const noexcept {
    return gg_sum + gg_count * m.count + gg_u1 * m.u1 + gg_u2 * m.u2 + gg_u3 * m.u3 + gg_u4 * m.u4;
  }
  template <class T>
  T fg(const MomentsOf<T>& m) const noexcept {
    return fg_sum + fg_f0 * m.f0 + fg_f1 * m.f1 + fg_f2 * m.f2;
  }
  /// The same form with given values at m: how one piece of g continues another.
  StiffnessForm from(double gg_before, double fg_before, const Moments& m) const noexcept {
    StiffnessForm form = *this;
    form.gg_sum += gg_before - gg(m);
    form.fg_sum += fg_before - fg(m);
    return form;
  }
};

/// g = (u - u0)², the cone.
inline StiffnessForm cone_form(double u0) noexcept {
  const double q = u0 * u0;
  return {0, q * q, -4 * q * u0, 6 * q, -4 * u0, 1, 0, q, -2 * u0, 1};
}

/// g = 2 s (u - u0) - s², the shank beyond the saturation depth s.
inline StiffnessForm shank_form(double u0, double s) noexcept {
  const double slope = 2 * s, offset = -(slope * u0 + s * s);
  return {0, offset * offset, 2 * slope * offset, slope * slope, 0, 0, 0, offset, slope, 0};
}

/// One trial contact depth: where contact starts, where the shank takes over, and what the line needs.
struct Trial {
  double u0 = 0;
  std::size_t start = 0;       // first sample past the contact
  std::size_t saturation = 0;  // first sample on the shank
  StiffnessForm cone, shank;
  Moments total;                                // of the insertion
  double withdrawal_hh = 0, withdrawal_fh = 0;  // Σ h², Σ F h of the withdrawal below u0

  const StiffnessForm& form(std::size_t puncture) const noexcept {
    return puncture > saturation ? shank : cone;
  }
};

inline Trial trial_at(const Series& insertion, const Series& withdrawal, double u0,
                      double saturation) noexcept {
  const std::size_t none = std::numeric_limits<std::size_t>::max();
  Trial trial{u0, insertion.passing(u0), none, {}, {}, insertion.total()};
  trial.cone = cone_form(u0).from(0, 0, insertion.before(trial.start));
  if (saturation < unlimited) {
    trial.saturation = insertion.passing(u0 + saturation);
    const Moments m = insertion.before(trial.saturation);
    trial.shank = shank_form(u0, saturation).from(trial.cone.gg(m), trial.cone.fg(m), m);
  }
  const Moments out = withdrawal.before(withdrawal.passing(u0));
  trial.withdrawal_hh = out.u2 - 2 * u0 * out.u1 + u0 * u0 * out.count;
  trial.withdrawal_fh = out.f1 - u0 * out.f0;
  return trial;
}

template <class T>
T at_least(T value, double bound) noexcept {
  return value > bound ? value : T{} + bound;
}

/// Gain of the stiffness for a puncture after the samples of m. Coefficients below zero are unphysical:
/// there, as for the line, the constrained optimum zero is what counts.
template <class T>
T stiffness_gain(const StiffnessForm& form, const MomentsOf<T>& m) noexcept {
  const T fg = at_least(form.fg(m), 0);
  return fg * fg / at_least(form.gg(m), tiny);
}

/// Common line of the insertion after the samples of m and the withdrawal.
template <class T>
struct Line {
  T slope, offset, gain;
};

/// Sums after the puncture; h is the embedded length, counted from the contact depth u0.
template <class T>
Line<T> line_after(const Trial& trial, const MomentsOf<T>& m) noexcept {
  const T n = trial.total.count - m.count, x = trial.total.u1 - m.u1, y = trial.total.f0 - m.f0;
  const T h = x - trial.u0 * n, mean = y / n;
  const T hh = trial.total.u2 - m.u2 - trial.u0 * (x + h) + trial.withdrawal_hh;
  const T fh = trial.total.f1 - m.f1 - trial.u0 * y - trial.withdrawal_fh;
  const T rise = at_least(fh - h * mean, 0), slope = rise / at_least(hh - h * (h / n), tiny);
  return {slope, (y - slope * h) / n, y * mean + slope * rise};
}

template <class T>
T gain_of(const Trial& trial, const StiffnessForm& form, const MomentsOf<T>& m) noexcept {
  return stiffness_gain(form, m) + line_after(trial, m).gain;
}

}  // namespace needleforce::fit
