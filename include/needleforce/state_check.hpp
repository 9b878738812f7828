// SPDX-License-Identifier: Apache-2.0
// A state from outside, part by part: the first that no needle can have is named, before a step relies on it.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <type_traits>

#include "sample.hpp"

namespace needleforce {

/// No number of a state is larger: the products of several are finite still.
inline constexpr double largest_in_a_state = 1e40;

/// Keeps the name of the first part that is impossible. Wait-free.
class StateCheck {
 public:
  const char* fault() const noexcept { return fault_; }

  void require(const char* part, bool possible) noexcept {
    if (!possible && !fault_) fault_ = part;
  }
  void number(const char* part, double value, double low, double high) noexcept {
    require(part, value >= low && value <= high);
  }
  /// A struct or an array of doubles alone, either sign.
  template <class Doubles>
  void numbers(const char* part, const Doubles& values, double most = largest_in_a_state) noexcept {
    static_assert(std::is_trivially_copyable_v<Doubles> && sizeof(Doubles) % sizeof(double) == 0);
    bool possible = true;
    for (std::size_t i = 0; i < sizeof(Doubles) / sizeof(double); ++i) {
      double value;
      std::memcpy(&value, reinterpret_cast<const char*>(&values) + i * sizeof value, sizeof value);
      possible = possible && std::abs(value) <= most;
    }
    require(part, possible);
  }
  template <class Word>
    requires std::is_enum_v<Word>
  void word(const char* part, Word value, Word last) noexcept {
    require(part, value >= Word{} && value <= last);
  }
  /// To read another byte than 0 and 1 as a flag is undefined.
  void flag(const char* part, const bool& flag) noexcept {
    require(part, reinterpret_cast<const unsigned char&>(flag) < 2);
  }
  void sample(const char* part, const Sample& sample) noexcept {
    word(part, sample.phase, Phase::extraction);
    word(part, sample.status, Status::not_finite);
    for (const bool* each : {&sample.contact, &sample.punctured, &sample.exit}) flag(part, *each);
    numbers(part,
            std::array{sample.depth, sample.velocity, sample.force, sample.stiffness, sample.friction,
                       sample.cutting, sample.lateral, sample.force_by_depth, sample.force_by_velocity},
            unbounded);
  }

 private:
  // what a step has shown is never used again but to be shown: at speeds of no needle some of it is large
  static constexpr double unbounded = 1e100;
  const char* fault_ = nullptr;
};

}  // namespace needleforce
