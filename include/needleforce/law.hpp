// SPDX-License-Identifier: Apache-2.0
// What a law is: a parameter table, a family, a source, the range in which it may be believed, and what its
// family must offer the loop. Everything here is called in the loop: noexcept, of cost without history.
#pragma once

#include <concepts>
#include <type_traits>

#include "parameter.hpp"

namespace needleforce {

/// The part of the force a law gives.
enum class Family { stiffness, puncture, friction, cutting };
inline constexpr const char* family_names[] = {"stiffness", "puncture", "friction", "cutting"};

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
/// its formula reaches, beyond which it goes on straight and a step says `outside_range`.
template <class P>
concept PreparedStiffness = requires(const P& prepared, double depth, double force) {
  { prepared.force(depth) } noexcept -> std::same_as<double>;
  { prepared.slope(depth) } noexcept -> std::same_as<double>;
  { prepared.energy(depth) } noexcept -> std::same_as<double>;
  { prepared.indentation(force) } noexcept -> std::same_as<double>;
  { prepared.reach() } noexcept -> std::same_as<double>;
};

/// Friction along the shaft. It remembers one state in [-1, 1], 0 at first, which `advance` takes over a
/// travel [m], in whatever steps; force [N] odd in the state, and its derivative by depth [N/m], state and
/// embedded length >= 0 [m] moving along. `surface` is the depth where embedding starts, of a puncture depth;
/// `sliding` the force after long travel inwards, whose negative is that outwards.
template <class P>
concept PreparedFriction = requires(const P& prepared, double state, double travel, double embedded) {
  { prepared.advance(state, travel) } noexcept -> std::same_as<double>;
  { prepared.force(state, embedded) } noexcept -> std::same_as<double>;
  { prepared.by_depth(state, embedded) } noexcept -> std::same_as<double>;
  { prepared.surface(embedded) } noexcept -> std::same_as<double>;
  { prepared.sliding(embedded) } noexcept -> std::same_as<double>;
};

/// Cutting, `retreat` >= 0 [m] behind the deepest cut: force [N], falling continuously to zero, its
/// derivative by depth [N/m] (minus that by retreat), and the steady force while it cuts, which is that at
/// retreat 0.
template <class P>
concept PreparedCutting = requires(const P& prepared, double retreat) {
  { prepared.force(retreat) } noexcept -> std::same_as<double>;
  { prepared.by_depth(retreat) } noexcept -> std::same_as<double>;
  { prepared.steady() } noexcept -> std::same_as<double>;
};

namespace detail {
/// All that a puncture law may ask of a contact.
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

/// A puncture law gives the depth [m] at which a contact breaks, before the loop.
template <class L>
concept PunctureLaw =
    Law<L> && L::family == Family::puncture && requires(const L& law, const detail::AnyStiffness& stiffness) {
      { law.puncture_depth(stiffness) } noexcept -> std::same_as<double>;
    };

template <class L>
concept FrictionLaw =
    Preparable<L> && L::family == Family::friction && PreparedFriction<typename L::Prepared>;

template <class L>
concept CuttingLaw = Preparable<L> && L::family == Family::cutting && PreparedCutting<typename L::Prepared>;

}  // namespace needleforce
