// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "../law.hpp"

namespace needleforce::laws {

/// Stick-slip cutting with arrest velocity. The tissue ahead of the tip is a spring F = k u that the needle
/// compresses and the crack releases, du/dt = V - v. The crack sticks until F reaches F_b, then runs with
/// v = (F - F_d) / c until it is slower than v_a, at F_a = F_d + c v_a. Steady for V >= v_a, with
/// F = F_d + c V; below, a limit cycle between F_a and F_b. Stepped exactly from event to event.
template <class Real>
struct BasicStickSlip {
  Real break_force;
  Real arrest_force;
  Real arrest_speed;
  Real damping;
  Real stiffness;

  static constexpr const char* name = "stick_slip";
  static constexpr Family family = Family::cutting;
  static constexpr bool springs = true;  // the force is that of tissue between the tip and the crack's front
  static constexpr bool cuts = true;
  static constexpr const char* summary =
      "Cutting that sticks and slips below an arrest speed and is steady above it.";
  static constexpr const char* source =
      "sec. 2.3, range of the cutting force; free: arrest speed, the choice of this project";
  static constexpr const char* validity =
      "Reconstructed from two speeds of the paper; the stiffness, which sets the period, is free.";
  static constexpr std::array<Parameter<BasicStickSlip, Real>, 5> table{{
      {&BasicStickSlip::break_force, "break_force", "N", 1e-6, 1e3, required, "F_b",
       "force at which the crack starts to run", "sec. 2.3"},
      {&BasicStickSlip::arrest_force, "arrest_force", "N", 0.0, 1e3, required, "F_a",
       "force at which the crack stops", "sec. 2.3"},
      {&BasicStickSlip::arrest_speed, "arrest_speed", "m/s", 1e-9, 1.0, required, "v_a",
       "speed of the crack below which it stops", "sec. 2.3"},
      {&BasicStickSlip::damping, "damping", "N s/m", 1e-6, 1e6, required, "c",
       "force of the running crack over its speed", "sec. 2.3"},
      {&BasicStickSlip::stiffness, "stiffness", "N/m", 1e-2, 1e6, 200.0, "k",
       "stiffness of the tissue ahead of the tip; it sets the period only", "free"},
  }};

  const char* contradiction() const noexcept {
    if (!(arrest_force < break_force)) return "arrest_force is not below break_force: nothing would slip";
    if (arrest_force < damping * arrest_speed)
      return "arrest_force is below damping * arrest_speed: the running crack would pull the needle in";
    return nullptr;
  }

  /// Time [s] the crack sticks in a cycle at a speed [m/s] below the arrest speed, and time it runs.
  Real stick_time(Real speed) const noexcept;
  Real slip_time(Real speed) const noexcept;
  /// Force [N] of a running crack at no speed, F_d = F_a - c v_a.
  Real still_force() const noexcept;
  /// Mean force [N] at a speed [m/s], over a cycle where it sticks and slips.
  Real mean_force(Real speed) const noexcept;

  struct Prepared;
  Prepared prepare() const noexcept;
};
using StickSlip = BasicStickSlip<double>;

template <class Real>
struct BasicStickSlip<Real>::Prepared {
  struct Memory {
    bool running = false;  ///< the crack runs; false while it sticks
    void stop() noexcept { running = false; }
    void check(StateCheck& check, const char* part, double) const noexcept { check.flag(part, running); }
  };

  BasicStickSlip<Real> law;
  Real still;          ///< F_d, force of the running crack at no speed [N]
  Real time_constant;  ///< c / k: time constant of the running crack [s]

  Real running(Real speed) const noexcept { return still + law.damping * speed; }
  Real stick_time(Real speed) const noexcept {
    return (law.break_force - law.arrest_force) / (law.stiffness * speed);
  }
  Real slip_time(Real speed) const noexcept {
    const Real aim = running(speed);
    return time_constant * log((law.break_force - aim) / (law.arrest_force - aim));
  }
  /// The force over a long travel at a speed [m/s]: the mean over a cycle, or the steady one.
  Real steady(Real speed) const noexcept {
    if (speed >= law.arrest_speed) return running(speed);
    if (!(speed > 0.0)) return 0.5 * (law.break_force + law.arrest_force);
    const Real stick = stick_time(speed), slip = slip_time(speed), fall = law.break_force - law.arrest_force;
    const Real work =
        0.5 * (law.break_force + law.arrest_force) * stick + running(speed) * slip + time_constant * fall;
    return work / (stick + slip);
  }

