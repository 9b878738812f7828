// SPDX-License-Identifier: Apache-2.0
// Laws along the path: which friction each node can bear, and what the tip meets.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>
#include <variant>

#include "../dispatch.hpp"
#include "../model.hpp"
#include "../sliding.hpp"
#include "condensed_tissue.hpp"

namespace needleforce::solid {

/// Largest compliance between shaft and tissue at a node [m/N], where the shaft covers next to nothing of it.
inline constexpr double max_presliding_compliance = 1e12;

/// Bounds of the force of a node [N], and the compliance [m/N] of what is between shaft and tissue.
struct FrictionBounds {
  double low = 0.0, high = 0.0, compliance = 0.0;
};

/// One layer's laws, prepared.
class PathLayer {
 public:
  PathLayer() = default;
  explicit PathLayer(const Layer& layer) noexcept
      : top(layer.top),
        contact_(prepare(layer.laws.stiffness)),
        friction_(prepare(layer.laws.friction)),
        cutting_(prepare(layer.laws.cutting)),
        criterion_(layer.laws.puncture),
        puncture(puncture_depth(layer.laws.puncture, contact_)),
        breaks_at(law_of_contact(puncture)) {}

  /// The law of contact [N], continued by a line where it would be stiffer than the solid around the tip.
  double contact_force(double indentation) const noexcept {
    if (indentation <= 0.0) return 0.0;
    const double within = std::min(indentation, linear_from);
    return law_of_contact(within) + (indentation - within) * solid_stiffness;
  }
  /// Its derivative by the indentation [N/m].
  double contact_slope(double indentation) const noexcept {
    if (indentation <= 0.0) return 0.0;
    return indentation < linear_from ? slope_of_contact(indentation) : solid_stiffness;
  }
  /// Energy of the contact [J].
  double contact_energy(double indentation) const noexcept {
    if (indentation <= 0.0) return 0.0;
    const double within = std::min(indentation, linear_from), beyond = indentation - within;
    const double energy = dispatch(contact_, [&](const auto& law) { return law.energy(within); });
    return energy + beyond * (law_of_contact(within) + 0.5 * beyond * solid_stiffness);
  }
  /// Force at which the tip breaks through, without relaxation [N].
  double puncture_force() const noexcept { return breaks_at; }
  /// True for a contact that has relaxed to a force [N], with its work [J].
  bool breaks(double force, double work) const noexcept {
    return dispatch(criterion_, [&](const auto& law) { return law.breaks(force, work); });
  }
  /// Before the loop, of a layer below others: no stiffer than the solid, whose compliance [m/N] to a load at
  /// its top this is. Tip and shaft are springs side by side there; if each were stiffer alone, they would
  /// have no balance.
  void limit(double compliance) noexcept {
    solid_stiffness = 1.0 / compliance;
    if (slope_of_contact(puncture) <= solid_stiffness) return;
    double low = 0.0, high = puncture;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (slope_of_contact(middle) <= solid_stiffness ? low : high) = middle;
    }
    linear_from = low;
  }
  /// Friction per length [N/m] while sliding at a velocity [m/s], whose sign is that of the direction.
  double sliding(double velocity) const noexcept {
    return dispatch(friction_, [&](const auto& law) -> double {
      if constexpr (SlidesSteadily<std::remove_cvref_t<decltype(law)>>)
        return law.sliding(1.0, velocity);
      else
        return 0.0;
    });
  }
  /// Of what is between shaft and tissue before they slide, per length [N/m^2]; infinite without.
  double presliding_stiffness() const noexcept {
    return dispatch(friction_, [&](const auto& law) -> double {
      if constexpr (requires { law.per_length / law.stiffness; })
        return law.stiffness;
      else
        return std::numeric_limits<double>::infinity();
    });
  }
  double cutting(double speed) const noexcept {
    return dispatch(cutting_, [&](const auto& law) { return law.steady(speed); });
  }

  double top = 0.0;  ///< [m]

 private:
  double law_of_contact(double indentation) const noexcept {
    return dispatch(contact_, [&](const auto& law) { return law.force(indentation); });
  }
  double slope_of_contact(double indentation) const noexcept {
    return dispatch(contact_, [&](const auto& law) { return law.slope(indentation); });
  }

  Prepared<Stiffness> contact_{};
  Prepared<Friction> friction_{};
  Prepared<Cutting> cutting_{};
  Puncture criterion_{};

 public:
  double puncture = 0.0;  ///< indentation at which the law would break through [m]

 private:
  double breaks_at = 0.0, solid_stiffness = 0.0;
  double linear_from = std::numeric_limits<double>::max();
};

