// SPDX-License-Identifier: Apache-2.0
// Steps of many plain insertions: the arithmetic of `PreparedInsertion::step`, for several members at a time
// and several steps of a motion, during which what they remember stays in registers.
#pragma once

#include <cstddef>

#include "batch_rows.hpp"
#include "lanes.hpp"
#include "plain_columns.hpp"

namespace needleforce::detail {

/// What members allow, and the lateral over the cutting force.
struct PlainLimits {
  double max_speed, slack, slack_ratio, lateral_ratio;
};

/// Contacts of members that are not pierced everywhere, a row for each step; without rows none pushes.
struct PlainContacts {
  const double *force = nullptr, *slope = nullptr, *beyond = nullptr;
};

/// Members from `at` on, their laws from `law` on, in steps from `from` to `to` of a motion.
struct PlainTask {
  const BatchMove& motion;
  const BatchSamples& out;
  const PlainLimits& limits;
  const PlainLaws& laws;
  PlainColumns& columns;
  PlainContacts contacts;
  std::size_t at, law, from, to;
  bool usual = false;  // stops where a member recedes into the entry of its cut, too
};

/// How far steps came, and bits of the members that have a rare case in the last of them: first steps,
/// punctures, and input that is refused. These are as before it.
struct PlainReach {
  std::size_t to;
  unsigned rare;
};

#ifdef NEEDLEFORCE_LANES
inline constexpr std::size_t rows_ahead = 4;

/// A layer of `width` members.
template <std::size_t width>
struct PlainLayer {
  using Number = Lanes<width>;
  Number top, puncture, surface, rise, per_length, stiffness, traction, strained, embedded;
  typename LanesOf<width>::mask pierced, joined;

