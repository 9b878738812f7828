// SPDX-License-Identifier: Apache-2.0
// What a law is: a parameter table, a family, a source, its validity, and the functions that its family must
// offer the loop: noexcept, of bounded cost whatever happened before; `prepare` and
// `puncture_depth` are called before it.
#pragma once

#include <concepts>
#include <type_traits>

#include "memory.hpp"
#include "parameter.hpp"
#include "relaxation.hpp"

namespace needleforce {

/// The part of the force a law gives; relaxation acts on the elastic parts of the others.
enum class Family { stiffness, puncture, friction, cutting, relaxation };
inline constexpr const char* family_names[] = {"stiffness", "puncture", "friction", "cutting", "relaxation"};

template <class L>
concept Law = Parameterised<L> && std::is_trivially_copyable_v<L> && requires {
  { L::family } -> std::convertible_to<Family>;
  { L::source } -> std::convertible_to<const char*>;
  { L::validity } -> std::convertible_to<const char*>;
};

/// A law whose `prepare()` computes once, as L::Prepared, what does not change in the loop.
template <class L>
concept Preparable = Law<L> && std::is_trivially_copyable_v<typename L::Prepared> && requires(const L& law) {
  { law.prepare() } noexcept -> std::same_as<typename L::Prepared>;
};

/// A contact at a depth >= 0 [m]: force [N], zero at depth 0 and convex; its slope dF/dh [N/m]; the energy
/// [J] stored, its integral; the indentation [m] at which a force is reached, its inverse; and the depth [m]
/// its formula reaches, beyond which it continues linearly and a step has the status `outside_range`.
template <class P>
concept PreparedStiffness = requires(const P& prepared, double depth, double force) {
  { prepared.force(depth) } noexcept -> std::same_as<double>;
  { prepared.slope(depth) } noexcept -> std::same_as<double>;
  { prepared.energy(depth) } noexcept -> std::same_as<double>;
  { prepared.indentation(force) } noexcept -> std::same_as<double>;
  { prepared.reach() } noexcept -> std::same_as<double>;
};

/// What a law remembers between two steps: plain numbers of its own, or `NoMemory`.
template <class M>
concept Memory = std::is_trivially_copyable_v<M> && std::is_default_constructible_v<M>;

/// Friction along the shaft in one layer. `advance` moves shaft and memory with the tip, also in layers not
/// reached yet, by the travel below the tissue's surface; above it both are released. `pierce` receives the
/// contact at the puncture. Then force [N], and its derivatives by depth [N/m] and by velocity [N s/m]. A law
/// with `slip(shaft, memory)`, what slipped in the last step, also keeps its force under noise of the depth.
template <class P>
concept PreparedFriction =
    Memory<typename P::Memory> &&
    requires(const P& prepared, Shaft& shaft, const Shaft& now, typename P::Memory& memory,
             const typename P::Memory& kept, const Move& move, const LayerExtent& extent,
             const Relaxing& relaxing, const ContactAtPuncture& contact, double velocity) {
      { prepared.advance(shaft, memory, move, extent, relaxing) } noexcept -> std::same_as<void>;
      { prepared.pierce(memory, contact) } noexcept -> std::same_as<void>;
      { prepared.force(now, kept, velocity) } noexcept -> std::same_as<double>;
      { prepared.by_depth(now, kept, velocity) } noexcept -> std::same_as<double>;
      { prepared.by_velocity(now, kept, velocity) } noexcept -> std::same_as<double>;
    };

/// Friction that has a force while sliding without memory: where embedding starts, of top and puncture depth
/// [m], and the force [N] over an embedded length [m] at a velocity [m/s].
template <class P>
concept SlidesSteadily = requires(const P& prepared, double number) {
  { prepared.surface(number, number) } noexcept -> std::same_as<double>;
  { prepared.sliding(number, number) } noexcept -> std::same_as<double>;
};

/// Cutting at the tip. `enter` starts it at the depth where a layer is punctured, with the force [N] that it
/// takes over through an interface without resistance, otherwise with a negative one; `advance` moves cut and
/// memory with the tip; `forceless` is where a front gives a tip at a depth no force [m]. Force [N] at a
/// depth [m], its derivative by depth [N/m], and the mean force [N] over a long travel at a speed [m/s].
template <class P>
concept PreparedCutting = Memory<typename P::Memory> &&
                          requires(const P& prepared, Cut& cut, const Cut& now, typename P::Memory& memory,
                                   const typename P::Memory& kept, const Move& move, double number) {
                            { prepared.enter(cut, memory, number, number) } noexcept -> std::same_as<void>;
                            { prepared.advance(cut, memory, move) } noexcept -> std::same_as<void>;
                            { prepared.forceless(now, number) } noexcept -> std::same_as<double>;
                            { prepared.force(now, kept, number) } noexcept -> std::same_as<double>;
                            { prepared.by_depth(now, kept, number) } noexcept -> std::same_as<double>;
                            { prepared.steady(number) } noexcept -> std::same_as<double>;
                          };

/// Relaxation: the numbers of a step of dt > 0 [s].
template <class P>
concept PreparedRelaxation = requires(const P& prepared, double dt) {
  { prepared.over(dt) } noexcept -> std::same_as<Relaxing>;
};

namespace detail {
/// All functions of a contact that a puncture law may use.
struct AnyStiffness {
  double force(double depth) const noexcept;
  double slope(double depth) const noexcept;
  double energy(double depth) const noexcept;
  double indentation(double force) const noexcept;
  double reach() const noexcept;
};
static_assert(PreparedStiffness<AnyStiffness>);
}  // namespace detail

template <class L>
concept StiffnessLaw =
    Preparable<L> && L::family == Family::stiffness && PreparedStiffness<typename L::Prepared>;

/// A puncture law gives the depth [m] at which an elastic contact breaks, before the loop; and in the loop,
/// whether a contact that has relaxed is punctured at its force [N] and work [J] so far.
template <class L>
concept PunctureLaw = Law<L> && L::family == Family::puncture &&
                      requires(const L& law, const detail::AnyStiffness& stiffness, double number) {
                        { law.puncture_depth(stiffness) } noexcept -> std::same_as<double>;
                        { law.breaks(number, number) } noexcept -> std::same_as<bool>;
                      };

template <class L>
concept FrictionLaw =
    Preparable<L> && L::family == Family::friction && PreparedFriction<typename L::Prepared>;

template <class L>
concept CuttingLaw = Preparable<L> && L::family == Family::cutting && PreparedCutting<typename L::Prepared>;

template <class L>
concept RelaxationLaw =
    Preparable<L> && L::family == Family::relaxation && PreparedRelaxation<typename L::Prepared>;

/// Which two parameters of a law contradict each other, in words, or nullptr.
template <Law L>
constexpr const char* contradiction(const L& law) noexcept {
  if constexpr (requires { law.contradiction(); })
    return law.contradiction();
  else
    return nullptr;
}

/// False for a law in a form fitted to recordings that may return energy over a closed path, declared with
/// `may_return_energy`.
template <Law L>
constexpr bool is_passive = [] {
  if constexpr (requires { L::may_return_energy; })
    return !L::may_return_energy;
  else
    return true;
}();

/// False for a law whose error falls with the step, to first order, declared with `first_order`; the others
/// give the same at constant velocity in one step or in many.
template <Law L>
constexpr bool steps_exactly = !requires { L::first_order; };

/// True for a law whose force follows the travel alone, not the time or the velocity, and never falls while
/// the needle moves against it, declared with `monotone`: what the second inequality of
/// docs/decisions/0014-rest-in-a-device.md needs.
template <Law L>
constexpr bool is_monotone = requires { L::monotone; };

}  // namespace needleforce
