// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "../sneddon.hpp"
#include "limits.hpp"

namespace needleforce::tips {

/// A profile given by knots (r_k, f_k) and straight in between: a stack of truncated cones, one at each knot
/// where the slope rises, whose closed forms add up. It starts at (0, 0), is convex and ends at the last
/// knot.
struct Profile {
  static constexpr int capacity = 32;
  std::array<double, capacity> radius{};  // endless behind the last knot
  std::array<double, capacity> rise{};    // height at each knot
  int count = 0;

  bool operator==(const Profile&) const = default;

  static constexpr const char* name = "profile";
  static constexpr const char* summary = "Profile measured at up to 32 radii, straight in between.";

  /// What is wrong with the knots: the first one that is.
  Flaw flaw() const noexcept {
    if (count < 2 || count > capacity)
      return {"count", -1, double(count), "not 2 to 32 knots",
              "Give the start (0, 0), the end, and knots between."};
    if (radius[0] != 0.0)
      return {"radii", 0, radius[0], "not 0", "Start at the apex, radius 0 and height 0."};
    if (rise[0] != 0.0) return {"heights", 0, rise[0], "not 0", "Start at the apex, radius 0 and height 0."};
    for (int i = 1; i < count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (!(std::isfinite(radius[k]) && std::isfinite(rise[k])))
        return {"heights", i, rise[k], "with its radius not finite", "Give numbers in m."};
      if (!(radius[k] <= 0.1 && rise[k] <= 1.0))
        return {"heights", i, rise[k], "of a knot beyond 1 m of height or 0.1 m of radius",
                "Give numbers in m."};
      if (!(radius[k] > radius[k - 1]))
        return {"radii", i, radius[k], "not beyond the one before: the slope would be vertical",
                "Give radii that grow; the shank beyond the tip has a radius of its own."};
      if (!(rise[k] >= rise[k - 1]))
        return {"heights", i, rise[k], "below the one before: the profile is not monotone",
                "Give heights above the apex that never fall."};
      if (k > 1 && !(secant(k) >= secant(k - 1) * (1.0 - 1e-9)))
        return {"heights", i, rise[k], "where the slope falls: the contact would jump over the hollow",
                "Give a convex profile, or leave out knots that only carry noise."};
    }
    if (!(rise[last()] > 0.0))
      return {"heights", count - 1, rise[last()], "0 at the end", "A flat face is the tip Flat."};
    return {};
  }

  /// Slope of the piece that ends at knot k.
  double secant(std::size_t k) const noexcept {
    return (rise[k] - rise[k - 1]) / (radius[k] - radius[k - 1]);
  }
  double slope(double r) const noexcept { return secant(piece(r)); }
  double height(double r) const noexcept {
    const std::size_t k = piece(r);
    return rise[k - 1] + (r - radius[k - 1]) * secant(k);
  }
  double end() const noexcept { return radius[last()]; }
  const std::array<double, capacity>& breaks() const noexcept { return radius; }
  double flat() const noexcept { return secant(1) > 0.0 ? 0.0 : radius[1]; }

  sneddon::Touch touch(double a) const noexcept {
    sneddon::Touch sum{0.0, 0.0};
    double before = 0.0;
    for (std::size_t k = 1; k <= last() && radius[k - 1] < a; ++k) {
      const double b = radius[k - 1], after = secant(k), chord = std::sqrt((a - b) * (a + b));
      const double angle = std::atan2(chord, b);
      sum.depth += (after - before) * a * angle;
      sum.force += (after - before) * (a * a * angle + b * chord);
      before = after;
    }
    return sum;
  }
  double depth(double a) const noexcept { return touch(a).depth; }
  double contact_radius(double h) const noexcept { return sneddon::contact_radius(*this, h, flat()); }
  double force(double a) const noexcept { return touch(a).force; }
  double energy(double a) const noexcept { return sneddon::energy(*this, depth(a), a); }

 private:
  /// The piece that holds r, named by the knot at its end.
  std::size_t piece(double r) const noexcept {
    std::size_t k = 1;
    while (k < last() && r >= radius[k]) ++k;
    return k;
  }
  /// The knot at the end, of a valid profile.
  std::size_t last() const noexcept { return static_cast<std::size_t>(count - 1); }
};

}  // namespace needleforce::tips
