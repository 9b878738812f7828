// SPDX-License-Identifier: Apache-2.0
// The C face of the insertion. Needs no C++ run-time library when compiled with -fno-exceptions -fno-rtti.
#include "needleforce.h"

#include <array>
#include <cstring>
#include <new>
#include <type_traits>

#include "in_memory.hpp"
#include "settings_by_name.hpp"

using namespace needleforce;

static_assert(NF_EXTRACTION == int(Phase::extraction) && std::size(phase_names) == NF_EXTRACTION + 1);
static_assert(NF_NOT_FINITE == int(Status::not_finite) && std::size(status_names) == NF_NOT_FINITE + 1);
static_assert(NF_NO_VELOCITY == no_velocity);
static_assert(std::is_standard_layout_v<nf_sample> && std::is_trivially_copyable_v<nf_sample>);
static_assert(std::is_standard_layout_v<nf_layer> && std::is_trivially_copyable_v<nf_layer>);

extern "C" {

const char* nf_version(void) { return version; }
int nf_abi_version(void) { return NF_ABI_VERSION; }
const char* nf_phase_name(int phase) {
  return phase >= 0 && phase <= NF_EXTRACTION ? phase_names[phase] : "unknown";
}
const char* nf_status_name(int status) {
  return status >= 0 && status <= NF_NOT_FINITE ? status_names[status] : "unknown";
}

nf_settings nf_default_settings(void) { return c::default_settings(); }

size_t nf_size(void) { return sizeof(nf_insertion); }

nf_insertion* nf_init(void* memory, size_t size, const nf_layer* named, size_t count,
                      const nf_settings* settings, nf_fault* why) {
  nf_fault ignored{};
  nf_fault& fault = why ? *why : ignored;
  fault = nf_fault{};
  const nf_settings chosen = settings ? *settings : c::default_settings();
  std::array<Layer, max_layers> layers{};
  if (!c::holds<nf_insertion>(memory, size, fault) || !c::in_range(c::limits_of(chosen), fault) ||
      !c::in_range(c::bevel_of(chosen), fault) || !c::read_layers(named, count, layers, fault))
    return nullptr;
  return new (memory)
      nf_insertion{Insertion({layers.data(), count}, c::limits_of(chosen), c::bevel_of(chosen))};
}

void nf_step(nf_insertion* self, double depth, double velocity, double dt, nf_sample* out) {
  *out = c::plain(self->insertion.step(depth, velocity, dt));
}

void nf_reset(nf_insertion* self) { self->insertion.reset(); }

size_t nf_snapshot_size(void) { return sizeof(Insertion::Saved); }

int nf_snapshot(const nf_insertion* self, void* bytes, size_t size) {
  if (!bytes || size < sizeof(Insertion::Saved)) return 0;
  const Insertion::Saved saved = self->insertion.save();
  std::memcpy(bytes, &saved, sizeof saved);
  return 1;
}

int nf_restore(nf_insertion* self, const void* bytes, size_t size) {
  if (!bytes || size < sizeof(Insertion::Saved)) return 0;
  Insertion::Saved saved;
  std::memcpy(&saved, bytes, sizeof saved);
  return self->insertion.restore(saved);
}

}  // extern "C"
