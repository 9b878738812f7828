// SPDX-License-Identifier: Apache-2.0
// The C face of a needle that bends for JavaScript: given piece by piece, after the model of its axial force,
// in layers or in a solid.
#include <cstddef>

#include "../c/needleforce_bend.h"
#include "pieces.hpp"

namespace {

// one more than is accepted, to be refused
constexpr std::size_t max_layers = 9, max_sections = 5, max_parameters = 16, max_points = 200;

nf_lateral_layer layers[max_layers];
nf_section sections[max_sections];
nf_parameter parameters[max_parameters];
nf_bending bending{layers, 0, sections, 0, parameters, 0, 0};
nf_bend* needle;
nf_bent bent;
double points[3 * max_points];
unsigned char* snapshot;

}  // namespace

// needleforce.mjs reads fifteen doubles, a sample and two integers
static_assert(offsetof(nf_bent, axial) == 15 * sizeof(double) && sizeof(nf_sample) == 12 * sizeof(double) &&
              offsetof(nf_bent, status) == 27 * sizeof(double));

extern "C" {

/// The parameters of the layer follow, by give().
int EXPORT(add_lateral)(const char* form) {
  if (bending.layer_count == max_layers) return 0;
  nf_lateral_layer& layer = layers[bending.layer_count++];
  layer.form = form;
  pieces::open(layer.parameters);
  return 1;
}
int EXPORT(add_section)(double end, double stiffness, double curvature) {
  if (bending.section_count == max_sections) return 0;
  sections[bending.section_count++] = {end, stiffness, curvature};
  return 1;
}
/// The parameters of needle, support and lengths follow, by give().
void EXPORT(open_bending)() { pieces::open(parameters); }

/// 1, or 0 and a fault with the reason.
int EXPORT(make_bend)(int elements) {
  void* memory = room(nf_bend_size());
  snapshot = static_cast<unsigned char*>(room(nf_bend_snapshot_size()));
  while (parameters[bending.parameter_count].name) ++bending.parameter_count;
  bending.elements = elements;
  needle = pieces::solid
               ? nf_bend_init_in_solid(memory, nf_bend_size(), pieces::solid, &bending, &pieces::fault)
               : nf_bend_init(memory, nf_bend_size(), pieces::insertion, &bending, &pieces::fault);
  return needle != nullptr;
}

const nf_bent* EXPORT(bent_at)() { return &bent; }
void EXPORT(bend_step)(double depth, double x, double y, double tilt_x, double tilt_y, double roll,
                       double dt) {
  const nf_base base{depth, {x, y}, {tilt_x, tilt_y}, roll};
  nf_bend_step(needle, &base, dt, &bent);
}
/// Number of points; their x, y, z are at `points_at`.
std::size_t EXPORT(bend_shape)() { return nf_bend_shape(needle, points, max_points); }
const double* EXPORT(points_at)() { return points; }
void EXPORT(bend_reset)() { nf_bend_reset(needle); }
unsigned char* EXPORT(bend_snapshot_at)() { return snapshot; }
std::size_t EXPORT(bend_snapshot_size)() { return nf_bend_snapshot_size(); }
void EXPORT(bend_save)() { nf_bend_snapshot(needle, snapshot, nf_bend_snapshot_size()); }
int EXPORT(bend_restore)(std::size_t size) { return nf_bend_restore(needle, snapshot, size); }

}  // extern "C"
