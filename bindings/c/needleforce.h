/* SPDX-License-Identifier: Apache-2.0
   The force of a needle in soft tissue, one control cycle at a time. SI units; force is + when it opposes
   insertion, depth + inwards from the undeformed surface. The caller owns all memory. nf_step, nf_reset,
   nf_snapshot, nf_restore are wait-free: no allocation, lock, system call or exception. `needleforce export`
   writes the layers of a model. One object is for one thread at a time, here and in the other headers;
   objects share nothing, so each thread may have its own. */
#ifndef NEEDLEFORCE_H
#define NEEDLEFORCE_H
#include <stddef.h>
#ifdef __cplusplus
extern "C" {
#endif
/* clang-format off */

/* The structs below belong to the version in these names: a program and a library that were compiled with different
   ones do not link. New members go to the end of a struct, with 0 for what was before, and the number goes up. A host
   that loads the library while it runs compares NF_ABI_VERSION with nf_abi_version() first; abi_v2.txt has all that
   the number stands for. */
#define NF_ABI_VERSION 2
#define nf_default_settings nf_default_settings_v2
#define nf_init nf_init_v2
#define nf_step nf_step_v2

typedef struct { const char* name; double value; } nf_parameter;
typedef struct { /* of the law tip_contact; radii and heights [m] for the tip `profile` alone */
  const char* name; nf_parameter parameters[8]; const char* equivalence; const double *radii, *heights; size_t knots;
} nf_tip;
typedef struct { const char* name; nf_parameter parameters[12]; const nf_tip* tip; } nf_law; /* left out: the default */
typedef struct { double top; nf_law stiffness, puncture, friction, cutting, relaxation; } nf_layer; /* top [m] */
typedef struct {
  double max_speed, hold_time;    /* [m/s] faster is refused; [s] for which a refused step keeps the last force */
  double velocity_slack, velocity_slack_ratio; /* [m/s], [1] between velocity and change of depth */
  double bevel_half_angle, bevel_friction_coefficient, bevel_face_share; /* [rad], [1], [1]; share 0: no lateral */
  double depth_noise;             /* [m] half the range of the measured depth at rest */
} nf_settings;
typedef struct { size_t layer; const char *law, *quantity, *reason; double value, low, high; } nf_fault;
typedef struct nf_insertion nf_insertion;

enum nf_phase { NF_FREE, NF_DEFORMATION, NF_INSERTION, NF_HOLD, NF_EXTRACTION };
enum nf_status { NF_OK, NF_OUTSIDE_RANGE, NF_INVALID_PARAMETER, NF_NOT_FINITE };
typedef struct {
  double depth, velocity;                             /* [m], [m/s] as accepted */
  double force, stiffness, friction, cutting;         /* [N] the sum and its parts */
  double lateral, force_by_depth, force_by_velocity;  /* [N], [N/m], [N s/m] */
  int phase, status, contact, punctured, exit;        /* the last three are 1 in one step alone */
} nf_sample;

#define NF_NO_VELOCITY 1.7976931348623157e308 /* as velocity: take the change of depth */

const char* nf_version(void);
int nf_abi_version(void); /* of the library: the NF_ABI_VERSION that it was compiled with */
const char* nf_phase_name(int phase);
const char* nf_status_name(int status);
nf_settings nf_default_settings(void);

size_t nf_size(void); /* bytes of memory for one insertion, aligned as a double */
/* Before the loop. NULL if refused, with the reason in *why (may be NULL). Settings NULL: defaults. */
nf_insertion* nf_init(void* memory, size_t size, const nf_layer* layers, size_t count,
                      const nf_settings* settings, nf_fault* why);
void nf_step(nf_insertion* insertion, double depth, double velocity, double dt, nf_sample* sample);
void nf_reset(nf_insertion* insertion); /* back to before the first contact */

size_t nf_snapshot_size(void);
/* 1, or 0 and nothing changes: too small a buffer, bytes of another version or model, altered bytes, a state that no
   needle can have. */
int nf_snapshot(const nf_insertion* insertion, void* bytes, size_t size);
int nf_restore(nf_insertion* insertion, const void* bytes, size_t size);

/* clang-format on */
#ifdef __cplusplus
}
#endif
#endif
