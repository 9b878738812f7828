// SPDX-License-Identifier: Apache-2.0
// A search for input that gets more energy, force or change of force out of a guard than it promises: random
// sequences of clocks, measurements and motions under random settings, made worse by mutation.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "guard_referee.hpp"
#include "needleforce/base_guard.hpp"

namespace guard_search {

using namespace needleforce;
using Generator = std::mt19937_64;

inline double uniform(Generator& generator, double low = 0.0, double high = 1.0) {
  return low + (high - low) * 0x1p-53 * static_cast<double>(generator() >> 11);
}
inline double logarithmic(Generator& generator, double low, double high) {
  return low * std::pow(high / low, uniform(generator));
}
inline bool once_in(Generator& generator, unsigned n) { return generator() % n == 0; }
template <class T, std::size_t n>
T one_of(Generator& generator, const std::array<T, n>& values) {
  return values[generator() % n];
}

/// What the search may use.
struct Kind {
  const char* name;
  bool acceleration;     ///< bounded in the settings
  bool clocks;           ///< that fail: zero, negative, NaN, infinite, far too short or long
  bool outside;          ///< motion beyond the bounds too: jumps, pauses, speeds that change at once
  int hidden_delay = 0;  ///< cycles of delay that the settings do not state
};
inline constexpr Kind kinds[] = {{"speed", false, false, false},
                                 {"speed, any clock", false, true, false},
                                 {"speed, any clock, beyond the bounds", false, true, true},
                                 {"acceleration", true, false, false},
                                 {"acceleration, any clock", true, true, false},
                                 {"acceleration, any clock, beyond the bounds", true, true, true}};

enum class Clock : std::uint8_t { right, wrong };
enum class Depth : std::uint8_t { measured, missed, rejected };
enum class Event : std::uint8_t { none, turn, jump, pause };

/// What happens along one axis in a cycle.
struct Along {
  bool against = false;  ///< the motion is relative to the force that is felt
  bool event = true;     ///< it turns or jumps where the others do
  double push = 0.0;     ///< -1 to 1 of the acceleration or speed that the bounds permit
  double error = 0.0;    ///< -1 to 1 of the error of the measurement
  double wanted = 0.0;   ///< by the engine [N, N m]
};

/// One cycle of a sequence: the clock and the measurement at its beginning, and the motion until its end.
template <std::size_t axes>
struct Step {
  Clock clock = Clock::right;
  Depth depth = Depth::measured;
  Event event = Event::none;
  double time = 1.0;      ///< as a share of the longest cycle
  double reported = 0.0;  ///< by a clock that is wrong [s]
  double bad = 0.0;       ///< a depth that is rejected
  double size = 1.0;      ///< of a jump or a pause, in cycles
  double early = 0.0;     ///< share of the travel in a pause that delayed measurements show at once after it
  std::array<Along, axes> along{};
};

template <std::size_t axes>
struct Sequence {
  Kind kind{};
  GuardSettings settings{};
  std::vector<Step<axes>> steps;
};

inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

inline void add_turning(Generator& g, const Kind& kind, GuardSettings& s) {
  s.max_lateral_force = logarithmic(g, 0.5, 50.0);
  s.max_lateral_slew = once_in(g, 3) ? logarithmic(g, 100.0, 1e5) : unlimited;
  s.max_moment = logarithmic(g, 0.01, 10.0);
  s.max_moment_slew = once_in(g, 3) ? logarithmic(g, 1.0, 1e4) : unlimited;
  s.max_angular_speed = logarithmic(g, 0.05, 2.0);
  s.max_angular_jump =
      once_in(g, 4) ? s.max_angular_speed * s.longest_cycle * uniform(g, 0.5, 5.0) : unlimited;
  if (kind.acceleration && !once_in(g, 4)) s.max_angular_acceleration = logarithmic(g, 1.0, 300.0);
  s.angle_error = once_in(g, 3) ? logarithmic(g, 1e-7, 3e-4) : 0.0;
}

inline GuardSettings random_settings(Generator& g, const Kind& kind, std::size_t axes) {
  GuardSettings s;
  s.force_scale = once_in(g, 4) ? logarithmic(g, 0.1, 10.0) : 1.0;
  s.motion_scale = once_in(g, 4) ? logarithmic(g, 0.1, 10.0) : 1.0;
  s.max_force = logarithmic(g, 0.5, 50.0);
  s.max_slew = once_in(g, 3) ? logarithmic(g, 100.0, 1e5) : unlimited;
  s.longest_cycle = once_in(g, 2) ? 1e-3 : logarithmic(g, 1e-4, 5e-3);
  s.stale_after = once_in(g, 2) ? s.longest_cycle * uniform(g, 0.0, 30.0) : 0.0;
  s.fall_time = once_in(g, 2) ? s.longest_cycle * uniform(g, 0.0, 30.0) : 0.0;
  s.max_speed = logarithmic(g, 0.05, 2.0);
  s.max_jump = once_in(g, 4) ? s.max_speed * s.longest_cycle * uniform(g, 0.5, 5.0) : unlimited;
  if (kind.acceleration) s.max_acceleration = logarithmic(g, 1.0, 300.0);
  s.delay = once_in(g, 3) ? static_cast<double>(g() % (max_delay + 1)) : static_cast<double>(g() % 4);
  s.position_error = once_in(g, 3) ? logarithmic(g, 1e-7, 3e-4) : 0.0;
  s.initial_reserve = logarithmic(g, 1e-7, 1e-3);
  if (kind.acceleration && s.position_error == 0.0 && once_in(g, 2)) s.initial_reserve = 0.0;
  s.max_reserve = once_in(g, 4) ? logarithmic(g, 1.0, 100.0) * std::max(s.initial_reserve, 1e-6) : unlimited;
  if (axes > axes_of_a_depth) add_turning(g, kind, s);
  return s;
}

inline constexpr std::array pushes{-1.0, 0.0, 1.0};

inline double random_share(Generator& g) { return once_in(g, 2) ? one_of(g, pushes) : uniform(g, -1.0, 1.0); }
inline double random_wish(Generator& g, const GuardSettings& settings, std::size_t axis) {
  const double largest = axis == 0                   ? settings.max_force
                         : axis < first_turning_axis ? settings.max_lateral_force
                                                     : settings.max_moment;
  const double strongest = 2.0 * largest / settings.force_scale;
  return once_in(g, 20)  ? one_of(g, std::array{not_a_number, unlimited, -unlimited})
         : once_in(g, 3) ? uniform(g, -strongest, strongest)
                         : strongest * one_of(g, pushes);
}

template <std::size_t axes>
Step<axes> random_step(Generator& g, const Sequence<axes>& in) {
  constexpr std::array clocks{0.0,    -0.0,  -1e-3, not_a_number, unlimited, -unlimited, 1e300,
                              1e-300, 1e-12, 1e-9,  1e-6,         1e-4,      1.0,        1e9};
  constexpr std::array depths{not_a_number, unlimited, -unlimited, 1e9, -1e300};
  Step<axes> step;
  Along& depth = step.along[0];
  depth.against = once_in(g, 2);
  step.time = once_in(g, 3) ? uniform(g, 1e-6, 1.0) : once_in(g, 8) ? 1e-6 : 1.0;
  depth.push = random_share(g);
  depth.error = random_share(g);
  depth.wanted = random_wish(g, in.settings, 0);
  step.bad = one_of(g, depths);
  step.depth = once_in(g, 10) ? Depth::missed : once_in(g, 10) ? Depth::rejected : Depth::measured;
  step.size = logarithmic(g, 1.0, 300.0);
  if (in.kind.clocks && once_in(g, 6)) {
    step.clock = Clock::wrong;
    step.reported = one_of(g, clocks);
  }
  step.early = once_in(g, 2) ? uniform(g) : 0.0;
  if (in.kind.outside && once_in(g, 8))
    step.event = one_of(g, std::array{Event::turn, Event::jump, Event::pause});
  for (std::size_t i = 1; i < axes; ++i)
    step.along[i] = {once_in(g, 2), once_in(g, 2), random_share(g), random_share(g),
                     once_in(g, 3) ? 0.0 : random_wish(g, in.settings, i)};
  if (axes > 1) depth.event = once_in(g, 2);
  return step;
}

template <std::size_t axes>
Sequence<axes> random_sequence(Generator& g, const Kind& kind) {
  Sequence<axes> made{kind, random_settings(g, kind, axes), {}};
  const std::size_t n = 20 + g() % 100;
  Step<axes> step;
  for (std::size_t i = 0; i < n; ++i) {
    // a motion that lasts for some cycles gets further than one that is drawn in each
    step = i == 0 || once_in(g, 3) ? random_step(g, made) : step;
    made.steps.push_back(step);
  }
  return made;
}

template <std::size_t axes>
Sequence<axes> mutated(Generator& g, const Sequence<axes>& from) {
  Sequence<axes> made = from;
  if (once_in(g, 8)) made.settings = random_settings(g, made.kind, axes);
  for (std::uint64_t left = 1 + g() % 4; left > 0; --left) {
    const std::size_t at = g() % made.steps.size(), to = g() % made.steps.size();
    if (once_in(g, 3))
      made.steps[to] = made.steps[at];
    else
      for (std::size_t i = at, end = std::min(made.steps.size(), at + 1 + g() % 4); i < end; ++i)
        made.steps[i] = random_step(g, made);
  }
  return made;
}

/// An engine that asks for what it is asked to.
struct Wish {
  double force = 0.0;
  Sample step(double, double, double) noexcept { return {.force = force}; }
};
struct BaseWish {
  double force = 0.0;
  std::array<double, 6> wrench{};
  bending::BentSample step(const bending::Base&, double) noexcept {
    return {.wrench = wrench, .force = force};
  }
};

/// The device in the user's hand along an axis: how it moves within the bounds.
class Hand {
 public:
  Hand(const GuardSettings& settings, std::size_t axis)
      : v_(settings.speed(axis)), a_(settings.acceleration(axis)) {}
  double travel(const Along& along, Event event, double size, double seconds, double force) {
    const double sign = along.against ? (force < 0.0 ? 1.0 : -1.0) : 1.0, push = sign * along.push;
    if (!along.event && event != Event::pause) event = Event::none;
    if (event == Event::jump) return push * v_ * seconds * (1.0 + size);
    if (event == Event::turn) speed_ = push * v_;
    if (!(a_ < unlimited)) return (speed_ = push * v_) * seconds;
    const double end = std::clamp(speed_ + push * a_ * seconds, -v_, v_), turn = std::abs(end - speed_) / a_;
    const double travel = 0.5 * (speed_ + end) * turn + end * (seconds - turn);
    speed_ = end;
    return push == 0.0 ? speed_ * seconds : travel;
  }

