/* SPDX-License-Identifier: Apache-2.0
   A rigid needle in a solid that was condensed onto its path: friction along the shaft and the force at the
   tip drag the tissue. Layers, settings and samples are those of needleforce.h. The caller owns all memory,
   about 60 kB; nf_solid_step, _forces, _displacements, _reset, _snapshot, _restore are wait-free. */
#ifndef NEEDLEFORCE_SOLID_H
#define NEEDLEFORCE_SOLID_H
#include "needleforce.h"
#ifdef __cplusplus
extern "C" {
#endif
/* clang-format off */

#define nf_solid_init nf_solid_init_v2 /* as in needleforce.h */
#define nf_solid_step nf_solid_step_v2

typedef struct nf_solid nf_solid;

size_t nf_solid_size(void); /* bytes of memory, aligned as a double */
/* Before the loop. `compliance` [m/N], nodes x nodes row by row, 2 to 64 nodes at a `spacing` [m] from the surface, as
   Tissue.condense writes it; friction needs a sliding force per length, relaxation is none or prony, the same in each
   layer. NULL if refused. */
nf_solid* nf_solid_init(void* memory, size_t size, const nf_layer* layers, size_t count, const nf_settings* settings,
                        double spacing, size_t nodes, const double* compliance, nf_fault* why);
void nf_solid_step(nf_solid* solid, double depth, double velocity, double dt, nf_sample* sample);
/* Of up to `count` nodes: forces of shaft and tip on the tissue [N], its displacements [m]; returns how many there are. */
size_t nf_solid_forces(const nf_solid* solid, double* forces, size_t count);
size_t nf_solid_displacements(const nf_solid* solid, double* displacements, size_t count);
double nf_solid_tip(const nf_solid* solid); /* along the path, in the undeformed tissue [m] */
void nf_solid_reset(nf_solid* solid);

size_t nf_solid_snapshot_size(void);
/* 1, or 0 and nothing changes: too small a buffer, bytes of another version, tissue or model, altered bytes, a state that
   no needle can have. */
int nf_solid_snapshot(const nf_solid* solid, void* bytes, size_t size);
int nf_solid_restore(nf_solid* solid, const void* bytes, size_t size);

/* clang-format on */
#ifdef __cplusplus
}
#endif
#endif
