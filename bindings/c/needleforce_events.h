/* SPDX-License-Identifier: Apache-2.0
   Contact, puncture, sliding, stop, reversal and exit, from force, depth and time as they come:
   docs/howto/online_events.md. Settings by name as there, in SI; those left out have their defaults. The
   caller owns all memory, about 8 kB; nf_events_step, _status, _noise, _needed_fall, _reset, _snapshot,
   _restore are wait-free. */
#ifndef NEEDLEFORCE_EVENTS_H
#define NEEDLEFORCE_EVENTS_H
#include "needleforce.h"
#ifdef __cplusplus
extern "C" {
#endif
/* clang-format off */

#define nf_events_init nf_events_init_v2 /* as in needleforce.h */
#define nf_events_step nf_events_step_v2

typedef struct nf_events nf_events;
enum nf_event_kind { NF_NO_EVENT, NF_CONTACT, NF_PUNCTURE, NF_SLIDING, NF_STOP, NF_REVERSAL, NF_EXIT };
enum nf_stream_status { /* what the last sample was worth */
  NF_STREAM_OK, NF_STREAM_LEARNING, NF_STREAM_NOT_FINITE, NF_STREAM_BAD_TIME, NF_STREAM_GAP, NF_STREAM_STUCK,
  NF_STREAM_UNKNOWN_ZERO, NF_STREAM_WRONG_SIGN
};
typedef struct {
  double time, depth;  /* [s] since the begin of the stream; [m] in its own zero */
  double size;         /* [N] fall or rise so far; [m] the way back of a reversal */
  double probability;  /* that it is real */
  double delay;        /* [s] from the event to this sample */
  int kind;
} nf_event;

const char* nf_event_name(int kind);
const char* nf_stream_status_name(int status);

size_t nf_events_size(void); /* bytes of memory, aligned as a double */
/* Before the loop. NULL if refused, with the reason in *why. */
nf_events* nf_events_init(void* memory, size_t size, const nf_parameter* settings, size_t count, nf_fault* why);
/* One sample: force [N], depth [m], time since the one before [s]. The kind of the event, mostly NF_NO_EVENT. */
int nf_events_step(nf_events* events, double force, double depth, double dt, nf_event* event);
int nf_events_status(const nf_events* events);
double nf_events_noise(const nf_events* events);       /* [N] standard deviation of a reading now */
double nf_events_needed_fall(const nf_events* events); /* [N] fall that would be a puncture now */
void nf_events_reset(nf_events* events);

size_t nf_events_snapshot_size(void);
/* 1, or 0 and nothing changes: too small a buffer, bytes of another version or other settings, altered bytes, a state
   that no stream can leave. */
int nf_events_snapshot(const nf_events* events, void* bytes, size_t size);
int nf_events_restore(nf_events* events, const void* bytes, size_t size);

/* clang-format on */
#ifdef __cplusplus
}
#endif
#endif