/// What is wrong with a layer for a solid, nullptr if nothing is. Not for the loop.
inline const char* solid_fault(const Layer& layer) noexcept {
  Model laws = layer.laws;
  if (std::holds_alternative<laws::Prony>(laws.relaxation)) laws.relaxation = laws::NoRelaxation{};
  if (!slides_steadily(laws))
    return "the friction law has no sliding force without memory, or the model relaxes otherwise than by "
           "prony";
  const bool per_length = std::visit(
      []<class L>(const L&) { return !requires(const typename L::Prepared& law) { law.effective(1.0); }; },
      layer.laws.friction);
  return per_length ? nullptr : "the friction law has no force per length that is the same along the shaft";
}

inline bool relax_alike(const Relaxation& one, const Relaxation& other) noexcept {
  const auto *first = std::get_if<laws::Prony>(&one), *second = std::get_if<laws::Prony>(&other);
  if (!first || !second) return !first && !second;
  return std::ranges::all_of(laws::Prony::table,
                             [&](const auto& each) { return first->*each.member == second->*each.member; });
}

/// The same of a stack.
inline const char* solid_fault(std::span<const Layer> layers) noexcept {
  for (const Layer& layer : layers) {
    if (const char* reason = solid_fault(layer)) return reason;
    if (!relax_alike(layers.front().laws.relaxation, layer.laws.relaxation))
      return "its layers do not all relax alike, and a solid has one relaxation";
  }
  return nullptr;
}

/// A stack of layers along a path.
class PathLayers {
 public:
  PathLayers() = default;
  PathLayers(std::span<const Layer> layers, const CondensedTissue& tissue) noexcept
      : relaxation_(prepare(layers.front().laws.relaxation)),
        count_(layers.size()),
        spacing_(tissue.spacing) {
    for (std::size_t i = 0; i < count_; ++i) {
      layers_[i] = PathLayer(layers[i]);
      presliding_[i] = layers_[i].presliding_stiffness();
      if (i > 0) layers_[i].limit(BetweenNodes::at(layers_[i].top, tissue).compliance(tissue));
    }
  }
  std::size_t count() const noexcept { return count_; }
  /// Over a time [s].
  Relaxing relaxing(double dt) const noexcept {
    return dispatch(relaxation_, [&](const auto& law) { return law.over(dt); });
  }
  const PathLayer& operator[](std::size_t i) const noexcept { return layers_[i]; }

  /// Friction per length at a speed [m/s], in both directions, before `bounds` is asked.
  void at_speed(double speed) noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
      inwards_[i] = std::max(0.0, layers_[i].sliding(speed));
      outwards_[i] = std::min(0.0, layers_[i].sliding(-speed));
    }
  }
  /// Of each node, for a shaft that ends at a distance along the path [m].
  void bounds(std::span<FrictionBounds> nodes, double tip) const noexcept {
    std::ranges::fill(nodes, FrictionBounds{});
    std::array<double, max_path_nodes> stiffness{};
    for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
      const double from = spacing_ * static_cast<double>(k);
      const double covered = std::clamp(tip - from, 0.0, spacing_);
      if (covered == 0.0) break;
      for (std::size_t layer = at(from); layer < count_; ++layer) {
        const double begin = std::clamp(layers_[layer].top - from, 0.0, covered);
        const double next = layer + 1 < count_ ? layers_[layer + 1].top - from : covered;
        const double end = std::clamp(next, begin, covered);
        // integrals of both hat functions over what is covered of this layer
        const double far = 0.5 * (end * end - begin * begin) / spacing_, near = end - begin - far;
        for (const auto& [node, length] : {std::pair{k, near}, std::pair{k + 1, far}}) {
          if (length <= 0.0) continue;
          nodes[node].high += length * inwards_[layer];
          nodes[node].low += length * outwards_[layer];
          stiffness[node] += length * presliding_[layer];
        }
        if (end >= covered) break;
      }
    }
    for (std::size_t k = 0; k < nodes.size(); ++k)
      if (stiffness[k] > 0.0) nodes[k].compliance = std::min(1.0 / stiffness[k], max_presliding_compliance);
  }
  /// Energy per length that strains the tissue which a tip adds to a shaft that slides [N].
  double straining(double tip) const noexcept {
    const std::size_t i = at(tip);
    return 0.5 * inwards_[i] * inwards_[i] / presliding_[i];
  }
  /// The layer at a distance along the path [m].
  std::size_t at(double distance) const noexcept {
    std::size_t i = 0;
    while (i + 1 < count_ && distance >= layers_[i + 1].top) ++i;
    return i;
  }

 private:
  std::array<PathLayer, max_layers> layers_{};
  std::array<double, max_layers> presliding_{}, inwards_{}, outwards_{};
  Prepared<Relaxation> relaxation_{};
  std::size_t count_ = 0;
  double spacing_ = 1.0;
};

}  // namespace needleforce::solid
