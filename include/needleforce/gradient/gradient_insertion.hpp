// SPDX-License-Identifier: Apache-2.0
// An insertion whose force has derivatives by parameters of its laws, from the same step.
// docs/howto/gradients.md
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <type_traits>
#include <utility>

#include "../insertion_definitions.hpp"
#include "directions.hpp"

namespace needleforce {

/// What happened in a step at a place that parameters move.
enum class ForceEventKind { contact, puncture, slip, reversal };
inline constexpr const char* force_event_names[] = {"contact", "puncture", "slip", "reversal"};

/// An event of the force. At a fixed depth next to it, the force changes at the rates `before` and `after`; a
/// parameter that moves the place adds -jump d(place) there, a delta.
template <std::size_t N>
struct ForceEvent {
  ForceEventKind kind;
  std::size_t layer = 0;
  double depth = 0.0;                ///< of the tip [m]
  double jump = 0.0;                 ///< force after it less before [N]
  std::array<double, N> by_depth{};  ///< d(depth) by each parameter
  std::array<double, N> before{}, after{};
};

/// An `Insertion` with up to N derivatives. Trivially copyable; every method but the constructor is
/// wait-free, and the constructor allocates nothing.
template <std::size_t N = 8>
class GradientInsertion {
 public:
  using Number = Dual<N>;
  using Event = ForceEvent<N>;
  /// A contact, a puncture and a slip for each layer, and a reversal.
  static constexpr std::size_t most_events = 3 * max_layers + 1;

  /// Checks and prepares the model, with derivatives along the first N of `along`.
  explicit GradientInsertion(std::span<const Layer> layers, std::span<const Direction> along,
                             const Limits& limits = {}) noexcept
      : GradientInsertion(layers, numbers_of(layers, along), limits) {}

  /// One cycle, as of `Insertion`: the sample, its force with derivatives. Wait-free; a step that punctures
  /// takes three.
  [[gnu::flatten]] BasicSample<Number> step(double depth, double velocity, double dt) noexcept {
    events_ = 0;
    const bool started = state_.started;
    const double before = state_.depth, elapsed = state_.waited + dt;
    const bool breaks = breaks_in(depth);
    if (breaks) probe(depth, velocity, elapsed);
    const BasicSample<Number> sample = prepared_.step(state_, depth, velocity, dt);
    if (sample.status == Status::ok || sample.status == Status::outside_range) {
      if (breaks) note_late_punctures(sample);
      if (started && state_.depth == depth && depth != before) note(before, depth);
    } else {
      events_ = 0;
    }
    last_ = sample.force;
    return sample;
  }

  /// What happened in the last step.
  std::span<const Event> events() const noexcept { return {event_.data(), events_}; }
  /// Back to before the first contact.
  void reset() noexcept {
    state_ = {};
    last_ = {};
    travel_ = 0.0;
    sticks_ = noted_ = {};
    events_ = 0;
  }
  bool accepted() const noexcept { return prepared_.accepted(); }

 private:
  using Numbers = std::array<BasicLayer<Number>, max_layers>;
  GradientInsertion(std::span<const Layer> layers, const Numbers& numbers, const Limits& limits) noexcept
      : prepared_(layers, numbers, limits, Bevel{}) {}
  static Numbers numbers_of(std::span<const Layer> layers, std::span<const Direction> along) noexcept {
    Numbers numbers{};
    for (std::size_t i = 0; i < layers.size() && i < max_layers; ++i)
      numbers[i] = with_derivatives<N>(layers[i], i, along);
    return numbers;
  }

