// SPDX-License-Identifier: Apache-2.0
// Settings and layers of a C program, checked.
#pragma once

#include <array>
#include <cstddef>

#include "by_name.hpp"
#include "needleforce/bevel.hpp"
#include "needleforce/limits.hpp"
#include "needleforce/model.hpp"

namespace needleforce::c {

inline nf_settings default_settings() noexcept {
  const Limits limits;
  const Bevel bevel;
  return {limits.max_speed, limits.hold_time,           limits.velocity_slack, limits.velocity_slack_ratio,
          bevel.half_angle, bevel.friction_coefficient, bevel.face_share,      limits.depth_noise};
}
inline Limits limits_of(const nf_settings& s) noexcept {
  return {s.max_speed, s.velocity_slack, s.velocity_slack_ratio, s.hold_time, s.depth_noise};
}
inline Bevel bevel_of(const nf_settings& s) noexcept {
  return {s.bevel_half_angle, s.bevel_friction_coefficient, s.bevel_face_share};
}

template <class T>
bool in_range(const T& value, nf_fault& why) noexcept {
  const auto* bad = first_invalid(value);
  return !bad ||
         refuse(why, T::name, bad->name, "is outside its range", value.*bad->member, bad->low, bad->high);
}

inline bool read_layers(const nf_layer* named, std::size_t count, std::array<Layer, max_layers>& layers,
                        nf_fault& why) noexcept {
  if (!named) return refuse(why, "layers", "layers", "are missing");
  if (count < 1 || count > max_layers)
    return refuse(why, "layers", "count", "is outside its range", double(count), 1.0, double(max_layers));
  for (why.layer = 0; why.layer < count; ++why.layer)
    if (!read_layer(named[why.layer], layers[why.layer], why)) {
      if (!why.law) why.law = "layer";  // a law without a name; the caller prints it
      return false;
    }
  const Fault fault = first_fault({layers.data(), count});
  why.layer = fault.layer;
  const double top = same(fault.quantity, "top") ? layers[fault.layer].top : 0.0;
  return !fault.reason || refuse(why, "layer", fault.quantity, fault.reason, top);
}

}  // namespace needleforce::c
