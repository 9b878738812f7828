// SPDX-License-Identifier: Apache-2.0
// A fuzzer on models that are replaced while the loop runs: two stacks of any laws and numbers take turns.
// Nothing that is not finite comes out, an invalid stack is refused and reported, free space has no force,
// and a guard around it keeps its largest_force.
#include "motion.hpp"
#include "needleforce/live.hpp"
#include "trial.hpp"

namespace {

using namespace needleforce;
using proof::require;

constexpr double largest_force = 3.0;

void check(const Output& output) {
  for (const double number : proof::numbers_of(output.sample))
    require(std::isfinite(number), "every number is finite while models are replaced");
  require(std::abs(output.force) <= largest_force,
          "no force above the largest_force while models are replaced");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  from_bytes::Bytes bytes(data, size);
  const double blend = bytes.number(0.0, 0.05);
  const std::vector<Layer> stacks[] = {from_bytes::layers(bytes), from_bytes::layers(bytes)};
  LiveInsertion live(stacks[0], blend);
  Guard<LiveInsertion&> guard(live, {.max_force = largest_force});
  std::size_t turn = 0;
  std::uint32_t refused = 0;
  from_bytes::Motion motion;
  while (!bytes.empty()) {
    const from_bytes::Cycle cycle = motion.next(bytes);
    if (cycle.ask == from_bytes::Ask::reset) {
      guard.reset();
    } else if (cycle.ask != from_bytes::Ask::step) {
      const auto& stack = stacks[++turn % 2];
      const bool kept_out = live.replace(stack).reason != nullptr;
      require(kept_out == (first_fault(stack).reason != nullptr), "an invalid stack is refused and reported");
      require(live.refused() == (refused += kept_out), "what was kept out is counted");
    } else {
      for (std::size_t i = 0; i < cycle.times; ++i)
        check(guard.step(motion.moved(cycle), cycle.velocity, cycle.dt));
    }
  }
  return 0;
}
