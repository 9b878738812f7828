// SPDX-License-Identifier: Apache-2.0
// What is wrong with a prior, before the loop relies on it.
#pragma once

#include <array>
#include <cmath>

#include "../laws/tip_contact.hpp"
#include "online_prior.hpp"

namespace needleforce::online {

/// What may be expected of a layer, in the order of the bindings: its largest value and standard deviation.
struct ExpectedLimit {
  const char* name;
  Expected LayerPrior::* member;
  double most;
};
inline constexpr std::array<ExpectedLimit, 6> expected_limits{{{"modulus", &LayerPrior::modulus, 1e12},
                                                               {"cutting", &LayerPrior::cutting, 1e6},
                                                               {"friction", &LayerPrior::friction, 1e9},
                                                               {"top", &LayerPrior::top, 1e3},
                                                               {"puncture", &LayerPrior::puncture, 1e3},
                                                               {"remainder", &LayerPrior::remainder, 1e3}}};

/// The first quantity of a prior that is impossible; `limit` is nullptr if none is. Wait-free.
inline tips::Flaw flaw_of(const OnlinePrior& prior) noexcept {
  constexpr double least = 1e-30;  // a standard deviation below that has no inverse that can be squared
  const laws::TipContact contact{1.0, prior.radius, prior.tip};
  if (prior.layers > most_layers)
    return {"punctures", -1, static_cast<double>(prior.layers), "more than 8", "Expect 8 at most."};
  if (first_invalid(contact))
    return {"radius", -1, prior.radius, "outside 1e-6 to 0.1 m", "Give the radius of the shank in m."};
  if (const tips::Flaw flaw = contact.flaw(); flaw.limit) return flaw;
  for (std::size_t k = 0; k < most_layers; ++k)
    for (const ExpectedLimit& each : expected_limits) {
      const auto [mean, sd] = prior.layer[k].*each.member;
      const int layer = static_cast<int>(k);
      if (!(std::abs(mean) <= each.most))
        return {each.name, layer, mean, "not finite, or of no tissue", "Give its mean in SI units."};
      if (sd != 0.0 && !(sd >= least * each.most && sd <= each.most))
        return {each.name, layer, sd, "no standard deviation of it", "Give one above 0, or 0 if unknown."};
    }
  const EarlierInsertions& earlier = prior.earlier;
  if (earlier.spacing == 0.0) return {};
  if (!(earlier.spacing >= 1e-9 && earlier.spacing <= 1.0))
    return {"spacing", -1, earlier.spacing, "outside 1e-9 to 1 m", "Give 0 without earlier insertions."};
  for (std::size_t i = 0; i < EarlierInsertions::points; ++i) {
    const int place = static_cast<int>(i);
    if (!(std::abs(earlier.mean[i]) <= 1e6))
      return {"earlier mean", place, earlier.mean[i], "not finite, or of no needle", "Give forces in N."};
    if (!(earlier.sd[i] >= 0.0 && earlier.sd[i] <= 1e6))
      return {"earlier sd", place, earlier.sd[i], "no standard deviation", "Give 0 or more, in N."};
  }
  return {};
}

}  // namespace needleforce::online
