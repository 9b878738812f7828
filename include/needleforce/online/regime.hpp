// SPDX-License-Identifier: Apache-2.0
// What the needle does, as far as a force is expected of it.
#pragma once

#include <array>

namespace needleforce::online {

/// What the needle does, as far as a force is expected of it.
enum class Regime { unknown, free, contact, rupture, sliding, reversing, withdrawal, rest };
inline constexpr std::array<const char*, 8> regime_names{"unknown", "free",      "contact",    "rupture",
                                                         "sliding", "reversing", "withdrawal", "rest"};

}  // namespace needleforce::online
