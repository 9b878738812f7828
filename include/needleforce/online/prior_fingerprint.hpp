// SPDX-License-Identifier: Apache-2.0
// A number that distinguishes what an identifier was made with: its state belongs to that alone.
#pragma once

#include <cstdint>

#include "../events/event_settings.hpp"
#include "../fingerprint.hpp"
#include "../laws/tip_contact.hpp"
#include "online_prior.hpp"
#include "online_settings.hpp"

namespace needleforce::online {

namespace detail {

inline void add(Fingerprint& print, const LayerPrior& layer) noexcept {
  for (const Expected& each :
       {layer.modulus, layer.cutting, layer.friction, layer.top, layer.puncture, layer.remainder}) {
    print.add(each.mean);
    print.add(each.sd);
  }
}
/// The tip and the shank, by the force that they make.
inline void add(Fingerprint& print, const laws::TipContact::Prepared& contact) noexcept {
  print.add(contact.modulus);
  contact.table.each([&](double number) { print.add(number); });
}
template <class Settings>
void add_settings(Fingerprint& print, const Settings& settings) noexcept {
  for (const auto& parameter : Settings::table) print.add(settings.*parameter.member);
}

}  // namespace detail

/// Of prior, contact and settings. Wait-free.
inline std::uint64_t fingerprint(const OnlinePrior& prior, const laws::TipContact::Prepared& contact,
                                 const OnlineSettings& settings,
                                 const events::EventSettings& watched) noexcept {
  Fingerprint print;
  print.add(static_cast<std::uint64_t>(prior.layers));
  print.add(static_cast<std::uint64_t>(prior.same_tissue));
  for (const LayerPrior& layer : prior.layer) detail::add(print, layer);
  print.add(prior.earlier.spacing);
  for (std::size_t i = 0; i < EarlierInsertions::points; ++i) {
    print.add(prior.earlier.mean[i]);
    print.add(prior.earlier.sd[i]);
  }
  detail::add(print, contact);
  detail::add_settings(print, settings);
  detail::add_settings(print, watched);
  return print.value();
}

}  // namespace needleforce::online
