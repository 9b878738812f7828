// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
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
struct StribeckCutting {
  double static_force;
  double kinetic_force;
  double stribeck_speed;
  double damping;
  double stiffness;
  double mass;

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
  static constexpr std::array<Parameter<StribeckCutting>, 6> table{{
      {&StribeckCutting::static_force, "static_force", "N", 1e-6, 1e3, required, "F_s",
       "force at which the crack starts to run", "sec. 2.3"},
      {&StribeckCutting::kinetic_force, "kinetic_force", "N", 0.0, 1e3, required, "F_k",
       "force of the running crack without its viscous part", "Stribeck 1902"},
      {&StribeckCutting::stribeck_speed, "stribeck_speed", "m/s", 1e-9, 1.0, required, "v_s",
       "speed over which the force falls", "Stribeck 1902"},
      {&StribeckCutting::damping, "damping", "N s/m", 1e-6, 1e6, required, "c",
       "viscous part of the running crack", "Stribeck 1902"},
      {&StribeckCutting::stiffness, "stiffness", "N/m", 1e-2, 1e6, 200.0, "k",
       "stiffness of the tissue ahead of the tip", "free"},
      {&StribeckCutting::mass, "mass", "kg", 1e-6, 1.0, 2e-3, "m", "mass that the crack carries along",
       "free"},
  }};

  const char* contradiction() const noexcept {
    return kinetic_force < static_force ? nullptr : "kinetic_force is not below static_force";
  }
  /// F_ss [N] of a crack that runs steadily at a speed >= 0 [m/s].
  double steady_force(double speed) const noexcept {
    return kinetic_force + (static_force - kinetic_force) * std::exp(-speed / stribeck_speed) +
           damping * speed;
  }
  /// Speed [m/s] below which steady cutting is unstable; 0 where it is always stable.
  double critical_speed() const noexcept {
    return std::max(0.0,
                    stribeck_speed * std::log((static_force - kinetic_force) / (damping * stribeck_speed)));
  }

  struct Prepared;
  Prepared prepare() const noexcept;
};

struct StribeckCutting::Prepared {
  struct Memory {
    double speed = 0.0;  ///< of the crack's tip [m/s]; 0 while it sticks
    void stop() noexcept { speed = 0.0; }
  };

  StribeckCutting law;

  double steady(double speed) const noexcept { return law.steady_force(std::max(0.0, speed)); }
  void enter(Cut& cut, Memory& memory, double depth, double carried) const noexcept {
    if (carried < 0.0) memory.speed = 0.0;
    cut.front = depth - std::max(0.0, carried) / law.stiffness;
  }
  /// A crack that sticks holds no more than its breaking force, also if another law or other parameters
  /// loaded it.
  void adopt(Cut& cut, Memory& memory, double depth) const noexcept {
    if (memory.speed == 0.0) cut.front = std::max(cut.front, depth - law.static_force / law.stiffness);
  }
  [[gnu::noinline]] void advance(Cut& cut, Memory& memory, const Move& move) const noexcept {
    const double last = law.stiffness * (move.depth - cut.front);
    if (memory.speed == 0.0 && last <= law.static_force) return;  // it sticks
    const int steps = static_cast<int>(std::clamp(std::ceil(move.dt * 1e5), 1.0, 256.0));
    const double dt = move.dt / steps, travel = move.travel / steps, inertia = law.mass / dt;
    double depth = move.depth - move.travel;
    for (int i = 0; i < steps; ++i) {
      depth += travel;
      const double push = inertia * memory.speed + law.stiffness * (depth - cut.front);
      memory.speed = next_speed(memory.speed, push, inertia + law.stiffness * dt);
      cut.front += memory.speed * dt;
    }
  }
  double forceless(const Cut&, double depth) const noexcept { return depth; }
  double force(const Cut& cut, const Memory&, double depth) const noexcept {
    return std::max(0.0, law.stiffness * (depth - cut.front));
  }
  double by_depth(const Cut& cut, const Memory&, double depth) const noexcept {
    return depth > cut.front ? law.stiffness : 0.0;
  }

 private:
  /// Implicit Euler: v with m (v - v_0) / dt = k (z - front - v dt) - F_ss(v), or 0 where it stays stuck:
  /// resisting v + F_ss(v) = push.
  double next_speed(double speed, double push, double resisting) const noexcept {
    if (push <= law.static_force) return 0.0;
    // Newton from the last speed, by halving where it would leave the bracket: bounded, seldom more than four
    // iterations
    const double per_speed = 1.0 / law.stribeck_speed;
    double low = 0.0, high = push / resisting;  // the force is positive
    double v = std::min(speed, high);
    for (int i = 0; i < 12; ++i) {
      const double falling = (law.static_force - law.kinetic_force) * std::exp(-v * per_speed);
      const double excess = push - resisting * v - (law.kinetic_force + falling + law.damping * v);
      (excess > 0.0 ? low : high) = v;
      const double next = v + excess / (resisting + law.damping - falling * per_speed);
      if (std::abs(next - v) <= 1e-8 * v) return next;  // quadratic convergence: the last digits
      v = next > low && next < high ? next : 0.5 * (low + high);
    }
    return v;
  }
};

inline StribeckCutting::Prepared StribeckCutting::prepare() const noexcept { return {*this}; }

}  // namespace needleforce::laws
