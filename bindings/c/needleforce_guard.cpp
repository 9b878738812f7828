// SPDX-License-Identifier: Apache-2.0
#include "needleforce_guard.h"

#include <new>

#include "in_memory.hpp"
#include "needleforce/guard.hpp"

using namespace needleforce;

struct nf_guard {
  Guard<Insertion&> guard;
};

namespace {

bool read(const nf_parameter* parameters, std::size_t count, GuardSettings& settings,
          nf_fault& why) noexcept {
  if (!parameters && count) return c::refuse(why, "guard", "settings", "are missing");
  if (!c::fill(settings, std::span(parameters, count), why)) return false;
  const GuardFault fault = first_fault(settings);
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

}  // namespace

extern "C" {

size_t nf_guard_size(void) { return sizeof(nf_guard); }

nf_guard* nf_guard_init(void* memory, size_t size, nf_insertion* insertion, const nf_parameter* parameters,
                        size_t count, nf_fault* why) {
  nf_fault ignored{};
  nf_fault& fault = why ? *why : ignored;
  fault = nf_fault{};
  GuardSettings settings;
  if (!insertion && !c::refuse(fault, "guard", "insertion", "is missing")) return nullptr;
  if (!c::holds<nf_guard>(memory, size, fault) || !read(parameters, count, settings, fault)) return nullptr;
  return new (memory) nf_guard{Guard<Insertion&>(insertion->insertion, settings)};
}

void nf_guard_step(nf_guard* self, double depth, double velocity, double dt, nf_output* output) {
  *output = plain(self->guard.step(depth, velocity, dt));
}
void nf_guard_miss(nf_guard* self, double dt, nf_output* output) { *output = plain(self->guard.miss(dt)); }
void nf_guard_reset(nf_guard* self) { self->guard.reset(); }

}  // extern "C"
