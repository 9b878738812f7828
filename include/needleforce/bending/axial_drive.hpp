// SPDX-License-Identifier: Apache-2.0
// The axial insertion as the shaft slides, and the search for the force that it has at its own shape.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "../limits.hpp"
#include "../returnable_slip.hpp"
#include "../sample.hpp"
#include "../state_check.hpp"
#include "bending.hpp"
#include "elementary.hpp"

namespace needleforce::bending {

/// What the shaft remembers of its slide along the path, apart from the axial insertion.
struct Slide {
  double travel = 0.0;          ///< of the shaft, as the axial insertion has it [m]
  double share = 0.0;           ///< of friction in the axial force when the tip last cut
  double rub = 0.0;             ///< friction of the lateral pressure [N]
  double holds = 0.0;           ///< its stiffness before it slides [N/m]
  double most = 0.0;            ///< its size while it slides [N]
  ReturnableSlip returnable{};  ///< of that friction

  /// Looks at what came from outside. Wait-free.
  void check(StateCheck& check) const noexcept {
    check.number("slide.travel", travel, -4.0 * farthest, 4.0 * farthest);
    check.number("slide.share", share, 0.0, 1.0);
    check.number("slide.holds", holds, 0.0, largest_in_a_state);
    check.number("slide.most", most, 0.0, largest_in_a_state);
    check.number("slide.rub", rub, -most, most);
    returnable.check(check, "returnable");
  }
};

/// One part of a step: from where it began, the shaft may be tried at one travel after another.
template <class Axial>
class AxialDrive {
 public:
  /// `pressing` [N] is the lateral pressure along the shaft.
  AxialDrive(Axial& axial, Slide& slide, const Bending& lengths, double pressing, double dt) noexcept
      : axial_(axial),
        slide_(slide),
        lengths_(lengths),
        full_(lengths.pressure_friction * pressing),
        dt_(dt),
        began_(slide),
        memory_(axial.state()) {}

  /// The shaft slides to a travel [m], no faster than the limits allow. The next step makes up for what is
  /// negligible. The tip has moved by `aside` [m] without the cut. Wait-free.
  void to(double travel, bool embedded, double aside = 0.0) noexcept {
    if (tried_ && aside == aside_ && std::abs(travel - slide_.travel) <= negligible) return;
    if (tried_) axial_.return_to(memory_), slide_ = began_;
    tried_ = true;
    const Limits& limits = axial_.limits();
    const double most = std::min(limits.max_speed, fastest) * dt_ + 2.0 * limits.depth_noise;
    const double way = travel - slide_.travel;
    slide_.travel = axial_.state().started ? slide_.travel + std::clamp(way, -most, most) : travel;
    aside_ = aside;
    sample_ = axial_.step_aside(slide_.travel, aside, dt_);
    if (embedded && lengths_.pressure_friction > 0.0) rub(slide_.travel - began_.travel);
  }
  const Sample& sample() const noexcept { return sample_; }
  double travel() const noexcept { return slide_.travel; }
  /// Axial force of insertion and lateral pressure [N], and its derivative by the travel [N/m].
  double force() const noexcept { return sample_.force + slide_.rub; }
  double by_travel() const noexcept {
    return std::max(0.0, sample_.force_by_depth) + (std::abs(slide_.rub) < slide_.most ? slide_.holds : 0.0);
  }

 private:
  static constexpr double negligible = 1e-9;  // [m]

  /// The friction of the lateral pressure, which keeps its force at rest as the axial laws do. A stiffness
  /// that never falls under load, and any limit, give nothing back: the limit follows a pressure that falls
  /// as the shaft slides.
  void rub(double travel) noexcept {
    const DepthNoise noise = noise_of(axial_.limits().depth_noise);
    const double before = slide_.rub, own = full_ / lengths_.presliding;
    if (noise.range > 0.0) travel = slide_.returnable.felt(travel, {.force = before}, dt_, noise);
    slide_.most += (1.0 - falling(std::abs(travel) / lengths_.presliding)) * (full_ - slide_.most);
    slide_.most = std::max(slide_.most, full_);
    slide_.holds = before == 0.0 ? own : std::max(slide_.holds, own);
    const double wanted = before + slide_.holds * travel;
    slide_.rub = std::clamp(wanted, -slide_.most, slide_.most);
    const double slipped = slide_.holds > 0.0 ? (wanted - slide_.rub) / slide_.holds : 0.0;
    if (before * slide_.rub < 0.0) {
      slide_.rub *= own / slide_.holds;
      slide_.holds = own;
    }
    if (noise.range > 0.0) slide_.returnable.add(before, {slipped, slide_.rub}, noise);
  }

  Axial& axial_;
  Slide& slide_;
  const Bending& lengths_;
  double full_, dt_, aside_ = 0.0;
  bool tried_ = false;
  const Slide began_;
  const typename Axial::State memory_;
  Sample sample_{};
};

/// The force at which a needle is as short as the force makes it: more force makes it shorter, and then the
/// shaft has slid less. Newton's steps with the last two solutions, between bounds.
class ForceSearch {
 public:
  /// The next force to try after one that left so much missing [N], where the shaft had slid to a travel [m]
  /// and its force rises by so much per travel [N/m]. Wait-free.
  double next(double force, double missing, double travel, double by_travel, double& give) noexcept {
    const bool more = missing > 0.0, nearer = std::abs(missing) < 0.5 * missing_;
    (more ? low_ : high_) = force;
    // a bound is of the shape at which it was found: what contradicts it replaces it
    if (!(low_ < high_)) (more ? high_ : low_) = more ? endless : -endless;
    missing_ = std::abs(missing);
    if (force_ < endless && std::abs(force - force_) > 1e-9)
      give = std::clamp((travel_ - travel) / (force - force_), 0.0, 1.0);
    force_ = force;
    travel_ = travel;
    const double step = force + missing / (1.0 + by_travel * give);
    if (nearer || (step >= low_ && step <= high_)) return step;
    return low_ > -endless && high_ < endless ? 0.5 * (low_ + high_) : std::clamp(step, low_, high_);
  }

  /// The next after one at which the needle buckles, where another bore it. Wait-free.
  double back(double force, double bears) noexcept {
    high_ = force;
    if (!(low_ < high_)) low_ = -endless;
    return 0.5 * (force + bears);
  }

 private:
  static constexpr double endless = std::numeric_limits<double>::max();
  double low_ = -endless, high_ = endless, missing_ = 0.0;
  double force_ = endless, travel_ = 0.0;  // of the last try
};

}  // namespace needleforce::bending
