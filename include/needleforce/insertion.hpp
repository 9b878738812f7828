// SPDX-License-Identifier: Apache-2.0
// The simulated insertion: the only stateful object, one cycle at a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "model.hpp"
#include "sample.hpp"

namespace needleforce {

/// What a step accepts, and what reaches the hand when it does not.
struct Limits {
  double max_speed = 1.0;        ///< [m/s]; a depth that moved faster since the last good step is refused
  double velocity_slack = 2e-3;  ///< [m/s] by which velocity may differ from the change of depth
  double velocity_slack_ratio = 0.5;  ///< and as a share of the larger of the two
  double hold_time = 0.0;             ///< [s] for which a fault keeps the last force; after it the force is 0
};

/// True if no limit is NaN or negative; an infinite `max_speed` accepts every jump.
inline bool valid(const Limits& limits) noexcept {
  return limits.max_speed > 0.0 && limits.velocity_slack >= 0.0 && limits.velocity_slack_ratio >= 0.0 &&
         limits.hold_time >= 0.0;
}

/// Pass as velocity where none is measured: the step takes the change of depth over dt.
inline constexpr double no_velocity = std::numeric_limits<double>::max();

/// A needle going in and out of one layer. Trivially copyable: a snapshot is a copy, restoring is assignment.
class Insertion {
 public:
  /// Checks and prepares the model; with an invalid one every step gives force 0 and `invalid_parameter`.
  /// A first step that lies below the puncture depth counts as pierced and cuts there.
  explicit Insertion(const Model& model, const Limits& limits = {}) noexcept
      : stiffness_(prepare(model.stiffness)),
        friction_(prepare(model.friction)),
        cutting_(prepare(model.cutting)),
        limits_(limits),
        valid_(valid(model) && valid(limits)),
        puncture_depth_(puncture_depth(model.puncture, stiffness_)) {}

  /// One cycle: the tip is at `depth` [m], moves at `velocity` [m/s], `dt` [s] after the last call.
  /// Wait-free: no allocation, lock, system call or exception; the cost does not depend on depth or history.
  Sample step(double depth, double velocity, double dt) noexcept {
    const Status status = check(depth, velocity, dt);
    if (status != Status::ok) return refuse(status, dt);
    if (velocity == no_velocity)
      velocity = state_.started ? (depth - state_.depth) / (state_.waited + dt) : 0.0;
    const bool was_pierced = state_.pierced;
    move(depth);
    const Sample sample = force(depth, velocity, state_.pierced && !was_pierced);
    if (limits_.hold_time > 0.0) state_.last = sample;  // else never shown again
    return sample;
  }

  /// Back to before the first contact.
  void reset() noexcept { state_ = State{}; }

  /// The whole object; assign it back to restore.
  Insertion snapshot() const noexcept { return *this; }

  double puncture_depth_in_model() const noexcept { return puncture_depth_; }
  /// Deepest cut so far [m], 0 before the puncture.
  double deepest_cut() const noexcept { return state_.deepest; }

 private:
  struct State {
    Sample last{};
    double depth = 0.0;    // of the last accepted step
    double waited = 0.0;   // time since the last accepted step
    double deepest = 0.0;  // the cut
    double bristle = 0.0;  // of the friction
    bool pierced = false;
    bool started = false;
  };

  Status check(double depth, double velocity, double dt) const noexcept {
    if (!valid_) return Status::invalid_parameter;
    if (!std::isfinite(depth) || !std::isfinite(dt) || !std::isfinite(velocity)) return Status::not_finite;
    if (!(dt > 0.0)) return Status::outside_range;
    if (!state_.started) return std::abs(depth) <= 1.0 ? Status::ok : Status::outside_range;
    const double elapsed = state_.waited + dt;
    const double travel = depth - state_.depth;
    if (std::abs(travel) > limits_.max_speed * elapsed) return Status::outside_range;
    return velocity == no_velocity || agrees(velocity, travel / elapsed) ? Status::ok : Status::outside_range;
  }

  bool agrees(double velocity, double measured) const noexcept {
    const double larger = std::max(std::abs(velocity), std::abs(measured));
    return std::abs(velocity - measured) <= limits_.velocity_slack + limits_.velocity_slack_ratio * larger;
  }

  /// The last force for a bounded time, then none; depth and memory stay as they were.
  Sample refuse(Status status, double dt) noexcept {
    if (dt > 0.0 && std::isfinite(dt)) state_.waited += dt;
    const bool holding = valid_ && dt > 0.0 && state_.waited <= limits_.hold_time;
    Sample sample = holding ? state_.last : Sample{};
    sample.depth = state_.depth;
    sample.velocity = 0.0;
    sample.punctured = false;
    sample.status = status;
    return sample;
  }

  void move(double depth) noexcept {
    const double travel = state_.started ? depth - state_.depth : 0.0;
    state_.bristle =
        std::visit([&](const auto& law) { return law.advance(state_.bristle, travel); }, friction_);
    state_.pierced = state_.pierced || depth > puncture_depth_;
    if (state_.pierced) state_.deepest = std::max(state_.deepest, depth);
    state_.depth = depth;
    state_.waited = 0.0;
    state_.started = true;
  }

  Sample force(double depth, double velocity, bool punctured) const noexcept {
    Sample sample{.depth = depth, .velocity = velocity, .punctured = punctured};
    if (state_.pierced)
      pierced_force(sample);
    else if (depth > 0.0)
      contact_force(sample);
    sample.force = sample.stiffness + sample.friction + sample.cutting;
    return sample;
  }

  void contact_force(Sample& sample) const noexcept {
    sample.phase = Phase::deformation;
    std::visit(
        [&](const auto& law) {
          sample.stiffness = law.force(sample.depth);
          sample.force_by_depth = law.slope(sample.depth);
        },
        stiffness_);
  }

  void pierced_force(Sample& sample) const noexcept {
    std::visit(
        [&](const auto& law) {
          const double embedded = std::max(0.0, sample.depth - law.surface(puncture_depth_));
          if (embedded > 0.0) sample.phase = moving_phase(sample.velocity);
          sample.friction = law.force(state_.bristle, embedded);
          sample.force_by_depth += law.by_depth(state_.bristle, embedded);
        },
        friction_);
    std::visit(
        [&](const auto& law) {
          const double retreat = state_.deepest - sample.depth;
          sample.cutting = law.force(retreat);
          sample.force_by_depth += law.by_depth(retreat);
        },
        cutting_);
  }

  static Phase moving_phase(double velocity) noexcept {
    constexpr double at_rest = 1e-4;  // 0.1 mm/s: slower is a hold, whatever the velocity's noise
    if (std::abs(velocity) < at_rest) return Phase::hold;
    return velocity > 0.0 ? Phase::insertion : Phase::extraction;
  }

  Prepared<Stiffness> stiffness_;
  Prepared<Friction> friction_;
  Prepared<Cutting> cutting_;
  Limits limits_;
  bool valid_;
  double puncture_depth_;
  State state_{};
};

static_assert(std::is_trivially_copyable_v<Insertion>);
static_assert(noexcept(std::declval<Insertion&>().step(0.0, 0.0, 0.0)));

}  // namespace needleforce
