// SPDX-License-Identifier: Apache-2.0
// What no loop inlines of a prepared insertion: compiled by each program that includes the headers, or once,
// in the library of `needleforce::compiled`, whose programs compile in a quarter of the time.
#pragma once

#include "model_fingerprint.hpp"
#include "model_swap.hpp"
#include "prepared_insertion.hpp"

namespace needleforce {

template <class Real>
BasicPreparedInsertion<Real>::BasicPreparedInsertion(std::span<const Layer> layers,
                                                     std::span<const BasicLayer<Real>> numbers,
                                                     const Limits& limits, const Bevel& bevel,
                                                     const TipTable* tip) noexcept
    : limits_(limits),
      valid_(tip || (!first_fault(layers).reason && valid(limits) && !first_invalid(bevel))),
      count_(valid_ ? layers.size() : 1) {
  if (!valid_) return;
  lateral_ratio_ = bevel.lateral_ratio();
  model_ = fingerprint(layers);
  tip_ = tip ? *tip : table_of_tip(layers);
  for (std::size_t i = 0; i < layers.size(); ++i) layers_[i] = BasicPreparedLayer<Real>(numbers[i], tip_);
  for (std::size_t i = 1; i < layers.size(); ++i) {
    // a law that stands alone has a spring of its own in each layer
    const bool continues = !layers_[i].resists() && !detail::adds(layers[i].laws) &&
                           same_law(layers[i].laws.friction, layers[i - 1].laws.friction);
    roots_[i] = continues ? roots_[i - 1] : static_cast<std::uint8_t>(i);
    same_cutting_[i] = same_law(layers[i].laws.cutting, layers[i - 1].laws.cutting);
  }
  noise_ = noise_of(limits.depth_noise);
  plain_ = count_ == 1 && layers_[0].plain() && noise_.range == 0.0;
  relaxes_ = layers_[0].relaxes();
  for (std::size_t i = 0; i < count_ && count_ > 1; ++i) looks_ahead_ |= layers_[i].looks_ahead();
}

template <class Real>
const char* BasicPreparedInsertion<Real>::restore_fault(const Saved& bytes) const noexcept {
  if (!valid_) return "model of this insertion";
  if (const char* part = foreign_part(bytes, model_)) return part;
  const BasicInsertionState<Real> state = bytes.state();
  StateCheck check;
  needleforce::check(check, state, count_);
  for (std::size_t i = 0; i < max_layers; ++i)
    needleforce::check(check, state.layers[i], i < count_ ? layers_[i].largest_contact(tip_) : 0.0);
  if (!check.fault() && state.pierced > 0)
    layers_[state.pierced - 1].check(check, state.cut, smaller(limits_.max_speed, fastest));
  return check.fault();
}

template <class Real>
void BasicPreparedInsertion<Real>::restore_exponentials(BasicInsertionState<Real>& state) const noexcept {
  if (state.relaxation_dt > 0.0) relax(state, state.relaxation_dt);
  for (std::size_t i = 0; i < count_; ++i) layers_[i].look_again(state.layers[i]);
}

template <class Real>
BasicInsertionState<Real> BasicPreparedInsertion<Real>::continued(
    const BasicPreparedInsertion<Real>& old, const BasicInsertionState<Real>& state) const noexcept {
  if (model_ == old.model_) return state;
  const auto stack = [](const BasicPreparedInsertion& one) {
    return ModelSwap::Stack{{one.layers_.data(), one.count_}, one.tip_};
  };
  return ModelSwap::continued(stack(old), state, stack(*this));
}

template <class Real>
Real BasicPreparedInsertion<Real>::steady_cutting(const BasicInsertionState<Real>& state) const noexcept {
  return state.pierced > 0 ? front(state).steady_cutting() : 0.0;
}

template <class Real>
bool BasicPreparedInsertion<Real>::pays(bool other) const noexcept {
  if (!(other || lateral_ratio_ != 0.0)) return true;
  for (std::size_t i = 0; i < count_; ++i)
    if (!layers_[i].keeps() || (other && !(layers_[i].steady_cutting() > 0.0))) return false;
  return true;
}

template <class Real>
BasicSample<Real> BasicPreparedInsertion<Real>::in_general(BasicInsertionState<Real>& state, double depth,
                                                           double travel, double velocity, double elapsed,
                                                           bool first, double aside) const noexcept {
  return through<false, false>(state, numbers_of<Real>(moved(state, depth, travel, velocity, elapsed)), first,
                               aside);
}

}  // namespace needleforce
