// SPDX-License-Identifier: Apache-2.0
// A fuzzer on parameters and motions. Whatever the bytes say: nothing that is not finite comes out, no force beyond what
// the laws' numbers allow, a refused cycle says so, and the same input gives the same bits, also from a snapshot on.
#include <array>
#include <bit>
#include <cstdio>
#include <cstdlib>

#include "bounds.hpp"
#include "from_bytes.hpp"

namespace {

using namespace needleforce;

void require(bool kept, const char* property) {
  if (kept) return;
  std::fprintf(stderr, "property broken: %s\n", property);
  std::abort();
}

std::array<double, 8> numbers_of(const Sample& s) {
  return {s.depth, s.velocity, s.force, s.stiffness, s.friction, s.cutting, s.force_by_depth, s.force_by_velocity};
}

bool same(const Sample& a, const Sample& b) {
  using Bits = std::array<std::uint64_t, 8>;
  return std::bit_cast<Bits>(numbers_of(a)) == std::bit_cast<Bits>(numbers_of(b)) && a.phase == b.phase &&
         a.status == b.status && a.punctured == b.punctured;
}

/// The engine beside a second one of the same model, and one that goes on from the last snapshot.
class Trial {
 public:
  Trial(std::span<const Layer> layers, const Limits& limits)
      : valid_(!first_fault(layers).reason && needleforce::valid(limits)),
        limits_(limits),
        most_(valid_ ? bounds::of(layers, std::min(fastest, 2.0 * limits.max_speed + 1.0)) : bounds::Parts{}),
        insertion_(layers, limits),
        twin_(layers, limits),
        kept_(insertion_.snapshot()),
        shadow_(kept_) {}

  void ask(const from_bytes::Cycle& cycle) {
    switch (cycle.ask) {
      case from_bytes::Ask::reset:
        insertion_.reset(), twin_.reset(), shadow_ = insertion_.snapshot();
        break;
      case from_bytes::Ask::keep:
        kept_ = insertion_.snapshot(), shadow_ = kept_;
        break;
      default:
        insertion_ = kept_, twin_ = kept_, shadow_ = kept_;
    }
  }

  void step(double depth, double velocity, double dt) {
    const Sample sample = insertion_.step(depth, velocity, dt);
    require(same(sample, twin_.step(depth, velocity, dt)), "the same input gives the same bits");
    require(same(sample, shadow_.step(depth, velocity, dt)), "a snapshot goes on as the engine does");
    check(sample);
    const bool bad = !std::isfinite(depth) || !std::isfinite(velocity) || !std::isfinite(dt) || !(dt > 0.0) ||
                     !(std::abs(depth) <= farthest);
    require(!bad || sample.status != Status::ok, "bad input says so");
    require(valid_ || sample.status == Status::invalid_parameter, "an invalid model says so");
    require(!(bad && limits_.hold_time == 0.0) || sample.force == 0.0, "bad input lets go");
  }

 private:
  void check(const Sample& sample) const {
    for (const double number : numbers_of(sample)) require(std::isfinite(number), "every number is finite");
    require(std::abs(sample.depth) <= farthest, "the depth is one that was accepted");
    require(sample.stiffness >= 0.0 && sample.stiffness <= most_.stiffness, "a contact pushes, no more than it can");
    require(sample.cutting >= 0.0 && sample.cutting <= most_.cutting, "cutting pushes, no more than it can");
    require(std::abs(sample.friction) <= most_.friction, "friction is no more than it can be");
    const double sum = sample.stiffness + sample.friction + sample.cutting;
    require(sample.force == sum, "the force is the sum of its parts");
  }

  bool valid_;
  Limits limits_;
  bounds::Parts most_;
  Insertion insertion_, twin_, kept_, shadow_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  from_bytes::Bytes bytes(data, size);
  const Limits limits = from_bytes::limits(bytes);
  const std::vector<Layer> layers = from_bytes::layers(bytes);
  Trial trial(layers, limits);
  from_bytes::Motion motion;
  while (!bytes.empty()) {
    const from_bytes::Cycle cycle = motion.next(bytes);
    if (cycle.ask != from_bytes::Ask::step) {
      trial.ask(cycle);
      continue;
    }
    for (std::size_t i = 0; i < cycle.times; ++i) trial.step(motion.moved(cycle), cycle.velocity, cycle.dt);
  }
  return 0;
}
