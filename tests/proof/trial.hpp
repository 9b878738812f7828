// SPDX-License-Identifier: Apache-2.0
// One input of the fuzzer: the engine beside a second one of the same model, one that goes on from the last
// snapshot, the same model through the C face, and as members of a batch, each step compared to the bit.
#pragma once

#include <array>
#include <bit>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "batch_trial.hpp"
#include "bounds.hpp"
#include "c_layers.hpp"
#include "motion.hpp"

namespace needleforce::proof {

/// Every number of a sample of either face, and its words as numbers.
auto numbers_of(const auto& s) {
  return std::array{s.depth,
                    s.velocity,
                    s.force,
                    s.stiffness,
                    s.friction,
                    s.cutting,
                    s.lateral,
                    s.force_by_depth,
                    s.force_by_velocity,
                    double(s.phase),
                    double(s.status),
                    double(s.contact),
                    double(s.punctured),
                    double(s.exit)};
}
bool same(const auto& a, const auto& b) {
  using Bits = std::array<std::uint64_t, 14>;
  return std::bit_cast<Bits>(numbers_of(a)) == std::bit_cast<Bits>(numbers_of(b));
}

/// The C face; without an insertion where it refused.
class CFace {
 public:
  CFace(std::span<const Layer> layers, const Limits& limits, const Bevel& bevel)
      : memory_(nf_size() / sizeof(double) + 1), kept_(nf_snapshot_size()) {
    CLayers named(layers);
    const nf_settings settings{
        limits.max_speed, limits.hold_time,           limits.velocity_slack, limits.velocity_slack_ratio,
        bevel.half_angle, bevel.friction_coefficient, bevel.face_share,      limits.depth_noise};
    nf_fault why{};
    insertion_ = nf_init(memory_.data(), nf_size(), named.data(), named.size(), &settings, &why);
    require((insertion_ == nullptr) == (why.reason != nullptr), "a refusal has a reason");
    keep();
  }
  bool made() const { return insertion_; }
  const nf_insertion* get() const { return insertion_; }
  nf_sample step(double depth, double velocity, double dt) {
    nf_sample sample;
    nf_step(insertion_, depth, velocity, dt, &sample);
    return sample;
  }
  void reset() { nf_reset(insertion_); }
  void keep() {
    if (insertion_) require(nf_snapshot(insertion_, kept_.data(), kept_.size()) == 1, "a snapshot is taken");
  }
  void restore() {
    require(nf_restore(insertion_, kept_.data(), kept_.size()) == 1, "a snapshot is taken back");
  }
  /// One byte changed, or the last ones missing.
  void restore_altered(std::size_t where, std::uint8_t change) {
    std::vector<std::uint8_t> altered = kept_;
    altered[where % altered.size()] ^= change ? change : 1;
    require(nf_restore(insertion_, altered.data(), altered.size()) == 0, "altered bytes are refused");
    require(nf_restore(insertion_, kept_.data(), where % kept_.size()) == 0, "missing bytes are refused");
  }

 private:
  std::vector<double> memory_;
  std::vector<std::uint8_t> kept_;
  nf_insertion* insertion_ = nullptr;
};

/// The guarded force, of an engine of its own.
class Hand {
 public:
  Hand(const Insertion& engine, const GuardSettings& settings) : guard_(engine, settings) {}
  void step(double depth, double velocity, double dt) {
    const Output output = guard_.step(depth, velocity, dt);
    check(output);
    const bool bad = !std::isfinite(depth) || !(dt > 0.0) || std::isinf(dt);
    require(!bad || !valid(guard_.settings()) || output.did.rejected, "the guard reports what it rejects");
  }
  void miss(double dt) { check(guard_.miss(dt)); }
  void reset() { guard_.reset(); }

 private:
  void check(const Output& output) const {
    for (const double number : {output.force, output.energy, output.reserve})
      require(std::isfinite(number), "every number of the guard is finite");
    const bool possible = valid(guard_.settings());
    require(std::abs(output.force) <= (possible ? guard_.settings().max_force : 0.0),
            "no force above the clamp");
  }
  Guard<Insertion> guard_;
};

class Trial {
 public:
  Trial(std::span<const Layer> layers, const Limits& limits, const Bevel& bevel, const GuardSettings& guard)
      : valid_(!first_fault(layers).reason && needleforce::valid(limits) && !first_invalid(bevel)),
        limits_(limits),
        most_(valid_ ? bounds::of(layers, bounds::fastest_accepted(limits)) : bounds::Parts{}),
        insertion_(layers, limits, bevel),
        twin_(layers, limits, bevel),
        kept_(insertion_.snapshot()),
        shadow_(kept_),
        c_(layers, limits, bevel),
        batch_(layers, limits, bevel),
        hand_(insertion_, guard) {
    require(c_.made() == valid_, "C takes the models that C++ takes");
  }

  void ask(const from_bytes::Cycle& cycle) {
    hand_.miss(1e-5 * cycle.where);
    if (!valid_) return;
    if (cycle.ask == from_bytes::Ask::reset) {
      insertion_.reset(), twin_.reset(), shadow_ = insertion_.snapshot(), c_.reset(), hand_.reset(),
                                         batch_.reset();
    } else if (cycle.ask == from_bytes::Ask::keep) {
      kept_ = insertion_.snapshot(), shadow_ = kept_, c_.keep(), batch_.keep();
      require(twin_.restore(insertion_.save()), "a twin takes the memory");
    } else {
      c_.restore(), c_.restore_altered(cycle.where, cycle.change), batch_.restore();
      insertion_ = kept_, twin_ = kept_, shadow_ = kept_;
    }
  }

  void step(double depth, double velocity, double dt) {
    const Sample sample = insertion_.step(depth, velocity, dt);
    require(same(sample, twin_.step(depth, velocity, dt)), "the same input gives the same bits");
    require(same(sample, shadow_.step(depth, velocity, dt)), "a snapshot continues as the engine does");
    if (valid_) require(same(sample, c_.step(depth, velocity, dt)), "C gives the bits of C++");
    batch_.step(depth, velocity, dt, numbers_of(sample));
    check(sample);
    hand_.step(depth, velocity, dt);
    const bool bad = !std::isfinite(depth) || !std::isfinite(velocity) || !std::isfinite(dt) || !(dt > 0.0) ||
                     !(std::abs(depth) <= farthest);
    require(!bad || sample.status != Status::ok, "bad input is reported");
    require(valid_ || sample.status == Status::invalid_parameter, "an invalid model is reported");
    require(!(bad && limits_.hold_time == 0.0) || sample.force == 0.0, "bad input lets go");
  }

 private:
  void check(const Sample& sample) const {
    for (const double number : numbers_of(sample)) require(std::isfinite(number), "every number is finite");
    require(std::abs(sample.depth) <= farthest, "the depth is one that was accepted");
    require(sample.stiffness >= 0.0 && sample.stiffness <= most_.stiffness,
            "a contact pushes as far as it can");
    require(sample.cutting >= 0.0 && sample.cutting <= most_.cutting, "cutting pushes as far as it can");
    require(std::abs(sample.friction) <= most_.friction, "friction is no more than it can be");
    const double sum = sample.stiffness + sample.friction + sample.cutting;
    require(sample.force == sum, "the force is the sum of its parts");
  }

  bool valid_;
  Limits limits_;
  bounds::Parts most_;
  Insertion insertion_, twin_, kept_, shadow_;
  CFace c_;
  BatchTrial batch_;
  Hand hand_;
};

}  // namespace needleforce::proof
