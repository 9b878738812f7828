// SPDX-License-Identifier: Apache-2.0
// Motions from the bytes of a fuzzer: strokes at some speed, leaps, and cycles that no clock or sensor should
// give.
#pragma once

#include "from_bytes.hpp"

namespace from_bytes {

/// What a loop may ask of the engine in one cycle.
enum class Ask { step, reset, keep, restore };

struct Cycle {
  Ask ask = Ask::step;
  double depth = 0.0, velocity = no_velocity, dt = 1e-3;
  std::size_t times = 1;  ///< with the same travel each time
  double travel = 0.0;
  std::uint16_t where = 0;  ///< a byte of the snapshot that is restored, altered by
  std::uint8_t change = 0;
};

/// Where the tip is between two cycles.
class Motion {
 public:
  Cycle next(Bytes& bytes) {
    const auto kind = bytes.take<std::uint8_t>();
    Cycle cycle;
    if (kind >= 244) {
      cycle.ask = kind >= 252 ? Ask::restore : kind >= 248 ? Ask::keep : Ask::reset;
      if (cycle.ask == Ask::restore)
        cycle.where = bytes.take<std::uint16_t>(), cycle.change = bytes.take<std::uint8_t>();
      return cycle;
    }
    if (kind >= 176) cycle.dt = bytes.number(1e-9, 1e9);
    if (kind >= 216) return leap(bytes, cycle, kind);
    cycle.travel = std::pow(10.0, -4.0 - kind % 4) * bytes.take<std::int8_t>() / 16.0;
    cycle.times = 1 + bytes.below(kind % 16 == 0 ? 256 : 16);
    if (kind >= 128 && cycle.dt != 0.0) cycle.velocity = bytes.number(0.5, 1.5) * cycle.travel / cycle.dt;
    return cycle;
  }
  /// The depth [m] of the cycle's next repetition.
  double moved(const Cycle& cycle) {
    if (cycle.times > 1 || cycle.travel != 0.0) return depth_ += cycle.travel;
    return depth_ = std::isfinite(cycle.depth) ? cycle.depth : depth_, cycle.depth;
  }

 private:
  Cycle leap(Bytes& bytes, Cycle cycle, std::size_t kind) {
    cycle.depth = kind % 2 ? bytes.number(-farthest, farthest) : depth_;
    if (kind % 4 == 0) cycle.velocity = bytes.number(-1.0, 1.0);
    if (kind % 8 == 0) cycle.velocity = bytes.number(-fastest, fastest);
    if (kind == 243) cycle.depth = Bytes::odd(bytes.take<std::uint8_t>());
    return cycle;
  }
  double depth_ = 0.0;
};

}  // namespace from_bytes
