// SPDX-License-Identifier: Apache-2.0
// Layers as the C face takes them: laws and tips by name, parameters from the tables.
#pragma once

#include <deque>
#include <span>
#include <vector>

#include "../../bindings/c/needleforce.h"
#include "needleforce/insertion.hpp"

/// The plain structs of some layers; the tips they point to live as long as this.
class CLayers {
 public:
  explicit CLayers(std::span<const needleforce::Layer> layers) {
    for (const needleforce::Layer& layer : layers)
      layers_.push_back({layer.top, law(layer.laws.stiffness), law(layer.laws.puncture),
                         law(layer.laws.friction), law(layer.laws.cutting), law(layer.laws.relaxation)});
  }
  nf_layer* data() { return layers_.data(); }
  std::size_t size() const { return layers_.size(); }

 private:
  template <class T>
  static void name_parameters(const T& value, nf_parameter* parameters) {
    for (const auto& parameter : T::table) *parameters++ = {parameter.name, value.*parameter.member};
  }
  nf_tip tip(const needleforce::tips::Profile& profile) {
    profiles_.push_back(profile);
    const auto& kept = profiles_.back();
    return {profile.name, {}, nullptr, kept.radius.data(), kept.rise.data(), std::size_t(profile.count)};
  }
  template <class Shape>
  nf_tip tip(const Shape& shape) {
    nf_tip named{shape.name, {}, nullptr, nullptr, nullptr, 0};
    name_parameters(shape, named.parameters);
    if constexpr (requires { shape.equivalence; })
      named.equivalence = needleforce::tips::bevel_equivalence_names[std::size_t(shape.equivalence)];
    return named;
  }
  template <class... L>
  nf_law law(const std::variant<L...>& laws) {
    return std::visit(
        [this](const auto& law) {
          nf_law named{law.name, {}, nullptr};
          name_parameters(law, named.parameters);
          if constexpr (requires { law.tip; }) {
            tips_.push_back(std::visit([this](const auto& shape) { return this->tip(shape); }, law.tip));
            named.tip = &tips_.back();
          }
          return named;
        },
        laws);
  }
  std::vector<nf_layer> layers_;
  std::deque<nf_tip> tips_;
  std::deque<needleforce::tips::Profile> profiles_;
};
