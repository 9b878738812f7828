// SPDX-License-Identifier: Apache-2.0
// The law that was chosen at run time, without virtual calls and without std::visit's table.
#pragma once

#include <cstddef>
#include <variant>

namespace needleforce {

/// The law of a variant that is known to hold it: the compiler need not look.
template <class Law>
[[gnu::always_inline]] inline const Law& known(const Law* law) noexcept {
#if defined(__GNUC__) || defined(__clang__)
  if (!law) __builtin_unreachable();
#endif
  return *law;
}

/// Calls `f` with the law that the variant holds. A chain of comparisons, the first of the list first: a loop
/// takes the same branch every time, and the compiler sees through it. Written out: a function that calls
/// itself for the next law takes a compiler much longer, as it is one of its own for each law and each `f`.
template <class F, class... L>
[[gnu::always_inline]] inline decltype(auto) dispatch(const std::variant<L...>& laws, F&& f) noexcept {
  constexpr std::size_t n = sizeof...(L);
  static_assert(n <= 12, "one more comparison below for each law more");
  const std::size_t held = laws.index();
  if constexpr (n > 1)
    if (held == 0) return f(known(std::get_if<0>(&laws)));
  if constexpr (n > 2)
    if (held == 1) return f(known(std::get_if<1>(&laws)));
  if constexpr (n > 3)
    if (held == 2) return f(known(std::get_if<2>(&laws)));
  if constexpr (n > 4)
    if (held == 3) return f(known(std::get_if<3>(&laws)));
  if constexpr (n > 5)
    if (held == 4) return f(known(std::get_if<4>(&laws)));
  if constexpr (n > 6)
    if (held == 5) return f(known(std::get_if<5>(&laws)));
  if constexpr (n > 7)
    if (held == 6) return f(known(std::get_if<6>(&laws)));
  if constexpr (n > 8)
    if (held == 7) return f(known(std::get_if<7>(&laws)));
  if constexpr (n > 9)
    if (held == 8) return f(known(std::get_if<8>(&laws)));
  if constexpr (n > 10)
    if (held == 9) return f(known(std::get_if<9>(&laws)));
  if constexpr (n > 11)
    if (held == 10) return f(known(std::get_if<10>(&laws)));
  return f(known(std::get_if<n - 1>(&laws)));
}

}  // namespace needleforce
