/* SPDX-License-Identifier: Apache-2.0
   A guard between an engine and a device: scale, clamp, slew, watchdog, energy; docs/howto/guard.md. nf_guard
   is for an insertion along the depth, also of a condensed solid; nf_base_guard for a needle that bends: one
   account of energy for depth, lateral position, tilt and roll of its base. Settings by name as there, in SI;
   those left out are off. The caller owns all memory; _step, _miss, _reset of both are wait-free. */
#ifndef NEEDLEFORCE_GUARD_H
#define NEEDLEFORCE_GUARD_H
#include "needleforce.h"
#include "needleforce_bend.h"
#include "needleforce_solid.h"
#ifdef __cplusplus
extern "C" {
#endif
/* clang-format off */

#define nf_guard_init nf_guard_init_v2 /* as in needleforce.h */
#define nf_guard_init_in_solid nf_guard_init_in_solid_v2
#define nf_guard_step nf_guard_step_v2
#define nf_guard_miss nf_guard_miss_v2
#define nf_base_guard_init nf_base_guard_init_v2
#define nf_base_guard_step nf_base_guard_step_v2
#define nf_base_guard_miss nf_base_guard_miss_v2

typedef struct nf_guard nf_guard;
enum nf_did { /* what the guard did in a cycle: bits */
  NF_REJECTED = 1, NF_STALE = 2, NF_CLAMPED = 4, NF_SLEWED = 8, NF_LIMITED_BY_ENERGY = 16, NF_OUTSIDE_BOUNDS = 32
};
typedef struct {
  double force;           /* [N] for the device, + opposes insertion */
  double energy, reserve; /* [J] the user has put in so far; may still take out */
  int did;
  nf_sample sample;       /* of the tissue */
} nf_output;

size_t nf_guard_size(void); /* bytes of memory for one guard, aligned as a double */
/* Before the loop, around an insertion that stays the caller's. NULL if refused, with the reason in *why. */
nf_guard* nf_guard_init(void* memory, size_t size, nf_insertion* insertion, const nf_parameter* settings, size_t count,
                        nf_fault* why);
/* The same around a condensed solid. */
nf_guard* nf_guard_init_in_solid(void* memory, size_t size, nf_solid* solid, const nf_parameter* settings, size_t count,
                                 nf_fault* why);
void nf_guard_step(nf_guard* guard, double depth, double velocity, double dt, nf_output* output);
void nf_guard_miss(nf_guard* guard, double dt, nf_output* output); /* a cycle without a measurement */
void nf_guard_reset(nf_guard* guard);                              /* the insertion too */

typedef struct nf_base_guard nf_base_guard;
typedef struct { /* for the device, along each coordinate of nf_base, + where it opposes that coordinate */
  double depth, lateral[2]; /* [N] along the needle, + opposes insertion; across, along the axes of the tissue */
  double tilt[2], roll;     /* [N m] by the slopes; about the needle */
} nf_base_force;
typedef struct {
  nf_base_force force;
  double energy, reserve; /* [J] the user has put in so far along all coordinates; may still take out */
  int did;
  nf_bent sample;         /* of the tissue */
} nf_base_output;

size_t nf_base_guard_size(void); /* bytes of memory for one guard, aligned as a double */
/* Before the loop, around a needle that stays the caller's. NULL if refused, with the reason in *why. */
nf_base_guard* nf_base_guard_init(void* memory, size_t size, nf_bend* needle, const nf_parameter* settings,
                                  size_t count, nf_fault* why);
void nf_base_guard_step(nf_base_guard* guard, const nf_base* base, double dt, nf_base_output* output);
void nf_base_guard_miss(nf_base_guard* guard, double dt, nf_base_output* output); /* a cycle without a measurement */
void nf_base_guard_reset(nf_base_guard* guard);                                   /* the needle too */

/* clang-format on */
#ifdef __cplusplus
}
#endif
#endif