  void enter(BasicCut<Real>& cut, Memory& memory, Real depth, Real carried) const noexcept {
    // the puncture's crack is just stopping; another law's runs on only with a force that keeps it running
    memory.running = carried < 0.0 || (memory.running && carried >= law.arrest_force);
    cut.front = depth - (carried < 0.0 ? law.arrest_force : carried) / law.stiffness;
  }
  /// A crack that sticks holds no more than its breaking force, also if another law or other parameters
  /// loaded it.
  void adopt(BasicCut<Real>& cut, Memory& memory, Real depth) const noexcept {
    if (law.stiffness * (depth - cut.front) < law.arrest_force) memory.running = false;
    if (!memory.running) cut.front = larger(cut.front, depth - law.break_force / law.stiffness);
  }
  [[gnu::noinline]] void advance(BasicCut<Real>& cut, Memory& memory,
                                 const BasicMove<Real>& move) const noexcept {
    Real force = law.stiffness * (move.depth - move.travel - cut.front);
    Real left = move.dt;
    const Real speed = move.travel / move.dt;
    // a cycle has two events and complete cycles are skipped: the bound is never reached
    for (int event = 0; event < 6 && left > 0.0; ++event)
      memory.running ? run(memory, force, left, speed) : stick(memory, force, left, speed);
    cut.front = move.depth - force / law.stiffness;
  }
  Real forceless(const BasicCut<Real>&, Real depth) const noexcept { return depth; }
  Real force(const BasicCut<Real>& cut, const Memory&, Real depth) const noexcept {
    return larger(0.0, law.stiffness * (depth - cut.front));
  }
  /// Of the tissue, also while the crack runs: it takes its time c / k to follow.
  Real by_depth(const BasicCut<Real>& cut, const Memory&, Real depth) const noexcept {
    return depth > cut.front ? law.stiffness : 0.0;
  }

 private:
  void stick(Memory& memory, Real& force, Real& left, Real speed) const noexcept {
    const Real time = speed > 0.0 ? (law.break_force - force) / (law.stiffness * speed) : left;
    if (time >= left) {
      force += law.stiffness * speed * left;
      left = 0.0;
      return;
    }
    force = larger(force, law.break_force);
    left -= larger(0.0, time);
    memory.running = true;
    if (speed < law.arrest_speed) skip_cycles(left, speed);
  }
  void run(Memory& memory, Real& force, Real& left, Real speed) const noexcept {
    const Real aim = running(speed);
    const Real time = aim >= law.arrest_force ? left
                      : force > law.arrest_force
                          ? time_constant * log((force - aim) / (law.arrest_force - aim))
                          : 0.0;
    if (time >= left) {
      force += (force - aim) * expm1(-left / time_constant);  // does not cancel at small steps
      left = 0.0;
      return;
    }
    force = smaller(force, law.arrest_force);
    left -= time;
    memory.running = false;
  }
  void skip_cycles(Real& left, Real speed) const noexcept {
    const Real cycle = stick_time(speed) + slip_time(speed);
    const double whole = smaller(value_of(left / cycle), 1e15);
    left = larger(0.0, left - cycle * static_cast<double>(static_cast<long long>(whole)));
    left = smaller(left, cycle);
  }
};

template <class Real>
inline typename BasicStickSlip<Real>::Prepared BasicStickSlip<Real>::prepare() const noexcept {
  return {*this, arrest_force - damping * arrest_speed, damping / stiffness};
}
template <class Real>
inline Real BasicStickSlip<Real>::stick_time(Real speed) const noexcept {
  return prepare().stick_time(speed);
}
template <class Real>
inline Real BasicStickSlip<Real>::slip_time(Real speed) const noexcept {
  return prepare().slip_time(speed);
}
template <class Real>
inline Real BasicStickSlip<Real>::still_force() const noexcept {
  return prepare().still;
}
template <class Real>
inline Real BasicStickSlip<Real>::mean_force(Real speed) const noexcept {
  return prepare().steady(speed);
}

}  // namespace needleforce::laws
