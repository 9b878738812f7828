// SPDX-License-Identifier: Apache-2.0
// A search for input that gets more energy, force or change of force out of a guard than it promises: random
// sequences of clocks, measurements and motions under random settings, made worse by mutation.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "guard_referee.hpp"
#include "needleforce/guard.hpp"

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

/// One cycle of a sequence: the clock and the depth at its beginning, and the motion until its end.
struct Step {
  Clock clock = Clock::right;
  Depth depth = Depth::measured;
  Event event = Event::none;
  bool against = false;   ///< the motion is relative to the force that is felt
  double time = 1.0;      ///< as a share of the longest cycle
  double reported = 0.0;  ///< by a clock that is wrong [s]
  double push = 0.0;      ///< -1 to 1 of the acceleration or speed that the bounds permit
  double error = 0.0;     ///< -1 to 1 of the position error
  double wanted = 0.0;    ///< by the engine [N]
  double bad = 0.0;       ///< a depth that is rejected
  double size = 1.0;      ///< of a jump or a pause, in cycles
  double early = 0.0;     ///< share of the travel in a pause that delayed measurements show at once after it
};

struct Sequence {
  Kind kind{};
  GuardSettings settings{};
  std::vector<Step> steps;
};

inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

inline GuardSettings random_settings(Generator& g, const Kind& kind) {
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
  return s;
}

inline Step random_step(Generator& g, const Sequence& in) {
  constexpr std::array pushes{-1.0, 0.0, 1.0};
  constexpr std::array clocks{0.0,    -0.0,  -1e-3, not_a_number, unlimited, -unlimited, 1e300,
                              1e-300, 1e-12, 1e-9,  1e-6,         1e-4,      1.0,        1e9};
  constexpr std::array depths{not_a_number, unlimited, -unlimited, 1e9, -1e300};
  const double strongest = 2.0 * in.settings.max_force / in.settings.force_scale;
  Step step;
  step.against = once_in(g, 2);
  step.time = once_in(g, 3) ? uniform(g, 1e-6, 1.0) : once_in(g, 8) ? 1e-6 : 1.0;
  step.push = once_in(g, 2) ? one_of(g, pushes) : uniform(g, -1.0, 1.0);
  step.error = once_in(g, 2) ? one_of(g, pushes) : uniform(g, -1.0, 1.0);
  step.wanted = once_in(g, 20)  ? one_of(g, std::array{not_a_number, unlimited, -unlimited})
                : once_in(g, 3) ? uniform(g, -strongest, strongest)
                                : strongest * one_of(g, pushes);
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
  return step;
}

inline Sequence random_sequence(Generator& g, const Kind& kind) {
  Sequence made{kind, random_settings(g, kind), {}};
  const std::size_t n = 20 + g() % 100;
  Step step;
  for (std::size_t i = 0; i < n; ++i) {
    // a motion that lasts for some cycles gets further than one that is drawn in each
    step = i == 0 || once_in(g, 3) ? random_step(g, made) : step;
    made.steps.push_back(step);
  }
  return made;
}

inline Sequence mutated(Generator& g, const Sequence& from) {
  Sequence made = from;
  if (once_in(g, 8)) made.settings = random_settings(g, made.kind);
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

/// The device in the user's hand: where it is, and how it moves within the bounds.
class Hand {
 public:
  explicit Hand(const GuardSettings& settings) : settings_(settings) {}
  double time(const Step& step) const {
    return settings_.longest_cycle * (step.event == Event::pause ? 1.0 + step.size : step.time);
  }
  double travel(const Step& step, double force) {
    const double sign = step.against ? (force < 0.0 ? 1.0 : -1.0) : 1.0, push = sign * step.push;
    const double v = settings_.max_speed, seconds = time(step);
    if (step.event == Event::jump) return push * v * seconds * (1.0 + step.size);
    if (step.event == Event::turn) speed_ = push * v;
    const double a = settings_.max_acceleration;
    if (!(a < unlimited)) return (speed_ = push * v) * seconds;
    const double end = std::clamp(speed_ + push * a * seconds, -v, v), turn = std::abs(end - speed_) / a;
    const double travel = 0.5 * (speed_ + end) * turn + end * (seconds - turn);
    speed_ = end;
    return push == 0.0 ? speed_ * seconds : travel;
  }

 private:
  GuardSettings settings_;
  double speed_ = 0.0;
};

/// What a sensor shows that is late by some calls. In a pause of the loop it catches up.
class LateSensor {
 public:
  explicit LateSensor(std::size_t delay) : shown_(delay + 1, 0.0) {}
  double shown() const { return shown_.front(); }
  double now() const { return shown_.back(); }
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

/// The sequence played to a guard, and what the referee found.
inline Referee played(const Sequence& sequence) {
  const GuardSettings& s = sequence.settings;
  Wish wish;
  Guard<Wish&> guard(wish, s);
  Referee referee(s, sequence.steps.size(), !sequence.kind.outside);
  Hand hand(s);
  LateSensor sensor(static_cast<std::size_t>(s.delay) + static_cast<std::size_t>(sequence.kind.hidden_delay));
  double time = s.longest_cycle, travel = 0.0;
  bool paused = false;
  for (const Step& step : sequence.steps) {
    // a clock that is wrong and can be believed is beyond the bounds too
    const bool possible = step.reported > 0.1 * s.longest_cycle && step.reported <= s.longest_cycle;
    const bool wrong = step.clock == Clock::wrong && (sequence.kind.outside || !possible);
    const double dt = wrong ? step.reported : time;
    if (paused && !(dt > 0.0 && dt <= s.longest_cycle)) sensor.catch_up(travel, step.early);
    wish.force = step.wanted;
    const double seen = sensor.shown() + s.position_error * step.error;
    const double depth = step.depth == Depth::rejected ? step.bad : seen;
    const Output output = step.depth == Depth::missed ? guard.miss(dt) : guard.step(depth, no_velocity, dt);
    referee.call(dt, step.depth == Depth::measured && !output.did.rejected, output.force);
    travel = hand.travel(step, output.force);
    referee.move(travel);
    sensor.move(travel);
    time = hand.time(step);
    paused = step.event == Event::pause;
  }
  referee.finish();
  return referee;
}

/// How bad it is: beyond a limit of force as a ratio, and energy in cycles of the whole force.
inline double score(const Sequence& sequence, const Referee& referee) {
  const GuardSettings& s = sequence.settings;
  const double energy = referee.missing() / (s.max_force * s.max_speed * s.longest_cycle);
  return referee.excess() > 1e-9 ? std::max(referee.excess(), energy) : energy;
}

struct Found {
  long cycles = 0, broken = 0;
  double worst = -unlimited, worst_energy = -unlimited;  ///< score, and [J] beyond the promise
  Sequence example{};
};

/// Sequences of a kind from random ones by mutation, over about this many cycles.
inline Found search(const Kind& kind, long cycles, std::uint64_t seed, int climbs = 60) {
  Generator generator{seed};
  Found found;
  while (found.cycles < cycles) {
    Sequence best = random_sequence(generator, kind);
    double top = -unlimited;
    for (int i = 0; i <= climbs; ++i) {
      Sequence next = i == 0 ? best : mutated(generator, best);
      const Referee referee = played(next);
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
