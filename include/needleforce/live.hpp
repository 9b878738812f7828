// SPDX-License-Identifier: Apache-2.0
// An insertion whose model another thread may replace between the slow frames of a planner or a simulation.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "exchange.hpp"
#include "insertion.hpp"

namespace needleforce {

/// Steps like an Insertion in one thread, the loop, while one other thread replaces its layers. A new model
/// is checked and prepared in that other thread, and the loop takes over the newest. The memory of the hole
/// continues, and over the blend time the force changes linearly from that of the old model to that of the
/// new, both of which run meanwhile; the next is taken when that is over.
class LiveInsertion {
 public:
  static constexpr double usual_blend = 10e-3;  ///< [s]
  static constexpr double longest_blend = 1.0;  ///< [s]

  /// As an Insertion. `blend_time` [s]: 0 (and what is no time) is at once, at most `longest_blend`.
  explicit LiveInsertion(std::span<const Layer> layers, double blend_time = usual_blend,
                         const Limits& limits = {}, const Bevel& bevel = {}) noexcept
      : limits_(limits),
        bevel_(bevel),
        blend_time_(blend_time > 0.0 ? std::min(blend_time, longest_blend) : 0.0),
        models_(Insertion(layers, limits, bevel)) {}

  /// The other thread, one at a time: offers other layers to the loop. An invalid stack is kept out, what
  /// runs stays, and its first fault comes back. Takes as long as checking and preparing takes, without a
  /// lock.
  Fault replace(std::span<const Layer> layers) noexcept {
    const Fault fault = first_fault(layers);
    last_refused_.store(fault.reason != nullptr, std::memory_order_relaxed);
    if (fault.reason) {
      refused_.fetch_add(1, std::memory_order_relaxed);
      return fault;
    }
    models_.publish(Insertion(layers, limits_, bevel_));
    return {};
  }

  /// The loop: one cycle, as Insertion::step(); phase, events and status are those of the newest model.
  /// Wait-free: costs one step, during a blend two, and where a model is taken over the copy of its memory.
  Sample step(double depth, double velocity, double dt) noexcept {
    if (!blending_) take();
    const Sample now = models_.taken().step(depth, velocity, dt);
    if (!blending_) return now;
    const Sample before = models_.taken(1).step(depth, velocity, dt);
    if (dt > 0.0 && std::isfinite(dt)) blended_for_ += dt;
    blending_ = blended_for_ < blend_time_;
    return blending_ ? between(before, now, blended_for_ / blend_time_) : now;
  }

  /// The loop: back to before the first contact, with the newest model taken. Wait-free.
  void reset() noexcept {
    models_.taken().reset();
    blending_ = false;
  }

  /// The loop: a copy of what runs, model and memory. Wait-free.
  Insertion snapshot() const noexcept { return models_.taken(); }
  /// The loop: deepest cut so far [m], 0 before the puncture, and pierced layers. Wait-free.
  double deepest_cut() const noexcept { return models_.taken().deepest_cut(); }
  std::size_t pierced_layers() const noexcept { return models_.taken().pierced_layers(); }
  /// The loop: true while two models run. Wait-free.
  bool blending() const noexcept { return blending_; }

  /// Any thread: how many models the loop took over. Wait-free.
  std::uint32_t taken() const noexcept { return taken_.load(std::memory_order_relaxed); }
  /// Any thread: how many models were kept out as invalid. Wait-free.
  std::uint32_t refused() const noexcept { return refused_.load(std::memory_order_relaxed); }
  /// Any thread: true if the last model offered was kept out, so that an older one stays. Wait-free.
  bool last_refused() const noexcept { return last_refused_.load(std::memory_order_relaxed); }

 private:
  void take() noexcept {
    if (!models_.take()) return;
    models_.taken().continue_from(models_.taken(1));
    blended_for_ = 0.0;
    blending_ = blend_time_ > 0.0;
    taken_.fetch_add(1, std::memory_order_relaxed);
  }

  /// A convex combination of two valid forces, with all that adds up to them.
  static Sample between(const Sample& before, const Sample& now, double share) noexcept {
    Sample sample = now;
    for (double Sample::* number : {&Sample::force, &Sample::stiffness, &Sample::friction, &Sample::cutting,
                                    &Sample::lateral, &Sample::force_by_depth, &Sample::force_by_velocity})
      sample.*number = before.*number + share * (now.*number - before.*number);
    return sample;
  }

  static_assert(std::atomic<bool>::is_always_lock_free);

  Limits limits_;
  Bevel bevel_;
  double blend_time_;
  double blended_for_ = 0.0;
  bool blending_ = false;
  Exchange<Insertion, 2> models_;  // the loop keeps the new one and the one before it
  std::atomic<std::uint32_t> taken_{0}, refused_{0};
  std::atomic<bool> last_refused_{false};
};

}  // namespace needleforce
