// SPDX-License-Identifier: Apache-2.0
// A model: one law for each part of the force in each layer, checked and prepared before the loop.
#pragma once

#include <cstddef>
#include <span>
#include <type_traits>
#include <variant>

#include "dispatch.hpp"
#include "laws/all.hpp"

namespace needleforce {

/// One law of each family. Plain values: all that an insertion into one layer needs.
template <class Real>
struct BasicModel {
  BasicStiffness<Real> stiffness;
  BasicPuncture<Real> puncture;
  BasicFriction<Real> friction;
  BasicCutting<Real> cutting;
  BasicRelaxation<Real> relaxation{};
};
using Model = BasicModel<double>;
// found here, for g++ 12 fails where a program with a precompiled header is the first to ask
static_assert(std::is_nothrow_default_constructible_v<Relaxation> &&
              std::is_nothrow_default_constructible_v<Model>);

/// A layer from a depth `top` [m] below the undeformed surface on, with the laws of its own. Its puncture is
/// counted from its top.
template <class Real>
struct BasicLayer {
  Real top = 0.0;
  BasicModel<Real> laws;
};
using Layer = BasicLayer<double>;

/// Largest number of layers of an insertion.
inline constexpr std::size_t max_layers = 8;

namespace detail {
template <class Variant>
struct prepared_variant;
template <class... L>
struct prepared_variant<std::variant<L...>> {
  using type = std::variant<typename L::Prepared...>;
};

/// The memories of a list of laws, each type once.
template <class Found, class... Rest>
struct memories {
  using type = Found;
};
template <class... M, class Next, class... Rest>
struct memories<Memories<M...>, Next, Rest...>
    : memories<std::conditional_t<(std::is_same_v<M, Next> || ...), Memories<M...>, Memories<M..., Next>>,
               Rest...> {};
template <class Variant>
struct memories_of;
template <class... L>
struct memories_of<std::variant<L...>> : memories<Memories<>, typename L::Prepared::Memory...> {};

template <class All>
struct one_of;
template <class... M>
struct one_of<Memories<M...>> {
  using type = OneMemory<M...>;
};

template <class L>
constexpr bool counts_cutting = requires { L::cuts; };
/// Layers of such laws add up; of others, the tip can be in one interface only.
template <class L>
constexpr bool stands_alone = requires { L::stands_alone; };
template <class L>
constexpr bool needs_surface = requires { L::needs_surface; };
}  // namespace detail

/// A family's laws with everything computed that does not change in the loop.
template <class Laws>
using Prepared = typename detail::prepared_variant<Laws>::type;

/// What the laws of a list remember between two steps, where one follows another.
template <class Laws>
using MemoriesOf = typename detail::memories_of<Laws>::type;

/// What one law of a list remembers.
template <class Laws>
using MemoryOf = typename detail::one_of<MemoriesOf<Laws>>::type;

template <class... L>
Prepared<std::variant<L...>> prepare(const std::variant<L...>& laws) noexcept {
  return dispatch(laws, [](const auto& law) { return Prepared<std::variant<L...>>{law.prepare()}; });
}

/// The depth [m] from the top of its layer at which an elastic contact punctures, whatever its criterion.
template <class Real>
Real puncture_depth(const BasicPuncture<Real>& puncture,
                    const Prepared<BasicStiffness<Real>>& stiffness) noexcept {
  return dispatch(stiffness, [&](const auto& contact) {
    return dispatch(puncture, [&](const auto& law) { return law.puncture_depth(contact); });
  });
}

/// What is wrong with a model: in which layer, which quantity, and why; `reason` is nullptr if nothing is.
struct Fault {
  std::size_t layer = 0;
  const char* quantity = nullptr;
  const char* reason = nullptr;
};

namespace detail {

template <class Laws>
Fault fault_of(const Laws& laws) noexcept {
  return dispatch(laws, [](const auto& law) -> Fault {
    if (const auto* parameter = first_invalid(law)) return {0, parameter->name, "outside its range"};
    if (const tips::Flaw flaw = flaw_of(law); flaw.limit) return {0, flaw.quantity, flaw.limit};
    return {0, law.name, contradiction(law)};
  });
}

inline Fault counted_twice(const Model& model) noexcept {
  const bool tip = dispatch(model.friction, []<class F>(const F&) { return counts_cutting<F>; }) &&
                   dispatch(model.cutting, []<class C>(const C&) { return counts_cutting<C>; });
  if (tip) return {0, "cutting", "the friction law counts the force at the tip already: take no_cutting"};
  const bool creep = dispatch(model.friction, []<class F>(const F&) { return needs_surface<F>; }) &&
                     !std::holds_alternative<laws::NoRelaxation>(model.relaxation);
  return {0, "relaxation", creep ? "the friction law counts the creep of the surface already" : nullptr};
}

/// A law that can tell from its parameters that it would return energy is refused in a loop.
inline Fault returned_energy(const Model& model) noexcept {
  return dispatch(model.friction, []<class F>(const F& law) -> Fault {
    if constexpr (requires { law.returns_energy(); })
      return {0, "viscous", law.returns_energy()};
    else
      return {};
  });
}

inline Fault fault_of_laws(const Model& model) noexcept {
  for (const Fault& fault :
       {fault_of(model.stiffness), fault_of(model.puncture), fault_of(model.friction),
        fault_of(model.cutting), fault_of(model.relaxation), counted_twice(model), returned_energy(model)})
    if (fault.reason) return fault;
  return {};
}

inline bool adds(const Model& model) noexcept {
  return dispatch(model.friction, []<class F>(const F&) { return stands_alone<F>; });
}

inline bool at_surface_alone(const Model& model) noexcept {
  return dispatch(model.friction, []<class F>(const F&) { return needs_surface<F>; });
}

inline const char* fault_of_place(const Layer& layer, const Layer* above) noexcept {
  if (!above) return layer.top == 0.0 ? nullptr : "the first layer's top is the undeformed surface, depth 0";
  if (!(layer.top > above->top)) return "layers overlap or are out of order";
  if (!(layer.top <= 1.0)) return "deeper than 1 m, where no needle goes";
  if (adds(above->laws) != adds(layer.laws))
    return "layers of dragged tissue add up, others end at the next: the shaft would be counted twice";
  if (at_surface_alone(layer.laws)) return "its friction law is for the surface of the tissue alone";
  const double punctures = above->top + puncture_depth(above->laws.puncture, prepare(above->laws.stiffness));
  if (punctures > layer.top && !(adds(above->laws) && adds(layer.laws)))
    return "the layer above punctures below this top: the tip would stand in two interfaces";
  return nullptr;
}

/// The first layer whose contact is that of a tip.
inline const laws::TipContact* first_tip(std::span<const Layer> layers) noexcept {
  for (const Layer& layer : layers)
    if (const auto* law = std::get_if<laws::TipContact>(&layer.laws.stiffness)) return law;
  return nullptr;
}

/// A needle has one tip, and an insertion one table for it.
inline const char* fault_of_tip(const Layer& layer, const laws::TipContact* first) noexcept {
  const auto* law = std::get_if<laws::TipContact>(&layer.laws.stiffness);
  const bool same = !law || (law->tip == first->tip && law->radius == first->radius);
  return same ? nullptr : "not the tip and the radius of the layers above: a needle has one of each";
}

}  // namespace detail

/// The first fault of a stack of layers from the surface down, or one without a reason. For use before the
/// loop.
inline Fault first_fault(std::span<const Layer> layers) noexcept {
  if (layers.empty() || layers.size() > max_layers) return {0, "layers", "not between 1 and 8"};
  const laws::TipContact* const tip = detail::first_tip(layers);
  for (std::size_t i = 0; i < layers.size(); ++i) {
    Fault fault = detail::fault_of_laws(layers[i].laws);
    if (!fault.reason) fault = {i, "top", detail::fault_of_place(layers[i], i ? &layers[i - 1] : nullptr)};
    if (!fault.reason) fault = {i, "tip", detail::fault_of_tip(layers[i], tip)};
    fault.layer = i;
    if (fault.reason) return fault;
  }
  return {};
}

/// True if every parameter of every law is in its range and the laws do not contradict each other.
inline bool valid(const Model& model) noexcept { return detail::fault_of_laws(model).reason == nullptr; }

/// The table of a needle's tip, with which all layers are prepared; without such a contact one that none
/// reads.
inline TipTable table_of_tip(std::span<const Layer> layers) noexcept {
  const laws::TipContact* const law = detail::first_tip(layers);
  return law ? TipTable(law->tip, law->radius) : TipTable();
}
/// True where one table is enough for both.
inline bool same_tip(std::span<const Layer> layers, std::span<const Layer> others) noexcept {
  const laws::TipContact *const law = detail::first_tip(layers), *const other = detail::first_tip(others);
  return law && other ? law->tip == other->tip && law->radius == other->radius : law == other;
}

}  // namespace needleforce
