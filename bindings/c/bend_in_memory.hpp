// SPDX-License-Identifier: Apache-2.0
// A needle that bends behind its pointer, of either kind, for its own face and that of its guard.
#pragma once

#include <algorithm>
#include <variant>

#include "in_memory.hpp"
#include "needleforce/solid/bent_in_solid.hpp"
#include "needleforce_bend.h"

struct nf_bend {
  std::variant<needleforce::bending::SpatialInsertion, needleforce::solid::BentInSolid<2>> needle;
};

namespace needleforce::c {

/// Calls `f` with the one of two that is there. Unlike std::visit it meets no variant without a value.
template <class First, class Second, class F>
auto with(std::variant<First, Second>& either, F f) noexcept {
  auto* first = std::get_if<First>(&either);
  return first ? f(*first) : f(*std::get_if<Second>(&either));
}
template <class First, class Second, class F>
auto with(const std::variant<First, Second>& either, F f) noexcept {
  const auto* first = std::get_if<First>(&either);
  return first ? f(*first) : f(*std::get_if<Second>(&either));
}

inline bending::Base base_of(const nf_base& base) noexcept {
  return {base.depth, {base.lateral[0], base.lateral[1]}, {base.tilt[0], base.tilt[1]}, base.roll};
}

inline nf_bent plain(const bending::BentSample& s) noexcept {
  nf_bent out{};
  std::copy(s.tip.begin(), s.tip.end(), out.tip);
  std::copy(s.tangent.begin(), s.tangent.end(), out.tangent);
  std::copy(s.wrench.begin(), s.wrench.end(), out.wrench);
  out.force = s.force;
  out.lateral = s.lateral;
  out.unsupported = s.unsupported;
  out.axial = plain(s.axial);
  out.status = int(s.status);
  out.buckled = s.buckled;
  return out;
}

}  // namespace needleforce::c
