// SPDX-License-Identifier: Apache-2.0
// What counts as an event, in physical units, so that it holds for any rate and any sensor.
#pragma once

#include <array>

#include "../parameter.hpp"

namespace needleforce::events {

/// The defaults are what a puncture is in docs/evidence/online_events.md; none was fitted to recordings.
struct EventSettings {
  double fall = 0.15;
  double share = 0.1;
  double within = 0.1;
  double false_alarms = 1e-3;
  double contact_force = 0.03;
  double force_noise = 0.0;
  double depth_noise = 5e-6;
  double rest_speed = 1e-4;
  double force_delay = 0.0;

  static constexpr const char* name = "events";
  static constexpr const char* summary = "What counts as an event while a needle moves.";
  static constexpr std::array<Parameter<EventSettings>, 9> table{{
      {&EventSettings::fall, "fall", "N", 0.0, 1e6, 0.15, "d",
       "the smallest fall of the force that is a puncture", "free"},
      {&EventSettings::share, "share", "1", 0.0, 1.0, 0.1, "s", "the same as a share of the running peak",
       "free"},
      {&EventSettings::within, "within", "s", 1e-3, 10.0, 0.1, "T", "time in which it falls", "free"},
      {&EventSettings::false_alarms, "false_alarms", "1/s", 1e-12, 1.0, 1e-3, "r",
       "punctures that noise alone may make, at most", "free: bound of Bonferroni over the windows"},
      {&EventSettings::contact_force, "contact_force", "N", 0.0, 1e6, 0.03, "F_c",
       "rise above the free travel that is a contact", "free"},
      {&EventSettings::force_noise, "force_noise", "N", 0.0, 1e3, 0.0, "s_F",
       "the least standard deviation of the force; it is learnt above this", "free"},
      {&EventSettings::depth_noise, "depth_noise", "m", 1e-9, 1e-2, 5e-6, "s_z",
       "standard deviation of the depth", "free"},
      {&EventSettings::rest_speed, "rest_speed", "m/s", 1e-9, 1.0, 1e-4, "v_0",
       "speed below which the needle stands", "free"},
      {&EventSettings::force_delay, "force_delay", "s", 0.0, 1.0, 0.0, "t_F",
       "by which a force is read later than the depth where it acted", "free"},
  }};
};

}  // namespace needleforce::events