 private:
  double v_, a_, speed_ = 0.0;
};

/// What a sensor shows that is late by some calls. In a pause of the loop it catches up.
class LateSensor {
 public:
  explicit LateSensor(std::size_t delay) : shown_(delay + 1, 0.0) {}
  double shown() const { return shown_.front(); }
  void move(double travel) {
    for (std::size_t i = 1; i < shown_.size(); ++i) shown_[i - 1] = shown_[i];
    shown_.back() += travel;
  }
  /// The last travel was that of a pause: what is on its way was measured within it.
  void catch_up(double travel, double early) {
    for (std::size_t i = 0; i + 1 < shown_.size(); ++i) shown_[i] = shown_.back() - (1.0 - early) * travel;
  }

 private:
  std::vector<double> shown_;
};

/// A guard around an engine that asks for what a step says.
template <std::size_t axes>
struct Guarded;

template <>
struct Guarded<1> {
  Wish wish{};
  Guard<Wish&> guard;
  explicit Guarded(const GuardSettings& settings) : guard(wish, settings) {}
  void ask(const Step<1>& step) { wish.force = step.along[0].wanted; }
  Output step(const std::array<double, 1>& seen, double dt) { return guard.step(seen[0], no_velocity, dt); }
  static std::array<double, 1> forces(const Output& output) { return {output.force}; }
};
template <>
struct Guarded<6> {
  BaseWish wish{};
  Guard<BaseWish&> guard;
  explicit Guarded(const GuardSettings& settings) : guard(wish, settings) {}
  void ask(const Step<6>& step) {
    const auto& a = step.along;
    wish.force = a[0].wanted;
    wish.wrench = {a[1].wanted, a[2].wanted, -a[0].wanted, a[3].wanted, a[4].wanted, a[5].wanted};
  }
  BaseOutput step(const std::array<double, 6>& s, double dt) {
    return guard.step({s[0], {s[1], s[2]}, {s[3], s[4]}, s[5]}, dt);
  }
  static std::array<double, 6> forces(const BaseOutput& output) {
    const BaseForce& f = output.force;
    return {f.depth, f.lateral[0], f.lateral[1], f.tilt[0], f.tilt[1], f.roll};
  }
};

/// The sequence played to a guard, and what the referee found.
template <std::size_t axes>
Referee<axes> played(const Sequence<axes>& sequence) {
  const GuardSettings& s = sequence.settings;
  Guarded<axes> guarded(s);
  Referee<axes> referee(s, sequence.steps.size(), !sequence.kind.outside);
  std::vector<Hand> hands;
  for (std::size_t i = 0; i < axes; ++i) hands.emplace_back(s, i);
  std::vector<LateSensor> sensors(axes, LateSensor(static_cast<std::size_t>(s.delay) +
                                                   static_cast<std::size_t>(sequence.kind.hidden_delay)));
  double time = s.longest_cycle;
  std::array<double, axes> travel{}, seen{};
  bool paused = false;
  for (const Step<axes>& step : sequence.steps) {
    // a clock that is wrong and can be believed is beyond the bounds too
    const bool possible = step.reported > 0.1 * s.longest_cycle && step.reported <= s.longest_cycle;
    const bool wrong = step.clock == Clock::wrong && (sequence.kind.outside || !possible);
    const double dt = wrong ? step.reported : time;
    const bool catches_up = paused && !(dt > 0.0 && dt <= s.longest_cycle);
    guarded.ask(step);
    for (std::size_t i = 0; i < axes; ++i) {
      if (catches_up) sensors[i].catch_up(travel[i], step.early);
      seen[i] = sensors[i].shown() + s.error(i) * step.along[i].error;
    }
    if (step.depth == Depth::rejected) seen[0] = step.bad;
    const auto output = step.depth == Depth::missed ? guarded.guard.miss(dt) : guarded.step(seen, dt);
    const std::array<double, axes> force = guarded.forces(output);
    referee.call(dt, step.depth == Depth::measured && !output.did.rejected, force);
    time = s.longest_cycle * (step.event == Event::pause ? 1.0 + step.size : step.time);
    for (std::size_t i = 0; i < axes; ++i) {
      travel[i] = hands[i].travel(step.along[i], step.event, step.size, time, force[i]);
      sensors[i].move(travel[i]);
    }
    referee.move(travel);
    paused = step.event == Event::pause;
  }
  referee.finish();
  return referee;
}

/// How bad it is: beyond a limit of force as a ratio, and energy in cycles of the whole force.
template <std::size_t axes>
double score(const Sequence<axes>& sequence, const Referee<axes>& referee) {
  const GuardSettings& s = sequence.settings;
  double power = s.max_force * s.max_speed;
  if (axes > 1) power += s.max_lateral_force * s.max_speed + s.max_moment * s.max_angular_speed;
  const double energy = referee.missing() / (power * s.longest_cycle);
  return referee.excess() > 1e-9 ? std::max(referee.excess(), energy) : energy;
}

template <std::size_t axes>
struct Found {
  long cycles = 0, broken = 0;
  double worst = -unlimited, worst_energy = -unlimited;  ///< score, and [J] beyond the promise
  Sequence<axes> example{};
};

/// Sequences of a kind from random ones by mutation, over about this many cycles.
template <std::size_t axes = 1>
Found<axes> search(const Kind& kind, long cycles, std::uint64_t seed, int climbs = 60) {
  Generator generator{seed};
  Found<axes> found;
  while (found.cycles < cycles) {
    Sequence<axes> best = random_sequence<axes>(generator, kind);
    double top = -unlimited;
    for (int i = 0; i <= climbs; ++i) {
      Sequence<axes> next = i == 0 ? best : mutated(generator, best);
      const Referee<axes> referee = played(next);
      found.cycles += static_cast<long>(next.steps.size());
      found.broken += !referee.kept();
      const double reached = score(next, referee);
      if (!referee.kept() && reached > found.worst) {
        found.worst = reached;
        found.worst_energy = referee.missing();
        found.example = next;
      }
      if (reached >= top) top = reached, best = std::move(next);
    }
  }
  return found;
}

}  // namespace guard_search
