/* SPDX-License-Identifier: Apache-2.0
   The same streams through the C header alone. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../bindings/c/needleforce_events.h"

static void step(nf_events* watch, char* line) {
  char *depth, *dt;
  nf_event e;
  const double force = strtod(line, &depth), at = strtod(depth, &dt);
  nf_events_step(watch, force, at, strtod(dt, NULL), &e);
  printf("%.17g %.17g %.17g %.17g %.17g %.17g %.17g %s %s\n", e.time, e.depth, e.size, e.probability, e.delay,
         nf_events_noise(watch), nf_events_needed_fall(watch), nf_event_name(e.kind),
         nf_stream_status_name(nf_events_status(watch)));
}

int main(int count, char** paths) {
  const size_t size = nf_events_snapshot_size();
  void *memory = malloc(nf_events_size()), *kept = malloc(size);
  char line[200];
  for (int i = 1; i < count; ++i) {
    FILE* file = fopen(paths[i], "r");
    nf_events* watch = nf_events_init(memory, nf_events_size(), NULL, 0, NULL);
    if (!file || !watch) return 1;
    printf("case %s\n", paths[i]);
    while (fgets(line, sizeof line, file)) {
      if (!strcmp(line, "keep\n"))
        nf_events_snapshot(watch, kept, size);
      else if (!strcmp(line, "restore\n"))
        puts(nf_events_restore(watch, kept, size) ? "taken" : "refused");
      else if (!strcmp(line, "reset\n"))
        nf_events_reset(watch);
      else
        step(watch, line);
    }
    fclose(file);
  }
  free(kept);
  free(memory);
  return 0;
}
