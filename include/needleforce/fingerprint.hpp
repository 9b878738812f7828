// SPDX-License-Identifier: Apache-2.0
// A running hash.
#pragma once

#include <bit>
#include <cstdint>

namespace needleforce {

/// A running hash (FNV-1a, by words of 64 bits). Wait-free.
class Fingerprint {
 public:
  constexpr void add(std::uint64_t word) noexcept { hash_ = (hash_ ^ word) * 1099511628211ull; }
  constexpr void add(double number) noexcept { add(std::bit_cast<std::uint64_t>(number)); }
  constexpr void add(const char* text) noexcept {
    while (*text) add(static_cast<std::uint64_t>(*text++));
  }
  constexpr std::uint64_t value() const noexcept { return hash_ ^ (hash_ >> 29); }

 private:
  std::uint64_t hash_ = 14695981039346656037ull;
};

}  // namespace needleforce
