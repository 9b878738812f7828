// SPDX-License-Identifier: Apache-2.0
// A fuzzer on parameters and motions. Whatever the bytes say: nothing that is not finite comes out, no force
// beyond what the laws' numbers allow, a refused cycle says so, and the same input gives the same bits, also
// from a snapshot on and through the C face.
#include "trial.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace needleforce;
  from_bytes::Bytes bytes(data, size);
  const Limits limits = from_bytes::limits(bytes);
  const Bevel bevel = from_bytes::bevel(bytes);
  const std::vector<Layer> layers = from_bytes::layers(bytes);
  proof::Trial trial(layers, limits, bevel, from_bytes::guard_settings(bytes));
  from_bytes::Motion motion;
  while (!bytes.empty()) {
    const from_bytes::Cycle cycle = motion.next(bytes);
    if (cycle.ask != from_bytes::Ask::step)
      trial.ask(cycle);
    else
      for (std::size_t i = 0; i < cycle.times; ++i) trial.step(motion.moved(cycle), cycle.velocity, cycle.dt);
  }
  return 0;
}
