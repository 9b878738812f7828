// SPDX-License-Identifier: Apache-2.0
// Hands at a device whose force is held over each cycle, the tissues they feel, and the true energy of both.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "needleforce/guard.hpp"
#include "needleforce/insertion.hpp"

namespace hands {

using namespace needleforce;

inline constexpr double cycle = 1e-3;  // [s]

/// A spring behind the surface: what every haptic wall is, and never passive when sampled.
struct Wall {
  double stiffness;
  Sample step(double depth, double, double) noexcept {
    const double force = std::max(0.0, stiffness * depth);
    return {.depth = depth, .force = force, .stiffness = force};
  }
};

/// Where the device goes in one cycle of `time` [s]: a speed and a constant acceleration.
struct Stretch {
  double time = cycle, speed = 0.0, acceleration = 0.0;
  double travel(double t) const { return (speed + 0.5 * acceleration * t) * t; }
  double travel() const { return travel(time); }
  /// Every travel from the last sample lies between those at the end and at the turn.
  double turn() const {
    const double t = acceleration != 0.0 ? -speed / acceleration : -1.0;
    return t > 0.0 && t < time ? travel(t) : 0.0;
  }
};

/// The energy that a hand puts into held forces, with its least value at any time.
struct TrueEnergy {
  double in = 0.0, out = 0.0, least = 0.0;
  double balance() const { return in - out; }
  /// What summing in double precision may be wrong by.
  double rounding() const { return 1e-12 * (in + out); }
  void add(double work) {
    (work > 0.0 ? in : out) += std::abs(work);
    least = std::min(least, balance());
  }
  void add(double force, const Stretch& stretch) {
    least = std::min(least, balance() + force * stretch.turn());
    add(force * stretch.travel());
  }
};

/// A hand that goes its own way, whatever the force: to random places, with bounded speed and acceleration.
class WilfulHand {
 public:
  WilfulHand(double from, double to, double max_speed, double max_acceleration, unsigned seed)
      : generator_(seed), place_(from, to), v_(max_speed), a_(max_acceleration), depth_(from) {}
  double depth() const { return depth_; }
  Stretch move(double time = cycle) {
    if (left_-- <= 0) choose();
    constexpr double tau = 20e-3;
    const double wanted = (target_ - depth_ - 2.0 * tau * speed_) / (tau * tau);
    const double slowest = std::max(-a_, (-pace_ - speed_) / time),
                 fastest = std::min(a_, (pace_ - speed_) / time);
    const Stretch stretch{time, speed_, std::clamp(wanted, std::min(slowest, a_), std::max(fastest, -a_))};
    depth_ += stretch.travel();
    speed_ += stretch.acceleration * time;
    return stretch;
  }

 private:
  void choose() {
    target_ = place_(generator_);
    pace_ = v_ * std::pow(10.0, -2.0 * unit_(generator_));  // from creeping to as fast as it can
    left_ = static_cast<int>(20 + 400 * unit_(generator_));
  }
  std::mt19937 generator_;
  std::uniform_real_distribution<double> place_, unit_{0.0, 1.0};
  double v_, a_, depth_, speed_ = 0.0, target_ = 0.0, pace_ = 1.0;
  int left_ = 0;
};

/// A handle [kg] that a hand pulls to random places like a spring and damper, and that feels the force.
class FeelingHand {
 public:
  FeelingHand(double mass, double stiffness, double damping, double from, double to, unsigned seed)
      : generator_(seed),
        place_(from, to),
        mass_(mass),
        k_(stiffness),
        b_(damping),
        depth_(from),
        aim_(from) {}
  double depth() const { return depth_; }
  double speed() const { return speed_; }
  /// The hand rests at a place from now on.
  void rest(double at) { target_ = at, resting_ = true; }
  /// The cycle under a force that is held, in steps so short that they are the motion.
  template <class Visit>
  void move(double force, Visit visit) {
    if (!resting_ && left_-- <= 0) {
      target_ = place_(generator_);
      left_ = 200 + static_cast<int>(generator_() % 600);
    }
    constexpr int steps = 20;
    constexpr double dt = cycle / steps;
    for (int i = 0; i < steps; ++i) {
      aim_ += (target_ - aim_) * dt / 50e-3;
      speed_ += (k_ * (aim_ - depth_) - b_ * speed_ - force) / mass_ * dt;
      depth_ += speed_ * dt;
      visit(force * speed_ * dt);
    }
  }

 private:
  std::mt19937 generator_;
  std::uniform_real_distribution<double> place_;
  double mass_, k_, b_, depth_, speed_ = 0.0, aim_, target_ = 0.0;
  int left_ = 0;
  bool resting_ = false;
};

/// What was put in as what comes out `cycles` later; before that, the first.
class DelayLine {
 public:
  DelayLine(int cycles, double first) : values_(static_cast<std::size_t>(cycles) + 1, first) {}
  double operator()(double value) {
    values_[at_++ % values_.size()] = value;
    return values_[at_ % values_.size()];
  }

 private:
  std::vector<double> values_;
  std::size_t at_ = 0;
};

/// The numbers of the presets of these names.
inline std::vector<Layer> paper() {
  return {{0.0,
           {laws::Cone{117546.06040021202, 15.0 * tips::degree}, laws::PunctureDepth{3.237e-3},
            laws::Coulomb{18.6, 20e-6, 0.0}, laws::ConstantCutting{0.0776, 20e-6}}}};
}
inline std::vector<Layer> lugre() {
  return {{0.0,
           {laws::ConeCylinder{154666.55782265437, 15.0 * tips::degree, 0.35e-3},
            laws::PunctureDepth{3.237e-3}, laws::LuGre{930e3, 0.0, 0.0, 18.6, 21.51764705882353, 1e-3, 2.0},
            laws::ConstantCutting{0.0776, 20e-6}}}};
}
template <class Dragged, class Relaxing>
std::vector<Layer> two_layers() {
  const Relaxing relaxing{0.31, 0.7, 0.26, 5.0};
  return {{0.0,
           {laws::ConeCylinder{47123.8898038469, 45.0 * tips::degree, 3.819718634205488e-3},
            laws::PunctureDepth{8e-3}, Dragged{140.0, 220.0, 0.4e-3, 3.2e-3}, laws::NoCutting{}, relaxing}},
          {10e-3,
           {laws::ConeCylinder{23561.94490192345, 45.0 * tips::degree, 3.819718634205488e-3},
            laws::PunctureDepth{5e-3}, Dragged{70.0, 110.0, 0.4e-3, 0.0}, laws::NoCutting{}, relaxing}}};
}
inline std::vector<Layer> layered() { return two_layers<laws::DraggedTissuePassive, laws::Prony>(); }
inline std::vector<Layer> layered_as_fitted() {
  return two_layers<laws::DraggedTissueAsFitted, laws::PronyAtRest>();
}

/// What the energy controller is told in these trials of a hand of 0.3 m/s and 20 m/s^2.
inline GuardSettings bounds(int delay) {
  return {.longest_cycle = cycle,
          .max_speed = 0.3,
          .max_acceleration = 20.0,
          .delay = static_cast<double>(delay),
          .initial_reserve = 1e-5};
}

}  // namespace hands
