// SPDX-License-Identifier: Apache-2.0
// What a law is: a parameter table, a family, a source, and the range in which it may be believed.
#pragma once

#include <type_traits>

#include "parameter.hpp"

namespace needleforce {

/// The part of the force a law gives.
enum class Family { stiffness, puncture, friction, cutting };
inline constexpr const char* family_names[] = {"stiffness", "puncture", "friction", "cutting"};

template <class L>
concept Law = Parameterised<L> && std::is_trivially_copyable_v<L> && requires {
  { L::family } -> std::convertible_to<Family>;
  { L::source } -> std::convertible_to<const char*>;
  { L::validity } -> std::convertible_to<const char*>;
};

}  // namespace needleforce
