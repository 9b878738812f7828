// SPDX-License-Identifier: Apache-2.0
#include "sliding_force.hpp"

#include <thread>
#include <variant>

#include "needleforce/sliding.hpp"

namespace needleforce::python {

namespace {

// Vectorised as wide as the machine allows; values do not change (no FMA). One function for each contact law.
template <class Contact>
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
[[gnu::target_clones("avx2", "default"), gnu::flatten]]
#endif
void slide_after_wide(const Contact& contact, double puncture, const Model& model, const double* depth,
                      const double* velocity, double* force, std::size_t n) {
  detail::slide_after(contact, puncture, model, depth, velocity, force, n);
}

void sliding_force_wide(const Model& model, const double* depth, const double* velocity, double* force,
                        std::size_t n) {
  const auto contact = prepare(model.stiffness);
  const double puncture = puncture_depth(model.puncture, contact);
  std::visit([&](const auto& law) { slide_after_wide(law, puncture, model, depth, velocity, force, n); },
             contact);
}

}  // namespace

// A long array is bound by memory, of which one core alone does not get all: its second half goes to another.
void sliding_force_long(const Model& model, const double* depth, const double* velocity, double* force,
                        std::size_t n) {
  constexpr std::size_t worthwhile = std::size_t{1} << 20;
  if (n < worthwhile || std::thread::hardware_concurrency() < 2)
    return sliding_force_wide(model, depth, velocity, force, n);
  const std::size_t half = n / 2;
  std::thread other([=, &model] { sliding_force_wide(model, depth, velocity, force, half); });
  sliding_force_wide(model, depth + half, velocity ? velocity + half : nullptr, force + half, n - half);
  other.join();
}

}  // namespace needleforce::python
