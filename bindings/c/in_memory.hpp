// SPDX-License-Identifier: Apache-2.0
// What both faces of C share: the objects behind the pointers, and the memory of the caller.
#pragma once

#include <cstddef>
#include <cstdint>

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

/// True if this memory can hold a T; otherwise false and `why`.
template <class T>
bool holds(const void* memory, std::size_t size, nf_fault& why) noexcept {
  static_assert(alignof(T) <= alignof(double));
  if (!memory || size < sizeof(T))
    return refuse(why, "memory", "size", "is less than what it needs", double(size), double(sizeof(T)));
  if (reinterpret_cast<std::uintptr_t>(memory) % alignof(T))
    return refuse(why, "memory", "address", "is not aligned as a double");
  return true;
}

inline nf_sample plain(const Sample& s) noexcept {
  return {
      s.depth,          s.velocity,          s.force,      s.stiffness,   s.friction, s.cutting,   s.lateral,
      s.force_by_depth, s.force_by_velocity, int(s.phase), int(s.status), s.contact,  s.punctured, s.exit};
}

}  // namespace needleforce::c
