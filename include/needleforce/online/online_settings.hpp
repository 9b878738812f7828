// SPDX-License-Identifier: Apache-2.0
// How finely a motion is read, and how fast what was learnt of its texture is forgotten.
#pragma once

#include <array>

#include "../parameter.hpp"

namespace needleforce::online {

struct OnlineSettings {
  double spacing = 5e-5;
  double memory = 5e-3;
  double roughness = 0.02;
  double false_changes = 1e-3;

  static constexpr const char* name = "online";
  static constexpr const char* summary = "How parameters are learnt while a needle moves.";
  static constexpr std::array<Parameter<OnlineSettings>, 4> table{{
      {&OnlineSettings::spacing, "spacing", "m", 1e-6, 1e-2, 5e-5, "dz",
       "travel over which readings are averaged to one", "free"},
      {&OnlineSettings::memory, "memory", "m", 1e-4, 1.0, 5e-3, "l_m",
       "travel over which the size of the texture is forgotten", "free"},
      {&OnlineSettings::roughness, "roughness", "1", 1e-6, 1.0, 0.02, "r",
       "texture expected of an unknown tissue as a share of the force", "free"},
      {&OnlineSettings::false_changes, "false_changes", "1/m", 1e-12, 1e3, 1e-3, "c",
       "changes of the tissue that texture alone may make in a metre", "free"},
  }};
};

}  // namespace needleforce::online
