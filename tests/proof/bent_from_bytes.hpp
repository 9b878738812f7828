// SPDX-License-Identifier: Apache-2.0
// Settings of a needle that bends, and motions of its base, from the bytes of a fuzzer: mostly usual ones,
// now and then any number of a range, beyond it, or none at all.
#pragma once

#include <array>

#include "from_bytes.hpp"
#include "motion.hpp"
#include "needleforce/bending/flexible_insertion.hpp"

namespace from_bytes {

using namespace needleforce::bending;

/// Parameters of which a half keep their default, where there is one.
template <class T>
T mostly_usual(Bytes& bytes) {
  T value{};
  for (const auto& parameter : T::table) {
    const bool usual = bytes.below(2) == 0 && parameter.initial == parameter.initial;
    value.*parameter.member = usual ? parameter.initial : bytes.number(parameter.low, parameter.high);
  }
  return value;
}

inline LateralLayer lateral_layer(Bytes& bytes, double top) {
  LateralLayer layer = mostly_usual<LateralLayer>(bytes);
  layer.top = bytes.below(32) == 31 ? layer.top : top;
  if (bytes.below(2) == 0) layer.modulus = bytes.number(1e2, 1e6);
  if (bytes.below(2) == 0) layer.tip_force = bytes.number(-1.0, 1.0);
  layer.form = static_cast<FoundationForm>(bytes.below(4));
  return layer;
}

inline Sections sections(Bytes& bytes) {
  std::array<Section, max_sections> list{};
  const std::size_t count = bytes.below(16) == 15 ? 0 : 1 + bytes.below(max_sections);
  double end = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double stiffness = bytes.below(2) == 0 ? bytes.number(1e-4, 1.0) : bytes.number(1e-15, 1e9);
    const double curvature = bytes.below(2) == 0 ? 0.0 : bytes.number(-20.0, 20.0);
    list[i] = {end += bytes.number(1e-6, 0.1), stiffness, curvature};
  }
  return Sections(std::span<const Section>(list.data(), count));
}

/// A paper-like tissue, or any laws.
inline std::vector<Layer> axial_layers(Bytes& bytes) {
  if (bytes.below(4) == 3) return layers(bytes);
  const double depth = bytes.number(0.0, 1e-2);
  return {{0.0,
           {laws::Cone{bytes.number(1e3, 1e6), 0.26}, laws::PunctureDepth{depth},
            laws::Coulomb{bytes.number(0.0, 1e3), 20e-6, 0.0},
            laws::ConstantCutting{bytes.number(0.0, 10.0), 20e-6}}}};
}

inline FlexibleSettings flexible_settings(Bytes& bytes) {
  FlexibleSettings settings;
  settings.beam.sections = sections(bytes);
  settings.beam.support = mostly_usual<Support>(bytes);
  settings.lengths = mostly_usual<Bending>(bytes);
  settings.beam.layer_count =
      bytes.below(64) == 63 ? bytes.below(max_lateral_layers + 2) : 1 + bytes.below(3);
  double top = 0.0;
  for (std::size_t i = 0; i < std::min(settings.beam.layer_count, max_lateral_layers); ++i) {
    settings.beam.layers[i] = lateral_layer(bytes, top);
    top += bytes.number(1e-6, 3e-2);
  }
  settings.beam.elements = bytes.below(2) == 0 ? 40 : bytes.below(102);
  settings.small_slopes = bytes.below(4) == 0;
  return settings;
}

/// What a loop asks of a needle that bends in one cycle.
struct BentCycle {
  Ask ask = Ask::step;
  Base move{};  ///< of the base in each of the steps
  Base leap{};  ///< in the first of them
  double dt = 1e-2;
  std::size_t times = 1;
  std::uint32_t where = 0;  ///< a byte or word of the saved bytes that is altered
  std::uint64_t change = 0;
};

class BentMotion {
 public:
  BentCycle next(Bytes& bytes) {
    const auto kind = bytes.take<std::uint8_t>();
    BentCycle cycle;
    if (kind >= 240) {
      cycle.ask = kind >= 248 ? Ask::restore : kind >= 243 ? Ask::keep : Ask::reset;
      cycle.where = bytes.take<std::uint32_t>(), cycle.change = bytes.take<std::uint64_t>();
      return cycle;
    }
    if (kind >= 200) cycle.dt = bytes.number(1e-9, 1e9);
    if (kind >= 220) return leap(bytes, cycle, kind);
    const double size = std::pow(10.0, -4.0 - kind % 3);
    cycle.times = 1 + bytes.below(kind % 8 == 0 ? 64 : 8);
    cycle.move.depth = size * bytes.take<std::int8_t>() / 16.0;
    if (kind % 2) cycle.move.roll = bytes.take<std::int8_t>() / 41.0;
    for (std::size_t d = 0; d < 2 && kind >= 100; ++d) {
      cycle.move.lateral[d] = size * bytes.take<std::int8_t>() / 64.0;
      if (kind >= 160) cycle.move.tilt[d] = bytes.take<std::int8_t>() * 1e-4;
    }
    return cycle;
  }
  /// Where the base is in the cycle's next step; in a plane y stays 0.
  Base moved(const BentCycle& cycle, std::size_t step, std::size_t dimension) {
    add(cycle.move, dimension);
    Base at = base_;
    if (step > 0) return at;
    const Base& leap = cycle.leap;
    at.depth += leap.depth, at.roll += leap.roll;
    for (std::size_t d = 0; d < 2; ++d) at.lateral[d] += leap.lateral[d], at.tilt[d] += leap.tilt[d];
    const double sum = at.depth + at.roll + at.lateral[0] + at.lateral[1] + at.tilt[0] + at.tilt[1];
    if (std::isfinite(sum) && std::abs(sum) < 10.0) base_ = at;
    return at;
  }
  /// The loop goes back to a place.
  void set(const Base& base) { base_ = base; }
  const Base& base() const { return base_; }

 private:
  void add(const Base& move, std::size_t dimension) {
    base_.depth += move.depth, base_.roll += move.roll;
    for (std::size_t d = 0; d < dimension; ++d)
      base_.lateral[d] += move.lateral[d], base_.tilt[d] += move.tilt[d];
  }
  /// One of the six numbers anywhere in its range or beyond.
  static BentCycle leap(Bytes& bytes, BentCycle cycle, std::size_t kind) {
    Base& leap = cycle.leap;
    double* numbers[] = {&leap.depth,      &leap.roll,    &leap.lateral[0],
                         &leap.lateral[1], &leap.tilt[0], &leap.tilt[1]};
    const std::size_t which = kind % 6;
    constexpr double far[] = {0.3, 4.0, 0.02, 0.02, 0.3, 0.3};
    *numbers[which] =
        kind >= 238 ? Bytes::odd(bytes.take<std::uint8_t>()) : bytes.number(-far[which], far[which]);
    return cycle;
  }
  Base base_{};
};

}  // namespace from_bytes
