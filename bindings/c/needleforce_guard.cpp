// SPDX-License-Identifier: Apache-2.0
#include "needleforce_guard.h"

#include <new>
#include <type_traits>
#include <variant>

#include "bend_in_memory.hpp"
#include "needleforce/base_guard.hpp"

using namespace needleforce;
using solid::CondensedInsertion;
using InLayers = bending::SpatialInsertion;
using InSolid = solid::BentInSolid<2>;

struct nf_guard {
  std::variant<Guard<Insertion&>, Guard<CondensedInsertion&>> guard;
};
struct nf_base_guard {
  std::variant<Guard<InLayers&>, Guard<InSolid&>> guard;
};

namespace {

bool read(const nf_parameter* parameters, std::size_t count, std::size_t axes, GuardSettings& settings,
          nf_fault& why) noexcept {
  if (!parameters && count) return c::refuse(why, "guard", "settings", "are missing");
  if (!c::fill(settings, std::span(parameters, count), why)) return false;
  const GuardFault fault = first_fault(settings, axes);
  return !fault.reason || c::refuse(why, "guard", fault.quantity, fault.reason);
}

int bits(const Interventions& did) noexcept {
  return did.rejected * NF_REJECTED + did.stale * NF_STALE + did.clamped * NF_CLAMPED +
         did.slewed * NF_SLEWED + did.limited_by_energy * NF_LIMITED_BY_ENERGY +
         did.outside_bounds * NF_OUTSIDE_BOUNDS;
}

nf_output plain(const Output& o) noexcept {
  return {o.force, o.energy, o.reserve, bits(o.did), c::plain(o.sample)};
}
nf_base_output plain(const BaseOutput& o) noexcept {
  const BaseForce& f = o.force;
  return {{f.depth, {f.lateral[0], f.lateral[1]}, {f.tilt[0], f.tilt[1]}, f.roll},
          o.energy,
          o.reserve,
          bits(o.did),
          c::plain(o.sample)};
}

/// A guard of a kind around `engine`, which has the name for a fault.
template <class Made, std::size_t axes, class Engine>
Made* made(void* memory, size_t size, Engine* engine, const char* name, const nf_parameter* parameters,
           size_t count, nf_fault* why) noexcept {
  nf_fault ignored{};
  nf_fault& fault = why ? *why : ignored;
  fault = nf_fault{};
  GuardSettings settings;
  if (!engine && !c::refuse(fault, "guard", name, "is missing")) return nullptr;
  if (!c::holds<Made>(memory, size, fault) || !read(parameters, count, axes, settings, fault)) return nullptr;
  if constexpr (axes == axes_of_a_depth) {
    return new (memory) Made{Guard<decltype(engine->insertion)&>(engine->insertion, settings)};
  } else {
    return c::with(engine->needle, [&](auto& needle) noexcept {
      return new (memory) Made{Guard<std::remove_reference_t<decltype(needle)>&>(needle, settings)};
    });
  }
}

}  // namespace

extern "C" {

size_t nf_guard_size(void) { return sizeof(nf_guard); }
nf_guard* nf_guard_init(void* memory, size_t size, nf_insertion* insertion, const nf_parameter* parameters,
                        size_t count, nf_fault* why) {
  return made<nf_guard, axes_of_a_depth>(memory, size, insertion, "insertion", parameters, count, why);
}
nf_guard* nf_guard_init_in_solid(void* memory, size_t size, nf_solid* solid, const nf_parameter* parameters,
                                 size_t count, nf_fault* why) {
  return made<nf_guard, axes_of_a_depth>(memory, size, solid, "solid", parameters, count, why);
}
void nf_guard_step(nf_guard* self, double depth, double velocity, double dt, nf_output* output) {
  *output =
      c::with(self->guard, [&](auto& guard) noexcept { return plain(guard.step(depth, velocity, dt)); });
}
void nf_guard_miss(nf_guard* self, double dt, nf_output* output) {
  *output = c::with(self->guard, [&](auto& guard) noexcept { return plain(guard.miss(dt)); });
}
void nf_guard_reset(nf_guard* self) {
  c::with(self->guard, [](auto& guard) noexcept { guard.reset(); });
}

size_t nf_base_guard_size(void) { return sizeof(nf_base_guard); }
nf_base_guard* nf_base_guard_init(void* memory, size_t size, nf_bend* needle, const nf_parameter* parameters,
                                  size_t count, nf_fault* why) {
  return made<nf_base_guard, axes_of_a_base>(memory, size, needle, "needle", parameters, count, why);
}
void nf_base_guard_step(nf_base_guard* self, const nf_base* base, double dt, nf_base_output* output) {
  *output =
      c::with(self->guard, [&](auto& guard) noexcept { return plain(guard.step(c::base_of(*base), dt)); });
}
void nf_base_guard_miss(nf_base_guard* self, double dt, nf_base_output* output) {
  *output = c::with(self->guard, [&](auto& guard) noexcept { return plain(guard.miss(dt)); });
}
void nf_base_guard_reset(nf_base_guard* self) {
  c::with(self->guard, [](auto& guard) noexcept { guard.reset(); });
}

}  // extern "C"
