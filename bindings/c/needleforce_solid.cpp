// SPDX-License-Identifier: Apache-2.0
#include "needleforce_solid.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <span>

#include "in_memory.hpp"
#include "settings_by_name.hpp"

using namespace needleforce;
using solid::CondensedInsertion;

namespace {

bool read_table(double spacing, std::size_t nodes, const double* compliance, solid::CondensedTissue& tissue,
                nf_fault& why) noexcept {
  const std::size_t most = solid::max_path_nodes;
  if (!compliance) return c::refuse(why, "solid", "compliance", "is missing");
  if (nodes < 2 || nodes > most)
    return c::refuse(why, "solid", "nodes", "is outside its range", double(nodes), 2.0, double(most));
  tissue.nodes = nodes;
  tissue.spacing = spacing;
  for (std::size_t i = 0; i < nodes; ++i)
    std::copy(compliance + i * nodes, compliance + (i + 1) * nodes,
              tissue.compliance.begin() + long(i * most));
  return true;
}

}  // namespace

extern "C" {

size_t nf_solid_size(void) { return sizeof(nf_solid); }

nf_solid* nf_solid_init(void* memory, size_t size, const nf_layer* named, size_t count,
                        const nf_settings* settings, double spacing, size_t nodes, const double* compliance,
                        nf_fault* why) {
  nf_fault ignored{};
  nf_fault& fault = why ? *why : ignored;
  fault = nf_fault{};
  const nf_settings chosen = settings ? *settings : c::default_settings();
  std::array<Layer, max_layers> layers{};
  solid::CondensedTissue tissue;
  if (!c::holds<nf_solid>(memory, size, fault) || !c::in_range(c::limits_of(chosen), fault) ||
      !c::in_range(c::bevel_of(chosen), fault) || !c::read_layers(named, count, layers, fault) ||
      !read_table(spacing, nodes, compliance, tissue, fault))
    return nullptr;
  const std::span<const Layer> stack(layers.data(), count);
  if (const char* reason = CondensedInsertion::fault(tissue, stack)) {
    c::refuse(fault, "solid", "compliance or friction", reason);
    return nullptr;
  }
  return new (memory) nf_solid{CondensedInsertion(tissue, stack, c::limits_of(chosen), c::bevel_of(chosen))};
}

void nf_solid_step(nf_solid* self, double depth, double velocity, double dt, nf_sample* out) {
  *out = c::plain(self->insertion.step(depth, velocity, dt));
}

size_t nf_solid_forces(const nf_solid* self, double* forces, size_t count) {
  const std::size_t nodes = self->insertion.tissue().nodes;
  for (std::size_t i = 0; i < std::min(count, nodes); ++i) forces[i] = self->insertion.node_force(i);
  return nodes;
}
size_t nf_solid_displacements(const nf_solid* self, double* displacements, size_t count) {
  const std::size_t nodes = self->insertion.tissue().nodes;
  for (std::size_t i = 0; i < std::min(count, nodes); ++i) displacements[i] = self->insertion.displacement(i);
  return nodes;
}
double nf_solid_tip(const nf_solid* self) { return self->insertion.state().tip; }

void nf_solid_reset(nf_solid* self) { self->insertion.reset(); }

size_t nf_solid_snapshot_size(void) { return sizeof(CondensedInsertion::Saved); }

int nf_solid_snapshot(const nf_solid* self, void* bytes, size_t size) {
  if (!bytes || size < sizeof(CondensedInsertion::Saved)) return 0;
  const CondensedInsertion::Saved saved = self->insertion.save();
  std::memcpy(bytes, &saved, sizeof saved);
  return 1;
}

int nf_solid_restore(nf_solid* self, const void* bytes, size_t size) {
  if (!bytes || size < sizeof(CondensedInsertion::Saved)) return 0;
  CondensedInsertion::Saved saved;
  std::memcpy(&saved, bytes, sizeof saved);
  return self->insertion.restore(saved);
}

}  // extern "C"
