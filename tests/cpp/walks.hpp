// SPDX-License-Identifier: Apache-2.0
// Motions of the tip through one layer, for the contract tests of friction and cutting.
#pragma once

#include <initializer_list>
#include <vector>

#include "every_law.hpp"

/// A tip on its way, with what a loop would tell the laws about it.
struct TipMotion {
  double depth = 0.0, deepest = 0.0;
  Move move(double travel, double velocity, double dt) {
    depth += travel;
    deepest = std::max(deepest, depth);
    const bool withdrawing = depth < deepest;
    return {depth, travel, travel, velocity, dt, deepest, !withdrawing && travel > 0.0, withdrawing};
  }
};

/// Friction in one pierced layer that goes on for ever.
template <class L>
struct Shafted {
  typename L::Prepared law;
  LayerExtent extent{0.0, 3e-3, std::numeric_limits<double>::infinity(), true};
  TipMotion tip{3e-3, 3e-3};
  Shaft shaft{};
  typename L::Prepared::Memory memory{};
  Relaxing relaxing{};
  double velocity = 0.0;

  /// In a layer pierced at `puncture` [m] by a contact that held `force` [N]: a cone's energy and slope.
  explicit Shafted(const L& given, double puncture = 3e-3, double force = 0.2)
      : law(given.prepare()),
        extent{0.0, puncture, std::numeric_limits<double>::infinity(), true},
        tip{puncture, puncture} {
    law.pierce(memory, {Element{force}, force, force * puncture / 3.0, 2.0 * force / puncture});
    law.advance(shaft, memory, tip.move(0.0, 0.0, 1e-15), extent, relaxing);
  }
  double scale() const { return extent.puncture; }
  void step(double travel, double dt) { step(travel, travel / dt, dt); }
  void step(double travel, double velocity_, double dt) {
    velocity = velocity_;
    law.advance(shaft, memory, tip.move(travel, velocity, dt), extent, relaxing);
  }
  double force() const { return law.force(shaft, memory, velocity); }
  double by_depth() const { return law.by_depth(shaft, memory, velocity); }
  double by_velocity() const { return law.by_velocity(shaft, memory, velocity); }
};

/// Cutting from a puncture at depth 0 on.
template <class L>
struct Edged {
  typename L::Prepared law;
  TipMotion tip{};
  Cut cut{};
  typename L::Prepared::Memory memory{};

  explicit Edged(const L& given) : law(given.prepare()) { law.enter(cut, memory, 0.0, -1.0); }
  void step(double travel, double dt) { law.advance(cut, memory, tip.move(travel, travel / dt, dt)); }
  double force() const { return law.force(cut, memory, tip.depth); }
  double by_depth() const { return law.by_depth(cut, memory, tip.depth); }
};

/// Travels in and out [m], their sizes spread evenly over some decades up to `largest`; always the same.
inline std::vector<double> random_travels(int n, double largest = 1e-2, double decades = 6.0) {
  std::mt19937_64 generator{1};
  std::uniform_real_distribution<double> decade{-decades, 0.0};
  std::vector<double> travels;
  double depth = 0.0;
  for (int i = 0; i < n; ++i) {
    const double size = largest * std::pow(10.0, decade(generator));
    const bool inwards =
        std::abs(depth) > 2.0 * largest ? depth < 0.0 : generator() % 2 == 0;  // not far away
    travels.push_back(inwards ? size : -size);
    depth += travels.back();
  }
  return travels;
}

/// Step lengths [s] from the smallest a clock can tell to eleven days, or of no length that counts.
inline double random_dt(std::mt19937_64& generator) {
  constexpr double special[] = {1e-300, std::numeric_limits<double>::denorm_min(), 1e6};
  if (generator() % 10 == 0) return special[generator() % 3];
  return std::pow(10.0, -6.0 + static_cast<double>(generator() % 1000) * 9e-3);
}

/// The travel, or as much of it as the loop lets through in a step of dt [s].
inline double within(double travel, double dt) {
  const double most = 1e9 * dt;
  return std::clamp(travel, -most, most);
}

/// Goes `travel` at a speed in steps of at most `fine`, and gives the work by the trapezoid rule.
template <class Walk>
double go(Walk& walk, double travel, double speed, double fine) {
  const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(travel) / fine)));
  const double dz = travel / steps;
  double work = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double before = walk.force();
    walk.step(dz, std::abs(dz) / speed);
    work += 0.5 * (before + walk.force()) * dz;
  }
  return work;
}

/// The least work over closed paths that start as `start` does: after each of some random travels of up to
/// `reach` [m] straight back, over the work of a travel; the integral is good to 1e-3 of that.
template <class Walk>
double min_closed_work(const Walk& start, double reach, double speed) {
  constexpr int n = 30;
  const double fine = reach / 5000.0;
  Walk walk = start;
  double work = 0.0, turned = 0.0, least = std::numeric_limits<double>::infinity();
  for (const double travel : random_travels(n, reach, 2.0)) {
    const double part = go(walk, travel, speed, fine);
    work += part;
    turned += std::abs(part) / n;
    Walk closing = walk;
    least = std::min(least, work + go(closing, start.tip.depth - walk.tip.depth, speed, fine));
  }
  return turned > 0.0 ? least / turned : least;
}

/// The largest change of force in a step of n equal ones; it falls with the step unless the force jumps.
template <class Walk>
double largest_change(Walk& walk, double travel, double speed, int n) {
  double largest = 0.0;
  for (int i = 0; i < n; ++i) {
    const double before = walk.force();
    walk.step(travel / n, std::abs(travel) / (n * speed));
    if (i) largest = std::max(largest, std::abs(walk.force() - before));  // the first may turn
  }
  return largest;
}

/// True if a derivative agrees with one of some finite differences, to 1e-4 of it or of `unit`.
inline bool is_one_of(double derivative, double unit, std::initializer_list<double> differences) {
  const auto near = [=](double d) {
    return std::abs(derivative - d) <= 1e-4 * (std::abs(derivative) + unit);
  };
  return std::any_of(differences.begin(), differences.end(), near);
}
