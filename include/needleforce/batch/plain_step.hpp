// SPDX-License-Identifier: Apache-2.0
// Steps of many plain insertions: the arithmetic of `PreparedInsertion::step`, for several members at a time
// and several steps of a motion, during which what they remember stays in registers.
#pragma once

#include <array>
#include <cstddef>

#include "batch_rows.hpp"
#include "lanes.hpp"
#include "plain_columns.hpp"

namespace needleforce::detail {

/// What members allow, and the lateral over the cutting force.
struct PlainLimits {
  double max_speed, slack, slack_ratio, lateral_ratio;
};

/// Contacts of members that are not pierced, a row for each step; without rows none of them pushes.
struct PlainContacts {
  const double *force = nullptr, *slope = nullptr, *reach = nullptr;
};

/// Members from `at` on, in steps from `from` to `to` of a motion.
struct PlainTask {
  const BatchMove& motion;
  const BatchSamples& out;
  const PlainLimits& limits;
  const PlainLaws& laws;
  PlainColumns& columns;
  PlainContacts contacts;
  std::size_t at, from, to;
  bool usual = false;  // stops where a member recedes into the entry of its cut, too
};

/// The contacts of some members in some steps.
class ContactRows {
 public:
  static constexpr std::size_t most = 32;  // steps

  /// Those of members that are not pierced; slope and reach are asked for one step at a time.
  template <class LawOf>
  void fill(const PlainTask& task, std::size_t width, bool same, const LawOf& law_of) noexcept {
    for (std::size_t i = 0; i < width; ++i) {
      const std::size_t member = task.at + i;
      const bool whole = task.columns.pierced[member] > 0.0;
      const auto& contact = law_of(member);
      const double top = task.laws.top[same ? 0 : member];
      for (std::size_t t = task.from; t < task.to; ++t) {
        const double h = task.motion.depths(t)[member] - top;
        const bool pressed = h > 0.0 && !whole;
        force_[(t - task.from) * width + i] = pressed ? contact.force(h) : 0.0;
        slope_[i] = pressed && !task.out.force_alone ? contact.slope(h) : 0.0;
      }
      reach_[i] = contact.reach();
    }
  }
  PlainContacts found() const noexcept { return {force_.data(), slope_.data(), reach_.data()}; }

