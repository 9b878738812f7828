/* SPDX-License-Identifier: Apache-2.0
   A controller outside this repository, with the installed library and a model written by `needleforce export
   paper --name gel --language c -o gel.h`. Twin of ../cpp/main.cpp. */
#include <stdio.h>
#include <stdlib.h>

#include "gel.h"

int main(void) {
  nf_fault why;
  nf_sample sample;
  void* memory = malloc(nf_size()); /* before the loop; any memory will do that is aligned as a double */
  nf_insertion* gel_block = nf_init(memory, nf_size(), gel, gel_layers, NULL, &why);
  if (!gel_block) {
    fprintf(stderr, "%s: %s %s\n", why.law, why.quantity, why.reason);
    return 1;
  }
  for (int cycle = 0; cycle <= 4000; ++cycle) { /* 8 mm in at 2 mm/s, a step a millisecond */
    nf_step(gel_block, 2e-6 * cycle, 2e-3, 1e-3, &sample);
    if (sample.status != NF_OK) return 1;
    if (sample.punctured) printf("puncture at %.3f mm\n", 1e3 * sample.depth);
  }
  printf("force at %.1f mm: %.4f N\n", 1e3 * sample.depth, sample.force);
  free(memory);
  return 0;
}
