// SPDX-License-Identifier: Apache-2.0
// Upper bound of the force of a stack of layers for any motion, from the parameters of its laws,
// generously. The tip is within 1 m of the surface and is no faster than the engine allows.
#pragma once

#include <limits>
#include <span>

#include "needleforce/insertion.hpp"

namespace bounds {

using namespace needleforce;

inline constexpr double widest = 2.0 * farthest;  ///< [m] between two depths

/// Of a law that is not named below nothing is known but that it is finite.
template <class L>
double friction(const L&, double) {
  return std::numeric_limits<double>::max();
}
template <class L>
double cutting(const L&, double) {
  return std::numeric_limits<double>::max();
}

inline double friction(const laws::Coulomb& law, double) { return law.per_length * widest; }
inline double friction(const laws::RelaxingSurface& law, double) { return law.per_length * 2.0 * widest; }
inline double friction(const laws::Karnopp& law, double speed) {
  const double sliding =
      std::max(law.coulomb_in + law.viscous_in * speed, law.viscous_out * speed - law.coulomb_out);
  return std::max({sliding, law.static_in, -law.static_out}) * widest;
}
/// Bristles bent at rest spring back at speed against the weaker limit: 1 + F_s / F_c.
inline double friction(const laws::LuGre& law, double speed) {
  const double springing = law.bristle_damping * (1.0 + law.static_friction / law.coulomb);
  return (law.static_friction + (springing + law.viscous) * speed) * widest;
}
/// Its surface follows until the spring balances the grip: l = (z - z_r) / (1 - f'/k_t).
template <bool passive>
double friction(const laws::DraggedTissue<passive>& law, double) {
  const double outwards = law.per_length * std::max(1.0, law.withdrawal_ratio);
  const double grip = outwards * 2.0 * widest / (1.0 - outwards / law.stiffness);
  return std::max(grip, law.stiffness * 2.0 * widest);
}

/// The greater of a line and of the pressure where the bent shaft settles most.
template <class Form>
double friction(const laws::NonlinearFoundation<Form>& law, double) {
  const double ratio = law.settlement_ratio;
  const double most = ratio * (1.0 + law.bending_length / law.deflection_length);
  const double grows = ratio > 0.0 ? Form::pressure(most) / Form::pressure(ratio) : most;
  return law.per_length * (1.0 + grows + law.bending_length / law.deflection_length) * widest;
}
/// The contact that is left is no stronger than the stiffness law's, which is counted with it.
inline double friction(const laws::YieldingTissue& law, double speed) {
  return friction(laws::DraggedTissuePassive{law.per_length, law.stiffness, law.rupture_length, 0.0,
                                             law.withdrawal_ratio},
                  speed);
}
/// As above; what is left is no deeper in than the tip.
inline double friction(const laws::YieldingCoulomb& law, double speed) {
  return friction(laws::Coulomb{law.per_length, law.presliding, 0.0}, speed);
}

inline double cutting(const laws::ConstantCutting& law, double) { return law.force; }
inline double cutting(const laws::Fracture& law, double) { return law.prepare().steady(0.0); }
inline double cutting(const laws::NoCutting&, double) { return 0.0; }
/// A spring to the crack, which the tip cannot stretch further than it goes.
inline double cutting(const laws::StickSlip& law, double speed) {
  return law.break_force + law.damping * speed + law.stiffness * widest;
}
inline double cutting(const laws::StribeckCutting& law, double speed) {
  return law.static_force + law.damping * speed + law.stiffness * widest;
}

/// The largest velocity [m/s] that agrees with a travel at the speed limit.
inline double fastest_accepted(const Limits& limits) {
  const double ratio = limits.velocity_slack_ratio;
  const double agreeing = (limits.max_speed + limits.velocity_slack) / (1.0 - ratio);
  return ratio < 1.0 ? std::min(fastest, 1.001 * agreeing) : fastest;
}

struct Parts {
  double stiffness = 0.0, friction = 0.0, cutting = 0.0;
};

/// Of each part of the force [N]; what a contact held, friction and cutting may take over.
inline Parts of(std::span<const Layer> layers, double speed) {
  Parts most;
  for (const Layer& layer : layers) {
    const auto contact = prepare(layer.laws.stiffness);
    most.stiffness += 3.0 * std::visit([](const auto& law) { return law.force(farthest); }, contact);
    most.friction += std::visit([&](const auto& law) { return friction(law, speed); }, layer.laws.friction);
    most.cutting += std::visit([&](const auto& law) { return cutting(law, speed); }, layer.laws.cutting);
  }
  return {most.stiffness, most.friction + most.stiffness, most.cutting + most.stiffness};
}

}  // namespace bounds
