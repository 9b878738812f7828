// SPDX-License-Identifier: Apache-2.0
// A fuzzer on parameters and motions. Whatever the bytes say: nothing that is not finite comes out, no force
// beyond what the laws' numbers allow, a refused cycle says so, and the same input gives the same bits, also
// from a snapshot on and through the C face. Planted bytes are refused, or lead to numbers that are finite.
// The same bytes are then a stream for the event detector.
#include "planted.hpp"
#include "trial.hpp"
#include "watch_trial.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace needleforce;
  from_bytes::Bytes bytes(data, size);
  const Limits limits = from_bytes::limits(bytes);
  const Bevel bevel = from_bytes::bevel(bytes);
  const std::vector<Layer> layers = from_bytes::layers(bytes);
  proof::Trial trial(layers, limits, bevel, from_bytes::guard_settings(bytes));
  const Insertion fresh(layers, limits, bevel);
  proof::Planted<Insertion> planted;
  from_bytes::Motion motion;
  while (!bytes.empty()) {
    const from_bytes::Cycle cycle = motion.next(bytes);
    if (cycle.ask != from_bytes::Ask::step) {
      trial.ask(cycle);
      if (cycle.ask == from_bytes::Ask::restore && fresh.accepted())
        planted.restore(fresh, [&](auto& saved) { proof::plant(saved, cycle.where, cycle.change); });
      continue;
    }
    for (std::size_t i = 0; i < cycle.times; ++i) {
      const double depth = motion.moved(cycle);
      trial.step(depth, cycle.velocity, cycle.dt);
      planted.step([](const Sample& made) { return proof::numbers_of(made); }, depth, cycle.velocity,
                   cycle.dt);
    }
  }
  proof::watch(
      from_bytes::Bytes(data, std::min<std::size_t>(size, 128)));  // a stream is slower than a motion
  return 0;
}
