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
/// takes the same branch every time, and the compiler sees through it.
template <std::size_t index = 0, class F, class... L>
[[gnu::always_inline]] inline decltype(auto) dispatch(const std::variant<L...>& laws, F&& f) noexcept {
  if constexpr (index + 1 < sizeof...(L)) {
    if (laws.index() != index) return dispatch<index + 1>(laws, f);
  }
  return f(known(std::get_if<index>(&laws)));
}

}  // namespace needleforce
