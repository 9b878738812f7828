// SPDX-License-Identifier: Apache-2.0
// Numbers, tables and tips from the bytes of a fuzzer: mostly inside their ranges, now and then at an end,
// beyond it, or none at all. Bytes that have run out are zeros.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <span>
#include <variant>

#include "needleforce/tip.hpp"

namespace needleforce::proof {

inline void require(bool kept, const char* property) {
  if (kept) return;
  std::fprintf(stderr, "property broken: %s\n", property);
  std::abort();
}

}  // namespace needleforce::proof

namespace from_bytes {

using namespace needleforce;

class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : left_(data, size) {}
  bool empty() const { return left_.empty(); }

  template <class T>
  T take() {
    T value{};
    const std::size_t n = std::min(sizeof value, left_.size());
    if (n > 0) std::memcpy(&value, left_.data(), n);
    left_ = left_.subspan(n);
    return value;
  }
  std::size_t below(std::size_t n) { return take<std::uint8_t>() % n; }

  /// A number for a closed range.
  double number(double low, double high) {
    const auto kind = take<std::uint8_t>();
    if (kind < 240) return along(low, high, take<std::uint16_t>() / 65535.0);
    const double infinite = std::numeric_limits<double>::infinity();
    if (kind == 255) return take<double>();
    const double ends[] = {low, high, std::nextafter(low, -infinite), std::nextafter(high, infinite)};
    return kind < 250 ? ends[kind % 4] : odd(kind);
  }

  /// What no sensor should give.
  static double odd(std::size_t which) {
    using number = std::numeric_limits<double>;
    const double numbers[] = {number::quiet_NaN(),  number::infinity(),
                              -number::infinity(),  number::max(),
                              -number::max(),       0.0,
                              number::denorm_min(), -1e-300};
    return numbers[which % std::size(numbers)];
  }

 private:
  static double along(double low, double high, double place) {
    if (std::isinf(high)) return place < 0.25 ? high : along(low, std::max(1e3, 1e9 * low), place);
    if (low > 0.0 && high > 100.0 * low) return low * std::pow(high / low, place);
    return low + place * (high - low);
  }
  std::span<const std::uint8_t> left_;
};

/// One type of a list, with its value made by `make`.
template <class Make, class... L>
std::variant<L...> one_of(Bytes& bytes, std::variant<L...>*, Make make) {
  std::variant<L...> chosen;
  std::size_t index = bytes.below(sizeof...(L));
  ((index-- == 0 ? void(chosen = make.template operator()<L>(bytes)) : void()), ...);
  return chosen;
}

template <class T>
T numbers_of(Bytes& bytes) {
  T value{};
  for (const auto& parameter : T::table)
    value.*parameter.member = bytes.number(parameter.low, parameter.high);
  return value;
}

inline tips::Profile profile(Bytes& bytes) {
  tips::Profile profile;
  profile.count = static_cast<int>(bytes.below(tips::Profile::capacity + 2));
  double slope = 0.0;
  for (int k = 1; k < std::min(profile.count, tips::Profile::capacity); ++k) {
    const double step = bytes.number(1e-6, 1e-3);
    slope += bytes.number(0.0, 3.0);
    profile.radius[k] = profile.radius[k - 1] + step;
    profile.rise[k] = profile.rise[k - 1] + slope * step;
  }
  return profile;
}

struct MakeTip {
  template <class T>
  T operator()(Bytes& bytes) const {
    if constexpr (std::is_same_v<T, tips::Profile>) {
      return profile(bytes);
    } else {
      T tip = numbers_of<T>(bytes);
      if constexpr (requires { tip.equivalence; })
        tip.equivalence = static_cast<tips::BevelEquivalence>(bytes.below(4));
      return tip;
    }
  }
};

}  // namespace from_bytes
