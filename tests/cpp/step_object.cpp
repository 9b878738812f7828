// SPDX-License-Identifier: Apache-2.0
// One step as a controller would call it; its undefined symbols are checked against an allow-list.
#include "needleforce/insertion.hpp"

extern "C" double needleforce_one_step(needleforce::Insertion* insertion, double depth, double velocity,
                                       double dt) {
  return insertion->step(depth, velocity, dt).force;
}
