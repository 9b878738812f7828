// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "../law.hpp"

namespace needleforce::laws {

/// The smooth variant of stick-slip cutting: a crack front of mass m against a force that falls with speed
/// and rises again,
///
///     m dv/dt = F - F_ss(v), v >= 0        F_ss = F_k + (F_s - F_k) exp(-v / v_s) + c v        F = k u,
///     du/dt = V - v
///
/// Steady cutting is unstable below V_c = v_s ln((F_s - F_k) / (c v_s)). Implicit Euler in sub-steps of at
/// most 10 us while the crack runs and at most 256 of them: the only law here that takes
/// microseconds.
template <class Real>
struct BasicStribeckCutting {
  Real static_force;
  Real kinetic_force;
  Real stribeck_speed;
  Real damping;
  Real stiffness;
  Real mass;

  static constexpr const char* name = "stribeck_cutting";
  static constexpr Family family = Family::cutting;
  static constexpr bool springs = true;  // the force is that of tissue between the tip and the crack's front
  static constexpr bool cuts = true;
  static constexpr bool first_order = true;  // implicit Euler, as fine as the sub-steps
  static constexpr const char* summary =
      "Cutting against a force that falls with the crack's speed: stick-slip below a critical speed.";
  static constexpr const char* source =
      "sec. 2.3, range of the cutting force; Stribeck 1902; free: mass and spring, the choice of this "
      "project";
  static constexpr const char* validity =
      "Steps of the loop up to 2.5 ms at full resolution; its oscillation reaches F_s itself; with the "
      "paper's "
      "range at 1 mm/s its force at 3 mm/s is 15 "
      "% low.";
  static constexpr std::array<Parameter<BasicStribeckCutting, Real>, 6> table{{
      {&BasicStribeckCutting::static_force, "static_force", "N", 1e-6, 1e3, required, "F_s",
       "force at which the crack starts to run", "sec. 2.3"},
      {&BasicStribeckCutting::kinetic_force, "kinetic_force", "N", 0.0, 1e3, required, "F_k",
       "force of the running crack without its viscous part", "Stribeck 1902"},
      {&BasicStribeckCutting::stribeck_speed, "stribeck_speed", "m/s", 1e-9, 1.0, required, "v_s",
       "speed over which the force falls", "Stribeck 1902"},
      {&BasicStribeckCutting::damping, "damping", "N s/m", 1e-6, 1e6, required, "c",
       "viscous part of the running crack", "Stribeck 1902"},
      {&BasicStribeckCutting::stiffness, "stiffness", "N/m", 1e-2, 1e6, 200.0, "k",
       "stiffness of the tissue ahead of the tip", "free"},
      {&BasicStribeckCutting::mass, "mass", "kg", 1e-6, 1.0, 2e-3, "m", "mass that the crack carries along",
       "free"},
  }};

  const char* contradiction() const noexcept {
    return kinetic_force < static_force ? nullptr : "kinetic_force is not below static_force";
  }
  /// F_ss [N] of a crack that runs steadily at a speed >= 0 [m/s].
  Real steady_force(Real speed) const noexcept {
    return kinetic_force + (static_force - kinetic_force) * exp(-speed / stribeck_speed) + damping * speed;
  }
  /// Speed [m/s] below which steady cutting is unstable; 0 where it is always stable.
  Real critical_speed() const noexcept {
    return larger(0.0, stribeck_speed * log((static_force - kinetic_force) / (damping * stribeck_speed)));
  }

  struct Prepared;
  Prepared prepare() const noexcept;
};
using StribeckCutting = BasicStribeckCutting<double>;

template <class Real>
struct BasicStribeckCutting<Real>::Prepared {
  struct Memory {
    Real speed = 0.0;  ///< of the crack's tip [m/s]; 0 while it sticks
    void stop() noexcept { speed = 0.0; }
  };

  BasicStribeckCutting<Real> law;

  Real steady(Real speed) const noexcept { return law.steady_force(larger(0.0, speed)); }
  void enter(BasicCut<Real>& cut, Memory& memory, Real depth, Real carried) const noexcept {
    if (carried < 0.0) memory.speed = 0.0;
    cut.front = depth - larger(0.0, carried) / law.stiffness;
  }
  /// A crack that sticks holds no more than its breaking force, also if another law or other parameters
  /// loaded it.
  void adopt(BasicCut<Real>& cut, Memory& memory, Real depth) const noexcept {
    if (memory.speed == 0.0) cut.front = larger(cut.front, depth - law.static_force / law.stiffness);
  }
  [[gnu::noinline]] void advance(BasicCut<Real>& cut, Memory& memory,
                                 const BasicMove<Real>& move) const noexcept {
    const Real last = law.stiffness * (move.depth - cut.front);
    if (memory.speed == 0.0 && last <= law.static_force) return;  // it sticks
    const int steps = static_cast<int>(bounded(std::ceil(value_of(move.dt) * 1e5), 1.0, 256.0));
    const Real dt = move.dt / steps, travel = move.travel / steps, inertia = law.mass / dt;
    Real depth = move.depth - move.travel;
    for (int i = 0; i < steps; ++i) {
      depth += travel;
      const Real push = inertia * memory.speed + law.stiffness * (depth - cut.front);
      memory.speed = next_speed(memory.speed, push, inertia + law.stiffness * dt);
      cut.front += memory.speed * dt;
    }
  }
  Real forceless(const BasicCut<Real>&, Real depth) const noexcept { return depth; }
  Real force(const BasicCut<Real>& cut, const Memory&, Real depth) const noexcept {
    return larger(0.0, law.stiffness * (depth - cut.front));
  }
  Real by_depth(const BasicCut<Real>& cut, const Memory&, Real depth) const noexcept {
    return depth > cut.front ? law.stiffness : 0.0;
  }

 private:
  /// Implicit Euler: v with m (v - v_0) / dt = k (z - front - v dt) - F_ss(v), or 0 where it stays stuck:
  /// resisting v + F_ss(v) = push.
  Real next_speed(Real speed, Real push, Real resisting) const noexcept {
    if (push <= law.static_force) return 0.0;
    // Newton from the last speed, by halving where it would leave the bracket: bounded, seldom more than four
    // iterations
    const Real per_speed = 1.0 / law.stribeck_speed;
    Real low = 0.0, high = push / resisting;  // the force is positive
    Real v = smaller(speed, high);
    for (int i = 0; i < 12; ++i) {
      const Real falling = (law.static_force - law.kinetic_force) * exp(-v * per_speed);
      const Real excess = push - resisting * v - (law.kinetic_force + falling + law.damping * v);
      (excess > 0.0 ? low : high) = v;
      const Real next = v + excess / (resisting + law.damping - falling * per_speed);
      if (abs(next - v) <= 1e-8 * v) return next;  // quadratic convergence: the last digits
      v = next > low && next < high ? next : 0.5 * (low + high);
    }
    return v;
  }
};

template <class Real>
inline typename BasicStribeckCutting<Real>::Prepared BasicStribeckCutting<Real>::prepare() const noexcept {
  return {*this};
}

}  // namespace needleforce::laws
