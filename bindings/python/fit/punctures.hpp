// SPDX-License-Identifier: Apache-2.0
// Every puncture at one contact depth, exactly, without visiting them all.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "search.hpp"

namespace needleforce::fit {

/// The admitted punctures at one contact depth, block by block.
class Punctures {
 public:
  Punctures(const Problem& p, const Candidate& at) noexcept
      : p_(p),
        trial_(trial_at(p.insertion, p.withdrawal, at.u0, at.saturation)),
        first_(std::max(p.first, trial_.start + p.shortest)),
        last_(p.last) {}

  std::size_t first_block() const noexcept { return first_ / block; }
  std::size_t end_block() const noexcept { return first_ > last_ ? first_block() : last_ / block + 1; }

  /// No puncture within block k gains more. Left out of the fit, the block's samples cost nothing: stiffness
  /// up to its start, line from its end, and its own sum of squares explained whole. (Branch and bound:
  /// exact.)
  double bound(std::size_t k) const noexcept {
    const Moments &start = p_.insertion.rows()[k].before, &end = p_.insertion.rows()[k + 1].before;
    if (end.count >= trial_.total.count) return unlimited;
    const StiffnessForm form = k * block > trial_.start ? trial_.form(k * block) : StiffnessForm{};
    return coefficients(trial_, form, start, end).gain + (end.ff - start.ff);
  }

  /// Calls visit(puncture, gain) for each admitted puncture of block k.
  template <class Visit>
  void scan(std::size_t k, const Visit& visit) const noexcept {
    const std::size_t first = std::max(k * block, first_), last = std::min(k * block + block - 1, last_);
    if (first > last) return;
    Moments m = p_.insertion.before(first);
    for (std::size_t i = first; i <= last; ++i) {
      visit(i, gain_of(trial_, trial_.form(i), m));
      if (i < last) m.add(p_.insertion.u(i), p_.insertion.force(i));
    }
  }

 private:
  const Problem& p_;
  Trial trial_;
  std::size_t first_, last_;
};

/// The best puncture for the contact depth of `start`: all are considered, most of them by their block's
/// bound.
inline Candidate best_puncture(const Problem& p, const Candidate& start) noexcept {
  const Punctures punctures(p, start);
  Candidate best = start;
  const auto visit = [&](std::size_t puncture, double gain) {
    if (gain > best.gain) best.gain = gain, best.puncture = puncture;
  };
  punctures.scan(start.puncture / block, visit);  // a good start prunes the rest
  for (std::size_t k = punctures.first_block(); k < punctures.end_block(); ++k)
    if (k != start.puncture / block && punctures.bound(k) > best.gain) punctures.scan(k, visit);
  return best;
}

/// The global optimum; `free`: the saturation depth is sought as well.
inline Candidate search(const Problem& p, double saturation, bool free) noexcept {
  const std::span<const double> fixed(&saturation, 1);
  Candidate best = best_of_grid(p, free ? std::span<const double>(saturation_steps) : fixed);
  for (int round = 0; round < 20 && best.gain >= 0; ++round) {
    const std::size_t before = best.puncture;
    best = best_puncture(p, free ? best_saturation(p, best) : best_contact(p, best));
    if (best.puncture == before) break;
  }
  return best;
}

/// The gains of neighbouring punctures: gain[i] belongs to `first` + i samples before the puncture.
struct Profile {
  std::size_t first = 0, count = 0;
};

/// Writes the gain of every puncture that may come within `margin` of the best, and of those between them;
/// minus infinity where none is admitted. `gain` takes one value a sample of the insertion.
inline Profile profile(const Problem& p, const Candidate& best, double margin,
                       std::span<double> gain) noexcept {
  const Punctures punctures(p, best);
  std::size_t low = best.puncture / block, high = low + 1;
  for (std::size_t k = punctures.first_block(); k < punctures.end_block(); ++k)
    if (punctures.bound(k) > best.gain - margin) low = std::min(low, k), high = std::max(high, k + 1);
  const std::size_t first = low * block, count = std::min(high * block, gain.size()) - first;
  std::fill_n(gain.begin(), count, -unlimited);
  for (std::size_t k = low; k < high; ++k)
    punctures.scan(k, [&](std::size_t puncture, double value) { gain[puncture - first] = value; });
  return {first, count};
}

}  // namespace needleforce::fit
