/* SPDX-License-Identifier: Apache-2.0
   Parameters of a tissue while the needle moves, and the force ahead of it:
   docs/howto/online_identification.md. Settings by name as there, those of events among them, in SI; those
   left out have their defaults. The caller owns all memory, about 80 kB; every function but nf_online_init is
   wait-free, snapshot and restore with up to three times as much on the stack. */
#ifndef NEEDLEFORCE_ONLINE_H
#define NEEDLEFORCE_ONLINE_H
#include "needleforce_events.h"
#ifdef __cplusplus
extern "C" {
#endif
/* clang-format off */

#define nf_online_init nf_online_init_v2 /* as in needleforce.h */
#define nf_online_step nf_online_step_v2
#define nf_online_layer nf_online_layer_v2
#define nf_online_surface nf_online_surface_v2
#define nf_online_ahead nf_online_ahead_v2

enum { NF_EARLIER_POINTS = 161, NF_AHEAD_POINTS = 11 };
enum nf_regime { /* what the needle does, as far as a force is expected of it */
  NF_REGIME_UNKNOWN, NF_REGIME_FREE, NF_REGIME_CONTACT, NF_REGIME_RUPTURE, NF_REGIME_SLIDING, NF_REGIME_REVERSING,
  NF_REGIME_WITHDRAWAL, NF_REGIME_REST
};
typedef struct nf_online nf_online;
typedef struct { double mean, sd; } nf_expected; /* sd 0: nothing is expected */
typedef struct { /* depths from the contact with the first layer */
  nf_expected modulus, cutting, friction; /* [Pa], [N], [N/m] */
  nf_expected top, puncture;              /* [m] where it begins to be indented, and is pierced */
  nf_expected remainder;                  /* [1] share of the force after that */
} nf_layer_prior;
typedef struct {
  const nf_layer_prior* layers; size_t count; /* up to 8 */
  size_t punctures;                 /* how many are expected; 0 if that is unknown */
  int same_tissue;                  /* 1: from recordings of it, 0: from a model of another */
  double radius;                    /* [m] of the shank; 0: none */
  const nf_tip* tip;                /* NULL: a cone of 45 degrees */
  const double *mean, *sd;          /* [N] of earlier insertions, NF_EARLIER_POINTS each, or NULL */
  double spacing;                   /* [m] between them, the first at the contact; 0: none */
} nf_prior;
typedef struct { double value, sd, before; } nf_learnt; /* before: standard deviation of the prior */
typedef struct {
  nf_learnt modulus, cutting, friction;
  double top, puncture_depth, puncture_force, remaining, probability; /* depths in the stream's zero */
  int touched, pierced;
} nf_layer_learnt;
typedef struct { /* intervals hold 95 % */
  double depth[NF_AHEAD_POINTS], force[NF_AHEAD_POINTS], low[NF_AHEAD_POINTS], high[NF_AHEAD_POINTS];
  double puncture_probability;              /* within this travel */
  double puncture_depth, earliest, latest;  /* [m] of the next puncture */
} nf_ahead;

const char* nf_regime_name(int regime);

size_t nf_online_size(void); /* bytes of memory, aligned as a double */
/* Before the loop. NULL if refused, with the reason in *why, whose layer is that of the prior. Prior NULL: nothing. */
nf_online* nf_online_init(void* memory, size_t size, const nf_prior* prior, const nf_parameter* settings,
                          size_t count, nf_fault* why);
/* One sample: force [N], depth [m], time since the one before [s]. The kind of the event, mostly NF_NO_EVENT. */
int nf_online_step(nf_online* online, double force, double depth, double dt, nf_event* event);
int nf_online_status(const nf_online* online); /* of nf_stream_status */
int nf_online_regime(const nf_online* online);
size_t nf_online_pierced(const nf_online* online);
double nf_online_innovation(const nf_online* online); /* near 1 where the intervals hold */
void nf_online_layer(const nf_online* online, size_t layer, nf_layer_learnt* known); /* 0 the first */
void nf_online_surface(const nf_online* online, nf_learnt* known);                   /* [m] where the tissue begins */
void nf_online_ahead(const nf_online* online, double travel, nf_ahead* ahead);       /* over the next travel [m] */
void nf_online_reset(nf_online* online);

size_t nf_online_snapshot_size(void);
/* 1, or 0 and nothing changes: too small a buffer, bytes of another version, prior or settings, altered bytes, a state
   that no stream can leave. */
int nf_online_snapshot(const nf_online* online, void* bytes, size_t size);
int nf_online_restore(nf_online* online, const void* bytes, size_t size);

/* clang-format on */
#ifdef __cplusplus
}
#endif
#endif
