// SPDX-License-Identifier: Apache-2.0
// The contact law as a layer keeps it: of `tip_contact` without the table, which the insertion has.
#pragma once

#include <utility>
#include <variant>

#include "dispatch.hpp"
#include "laws/all.hpp"
#include "tip_table.hpp"

// Before C++23 a lambda takes this only as g++ and clang spell it; another compiler inlines by its own
// judgement.
#if defined(__GNUC__) || defined(__clang__)
#define NEEDLEFORCE_INLINED __attribute__((always_inline))
#else
#define NEEDLEFORCE_INLINED
#endif

namespace needleforce {

namespace detail {
template <class Laws>
struct contacts_in_layer;
template <class... L>
struct contacts_in_layer<std::variant<L...>> {
  template <class Law>
  static auto keep(const Law& law) noexcept {
    if constexpr (requires { law.shared(); })
      return law.shared();
    else
      return law.prepare();
  }
  using type = std::variant<decltype(keep(std::declval<L>()))...>;
};
}  // namespace detail

/// A prepared contact law, for which the insertion has the table of its tip. Wait-free in the loop.
template <class Real>
class BasicLayerContact {
  using Kept = detail::contacts_in_layer<BasicStiffness<Real>>;

 public:
  BasicLayerContact() = default;
  explicit BasicLayerContact(const BasicStiffness<Real>& laws) noexcept
      : law_(dispatch(laws, [](const auto& law) { return typename Kept::type{Kept::keep(law)}; })) {}

  /// Calls `visit` with the law, on the table if it needs one.
  template <class Visit>
  [[gnu::always_inline]] decltype(auto) on(const TipTable& tip, Visit visit) const noexcept {
    return dispatch(law_, [&](const auto& law) NEEDLEFORCE_INLINED -> decltype(auto) {
      if constexpr (requires { law.on(tip); })
        return visit(law.on(tip));
      else
        return visit(law);
    });
  }

 private:
  typename Kept::type law_{};
};

}  // namespace needleforce
