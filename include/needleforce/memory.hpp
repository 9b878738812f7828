// SPDX-License-Identifier: Apache-2.0
// What friction and cutting remember between two steps. The part that the loop reads is the same for every
// law; the rest is the `Memory` of the law. All of it is plain numbers, so that a snapshot is a copy.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "relaxation.hpp"
#include "returnable_slip.hpp"
#include "state_check.hpp"

namespace needleforce {

/// The extent of a layer along the shaft [m]; the bottom is the surface of the next layer, or infinity.
template <class Real>
struct BasicLayerExtent {
  Real top;
  Real puncture;  ///< depth at which the layer punctures, or has punctured
  Real bottom;
  bool pierced;
  /// Where the same tissue begins, above interfaces that do not resist; its own surface is above or equal.
  Real root = std::numeric_limits<double>::infinity();
};
using LayerExtent = BasicLayerExtent<double>;

/// The state of a contact when its layer is punctured.
template <class Real>
struct BasicContactAtPuncture {
  BasicElement<Real> element;
  Real force;   ///< [N]
  Real energy;  ///< stored, without relaxation [J]
  Real slope;   ///< dF/dh, without relaxation [N/m]
  /// What friction may take over: force [N] and energy [J] apart from the cut's.
  Real free_force = 0.0, free_energy = 0.0;
  Real cut = 0.0;  ///< force of the cut that begins [N]
  BasicLayerExtent<Real> extent{};
  Real depth = 0.0;  ///< of the tip [m]
  /// For a law that keeps the contact: the share of its force that has not relaxed; this share of force [N]
  /// and energy [J] at the puncture's depth; the work [J] done on it until there; and the relaxation.
  Real left = 0.0, whole_force = 0.0, whole_energy = 0.0, work = 0.0;
  BasicRelaxing<Real> relaxing{};
};
using ContactAtPuncture = BasicContactAtPuncture<double>;

/// Embedded length [m] of a shaft between the surface where embedding starts and its end, the tip or the
/// bottom of the layer. Not a number if the end is none.
template <class Real>
Real embedded_length(const Real& end, const Real& surface) noexcept {
  return end <= surface ? Real(0.0) : Real(end - surface);
}

/// Limits of a traction [N/m].
template <class Real>
struct BasicTraction {
  Real low, high;
};
using Traction = BasicTraction<double>;

/// The shaft in one layer. A friction law counts the embedded length with `embed`; `dragged_tissue`, whose
/// layers add up, counts down to the tip, through all layers.
template <class Real>
struct BasicShaft {
  Real surface = 0.0;            ///< depth [m] where embedding starts
  Real embedded = 0.0;           ///< embedded length [m], 0 in a layer that is not pierced
  Real embedded_by_depth = 0.0;  ///< d(embedded) / d(depth)

  /// Sets the embedded length of the tip at `depth` in a layer where embedding starts at `from` [m].
  void embed(const BasicLayerExtent<Real>& extent, Real depth, Real from) noexcept {
    surface = from;
    // as embedded_length; written out, it takes a fifth off the shortest step
    const Real end = depth < extent.bottom ? depth : extent.bottom;
    const bool inside = extent.pierced && end > from;
    embedded = inside ? end - from : 0.0;
    embedded_by_depth = inside && depth < extent.bottom ? 1.0 : 0.0;
  }
  /// The limits of the traction of tissue of `stiffness` [N/m^2] that slides at `low` and `high` [N/m]. A
  /// length dl that the tip adds to the shaft holds the energy p^2 / 2k that all others hold; slip, which
  /// dissipates p l, pays for it up to p = 2 k l. docs/decisions/0013-energy.md.
  BasicTraction<Real> limits(const BasicLayerExtent<Real>& extent, Real stiffness, Real low,
                             Real high) const noexcept {
    if (!(embedded > 0.0)) return {0.0, 0.0};
    if (embedded_by_depth == 0.0) return {low, high};  // the tip is below the layer
    const Real length = embedded + larger(0.0, surface - extent.root);
    return {low, smaller(high, 2.0 * stiffness * length)};
  }
  /// The needle has left the tissue.
  void release() noexcept { embedded = embedded_by_depth = 0.0; }
};
using Shaft = BasicShaft<double>;

/// Cutting at the tip: force [N] and its derivative by depth [N/m].
template <class Real>
struct BasicTipForce {
  Real force = 0.0;
  Real by_depth = 0.0;
};
using TipForce = BasicTipForce<double>;

/// The cut at the tip.
template <class Real>
struct BasicCut {
  Real entry = 0.0;          ///< depth [m] at which cutting began
  Real retreat_limit = 0.0;  ///< depth [m] above which the cut has no force
  Real front = 0.0;          ///< deepest cut, or tip of the crack [m]
  Real held = 0.0;           ///< how far behind the front the force stays, against noise of the depth [m]

