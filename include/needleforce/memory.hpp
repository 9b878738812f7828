// SPDX-License-Identifier: Apache-2.0
// What friction and cutting remember between two steps: plain numbers, the same for every law, so that a
// snapshot is a copy.
#pragma once

#include "relaxation.hpp"

namespace needleforce {

/// Where a layer lies around the shaft [m]; the bottom is the surface of the next layer, or infinity.
struct LayerExtent {
  double top;
  double puncture;  ///< depth at which it gives way, or gave
  double bottom;
  bool pierced;
};

/// What a contact held when its layer gave way.
struct ContactAtPuncture {
  Element element;
  double force;   ///< [N]
  double energy;  ///< stored, without relaxation [J]
  double slope;   ///< dF/dh, without relaxation [N/m]
};

/// Friction along the shaft in one layer. A law uses what it needs.
struct Shaft {
  Element element{};                  ///< the tissue dragged along, before it slips
  double traction = 0.0;              ///< force per embedded length [N/m]
  double surface = 0.0;               ///< depth [m] where embedding starts
  double embedded = 0.0;              ///< [m]
  double embedded_by_depth = 0.0;     ///< d(embedded) / d(depth)
  double embedded_by_traction = 0.0;  ///< d(embedded) / d(traction) [m^2/N]
  double peak = 0.0;                  ///< force at puncture [N]
  double limit = 0.0;                 ///< traction of steady sliding at the last velocity [N/m]
  double weakening = 0.0;             ///< its derivative by velocity [N s/m^2]
  double dimple = 1.0;                ///< share of the surface's dimple that has not recovered
  bool slides = false;                ///< broken loose

  /// Lets go of the needle, which has left the tissue.
  void release() noexcept {
    element = Element{};
    traction = embedded = embedded_by_depth = embedded_by_traction = 0.0;
    slides = false;
  }

  /// Sets the embedded length between `from` and the tip or the bottom of the bed.
  void embed(const LayerExtent& bed, double depth, double from) noexcept {
    surface = from;
    const double length = (depth < bed.bottom ? depth : bed.bottom) - from;
    const bool inside = bed.pierced && length > 0.0;
    embedded = inside ? length : 0.0;
    embedded_by_depth = inside && depth < bed.bottom ? 1.0 : 0.0;
  }
};

/// Cutting at the tip. A law uses what it needs.
struct Cut {
  double entry = 0.0;          ///< depth [m] at which cutting began
  double retreat_limit = 0.0;  ///< depth [m] above which it can no longer push
  double front = 0.0;          ///< deepest cut, or tip of the crack [m]
  double opened = 0.0;         ///< share of the slit held open
  double speed = 0.0;          ///< of the crack's tip [m/s]
  bool running = false;        ///< the crack runs, or sticks
};

}  // namespace needleforce
