// SPDX-License-Identifier: Apache-2.0
// The version of needleforce, stated here and read by every build.
#pragma once

namespace needleforce {

inline constexpr const char* version = "0.2.0";

}  // namespace needleforce
