// SPDX-License-Identifier: Apache-2.0
// Models and settings from the bytes of a fuzzer.
#pragma once

#include <vector>

#include "bytes.hpp"
#include "needleforce/guard.hpp"
#include "needleforce/insertion.hpp"

namespace from_bytes {

struct MakeLaw {
  template <class L>
  L operator()(Bytes& bytes) const {
    L law = numbers_of<L>(bytes);
    if constexpr (requires { law.tip; }) law.tip = one_of(bytes, static_cast<Tip*>(nullptr), MakeTip{});
    return law;
  }
};

template <class Laws>
Laws laws_of(Bytes& bytes) {
  return one_of(bytes, static_cast<Laws*>(nullptr), MakeLaw{});
}

/// One to eight layers, seldom none or nine.
inline std::vector<Layer> layers(Bytes& bytes) {
  const std::size_t kind = bytes.take<std::uint8_t>();
  const std::size_t count = kind == 255 ? 0 : kind == 254 ? max_layers + 1 : 1 + kind % max_layers;
  std::vector<Layer> stack(count);
  double top = 0.0;
  for (Layer& layer : stack) {
    layer = {top,
             {laws_of<Stiffness>(bytes), laws_of<Puncture>(bytes), laws_of<Friction>(bytes),
              laws_of<Cutting>(bytes), laws_of<Relaxation>(bytes)}};
    top += bytes.number(1e-6, 1e-1);
  }
  return stack;
}

inline Limits limits(Bytes& bytes) {
  if (bytes.below(2) == 0) return {};
  Limits limits{bytes.number(1e-3, 1e9), bytes.number(0.0, 1.0), bytes.number(0.0, 1.0),
                bytes.number(0.0, 1.0)};
  if (bytes.below(2) == 0) limits.depth_noise = bytes.number(0.0, 1e-3);
  return limits;
}

inline Bevel bevel(Bytes& bytes) { return bytes.below(2) == 0 ? Bevel{} : numbers_of<Bevel>(bytes); }

/// Whole delays, and an energy controller now and then.
inline GuardSettings guard_settings(Bytes& bytes) {
  if (bytes.below(2) == 0) return {};
  GuardSettings settings;
  for (const auto& row : std::span(GuardSettings::table).first(GuardSettings::settings_of_a_depth))
    settings.*row.member = bytes.number(row.low, row.high);
  settings.delay = bytes.number(0.0, 0.0) + static_cast<double>(bytes.below(max_delay + 2));
  if (bytes.below(2) == 0) settings.max_speed = settings.max_acceleration = unlimited;
  return settings;
}

}  // namespace from_bytes
