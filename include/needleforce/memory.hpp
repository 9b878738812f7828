// SPDX-License-Identifier: Apache-2.0
// What friction and cutting remember between two steps. The part that the loop reads is the same for every
// law; the rest is the `Memory` of the law. All of it is plain numbers, so that a snapshot is a copy.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "relaxation.hpp"

namespace needleforce {

/// The extent of a layer along the shaft [m]; the bottom is the surface of the next layer, or infinity.
struct LayerExtent {
  double top;
  double puncture;  ///< depth at which the layer punctures, or has punctured
  double bottom;
  bool pierced;
  /// Where the same tissue begins, above interfaces that do not resist; its own surface is above or equal.
  double root = std::numeric_limits<double>::infinity();
};

/// The state of a contact when its layer is punctured.
struct ContactAtPuncture {
  Element element;
  double force;   ///< [N]
  double energy;  ///< stored, without relaxation [J]
  double slope;   ///< dF/dh, without relaxation [N/m]
  /// What friction may take over: force [N] and energy [J] apart from the cut's.
  double free_force = 0.0, free_energy = 0.0;
  LayerExtent extent{};
  double depth = 0.0;  ///< of the tip [m]
};

/// Embedded length [m] of a shaft between the surface where embedding starts and its end, the tip or the
/// bottom of the layer. Not a number if the end is none.
inline double embedded_length(double end, double surface) noexcept {
  return end <= surface ? 0.0 : end - surface;
}

/// Limits of a traction [N/m].
struct Traction {
  double low, high;
};

/// The shaft in one layer. A friction law counts the embedded length with `embed`; `dragged_tissue`, whose
/// layers add up, counts down to the tip, through all layers.
struct Shaft {
  double surface = 0.0;            ///< depth [m] where embedding starts
  double embedded = 0.0;           ///< embedded length [m], 0 in a layer that is not pierced
  double embedded_by_depth = 0.0;  ///< d(embedded) / d(depth)

  /// Sets the embedded length of the tip at `depth` in a layer where embedding starts at `from` [m].
  void embed(const LayerExtent& extent, double depth, double from) noexcept {
    surface = from;
    // as embedded_length; written out, it takes a fifth off the shortest step
    const double end = depth < extent.bottom ? depth : extent.bottom;
    const bool inside = extent.pierced && end > from;
    embedded = inside ? end - from : 0.0;
    embedded_by_depth = inside && depth < extent.bottom ? 1.0 : 0.0;
  }
  /// The limits of the traction of tissue of `stiffness` [N/m^2] that slides at `low` and `high` [N/m]. A
  /// length dl that the tip adds to the shaft holds the energy p^2 / 2k that all others hold; slip, which
  /// dissipates p l, pays for it up to p = 2 k l. docs/decisions/0013-energy.md.
  Traction limits(const LayerExtent& extent, double stiffness, double low, double high) const noexcept {
    if (!(embedded > 0.0)) return {0.0, 0.0};
    if (embedded_by_depth == 0.0) return {low, high};  // the tip is below the layer
    const double length = embedded + std::max(0.0, surface - extent.root);
    return {low, std::min(high, 2.0 * stiffness * length)};
  }
  /// The needle has left the tissue.
  void release() noexcept { embedded = embedded_by_depth = 0.0; }
};

/// The cut at the tip.
struct Cut {
  double entry = 0.0;          ///< depth [m] at which cutting began
  double retreat_limit = 0.0;  ///< depth [m] above which the cut has no force
  double front = 0.0;          ///< deepest cut, or tip of the crack [m]
};

/// Memory of a law that needs none.
struct NoMemory {};

/// What a friction law receives when it replaces a law of another kind.
struct TakenOver {
  double held;    ///< traction [N/m], or force [N] for a law with `own_surface`
  double dimple;  ///< share of the surface's dimple that has not recovered
  bool pierced;
};

/// The traction [N/m] with which a shaft of `length` [m] begins at the puncture: that of tissue dragged along
/// since the contact, up to `limit`. The force does not rise, and p^2 l / 2k is no more than the contact
/// leaves.
inline double traction_at_puncture(const ContactAtPuncture& contact, double length, double stiffness,
                                   double limit) noexcept {
  if (!(length > 0.0)) return 0.0;
  const double dragged = stiffness * (contact.extent.puncture - contact.extent.top);
  const double by_energy = std::sqrt(2.0 * stiffness * contact.free_energy / length);
  return std::min({limit, dragged, contact.free_force / length, by_energy, 2.0 * stiffness * length});
}

/// Memory of friction per embedded length: tissue that the shaft drags along before it slips.
struct TractionMemory {
  Element element{};
  double traction = 0.0;  ///< force per embedded length [N/m]

  double held() const noexcept { return traction; }
  void take_over(const TakenOver& taken) noexcept {
    element = Element{taken.held};
    traction = taken.held;
  }
  /// The mean traction where unstrained tissue makes the shaft longer; `share` is the former length over the
  /// new.
  void thin(double share) noexcept {
    traction *= share;
    element.elastic *= share;
    for (double& memory : element.memory) memory *= share;
  }
  /// Begins with `traction_at_puncture`, relaxed as far as the contact.
  void pierce(const ContactAtPuncture& contact, double length, double stiffness, double limit) noexcept {
    traction = traction_at_puncture(contact, length, stiffness, limit);
    const double share = contact.force > 0.0 ? traction / contact.force : 0.0;
    element = Element{share * contact.element.elastic};
    for (int j = 0; j < 2; ++j) element.memory[j] = share * contact.element.memory[j];
  }
  void release() noexcept {
    element = Element{};
    traction = 0.0;
  }
};

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
};

/// The memory of a prepared law among those of its family.
template <class PreparedLaw, class... M>
[[gnu::always_inline]] inline auto& memory_of(const PreparedLaw&, Memories<M...>& memories) noexcept {
  return memories.template of<typename PreparedLaw::Memory>();
}
template <class PreparedLaw, class... M>
[[gnu::always_inline]] inline const auto& memory_of(const PreparedLaw&,
                                                    const Memories<M...>& memories) noexcept {
  return memories.template of<typename PreparedLaw::Memory>();
}

}  // namespace needleforce