  /// Begins at a depth `at` [m], loaded by the puncture with a `force` [N]. If the tip recedes from there, it
  /// returns no more than half of the contact's energy, and nothing above the layer.
  void begin(Real at, Real force, Real indentation, Real energy) noexcept {
    entry = at;
    held = 0.0;
    retreat_limit = at - (force > 0.0 ? smaller(indentation, energy / force) : 0.0);
  }
  /// The tip's force where it has receded from there.
  BasicTipForce<Real> receding(const BasicTipForce<Real>& tip, Real depth) const noexcept {
    if (!(depth > retreat_limit)) return {};
    const Real length = larger(entry - retreat_limit, 1e-60), share = (depth - retreat_limit) / length;
    return {share * tip.force, share * tip.by_depth + tip.force / length};
  }
};
using Cut = BasicCut<double>;

/// Memory of a law that needs none.
struct NoMemory {};

/// What a friction law receives when it replaces a law of another kind.
template <class Real>
struct BasicTakenOver {
  Real held;    ///< traction [N/m], or force [N] for a law with `own_surface`
  Real dimple;  ///< share of the surface's dimple that has not recovered
  bool pierced;
};
using TakenOver = BasicTakenOver<double>;

/// The traction [N/m] with which a shaft of `length` [m] begins at the puncture: that of tissue dragged along
/// since the contact, up to `limit`. The force does not rise, and p^2 l / 2k is no more than the contact
/// leaves.
template <class Real>
Real traction_at_puncture(const BasicContactAtPuncture<Real>& contact, Real length, Real stiffness,
                          Real limit) noexcept {
  if (!(length > 0.0)) return 0.0;
  const Real dragged = stiffness * (contact.extent.puncture - contact.extent.top);
  const Real by_energy = sqrt(2.0 * stiffness * contact.free_energy / length);
  return std::min({limit, dragged, contact.free_force / length, by_energy, 2.0 * stiffness * length});
}

/// Memory of friction per embedded length: tissue that the shaft drags along before it slips.
template <class Real>
struct BasicTractionMemory {
  BasicElement<Real> element{};
  Real traction = 0.0;  ///< force per embedded length [N/m]

