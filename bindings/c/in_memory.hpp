// SPDX-License-Identifier: Apache-2.0
// What both faces of C share: the objects behind the pointers, and the memory of the caller.
#pragma once

#include "by_name.hpp"
#include "needleforce/insertion.hpp"
#include "needleforce/solid/condensed_insertion.hpp"

struct nf_insertion {
  needleforce::Insertion insertion;
};
struct nf_solid {
  needleforce::solid::CondensedInsertion insertion;
};

namespace needleforce::c {

inline nf_sample plain(const Sample& s) noexcept {
  return {
      s.depth,          s.velocity,          s.force,      s.stiffness,   s.friction, s.cutting,   s.lateral,
      s.force_by_depth, s.force_by_velocity, int(s.phase), int(s.status), s.contact,  s.punctured, s.exit};
}

}  // namespace needleforce::c
