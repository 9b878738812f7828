// SPDX-License-Identifier: Apache-2.0
// A controller outside this repository, with the installed package and a model written by `needleforce export
// paper --name gel -o gel.hpp`. Twin of ../c/main.c.
#include <cstdio>

#include "gel.hpp"

int main() {
  needleforce::Insertion gel_block(gel);
  needleforce::Sample sample;
  for (int cycle = 0; cycle <= 4000; ++cycle) {  // 8 mm in at 2 mm/s, a step a millisecond
    sample = gel_block.step(2e-6 * cycle, 2e-3, 1e-3);
    if (sample.status != needleforce::Status::ok) return 1;
    if (sample.punctured) std::printf("puncture at %.3f mm\n", 1e3 * sample.depth);
  }
  std::printf("force at %.1f mm: %.4f N\n", 1e3 * sample.depth, sample.force);
}
