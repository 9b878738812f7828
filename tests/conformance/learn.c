/* SPDX-License-Identifier: Apache-2.0
   The same streams through the C header alone. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../bindings/c/needleforce_online.h"

static nf_online* made(void* memory, char* line) {
  static double n[29 + 2 * NF_EARLIER_POINTS];
  char* rest = line;
  size_t count = 0;
  for (char* from = line; count < sizeof n / sizeof *n; from = rest, ++count) {
    n[count] = strtod(from, &rest);
    if (rest == from) break;
  }
  const nf_tip tip = {"cone", {{"half_angle", n[3]}}, NULL, NULL, NULL, 0};
  const nf_layer_prior* layers = (const nf_layer_prior*)(n + 5);
  const nf_prior prior = {
      layers, 2, (size_t)n[0], n[1] != 0.0, n[2], &tip, n + 29, n + 29 + NF_EARLIER_POINTS, n[4]};
  return nf_online_init(memory, nf_online_size(), count ? &prior : NULL, NULL, 0, NULL);
}

static void write_learnt(nf_learnt known) { printf(" %.17g %.17g", known.value, known.sd); }

static void write(const nf_online* online, const nf_event* event) {
  nf_learnt surface;
  nf_ahead ahead;
  nf_online_surface(online, &surface);
  printf("%.17g", nf_online_innovation(online));
  write_learnt(surface);
  for (size_t k = 0; k < 2; ++k) {
    nf_layer_learnt layer;
    nf_online_layer(online, k, &layer);
    write_learnt(layer.modulus), write_learnt(layer.cutting), write_learnt(layer.friction);
    printf(" %.17g %.17g", layer.puncture_depth, layer.puncture_force);
  }
  nf_online_ahead(online, 2e-3, &ahead);
  for (size_t i = 0; i < NF_AHEAD_POINTS; i += 5)
    printf(" %.17g %.17g %.17g", ahead.force[i], ahead.low[i], ahead.high[i]);
  printf(" %.17g %.17g %zu %s %s %s\n", ahead.puncture_probability, ahead.puncture_depth,
         nf_online_pierced(online), nf_event_name(event->kind), nf_regime_name(nf_online_regime(online)),
         nf_stream_status_name(nf_online_status(online)));
}

static void step(nf_online* online, char* line, long* samples) {
  char *depth, *dt;
  nf_event event;
  const double force = strtod(line, &depth), at = strtod(depth, &dt);
  nf_online_step(online, force, at, strtod(dt, NULL), &event);
  if (++*samples % 20 == 0 || event.kind != NF_NO_EVENT) write(online, &event);
}

int main(int count, char** paths) {
  const size_t size = nf_online_snapshot_size();
  void *memory = malloc(nf_online_size()), *kept = malloc(size);
  static char line[20000];
  for (int i = 1; i < count; ++i) {
    FILE* file = fopen(paths[i], "r");
    nf_online* online = made(memory, "");
    long samples = 0;
    if (!file || !online) return 1;
    printf("case %s\n", paths[i]);
    while (fgets(line, sizeof line, file)) {
      if (!strncmp(line, "prior ", 6))
        online = made(memory, line + 6);
      else if (!strcmp(line, "keep\n"))
        nf_online_snapshot(online, kept, size);
      else if (!strcmp(line, "restore\n"))
        puts(nf_online_restore(online, kept, size) ? "taken" : "refused");
      else if (!strcmp(line, "reset\n"))
        nf_online_reset(online);
      else
        step(online, line, &samples);
    }
    fclose(file);
  }
  free(kept);
  free(memory);
  return 0;
}
