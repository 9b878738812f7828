// SPDX-License-Identifier: Apache-2.0
// The one list of tips: rigid axisymmetric profiles with Sneddon's contact for a reduced modulus of 1.
#pragma once

#include <variant>

#include "dispatch.hpp"
#include "parameter.hpp"
#include "tips/blunted_cone.hpp"
#include "tips/cone.hpp"
#include "tips/flat.hpp"
#include "tips/lancet_bevel.hpp"
#include "tips/paraboloid.hpp"
#include "tips/power_profile.hpp"
#include "tips/profile.hpp"
#include "tips/sphere.hpp"
#include "tips/tangent_ogive.hpp"
#include "tips/truncated_cone.hpp"

namespace needleforce {

/// Every tip; docs/maintainers/adding_a_law.md, "A tip", has the places for a new one.
using Tip = std::variant<tips::Cone, tips::Paraboloid, tips::Sphere, tips::Flat, tips::PowerProfile,
                         tips::TruncatedCone, tips::BluntedCone, tips::TangentOgive, tips::LancetBevel,
                         tips::Profile>;

/// Which parameters of a tip, or of a law that has one as `tip`, contradict each other.
template <class T>
tips::Flaw flaw_of(const T& value) noexcept {
  if constexpr (requires { value.flaw(); })
    return value.flaw();
  else
    return {};
}

/// True if every parameter of a tip is in its range and none contradicts another.
inline bool valid(const Tip& tip) noexcept {
  return dispatch(tip, [](const auto& shape) {
    if constexpr (requires { shape.table; })
      if (first_invalid(shape)) return false;
    return flaw_of(shape).limit == nullptr;
  });
}

}  // namespace needleforce