  bool breaks_in(double depth) const noexcept {
    if (!prepared_.accepted()) return false;
    for (std::size_t i = 0; i < prepared_.layers(); ++i)
      if (!state_.layers[i].pierced && layer(i).resists() &&
          layer(i).template gives_way<false>(state_.layers[i], depth, !state_.started))
        return true;
    return false;
  }
  /// The force on both sides of each puncture of elastic contacts that the step passes, on a copy.
  void probe(double depth, double velocity, double elapsed) noexcept {
    if (!state_.started || !(depth > state_.depth)) return;
    BasicInsertionState<Number> copy = state_;
    const double travel = depth - state_.depth;
    for (std::size_t i = 0; i < prepared_.layers(); ++i) {
      const double at = layer(i).puncture.value, share = (at - copy.depth) / travel;
      if (copy.layers[i].pierced || !layer(i).resists() || layer(i).relaxes() || !(at < depth)) continue;
      const Number before = share > 0.0 ? prepared_.step(copy, at, velocity, share * elapsed).force : last_;
      const double past = std::min(at + beyond * travel, depth);
      const Number after = prepared_.step(copy, past, velocity, (past - copy.depth) / travel * elapsed).force;
      add({ForceEventKind::puncture, i, at, after.value - before.value, layer(i).puncture.derivatives(),
           before.derivatives(), after.derivatives()});
    }
  }
  /// Contacts that relaxed, and a first step below a puncture.
  void note_late_punctures(const BasicSample<Number>& sample) noexcept {
    for (std::size_t i = 0; i < prepared_.layers(); ++i) {
      const BasicLayerState<Number>& state = state_.layers[i];
      if (!state.pierced || !layer(i).resists() || known(i) || noted_[i]) continue;
      add({ForceEventKind::puncture, i, state.puncture_depth.value, sample.force.value - last_.value,
           state.puncture_depth.derivatives(), last_.derivatives(), sample.force.derivatives()});
    }
    for (std::size_t i = 0; i < prepared_.layers(); ++i) noted_[i] = state_.layers[i].pierced;
  }
  bool known(std::size_t i) const noexcept {
    for (const Event& event : events())
      if (event.kind == ForceEventKind::puncture && event.layer == i) return true;
    return false;
  }
  /// Contacts, reversals, and shafts that begin to slide.
  void note(double before, double depth) noexcept {
    const double travel = depth - before;
    if (travel * travel_ < 0.0)
      add({ForceEventKind::reversal, 0, before, 0.0, {}, last_.derivatives(), last_.derivatives()});
    travel_ = travel;
    for (std::size_t i = 0; i < prepared_.layers(); ++i) {
      const Number& top = layer(i).top;
      if (before <= top.value && depth > top.value && layer(i).resists() && !noted_[i])
        add({ForceEventKind::contact, i, top.value, 0.0, top.derivatives(), last_.derivatives(),
             last_.derivatives()});
      note_slip(i, depth);
    }
  }
  /// A spring that held and slipped by a travel began to slip that far back.
  void note_slip(std::size_t i, double depth) noexcept {
    const BasicLayerState<Number>& state = state_.layers[i];
    layer(i).with_friction(state, [&](const auto& law, const auto& memory) {
      if constexpr (requires { memory.element; }) {
        const bool inside = state.pierced && state.shaft.embedded.value > 0.0;
        const bool slides = inside && memory.element.stiffening.value == 0.0;
        if (slides && sticks_[i]) {
          const Number at = depth - law.slip(state.shaft, memory).travel;
          add({ForceEventKind::slip, i, at.value, 0.0, at.derivatives(), last_.derivatives(),
               last_.derivatives()});
        }
        sticks_[i] = inside && !slides;
      }
    });
  }
  void add(const Event& event) noexcept {
    if (events_ < most_events) event_[events_++] = event;
  }
  const BasicPreparedLayer<Number>& layer(std::size_t i) const noexcept { return prepared_.layer(i); }

  static constexpr double beyond = 1e-6;  // of a step, past a puncture

  BasicPreparedInsertion<Number> prepared_;
  BasicInsertionState<Number> state_{};
  Number last_{};
  double travel_ = 0.0;  // the last one that moved [m]
  std::array<bool, max_layers> sticks_{}, noted_{};
  std::array<Event, most_events> event_{};
  std::size_t events_ = 0;
};

static_assert(std::is_trivially_copyable_v<GradientInsertion<>>);
static_assert(noexcept(std::declval<GradientInsertion<>&>().step(0.0, 0.0, 0.0)));

}  // namespace needleforce
