// SPDX-License-Identifier: Apache-2.0
// How much of the sum of squares the model explains, for one contact depth and one puncture, in closed form.
//
// Given contact u0, saturation s and the number of samples before the puncture, the model is linear: c on the
// stiffness g between contact and puncture, f' and f_c on the insertion after it and on the withdrawal below
// u0, and the sensor's zero b on every sample. f_c and b of the insertion after the puncture act as one
// constant, which leaves three unknowns; given b, c and f' share no sample. This is variable projection
// (Golub & Pereyra 1973) with the projection written out over running sums.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>

#include "stroke.hpp"

namespace needleforce::fit {

inline constexpr double unlimited = std::numeric_limits<double>::infinity();
inline constexpr double tiny = std::numeric_limits<double>::min();

/// Σ g², Σ g and Σ F g up to a puncture, as combinations of the moments before it.
struct StiffnessForm {
  double gg_sum = 0, gg_count = 0, gg_u1 = 0, gg_u2 = 0, gg_u3 = 0, gg_u4 = 0;
  double g_sum = 0;                                    // Σ g at the form's start
  double fg_sum = 0, fg_f0 = 0, fg_f1 = 0, fg_f2 = 0;  // g in powers of u: of Σ g too

  template <class T>
  T gg(const MomentsOf<T>& m) const noexcept {
    return gg_sum + gg_count * m.count + gg_u1 * m.u1 + gg_u2 * m.u2 + gg_u3 * m.u3 + gg_u4 * m.u4;
  }
  template <class T>
  T fg(const MomentsOf<T>& m) const noexcept {
    return fg_sum + fg_f0 * m.f0 + fg_f1 * m.f1 + fg_f2 * m.f2;
  }
  template <class T>
  T g(const MomentsOf<T>& m) const noexcept {
    return g_sum + fg_f0 * m.count + fg_f1 * m.u1 + fg_f2 * m.u2;
  }
  /// The same form continuing `before` at m: how one piece of g follows another.
  StiffnessForm after(const StiffnessForm& before, const Moments& m) const noexcept {
    StiffnessForm form = *this;
    form.gg_sum += before.gg(m) - gg(m);
    form.g_sum += before.g(m) - g(m);
    form.fg_sum += before.fg(m) - fg(m);
    return form;
  }
};

/// g = (u - u0)², the cone.
inline StiffnessForm cone_form(double u0) noexcept {
  const double q = u0 * u0;
  return {0, q * q, -4 * q * u0, 6 * q, -4 * u0, 1, 0, 0, q, -2 * u0, 1};
}

/// g = 2 s (u - u0) - s², the shank beyond the saturation depth s.
inline StiffnessForm shank_form(double u0, double s) noexcept {
  const double slope = 2 * s, offset = -(slope * u0 + s * s);
  return {0, offset * offset, 2 * slope * offset, slope * slope, 0, 0, 0, 0, offset, slope, 0};
}

/// One trial contact depth: where contact starts, where the shank takes over, and what the line needs.
struct Trial {
  double u0 = 0;
  std::size_t start = 0;       // first sample past the contact
  std::size_t saturation = 0;  // first sample on the shank
  StiffnessForm cone, shank;
  Moments total;                                                  // of the insertion
  double withdrawal_h = 0, withdrawal_hh = 0, withdrawal_fh = 0;  // Σ h, Σ h², Σ F h below u0
  double withdrawal_count = 0, withdrawal_f = 0;                  // of the whole withdrawal

  const StiffnessForm& form(std::size_t puncture) const noexcept {
    return puncture > saturation ? shank : cone;
  }
};

inline Trial trial_at(const Series& insertion, const Series& withdrawal, double u0,
                      double saturation) noexcept {
  const std::size_t none = std::numeric_limits<std::size_t>::max();
  Trial trial{u0, insertion.passing(u0), none, {}, {}, insertion.total()};
  trial.cone = cone_form(u0).after({}, insertion.before(trial.start));
  if (saturation < unlimited) {
    trial.saturation = insertion.passing(u0 + saturation);
    const Moments m = insertion.before(trial.saturation);
    trial.shank = shank_form(u0, saturation).after(trial.cone, m);
  }
  const Moments out = withdrawal.before(withdrawal.passing(u0));
  trial.withdrawal_h = out.u1 - u0 * out.count;
  trial.withdrawal_hh = out.u2 - 2 * u0 * out.u1 + u0 * u0 * out.count;
  trial.withdrawal_fh = out.f1 - u0 * out.f0;
  trial.withdrawal_count = withdrawal.total().count, trial.withdrawal_f = withdrawal.total().f0;
  return trial;
}

template <class T>
T at_least(T value, double bound) noexcept {
  return chosen(value > bound, value, T{} + bound);
}

/// The linear coefficients: stiffness c, friction f' (both scaled), f_c and b, and what they explain.
template <class T>
struct Coefficients {
  T stiffness, friction, cutting, offset, gain;
};

/// The coefficients for samples up to the moments m before the puncture and from `until` on after it (the
/// samples between them are left out); `form` is the stiffness at m. c and f' below zero are unphysical:
/// there the constrained optimum zero is what counts, to the precision that a search needs.
template <class T>
Coefficients<T> coefficients(const Trial& trial, const StiffnessForm& form, const MomentsOf<T>& m,
                             const MomentsOf<T>& until) noexcept {
  const T n = trial.total.count - until.count, x = trial.total.u1 - until.u1, y = trial.total.f0 - until.f0;
  const T h = x - trial.u0 * n, mean = y / n;
  const T hh =
      at_least(trial.total.u2 - until.u2 - trial.u0 * (x + h) - h * (h / n) + trial.withdrawal_hh, tiny);
  const T fh = trial.total.f1 - until.f1 - trial.u0 * y - h * mean - trial.withdrawal_fh;
  // u is at most 1 in size: below this, sums of its fourth powers are rounding errors, and g is none
  const T rounding = 1e-12 * (m.count + 1.0), exact = form.gg(m),
          gg = chosen(exact > rounding, exact, rounding);
  const T shown = chosen(exact > rounding, T{} + 1.0, T{}), g = shown * form.g(m), fg = shown * form.fg(m);
  const T f_sum = m.f0 + trial.withdrawal_f, count = at_least(m.count + trial.withdrawal_count, tiny);
  const T enough = 1e-12 * count;
  T b_weight = count - g * (g / gg) - trial.withdrawal_h * (trial.withdrawal_h / hh);
  T b =
      (f_sum - g * (fg / gg) + trial.withdrawal_h * (fh / hh)) / chosen(b_weight > enough, b_weight, enough);
  const T with_c = chosen(fg - b * g > 0.0, T{} + 1.0, T{}),
          with_f = chosen(fh + b * trial.withdrawal_h > 0.0, T{} + 1.0, T{});
  b_weight = count - with_c * g * (g / gg) - with_f * trial.withdrawal_h * (trial.withdrawal_h / hh);
  const T level = f_sum - with_c * g * (fg / gg) + with_f * trial.withdrawal_h * (fh / hh);
  b_weight = chosen(b_weight > enough, b_weight, enough), b = level / b_weight;
  const T c = with_c * (fg - b * g) / gg, slope = with_f * (fh + b * trial.withdrawal_h) / hh;
  const T gain = with_c * fg * (fg / gg) + with_f * fh * (fh / hh) + b * level + y * mean;
  return {c, slope, (y - slope * h) / n - b, b, gain};
}

template <class T>
T gain_of(const Trial& trial, const StiffnessForm& form, const MomentsOf<T>& m) noexcept {
  return coefficients(trial, form, m, m).gain;
}

}  // namespace needleforce::fit
