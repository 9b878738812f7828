// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "../parameter.hpp"
#include "limits.hpp"

namespace needleforce::tips {

/// f = 0 up to the radius: a flat punch. The contact is the whole face from the start, F = 2 E_r R h.
struct Flat {
  double radius;

  bool operator==(const Flat&) const = default;

  static constexpr const char* name = "flat";
  static constexpr const char* summary = "Flat face across the axis.";
  static constexpr std::array<Parameter<Flat>, 1> table{{
      {&Flat::radius, "radius", "m", 1e-9, 1.0, required, "R", "radius of the flat face",
       "Sneddon 1965, sec. 5"},
  }};

  double slope(double) const noexcept { return 0.0; }
  double height(double) const noexcept { return 0.0; }
  double end() const noexcept { return radius; }
  auto breaks() const noexcept { return no_breaks; }
  double flat() const noexcept { return radius; }

  /// The depth at which the contact reaches a radius: at once.
  double depth(double) const noexcept { return 0.0; }
  double contact_radius(double) const noexcept { return radius; }
  double force(double) const noexcept { return 0.0; }
  double energy(double) const noexcept { return 0.0; }
};

}  // namespace needleforce::tips