 private:
  alignas(64) std::array<double, most * most_lanes> force_;
  alignas(64) std::array<double, most_lanes> slope_, reach_;
};

/// How far steps came, and bits of the members that have a rare case in the last of them: first steps,
/// punctures, and input that is refused. These are as before it.
struct PlainReach {
  std::size_t to;
  unsigned rare;
};

#ifdef NEEDLEFORCE_LANES
/// Steps `width` members, the force alone, until one of them recedes into the entry of its cut or has a rare
/// case; returns how far they came. The same values as below, of which these are what is left there.
template <std::size_t width, bool same>
[[gnu::always_inline]] inline std::size_t usual_steps(const PlainTask& task) noexcept {
  using Number = Lanes<width>;
  const std::size_t at = task.at;
  PlainColumns& columns = task.columns;
  for (std::size_t i = at; i < at + width; ++i)
    if (!(columns.started[i] > 0.0 && columns.waited[i] == 0.0)) return task.from;
  const Number none{};
  Number puncture, surface, per_length, stiffness, full, per_travel;
  take<same>(puncture, task.laws.puncture, at);
  take<same>(surface, task.laws.surface, at);
  take<same>(per_length, task.laws.per_length, at);
  take<same>(stiffness, task.laws.stiffness, at);
  take<same>(full, task.laws.full, at);
  take<same>(per_travel, task.laws.per_travel, at);
  Number before, front, entry, traction, pierced;
  read(before, &columns.depth[at]);
  read(front, &columns.front[at]);
  read(entry, &columns.entry[at]);
  read(traction, &columns.traction[at]);
  read(pierced, &columns.pierced[at]);
  const auto in = pierced > 0.0;
  // between these depths a pierced member is inside and its cut whole; any other touches, or is above
  raise(entry, surface);
  raise(entry, none);
  const Number above = in ? entry : none - 2.0 * farthest, shallow = none + farthest;
  lower(puncture, shallow);
  const Number deepest = in ? shallow : puncture, highest = none - farthest;
  const Number twice = 2.0 * stiffness, low = in ? -per_length : none;
  full = in ? full : none;
  surface = in ? surface : none + 2.0 * farthest;
  const double most_per_time = (1.0 + 1e-9) * task.limits.max_speed;
  std::size_t t = task.from;
  for (; t < task.to; ++t) {
    Number z, contact = none;
    read(z, task.motion.depths(t) + at);
    const double dt = task.motion.dt[t], most = dt > 0.0 && dt <= longest ? most_per_time * dt : -1.0;
    const Number travel = z - before;
    Number length = travel;
    make_positive(length);
    if (any<width>(~((z > above) & (z >= highest) & (z <= deepest) & (length <= most)))) break;
    raise(front, z);
    Number loaded = 1.0 - (front - z) * per_travel, embedded = z - surface;
    raise(loaded, none);
    raise(embedded, none);
    const Number cutting = full * loaded;
    Number below = travel, high = twice * embedded;
    lower(below, z);
    lower(high, per_length);
    traction = traction + stiffness * below;
    raise(traction, low);
    lower(traction, high);
    Number force = traction * embedded;
    if (task.contacts.force) {
      read(contact, task.contacts.force + (t - task.from) * width);
      Number pressing = contact - cutting;
      raise(pressing, none);
      force = pressing + force;
    }
    write(task.out.row(BatchRow::force, t) + at, force + cutting);
    before = z;
  }
  if (t == task.from) return t;
  write(&columns.depth[at], before);
  write(&columns.front[at], front);
  write(&columns.traction[at], traction);
  for (std::size_t i = at; i < at + width; ++i)
    columns.free[i] = columns.pierced[i] > 0.0 || columns.depth[i] > task.laws.top[same ? 0 : i] ? 0.0 : 1.0;
  return t;
}

/// Steps `width` members until one has a rare case.
template <std::size_t width, bool same, bool whole>
[[gnu::always_inline]] inline PlainReach plain_steps(const PlainTask& task) noexcept {
  using Number = Lanes<width>;
  const std::size_t at = task.at;
  const PlainLimits& limits = task.limits;
  const Number none{}, one = none + 1.0;
  Number top, puncture, surface, per_length, stiffness, full, per_travel;
  take<same>(top, task.laws.top, at);
  take<same>(puncture, task.laws.puncture, at);
  take<same>(surface, task.laws.surface, at);
  take<same>(per_length, task.laws.per_length, at);
  take<same>(stiffness, task.laws.stiffness, at);
  take<same>(full, task.laws.full, at);
  take<same>(per_travel, task.laws.per_travel, at);
  Number before, waited, front, entry, retreat, traction, was_free, pierced, started;
  PlainColumns& columns = task.columns;
  read(before, &columns.depth[at]);
  read(waited, &columns.waited[at]);
  read(front, &columns.front[at]);
  read(entry, &columns.entry[at]);
  read(retreat, &columns.retreat_limit[at]);
  read(traction, &columns.traction[at]);
  read(was_free, &columns.free[at]);
  read(pierced, &columns.pierced[at]);
  read(started, &columns.started[at]);
  const auto in = pierced > 0.0, begun = started > 0.0;
  Number over = entry - retreat;
  raise(over, none + 1e-60);
  unsigned rare = 0;
  std::size_t t = task.from;
  while (t < task.to && !rare) {
    Number z, dt;
    read(z, task.motion.depths(t) + at);
    task.motion.same_dt ? void(dt = none + task.motion.dt[t]) : read(dt, task.motion.dt + at);
    const Number travel = z - before, elapsed = waited + dt;
    Number distance = z, length = travel;
    make_positive(distance);
    make_positive(length);
    auto usual = begun & (distance <= farthest) & (dt > 0.0) & (dt <= longest) & (in | (z <= puncture)) &
                 (length <= (1.0 + 1e-9) * limits.max_speed * elapsed);
    const bool measured = whole && task.motion.velocity;
    Number v = none;
    if (whole) v = travel / elapsed;
    if (measured) {
      Number given;
      read(given, task.motion.velocity + at);
      Number speed = given, apart = given - v, most = v;
      make_positive(speed);
      make_positive(apart);
      make_positive(most);
      raise(most, speed);
      usual &= (speed <= fastest) & (apart <= limits.slack + limits.slack_ratio * most);
      v = given;
    }
    // the cut
    Number cut = front;
    raise(cut, z);
    const Number behind = cut - z;
    Number loaded = 1.0 - behind * per_travel;
    raise(loaded, none);
    Number cutting = in ? full * loaded : none;
    Number cutting_slope = (in & (z < cut) & (loaded > 0.0)) ? full * per_travel : none;
    const auto recedes = in & (z <= entry);
    const bool special = any<width>(~usual | recedes);  // asked once a step
    if (special) {
      const Number share = (z - retreat) / over;
      const auto there = z > retreat;
      cutting_slope = recedes ? (there ? share * cutting_slope + cutting / over : none) : cutting_slope;
      cutting = recedes ? (there ? share * cutting : none) : cutting;
    }
    // the shaft
    const auto wet = z > 0.0, inside = in & wet & (z > surface);
    const Number embedded = inside ? z - surface : none;
    Number below = travel;
    lower(below, z);
    below = wet ? below : none;
    const Number low = inside ? -per_length : none;
    Number high = 2.0 * stiffness * embedded;
    lower(high, per_length);
    Number strained = traction + stiffness * below;
    raise(strained, low);
    lower(strained, high);
    const Number friction = strained * embedded;
    // their sum
    Number contact = none;
    if (task.contacts.force) read(contact, task.contacts.force + (t - task.from) * width);
    const auto pushes = contact > cutting, touches = ~in & (z > top);
    const auto dry = in ? (embedded <= 0.0) & (friction == 0.0) : ~touches;
    const Number pressing = pushes ? contact - cutting : none;
    const Number is_free = dry ? one : none;
    const auto put = [&](BatchRow row, const Number& numbers) { write(task.out.row(row, t) + at, numbers); };
    put(BatchRow::force, pressing + friction + cutting);
    if constexpr (whole) {
      Number speed = v, slope = cutting_slope, reach = none;
      make_positive(speed);
      if (task.contacts.force) {
        Number pressed;
        read(pressed, task.contacts.slope);
        read(reach, task.contacts.reach);
        slope = pushes ? pressed : slope;
      }
      const Number sticks = ((strained > low) & (strained < high)) ? one : none;
      const Number moving = speed < speed_at_rest ? none + 3.0 : (v > 0.0 ? none + 2.0 : none + 4.0);
      put(BatchRow::depth, z);
      put(BatchRow::velocity, v);
      put(BatchRow::stiffness, pressing);
      put(BatchRow::friction, friction);
      put(BatchRow::cutting, cutting);
      put(BatchRow::lateral, limits.lateral_ratio * cutting);
      put(BatchRow::force_by_depth, (inside ? strained : none) + stiffness * sticks * embedded + slope);
      put(BatchRow::force_by_velocity, none);
      put(BatchRow::phase, dry ? none : (in ? moving : one));
      put(BatchRow::status, (~in & (z - top > reach)) ? one : none);
      put(BatchRow::contact, was_free * (1.0 - is_free));
      put(BatchRow::punctured, none);
      put(BatchRow::exit, (1.0 - was_free) * is_free);
    }
    ++t;
    if (special) {  // a rare case keeps its memory for the step that is made of it
      for (std::size_t i = 0; i < width; ++i) rare |= usual[i] ? 0u : 1u << i;
      before = usual ? z : before;
      waited = usual ? none : waited;
      front = (usual & in) ? cut : front;
      traction = usual ? (wet ? strained : none) : traction;
      was_free = usual ? is_free : was_free;
      continue;
    }
    before = z;
    waited = none;
    front = in ? cut : front;
    traction = wet ? strained : none;
    was_free = is_free;
  }
  write(&columns.depth[at], before);
  write(&columns.waited[at], waited);
  write(&columns.front[at], front);
  write(&columns.traction[at], traction);
  write(&columns.free[at], was_free);
  return {t, rare};
}
static_assert(static_cast<int>(Phase::deformation) == 1 && static_cast<int>(Phase::insertion) == 2 &&
              static_cast<int>(Phase::hold) == 3 && static_cast<int>(Phase::extraction) == 4 &&
              static_cast<int>(Status::outside_range) == 1);

// the same for each kind of processor
template <std::size_t width, bool same, bool whole>
[[gnu::always_inline]] inline PlainReach steps_of(const PlainTask& task) noexcept {
  if (!whole && task.usual) return {usual_steps<width, same>(task), 0};
  return plain_steps<width, same, whole>(task);
}
template <bool same, bool whole>
NEEDLEFORCE_WIDE PlainReach wide_steps(const PlainTask& task) noexcept {
  return steps_of<4, same, whole>(task);
}
/// Of so many members at a time.
template <bool same, bool whole>
PlainReach plain_steps(std::size_t width, const PlainTask& task) noexcept {
  if (width == 4) return wide_steps<same, whole>(task);
  return width == 2 ? steps_of<2, same, whole>(task) : steps_of<1, same, whole>(task);
}
#else
template <bool, bool>
PlainReach plain_steps(std::size_t, const PlainTask& task) noexcept {
  return {task.to, 0};
}
#endif

}  // namespace needleforce::detail

#undef NEEDLEFORCE_WIDE
#ifdef NEEDLEFORCE_LANES
#undef NEEDLEFORCE_LANES
#endif
