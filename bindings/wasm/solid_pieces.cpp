// SPDX-License-Identifier: Apache-2.0
// The C face of a condensed solid for JavaScript: its table is written into memory, after layers and
// settings.
#include <cstddef>

#include "pieces.hpp"

namespace {

constexpr std::size_t max_nodes = 65;  // one more than is accepted, to be refused

std::size_t nodes;
double *table, *at_nodes;  // compliances row by row; what was asked for last
unsigned char* snapshot;

}  // namespace

namespace pieces {
nf_solid* solid;
}

using namespace pieces;

extern "C" {

/// Where so many rows of so many compliances are to be written, one after the other; nullptr if they are too
/// many.
double* EXPORT(open_table)(std::size_t rows) {
  if (rows > max_nodes) return nullptr;
  nodes = rows;
  at_nodes = static_cast<double*>(room(rows * sizeof(double)));
  return table = static_cast<double*>(room(rows * rows * sizeof(double)));
}

/// 1, or 0 and a fault with the reason.
int EXPORT(make_solid)(double spacing) {
  void* memory = room(nf_solid_size());
  snapshot = static_cast<unsigned char*>(room(nf_solid_snapshot_size()));
  solid = nf_solid_init(memory, nf_solid_size(), layers, count, &settings, spacing, nodes, table, &fault);
  return solid != nullptr;
}

void EXPORT(solid_step)(double depth, double velocity, double dt) {
  nf_solid_step(solid, depth, velocity, dt, &sample);
}
double EXPORT(solid_tip)() { return nf_solid_tip(solid); }
/// Number of nodes; their forces or displacements are at `nodes_at`.
std::size_t EXPORT(solid_forces)() { return nf_solid_forces(solid, at_nodes, nodes); }
std::size_t EXPORT(solid_displacements)() { return nf_solid_displacements(solid, at_nodes, nodes); }
const double* EXPORT(nodes_at)() { return at_nodes; }
void EXPORT(solid_reset)() { nf_solid_reset(solid); }
unsigned char* EXPORT(solid_snapshot_at)() { return snapshot; }
std::size_t EXPORT(solid_snapshot_size)() { return nf_solid_snapshot_size(); }
void EXPORT(solid_save)() { nf_solid_snapshot(solid, snapshot, nf_solid_snapshot_size()); }
int EXPORT(solid_restore)(std::size_t size) { return nf_solid_restore(solid, snapshot, size); }

}  // extern "C"