  [[gnu::always_inline]] PlainLayer() noexcept {}
  [[gnu::always_inline]] void take(const PlainTask& task, std::size_t k) noexcept {
    const PlainLayerLaws& laws = task.laws.layers[k];
    read(top, &laws.top[task.law]);
    read(puncture, &laws.puncture[task.law]);
    read(surface, &laws.surface[task.law]);
    read(rise, &laws.rise[task.law]);
    read(per_length, &laws.per_length[task.law]);
    read(stiffness, &laws.stiffness[task.law]);
    read(traction, &task.columns.layers[k].traction[task.at]);
    Number one_if;
    read(one_if, &task.columns.layers[k].pierced[task.at]);
    pierced = one_if > 0.0;
    read(one_if, &laws.joined[task.law]);
    joined = one_if > 0.0;
  }
};
/// The cutting of the layers that tips are in.
template <class Number, class Mask>
[[gnu::always_inline]] inline void take_cutting(const PlainTask& task, std::size_t k, const Mask& pierced,
                                                Number& full, Number& per_travel) noexcept {
  Number force, unloading;
  read(force, &task.laws.layers[k].full[task.law]);
  read(unloading, &task.laws.layers[k].per_travel[task.law]);
  full = pierced ? force : full;
  per_travel = pierced ? unloading : per_travel;
}

/// Steps `width` members in one layer, the force alone, until one of them recedes into the entry of its cut
/// or has a rare case; returns how far they came. The same values as below, of which these are what is left
/// there.
template <std::size_t width>
[[gnu::always_inline]] inline std::size_t usual_steps(const PlainTask& task) noexcept {
  using Number = Lanes<width>;
  const std::size_t at = task.at;
  PlainColumns& columns = task.columns;
  for (std::size_t i = at; i < at + width; ++i)
    if (!(columns.started[i] > 0.0 && columns.waited[i] == 0.0)) return task.from;
  const Number none{};
  PlainLayer<width> layer;
  layer.take(task, 0);
  Number before, front, entry, full = none, per_travel = none + 1.0, traction = layer.traction;
  take_cutting(task, 0, layer.pierced, full, per_travel);
  read(before, &columns.depth[at]);
  read(front, &columns.front[at]);
  read(entry, &columns.entry[at]);
  const auto in = layer.pierced;
  // between these depths a pierced member is inside and its cut whole; any other touches, or is above
  raise(entry, layer.surface);
  raise(entry, none);
  Number deepest = none + farthest;
  const Number above = in ? entry : none - 2.0 * farthest, highest = none - farthest;
  lower(layer.puncture, deepest);
  deepest = in ? deepest : layer.puncture;
  const Number twice = 2.0 * layer.stiffness, low = in ? -layer.per_length : none;
  const Number surface = in ? layer.surface : none + 2.0 * farthest;
  const double most_per_time = (1.0 + 1e-9) * task.limits.max_speed;
  std::size_t t = task.from;
  for (; t < task.to; ++t) {
    Number z;
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
    lower(high, layer.per_length);
    traction = traction + layer.stiffness * below;
    raise(traction, low);
    lower(traction, high);
    Number force = traction * embedded;
    if (task.contacts.force) {
      Number pressing;
      read(pressing, task.contacts.force + (t - task.from) * width);
      pressing = pressing - cutting;
      raise(pressing, none);
      force = pressing + force;
    }
    write(task.out.row(BatchRow::force, t) + at, force + cutting);
    before = z;
  }
  if (t == task.from) return t;
  write(&columns.depth[at], before);
  write(&columns.front[at], front);
  write(&columns.layers[0].traction[at], traction);
  write(&columns.free[at], (in | (before > layer.top)) ? none : none + 1.0);
  return t;
}

/// Steps `width` members until one has a rare case; `one`: of one layer, known at compile time.
template <std::size_t width, bool one, bool whole>
[[gnu::always_inline]] inline PlainReach plain_steps(const PlainTask& task) noexcept {
  using Number = Lanes<width>;
  const std::size_t at = task.at, count = one ? 1 : task.laws.layers.size();
  const PlainLimits& limits = task.limits;
  PlainColumns& columns = task.columns;
  const Number none{}, unit = none + 1.0;
  PlainLayer<width> layers[one ? 1 : max_layers];
  auto in = none > 0.0;
  Number full = none, per_travel = unit;
  for (std::size_t k = 0; k < count; ++k) {
    layers[k].take(task, k);
    take_cutting(task, k, layers[k].pierced, full, per_travel);
    in |= layers[k].pierced;
  }
  Number before, waited, front, entry, retreat, was_free, started;
  read(before, &columns.depth[at]);
  read(waited, &columns.waited[at]);
  read(front, &columns.front[at]);
  read(entry, &columns.entry[at]);
  read(retreat, &columns.retreat_limit[at]);
  read(was_free, &columns.free[at]);
  read(started, &columns.started[at]);
  const auto begun = started > 0.0;
  Number over = entry - retreat;
  raise(over, none + 1e-60);
  unsigned rare = 0;
  std::size_t t = task.from;
  do {
    Number z, dt;
    read(z, task.motion.depths(t) + at);
    // a row of depths later stands far away, and a step is too long to see it coming
    if (!whole && t + rows_ahead < task.to) {
      __builtin_prefetch(task.motion.depths(t + rows_ahead) + at);
      __builtin_prefetch(task.out.row(BatchRow::force, t + rows_ahead) + at, 1);
    }
    task.motion.same_dt ? void(dt = none + task.motion.dt[t]) : read(dt, task.motion.dt + at);
    const Number travel = z - before, elapsed = waited + dt;
    Number distance = z, length = travel;
    make_positive(distance);
    make_positive(length);
    auto usual = begun & (distance <= farthest) & (dt > 0.0) & (dt <= longest) &
                 (length <= (1.0 + 1e-9) * limits.max_speed * elapsed);
    auto touches = none > 0.0;
    for (std::size_t k = 0; k < count; ++k) {
      usual &= layers[k].pierced | (z <= layers[k].puncture);
      touches |= ~layers[k].pierced & (z > layers[k].top);
    }
    const bool measured = task.motion.velocity != nullptr;
    Number v = none;
    if (whole || measured) v = travel / elapsed;
    if (measured) {
      Number given;
      read(given, task.motion.velocities(t) + at);
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
    Number loaded = 1.0 - (cut - z) * per_travel;
    raise(loaded, none);
    Number cutting = in ? full * loaded : none;
    Number slope = (in & (z < cut) & (loaded > 0.0)) ? full * per_travel : none;
    const auto recedes = in & (z <= entry);
    const bool special = any<width>(~usual | recedes);  // asked once a step
    if (special) {
      const Number share = (z - retreat) / over;
      const auto there = z > retreat;
      slope = recedes ? (there ? share * slope + cutting / over : none) : slope;
      cutting = recedes ? (there ? share * cutting : none) : cutting;
    }
    // the shaft, from the bottom up
    const auto wet = z > 0.0;
    Number below = travel, friction = none, by_depth = none, bottom = none + 2.0 * farthest;
    lower(below, z);
    below = wet ? below : none;
    auto held = none > 0.0;
    for (std::size_t k = count; k-- > 0;) {
      PlainLayer<width>& layer = layers[k];
      Number end = z;
      lower(end, bottom);
      const auto inside = layer.pierced & wet & (end > layer.surface), in_it = inside & (z < bottom);
      layer.embedded = inside ? end - layer.surface : none;
      const Number low = inside ? -layer.per_length : none;
      Number high = 2.0 * layer.stiffness * (layer.embedded + layer.rise);
      lower(high, layer.per_length);
      if constexpr (!one) high = (inside & ~in_it) ? layer.per_length : (inside ? high : none);
      Number strained = layer.traction + layer.stiffness * below;
      raise(strained, low);
      lower(strained, high);
      const Number force = strained * layer.embedded;
      const Number sticks = ((strained > low) & (strained < high)) ? unit : none;
      friction = friction + force;
      if (whole)
        by_depth = by_depth + ((in_it ? strained : none) + layer.stiffness * sticks * layer.embedded);
      held |= layer.pierced & ((layer.embedded > 0.0) | (force != 0.0));
      layer.strained = wet ? strained : none;
      if constexpr (!one) {  // tissue that continues below is strained as here
        if (k + 1 < count)
          layers[k + 1].strained = (layers[k + 1].joined & (layers[k + 1].embedded == 0.0))
                                       ? layer.strained
                                       : layers[k + 1].strained;
        bottom = layer.surface;
      }
    }
    // their sum
    Number contact = none;
    if (task.contacts.force) read(contact, task.contacts.force + (t - task.from) * width);
    const auto pushes = contact > cutting;
    const auto dry = in ? ~held : ~touches;
    const Number pressing = pushes ? contact - cutting : none;
    const Number is_free = dry ? unit : none;
    const auto put = [&](BatchRow row, const Number& numbers) { write(task.out.row(row, t) + at, numbers); };
    put(BatchRow::force, pressing + friction + cutting);
    if constexpr (whole) {
      Number speed = v, beyond = none;
      make_positive(speed);
      if (task.contacts.force) {
        Number pressed;
        read(pressed, task.contacts.slope);
        read(beyond, task.contacts.beyond);
        slope = pushes ? pressed : slope;
      }
      const Number moving = speed < speed_at_rest ? none + 3.0 : (v > 0.0 ? none + 2.0 : none + 4.0);
      put(BatchRow::depth, z);
      put(BatchRow::velocity, v);
      put(BatchRow::stiffness, pressing);
      put(BatchRow::friction, friction);
      put(BatchRow::cutting, cutting);
      put(BatchRow::lateral, limits.lateral_ratio * cutting);
      put(BatchRow::force_by_depth, by_depth + slope);
      put(BatchRow::force_by_velocity, none);
      put(BatchRow::phase, dry ? none : (in ? moving : unit));
      put(BatchRow::status, beyond);
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
      for (std::size_t k = 0; k < count; ++k)
        layers[k].traction = usual ? layers[k].strained : layers[k].traction;
      was_free = usual ? is_free : was_free;
      continue;
    }
    before = z;
    waited = none;
    front = in ? cut : front;
    for (std::size_t k = 0; k < count; ++k) layers[k].traction = layers[k].strained;
    was_free = is_free;
  } while (!whole && t < task.to && !rare);  // all numbers of one step, or the force of many
  write(&columns.depth[at], before);
  write(&columns.waited[at], waited);
  write(&columns.front[at], front);
  write(&columns.free[at], was_free);
  for (std::size_t k = 0; k < count; ++k) write(&columns.layers[k].traction[at], layers[k].traction);
  return {t, rare};
}
static_assert(static_cast<int>(Phase::deformation) == 1 && static_cast<int>(Phase::insertion) == 2 &&
              static_cast<int>(Phase::hold) == 3 && static_cast<int>(Phase::extraction) == 4 &&
              static_cast<int>(Status::outside_range) == 1);

// the same for each kind of processor
template <std::size_t width, bool one, bool whole>
[[gnu::always_inline]] inline PlainReach steps_of(const PlainTask& task) noexcept {
  if (one && !whole && task.usual) return {usual_steps<width>(task), 0};
  return plain_steps<width, one, whole>(task);
}
template <bool one, bool whole>
NEEDLEFORCE_WIDE PlainReach wide_steps(const PlainTask& task) noexcept {
  return steps_of<4, one, whole>(task);
}
/// Of so many members at a time.
template <bool one, bool whole>
PlainReach plain_steps(std::size_t width, const PlainTask& task) noexcept {
  if (width == 4) return wide_steps<one, whole>(task);
  return width == 2 ? steps_of<2, one, whole>(task) : steps_of<1, one, whole>(task);
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
