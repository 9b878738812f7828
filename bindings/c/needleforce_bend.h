/* SPDX-License-Identifier: Apache-2.0
   A needle that bends: motion of the base in; tip, shape, axial force and base wrench out. Frame of the
   tissue: z along the insertion, its undeformed surface at 0, x and y across. The caller owns all memory, of
   which a copy is a snapshot within one process; nf_bend_step, _shape, _reset, _snapshot, _restore are
   wait-free, the last two with 250 kB of stack. */
#ifndef NEEDLEFORCE_BEND_H
#define NEEDLEFORCE_BEND_H
#include "needleforce.h"
#include "needleforce_solid.h"
#ifdef __cplusplus
extern "C" {
#endif
/* clang-format off */

#define nf_bend_init nf_bend_init_v2 /* as in needleforce.h */
#define nf_bend_init_in_solid nf_bend_init_in_solid_v2
#define nf_bend_step nf_bend_step_v2

typedef struct nf_bend nf_bend;
typedef struct { /* top, modulus, tip_force ... by name; form NULL: linear, or cubic, hyperbolic, tanh */
  nf_parameter parameters[8]; const char* form;
} nf_lateral_layer;
typedef struct { double end, stiffness, curvature; } nf_section; /* end [m] from the tip, EI [N m^2], [1/m] unloaded */
typedef struct {
  const nf_lateral_layer* layers; size_t layer_count;     /* from the surface down, at most 8 */
  const nf_section* sections; size_t section_count;       /* from the tip on, at most 4 */
  const nf_parameter* parameters; size_t parameter_count; /* needle_length, guide_distance, bevel_length ... by name */
  int elements;                                           /* along the embedded needle; 0: 40 */
} nf_bending;
typedef struct { double depth, lateral[2], tilt[2], roll; } nf_base; /* [m], [m], [rad], [rad] not wrapped */
typedef struct {
  double tip[3], tangent[3];        /* [m], a unit vector */
  double wrench[6];                 /* [N], [N m] of the tissue on the needle at the base, in its frame */
  double force, lateral;            /* [N] along the axis, + opposes insertion; across, on the tip */
  double unsupported;               /* [m] between base and surface */
  nf_sample axial;                  /* parts of the axial force, phase, events */
  int status, buckled;
} nf_bent;

size_t nf_bend_size(void); /* bytes of memory, aligned as a double */
/* Before the loop. `axial` is copied: its force, its limits, and with a bevel its lateral force. NULL if refused. */
nf_bend* nf_bend_init(void* memory, size_t size, const nf_insertion* axial, const nf_bending* bending, nf_fault* why);
/* The same around a condensed solid: along the needle the solid, across it the layers of `bending`. */
nf_bend* nf_bend_init_in_solid(void* memory, size_t size, const nf_solid* axial, const nf_bending* bending, nf_fault* why);
void nf_bend_step(nf_bend* needle, const nf_base* base, double dt, nf_bent* sample);
/* Writes x, y, z of up to `count` points from the base to the tip; returns how many there are. */
size_t nf_bend_shape(const nf_bend* needle, double* points, size_t count);
void nf_bend_reset(nf_bend* needle);

size_t nf_bend_snapshot_size(void); /* about 110 kB, most of it the path of the tip */
/* 1, or 0 and nothing changes: too small a buffer, bytes of another version, model or settings, altered bytes, a state
   that no needle can have. */
int nf_bend_snapshot(const nf_bend* needle, void* bytes, size_t size);
int nf_bend_restore(nf_bend* needle, const void* bytes, size_t size);

/* clang-format on */
#ifdef __cplusplus
}
#endif
#endif
