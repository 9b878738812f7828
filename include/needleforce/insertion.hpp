// SPDX-License-Identifier: Apache-2.0
// The simulated insertion: layers and what it remembers, one cycle at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

#ifdef NEEDLEFORCE_COMPILED  // a program that links needleforce::compiled
#include "prepared_insertion.hpp"
extern template class needleforce::BasicPreparedInsertion<double>;
#else
#include "insertion_definitions.hpp"
#endif

namespace needleforce {

/// A needle going in and out of up to eight layers. Trivially copyable: a snapshot is a copy, restoring is
/// assignment. For one thread at a time, as every class here that does not state otherwise; objects share
/// nothing.
class Insertion {
 public:
  /// Checks and prepares the model; with an invalid one every step gives force 0 and `invalid_parameter`.
  /// A first step below a puncture depth counts as pierced and cuts there.
  explicit Insertion(const Model& model, const Limits& limits = {}, const Bevel& bevel = {}) noexcept
      : Insertion(std::span<const Layer>(std::array{Layer{0.0, model}}), limits, bevel) {}

  /// The same for a stack of layers, from the surface down.
  explicit Insertion(std::span<const Layer> layers, const Limits& limits = {},
                     const Bevel& bevel = {}) noexcept
      : prepared_(layers, limits, bevel) {}

  /// One cycle: the tip is at `depth` [m], moves at `velocity` [m/s], `dt` [s] after the last call.
  /// Wait-free: no allocation, lock, system call or exception; the cost is bounded whatever the depth and
  /// history; only the law `stribeck_cutting` takes microseconds, while its crack runs.
  [[gnu::always_inline]] Sample step(double depth, double velocity, double dt) noexcept {
    return prepared_.step(state_, depth, velocity, dt);
  }

  /// The same for a tip that moved by `aside` [m] where its face pushes it, by which the cut has moved less.
  /// Wait-free.
  Sample step_aside(double depth, double aside, double dt) noexcept {
    return prepared_.step_aside(state_, depth, aside, dt);
  }

  /// Back to before the first contact.
  void reset() noexcept { state_ = InsertionState{}; }

  /// The whole object; assign it back to restore. Wait-free.
  Insertion snapshot() const noexcept { return *this; }

  /// The memory without the model, as bytes that may leave the process. Wait-free.
  using Saved = PreparedInsertion::Saved;
  Saved save() const noexcept { return state_bytes(state_, prepared_.layers_fingerprint()); }
  /// Restores a memory; returns false and changes nothing for bytes of another version or model, altered
  /// bytes, or a state that no insertion can have. Wait-free.
  bool restore(const Saved& bytes) noexcept {
    if (restore_fault(bytes)) return false;
    state_ = bytes.state();
    prepared_.restore_exponentials(state_);
    return true;
  }
  /// Why `restore` refuses a memory, as the part of it that is at fault, or nullptr. Wait-free.
  const char* restore_fault(const Saved& bytes) const noexcept { return prepared_.restore_fault(bytes); }

  /// The memory in this process, and back to it: half of the whole object. Wait-free.
  using State = InsertionState;
  const State& state() const noexcept { return state_; }
  void return_to(const State& state) noexcept { state_ = state; }

  /// Continues an insertion into other layers: the same tip in the same hole, with other laws; see
  /// docs/decisions/0009. Wait-free.
  void continue_from(const Insertion& old) noexcept {
    state_ = prepared_.continued(old.prepared_, old.state_);
  }

  double puncture_depth_in_model() const noexcept { return prepared_.puncture_depth_in_model(); }
  /// Deepest cut so far [m], 0 before the puncture.
  double deepest_cut() const noexcept { return state_.pierced > 0 ? state_.cut.front : 0.0; }
  /// How many layers are pierced, from the surface down.
  std::size_t pierced_layers() const noexcept { return state_.pierced; }
  /// False if the model or a limit was refused: then no step has a force.
  bool accepted() const noexcept { return prepared_.accepted(); }
  const Limits& limits() const noexcept { return prepared_.limits(); }
  /// Lateral force of the bevel as a share of the cutting force. Wait-free.
  double lateral_ratio() const noexcept { return prepared_.lateral_ratio(); }
  /// Mean force of slow cutting in the layer that the tip is in [N]. Wait-free.
  double steady_cutting() const noexcept { return prepared_.steady_cutting(state_); }
  /// True where cutting pays for the lateral force of the bevel, which is a share of its own, and in each
  /// layer for one of another cause, if there is.
  bool pays(bool other) const noexcept { return prepared_.pays(other); }
  /// A number that distinguishes models, with the lateral force of the bevel.
  std::uint64_t model_fingerprint() const noexcept { return prepared_.model_fingerprint(); }
  /// How many layers there are.
  std::size_t layers() const noexcept { return prepared_.layers(); }
  /// Deepest travel that a step takes [m].
  static constexpr double reach() noexcept { return PreparedInsertion::reach(); }
  /// Calls `visit(from, to, force)` from the surface down: friction [N] along the shaft between two depths,
  /// of the last accepted step, whose velocity [m/s] it was. Wait-free.
  template <class Visit>
  void along_shaft(double velocity, Visit visit) const noexcept {
    prepared_.along_shaft(state_, velocity, visit);
  }

 private:
  PreparedInsertion prepared_;
  InsertionState state_{};
};

static_assert(std::is_trivially_copyable_v<Insertion>);
// a copy within the first-level cache, with another one next to it
static_assert(sizeof(Insertion) <= 6500);
static_assert(noexcept(std::declval<Insertion&>().step(0.0, 0.0, 0.0)));

}  // namespace needleforce
