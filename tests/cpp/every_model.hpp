// SPDX-License-Identifier: Apache-2.0
// Models for whole insertions: the paper's values where it has them, else values of soft tissue, for every
// law.
#pragma once

#include <vector>

#include "every_law.hpp"
#include "paper.hpp"

/// A law with the numbers of an insertion like the paper's; a law that is not named here with its middle
/// ones.
template <class L>
L usual() {
  return middle<L>();
}
template <>
inline laws::Cone usual() {
  return {116e3, paper::half_angle};
}
template <>
inline laws::ConeCylinder usual() {
  return {116e3, paper::half_angle, 0.35e-3};
}
template <>
inline laws::PowerLaw usual() {
  return {0.2, 1.6, paper::puncture};
}
template <>
inline laws::Polynomial usual() {
  return {20.0, 1.4e4};
}
template <>
inline laws::Exponential usual() {
  return {300.0, 0.12};
}
template <>
inline laws::PunctureDepth usual() {
  return {paper::puncture};
}
template <>
inline laws::PunctureForce usual() {
  return {0.15};
}
template <>
inline laws::PunctureEnergy usual() {
  return {1.5e-4};
}
template <>
inline laws::Coulomb usual() {
  return {paper::friction, 20e-6, 0.25};
}
template <>
inline laws::RelaxingSurface usual() {
  return {paper::friction, 20e-6, 2.0, 81.2, paper::cutting};
}
template <>
inline laws::Karnopp usual() {
  return {10.57, -11.96, 212.13, 293.08, 18.45, -18.23, 1e-4, 20e-6};
}
template <>
inline laws::LuGre usual() {
  return {1e6, 100.0, 200.0, 18.0, 25.0, 1e-3, 2.0};
}
template <>
inline laws::DraggedTissuePassive usual() {
  return {40.0, 220.0, 0.4e-3, 1e-3};
}
template <>
inline laws::DraggedTissueAsFitted usual() {
  return {40.0, 220.0, 0.4e-3, 1e-3};
}
template <>
inline laws::CubicFoundation usual() {
  return {paper::friction, 0.7, 12e-3, 0.1, 20e-6, 0.25};
}
template <>
inline laws::HyperbolicFoundation usual() {
  return {paper::friction, 1.5, 12e-3, 15e-3, 20e-6, 0.25};
}
template <>
inline laws::TanhFoundation usual() {
  return {paper::friction, 1.5, 12e-3, 1.0, 20e-6, 0.25};
}
template <>
inline laws::YieldingTissue usual() {
  return {40.0, 220.0, 0.4e-3, 1e-3, 2.0, 1e-3};
}
template <>
inline laws::YieldingCoulomb usual() {
  return {paper::friction, 20e-6, 0.4e-3, 2.0};
}
template <>
inline laws::ConstantCutting usual() {
  return {paper::cutting, 20e-6};
}
template <>
inline laws::Fracture usual() {
  return {110.9, 0.7e-3, 154667.0, 0.35e-3, 0.4, 20e-6};
}
template <>
inline laws::StickSlip usual() {
  return {0.10, 0.04, 1.5e-3, 25.07, 200.0};
}
template <>
inline laws::StribeckCutting usual() {
  return {0.10, 0.0033, 0.5714e-3, 20.73, 200.0, 2e-3};
}
template <>
inline laws::Prony usual() {
  return {0.31, 0.7, 0.26, 5.0};
}
template <>
inline laws::PronyLocked usual() {
  return {0.31, 0.7, 0.26, 5.0};
}
template <>
inline laws::PronyAtRest usual() {
  return {0.31, 0.7, 0.26, 5.0};
}

/// Every law on a list.
template <class Laws>
std::vector<Laws> each() {
  return []<class... L>(std::variant<L...>*) {
    return std::vector<Laws>{Laws{usual<L>()}...};
  }(static_cast<Laws*>(nullptr));
}

inline bool stands_alone(const Friction& friction) {
  return std::visit([]<class L>(const L&) { return detail::stands_alone<L>; }, friction);
}
inline const char* name_of(const auto& law) {
  return std::visit([](const auto& one) { return one.name; }, law);
}
inline std::string name_of(const Model& model) {
  return std::string(name_of(model.stiffness)) + " " + name_of(model.puncture) + " " +
         name_of(model.friction) + " " + name_of(model.cutting) + " " + name_of(model.relaxation);
}

/// Friction laws with each cutting and relaxation law that goes with them.
inline std::vector<Model> every_combination() {
  std::vector<Model> models;
  for (const auto& friction : each<Friction>())
    for (const auto& cutting : each<Cutting>())
      for (const auto& relaxation : each<Relaxation>())
        models.push_back({usual<laws::Cone>(), usual<laws::PunctureDepth>(), friction, cutting, relaxation});
  std::erase_if(models, [](const Model& model) { return !valid(model); });
  return models;
}

/// Every combination, and each stiffness and puncture law with the others at the paper's values and with
/// Prony.
inline std::vector<Model> every_model() {
  std::vector<Model> models = every_combination();
  for (const auto& relaxation : each<Relaxation>())
    for (const auto& stiffness : each<Stiffness>())
      for (const auto& puncture : each<Puncture>())
        models.push_back(
            {stiffness, puncture, usual<laws::Coulomb>(), usual<laws::ConstantCutting>(), relaxation});
  return models;
}
