// SPDX-License-Identifier: Apache-2.0
// The contacts of plain members that are not pierced, which follow from their depths alone: of some steps at
// a time, each by the law that an `Insertion` has.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "plain_step.hpp"

namespace needleforce::detail {

class ContactRows {
 public:
  /// Finds those of `width` members in steps that end the task, all of them if none can touch; slope and
  /// reach are asked for one step at a time.
  [[gnu::always_inline]] PlainContacts find(PlainTask& task, std::size_t width, std::size_t steps) noexcept {
    const bool all = all_pierced(task, width);
    task.to = all && task.usual ? steps : std::min(steps, task.from + most);
    return all || !any_touches(task, width) ? PlainContacts{} : found(task, width);
  }

 private:
  static constexpr std::size_t most = 32;  // steps

  [[gnu::noinline]] PlainContacts found(const PlainTask& task, std::size_t width) noexcept {
    std::fill_n(force_.begin(), (task.to - task.from) * width, 0.0);
    slope_.fill(0.0), beyond_.fill(0.0);
    for (std::size_t k = 0; k < task.laws.layers.size(); ++k)
      for (std::size_t i = 0; i < width; ++i)
        if (!pierced(task, k, i))
          task.laws.on_contact(law_of(task, i), k,
                               [&](const auto& contact) { add(task, contact, width, k, i); });
    return {force_.data(), slope_.data(), beyond_.data()};
  }

  static std::size_t law_of(const PlainTask& task, std::size_t i) noexcept { return task.law + i; }
  static bool pierced(const PlainTask& task, std::size_t k, std::size_t i) noexcept {
    return task.columns.layers[k].pierced[task.at + i] > 0.0;
  }
  static bool all_pierced(const PlainTask& task, std::size_t width) noexcept {
    for (const PlainColumns::InLayer& layer : task.columns.layers)
      for (std::size_t i = 0; i < width; ++i)
        if (!(layer.pierced[task.at + i] > 0.0)) return false;
    return true;
  }
  static bool any_touches(const PlainTask& task, std::size_t width) noexcept {
    std::array<double, most_lanes> tops;
    tops.fill(std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < width; ++i)
      for (std::size_t k = task.laws.layers.size(); k-- > 0;)
        if (!pierced(task, k, i)) tops[i] = std::min(tops[i], task.laws.layers[k].top[law_of(task, i)]);
    bool touches = false;
    for (std::size_t t = task.from; t < task.to; ++t)
      for (std::size_t i = 0; i < width; ++i) touches |= task.motion.depths(t)[task.at + i] > tops[i];
    return touches;
  }
  template <class Law>
  void add(const PlainTask& task, const Law& contact, std::size_t width, std::size_t k,
           std::size_t i) noexcept {
    const double top = task.laws.layers[k].top[law_of(task, i)];
    for (std::size_t t = task.from; t < task.to; ++t) {
      const double h = task.motion.depths(t)[task.at + i] - top;
      if (!(h > 0.0)) continue;
      force_[(t - task.from) * width + i] += contact.force(h);
      if (task.out.force_alone) continue;
      slope_[i] += contact.slope(h);
      if (h > contact.reach()) beyond_[i] = 1.0;
    }
  }

  alignas(64) std::array<double, most * most_lanes> force_;
  alignas(64) std::array<double, most_lanes> slope_, beyond_;
};

}  // namespace needleforce::detail
