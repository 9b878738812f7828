// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "../law.hpp"

namespace needleforce::laws {

/// What the dashpots do while the tip advances: they move; they lock, which takes no energy and gives none;
/// or what had faded is restored, as fitted to recordings, which may return energy. Over one insertion with
/// one hold, the last two are the same.
enum class Dashpots { move, lock, restore };

/// Relaxation of the elastic forces by a Prony series,
///
///     G(t) = 1 - sum g_j + sum g_j exp(-t / tau_j)
///
/// over the contact before the puncture and the tissue dragged along after it, updated exactly for a load
/// that comes evenly over a step.
template <Dashpots dashpots, class Real>
struct BasicPronySeries {
  Real share_1;
  Real time_1;
  Real share_2;
  Real time_2;

  static constexpr bool locks = dashpots == Dashpots::lock, restores = dashpots == Dashpots::restore;
  static constexpr bool only_at_rest = locks || restores;
  static constexpr const char* name = locks ? "prony_locked" : restores ? "prony_at_rest" : "prony";
  static constexpr Family family = Family::relaxation;
  static constexpr bool first_order = true;            // slip in a step is counted after what relaxes in it
  static constexpr bool may_return_energy = restores;  // what an advance restores, nobody has paid for
  static constexpr const char* summary =
      locks ? "Prony series that acts only while the tip does not advance, and restores nothing; passive."
      : restores ? "Prony series that acts only while the tip does not advance."
                 : "Prony series with one or two time constants.";
  static constexpr const char* source =
      only_at_rest ? "layered law; Fung 1993, sec. 7.6" : "Fung 1993, sec. 7.6, quasi-linear";
  static constexpr const char* validity =
      locks      ? "Insertion, hold, withdrawal. Recordings at one speed cannot distinguish it from prony."
      : restores ? "Insertion, hold, withdrawal. Recordings at one speed cannot distinguish the two forms."
                 : "Holds and speeds between those it was fitted to.";
  static constexpr std::array<Parameter<BasicPronySeries, Real>, 4> table{{
      {&BasicPronySeries::share_1, "share_1", "1", 0.0, 0.99, required, "g_1",
       "share of the elastic force that relaxes with the first time constant", "Fung 1993"},
      {&BasicPronySeries::time_1, "time_1", "s", 1e-6, 1e6, required, "tau_1", "first time constant",
       "Fung 1993"},
      {&BasicPronySeries::share_2, "share_2", "1", 0.0, 0.99, 0.0, "g_2",
       "share that relaxes with the second time constant; 0 for a single one", "Fung 1993"},
      {&BasicPronySeries::time_2, "time_2", "s", 1e-6, 1e6, 5.0, "tau_2", "second time constant",
       "Fung 1993"},
  }};

  const char* contradiction() const noexcept {
    return share_1 + share_2 < 1.0 ? nullptr : "share_1 + share_2 reaches 1: no elastic force would stay";
  }

  struct Prepared {
    Real share[2], time[2];

    /// exp and its mean over the step; the mean does not cancel at small dt, nor divide 0 by 0.
    BasicRelaxing<Real> over(double dt) const noexcept {
      BasicRelaxing<Real> relaxing{.lasting = 1.0 - share[0] - share[1],
                                   .relaxes = true,
                                   .only_at_rest = BasicPronySeries::only_at_rest,
                                   .restores = BasicPronySeries::restores};
      for (int j = 0; j < 2; ++j) {
        const Real x = dt / time[j], fallen = -expm1(-x);
        relaxing.share[j] = share[j];
        relaxing.left[j] = 1.0 - fallen;
        relaxing.during[j] = x > 1e-300 ? fallen / x : 1.0;
      }
      return relaxing;
    }
  };
  Prepared prepare() const noexcept { return {{share_1, share_2}, {time_1, time_2}}; }
};

template <Dashpots dashpots>
using PronySeries = BasicPronySeries<dashpots, double>;
using Prony = PronySeries<Dashpots::move>;
using PronyLocked = PronySeries<Dashpots::lock>;
using PronyAtRest = PronySeries<Dashpots::restore>;

}  // namespace needleforce::laws
