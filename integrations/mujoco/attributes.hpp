// SPDX-License-Identifier: Apache-2.0
// The XML attributes of the plugin: the laws' parameters by name, from the laws' own tables. A law may carry
// its parameters, "coulomb per_length=18.6"; those of the first layer have keys of their own as well,
// friction.per_length. MuJoCo takes no more than 255 keys, which all of them for eight layers would exceed.
// For use before the loop.
#pragma once

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <deque>
#include <string>
#include <tuple>
#include <vector>

#include "by_name.hpp"

namespace needleforce::mujoco {

/// What a family or a tip takes: the names of the parameters of all that may be chosen.
using Names = std::vector<const char*>;

inline void add_once(Names& names, const char* name) {
  const auto same = [&](const char* other) { return c::same(name, other); };
  if (std::none_of(names.begin(), names.end(), same)) names.push_back(name);
}

template <class... T>
Names parameters_of(const std::variant<T...>*) {
  Names names;
  const auto add = [&]<class Choice>(const Choice&) {
    if constexpr (Parameterised<Choice>)
      for (const auto& parameter : Choice::table) add_once(names, parameter.name);
  };
  (add(T{}), ...);
  return names;
}

template <class Variant>
Names parameters_of() {
  return parameters_of(static_cast<const Variant*>(nullptr));
}

struct FamilyNames {
  const char* name;
  nf_law nf_layer::* law;
  Names parameters;
};

inline const std::array<FamilyNames, 5>& families() {
  static const std::array<FamilyNames, 5> all{
      {{"stiffness", &nf_layer::stiffness, parameters_of<Stiffness>()},
       {"puncture", &nf_layer::puncture, parameters_of<Puncture>()},
       {"friction", &nf_layer::friction, parameters_of<Friction>()},
       {"cutting", &nf_layer::cutting, parameters_of<Cutting>()},
       {"relaxation", &nf_layer::relaxation, parameters_of<Relaxation>()}}};
  return all;
}

inline const Names& tip_parameters() {
  static const Names names = parameters_of<Tip>();
  return names;
}

/// "" for the first layer, "layer2." for the second.
inline std::string layer_prefix(std::size_t layer) {
  return layer == 0 ? "" : "layer" + std::to_string(layer + 1) + ".";
}

inline const char* const place_attributes[] = {"joint", "site", "surface.site", "surface.height",
                                               "surface.normal"};
inline const char* const setting_attributes[] = {"max_speed", "bevel.half_angle",
                                                 "bevel.friction_coefficient", "bevel.face_share"};

inline const char* const tip_words[] = {"equivalence", "radii", "heights"};

/// Every attribute; MuJoCo refuses others.
inline const std::deque<std::string>& attributes() {
  static const std::deque<std::string> all = [] {
    std::deque<std::string> names(std::begin(place_attributes), std::end(place_attributes));
    names.insert(names.end(), std::begin(setting_attributes), std::end(setting_attributes));
    for (std::size_t layer = 0; layer < max_layers; ++layer) {
      const std::string prefix = layer_prefix(layer);
      if (layer > 0) names.push_back(prefix + "top");
      for (const FamilyNames& family : families()) names.push_back(prefix + family.name);
      names.push_back(prefix + "stiffness.tip");
    }
    for (const FamilyNames& family : families())
      for (const char* name : family.parameters) names.push_back(std::string(family.name) + "." + name);
    for (const char* name : tip_parameters()) names.push_back(std::string("stiffness.tip.") + name);
    for (const char* name : tip_words) names.push_back(std::string("stiffness.tip.") + name);
    return names;
  }();
  return all;
}

}  // namespace needleforce::mujoco