  Real held() const noexcept { return traction; }
  void take_over(const BasicTakenOver<Real>& taken) noexcept {
    element = BasicElement<Real>{taken.held};
    traction = taken.held;
  }
  /// The mean traction where unstrained tissue makes the shaft longer; `share` is the former length over the
  /// new.
  void thin(Real share) noexcept {
    traction *= share;
    element.elastic *= share;
    for (Real& memory : element.memory) memory *= share;
  }
  /// Begins with `traction_at_puncture`, relaxed as far as the contact: an element that has relaxed to a
  /// share of its elastic force holds at most the energy of a spring softer by that share.
  void pierce(const BasicContactAtPuncture<Real>& contact, Real length, Real stiffness, Real limit) noexcept {
    const Real elastic = contact.element.elastic;
    const Real left = elastic > contact.force ? contact.force / elastic : 1.0;
    traction = traction_at_puncture(contact, length, left * stiffness, limit);
    const Real share = contact.force > 0.0 ? traction / contact.force : 0.0;
    element = BasicElement<Real>{share * contact.element.elastic};
    for (int j = 0; j < 2; ++j) element.memory[j] = share * contact.element.memory[j];
  }
  void release() noexcept {
    element = BasicElement<Real>{};
    traction = 0.0;
  }
};
using TractionMemory = BasicTractionMemory<double>;

/// What slipped along a shaft in the last step: a traction [N/m] and its travel [m], in tissue of `stiffness`
/// [N/m^2].
template <class Real>
BasicSlip<Real> slip_along(const BasicShaft<Real>& shaft, Real traction, Real travel,
                           Real stiffness) noexcept {
  const Real straining = 0.5 * abs(traction) / stiffness * shaft.embedded_by_depth;
  return {travel, traction * larger(0.0, shaft.embedded - straining), traction * shaft.embedded_by_depth};
}

/// Looks at a memory from outside. One of other parts than doubles, or of smaller ranges, has a `check` of
/// its own; `most` is the largest force that the layer's contact can leave [N].
template <class M>
void check_memory(StateCheck& check, const char* part, const M& memory, double most) noexcept {
  if constexpr (requires { memory.check(check, part, most); })
    memory.check(check, part, most);
  else if constexpr (!std::is_empty_v<M>)
    check.numbers(part, memory);
}

/// One memory of each type. A law that another law replaces, in a deeper layer or in another model, keeps
/// its memory for the time when it is used again: docs/decisions/0012-memory-of-laws.md.
template <class M>
struct MemorySlot {
  [[no_unique_address]] M memory{};
};
template <class... M>
struct Memories : MemorySlot<M>... {
  template <class Wanted>
  [[gnu::always_inline]] Wanted& of() noexcept {
    return static_cast<MemorySlot<Wanted>&>(*this).memory;
  }
  template <class Wanted>
  [[gnu::always_inline]] const Wanted& of() const noexcept {
    return static_cast<const MemorySlot<Wanted>&>(*this).memory;
  }
  /// Calls `visit` with each memory.
  template <class Visit>
  void each(Visit visit) noexcept {
    (visit(of<M>()), ...);
  }
  void check(StateCheck& check, const char* part, double most) const noexcept {
    (check_memory(check, part, of<M>(), most), ...);
  }
};

/// The memory of the law that used it last: another kind of law finds a new one. A quarter of the bytes of
/// all memories side by side, which a state would have to copy.
template <class... M>
// Without <memory>, which takes longer to compile than all other headers of the library of C++ together.
class OneMemory {
  template <class Wanted>
  static constexpr std::uint64_t number = [] {
    std::uint64_t i = 0, found = 0;
    ((++i, found = std::is_same_v<M, Wanted> ? i : found), ...);
    return found;
  }();
  template <class Wanted>
  static constexpr Wanted unused{};

 public:
  template <class Wanted>
  [[gnu::always_inline]] Wanted& of() noexcept {
    if (number_ != number<Wanted>) begin<Wanted>();
    return *__builtin_launder(reinterpret_cast<Wanted*>(bytes_.data()));
  }
  template <class Wanted>
  [[gnu::always_inline]] const Wanted& of() const noexcept {
    return number_ == number<Wanted> ? *__builtin_launder(reinterpret_cast<const Wanted*>(bytes_.data()))
                                     : unused<Wanted>;
  }
  void check(StateCheck& check, const char* part, double most) const noexcept {
    (check_memory(check, part, of<M>(), most), ...);
  }

 private:
  template <class Wanted>
  [[gnu::noinline]] void begin() noexcept {
    bytes_ = {};
    const auto fresh = std::bit_cast<std::array<std::byte, sizeof(Wanted)>>(unused<Wanted>);
    std::copy(fresh.begin(), fresh.end(), bytes_.begin());
    number_ = number<Wanted>;
  }
  std::uint64_t number_ = 0;  // 0: none yet
  alignas(double) std::array<std::byte, std::max({sizeof(M)...})> bytes_{};
};

/// The memory of a prepared law among those of its family.
template <class PreparedLaw, template <class...> class Held, class... M>
[[gnu::always_inline]] inline auto& memory_of(const PreparedLaw&, Held<M...>& memories) noexcept {
  return memories.template of<typename PreparedLaw::Memory>();
}
template <class PreparedLaw, template <class...> class Held, class... M>
[[gnu::always_inline]] inline const auto& memory_of(const PreparedLaw&, const Held<M...>& memories) noexcept {
  return memories.template of<typename PreparedLaw::Memory>();
}

}  // namespace needleforce
