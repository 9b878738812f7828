// SPDX-License-Identifier: Apache-2.0
// One step of many plain insertions: the arithmetic of `PreparedInsertion::step`, for several members at a
// time.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

#include "batch_rows.hpp"
#include "plain_columns.hpp"

// of the vector types; without them each member is stepped alone
#if defined(__GNUC__) || defined(__clang__)
#define NEEDLEFORCE_LANES
#endif

// as wide as the machine allows; values do not change, for nothing is contracted
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define NEEDLEFORCE_WIDE [[gnu::target_clones("avx2", "default"), gnu::flatten]]
#else
#define NEEDLEFORCE_WIDE
#endif

namespace needleforce::detail {

inline constexpr std::size_t plain_block = 128;

/// What a block of members works on. Beyond its members dt is 0, so that nothing there is stepped.
struct PlainBlock {
  using Each = std::array<double, plain_block>;
  alignas(64) Each depth, velocity, dt, contact_force, contact_slope, reach, rare;
  alignas(64) std::array<Each, batch_rows> rows;

  double* row(BatchRow which) noexcept { return rows[static_cast<std::size_t>(which)].data(); }
};

/// What members allow, and the lateral over the cutting force.
struct PlainLimits {
  double max_speed, slack, slack_ratio, lateral_ratio;
};

#ifdef NEEDLEFORCE_LANES
using Lanes = double __attribute__((vector_size(8 * lanes)));
/// Lanes where they stand in a column.
using Standing = double __attribute__((vector_size(8 * lanes), aligned(8), may_alias));

// Lanes go in and out by reference: without AVX a compiler warns of a function that returns them.
inline const Standing& read(const double* from) noexcept { return *reinterpret_cast<const Standing*>(from); }
inline void write(double* to, const Lanes& numbers) noexcept { std::memcpy(to, &numbers, sizeof numbers); }
/// The laws of members from `at` on, or those of all.
template <bool same>
void take(Lanes& law, const Column& column, std::size_t at) noexcept {
  if constexpr (same)
    law = Lanes{} + column[0];
  else
    law = read(&column[at]);
}
inline void raise(Lanes& number, const Lanes& least) noexcept { number = number < least ? least : number; }
inline void lower(Lanes& number, const Lanes& most) noexcept { number = most < number ? most : number; }
inline void make_positive(Lanes& number) noexcept { number = number < 0.0 ? -number : number; }

/// True if one of the lanes of a mask is set.
template <class Mask>
bool any(const Mask& mask) noexcept {
  auto found = mask[0];
  for (std::size_t i = 1; i < lanes; ++i) found |= mask[i];
  return found != 0;
}

/// Steps the members of a block but those with a rare case, which are marked: first steps, punctures, and
/// input that is refused.
template <bool same, bool whole>
NEEDLEFORCE_WIDE void plain_step(bool measured, std::size_t from, std::size_t n, const PlainLimits& limits,
                                 const PlainLaws& laws, PlainColumns& columns, PlainBlock& block) noexcept {
  const Lanes none{}, one = none + 1.0;
  Lanes top, puncture, surface, per_length, stiffness, full, per_travel;
  for (std::size_t i = 0; i < n; i += lanes) {
    const std::size_t at = from + i;
    take<same>(top, laws.top, at);
    take<same>(puncture, laws.puncture, at);
    take<same>(surface, laws.surface, at);
    take<same>(per_length, laws.per_length, at);
    take<same>(stiffness, laws.stiffness, at);
    take<same>(full, laws.full, at);
    take<same>(per_travel, laws.per_travel, at);
    const Lanes z = read(&block.depth[i]), dt = read(&block.dt[i]);
    const Lanes before = read(&columns.depth[at]), waited = read(&columns.waited[at]);
    const Lanes travel = z - before, elapsed = waited + dt;
    const auto in = read(&columns.pierced[at]) > 0.0;
    Lanes distance = z, length = travel;
    make_positive(distance);
    make_positive(length);
    auto usual = (read(&columns.started[at]) > 0.0) & (distance <= farthest) & (dt > 0.0) & (dt <= longest) &
                 (in | (z <= puncture)) & (length <= (1.0 + 1e-9) * limits.max_speed * elapsed);
    Lanes v = none;
    if (whole || measured) v = travel / elapsed;
    if (measured) {
      const Lanes given = read(&block.velocity[i]);
      Lanes speed = given, apart = given - v, most = v;
      make_positive(speed);
      make_positive(apart);
      make_positive(most);
      raise(most, speed);
      usual &= (speed <= fastest) & (apart <= limits.slack + limits.slack_ratio * most);
      v = given;
    }
    // the cut
    const Lanes last = read(&columns.front[at]);
    Lanes front = last;
    raise(front, z);
    Lanes behind = front - z;
    raise(behind, none);
    Lanes loaded = 1.0 - behind * per_travel;
    raise(loaded, none);
    Lanes cutting = in ? full * loaded : none;
    Lanes cutting_slope = (in & (z < front) & (loaded > 0.0)) ? full * per_travel : none;
    const Lanes entry = read(&columns.entry[at]);
    if (const auto recedes = in & (z <= entry); any(recedes)) {
      const Lanes retreat = read(&columns.retreat_limit[at]);
      Lanes over = entry - retreat;
      raise(over, none + 1e-60);
      const Lanes share = (z - retreat) / over;
      const auto there = z > retreat;
      cutting_slope = recedes ? (there ? share * cutting_slope + cutting / over : none) : cutting_slope;
      cutting = recedes ? (there ? share * cutting : none) : cutting;
    }
    // the shaft
    const auto wet = z > 0.0, inside = in & wet & (z > surface);
    const Lanes embedded = inside ? z - surface : none;
    Lanes below = travel;
    lower(below, z);
    below = wet ? below : none;
    const Lanes low = inside ? -per_length : none;
    Lanes high = 2.0 * stiffness * embedded;
    lower(high, per_length);
    Lanes traction = read(&columns.traction[at]) + stiffness * below;
    raise(traction, low);
    lower(traction, high);
    const Lanes friction = traction * embedded;
    const Lanes sticks = ((traction > low) & (traction < high)) ? one : none;
    // their sum
    const Lanes contact = in ? none : read(&block.contact_force[i]);
    const auto pushes = contact > cutting, dry = in ? (embedded <= 0.0) & (friction == 0.0) : z <= top;
    const Lanes pressing = pushes ? contact - cutting : none, was_free = read(&columns.free[at]);
    const Lanes is_free = dry ? one : none;
    const auto put = [&](BatchRow row, const Lanes& numbers) { write(block.row(row) + i, numbers); };
    put(BatchRow::force, pressing + friction + cutting);
    if constexpr (whole) {
      Lanes speed = v;
      make_positive(speed);
      const Lanes moving = speed < speed_at_rest ? none + 3.0 : (v > 0.0 ? none + 2.0 : none + 4.0);
      const Lanes slope = pushes ? read(&block.contact_slope[i]) : cutting_slope;
      put(BatchRow::depth, z);
      put(BatchRow::velocity, v);
      put(BatchRow::stiffness, pressing);
      put(BatchRow::friction, friction);
      put(BatchRow::cutting, cutting);
      put(BatchRow::lateral, limits.lateral_ratio * cutting);
      put(BatchRow::force_by_depth, (inside ? traction : none) + stiffness * sticks * embedded + slope);
      put(BatchRow::force_by_velocity, none);
      put(BatchRow::phase, dry ? none : (in ? moving : one));
      put(BatchRow::status, (~in & (z - top > read(&block.reach[i]))) ? one : none);
      put(BatchRow::contact, was_free * (1.0 - is_free));
      put(BatchRow::punctured, none);
      put(BatchRow::exit, (1.0 - was_free) * is_free);
    }
    // a rare case keeps its memory for the step that is made of it
    write(&block.rare[i], usual ? none : one);
    write(&columns.depth[at], usual ? z : before);
    write(&columns.waited[at], usual ? none : waited);
    write(&columns.front[at], usual & in ? front : last);
    write(&columns.traction[at], usual ? (wet ? traction : none) : read(&columns.traction[at]));
    write(&columns.free[at], usual ? is_free : was_free);
  }
}
static_assert(static_cast<int>(Phase::deformation) == 1 && static_cast<int>(Phase::insertion) == 2 &&
              static_cast<int>(Phase::hold) == 3 && static_cast<int>(Phase::extraction) == 4 &&
              static_cast<int>(Status::outside_range) == 1);
#else
template <bool same, bool whole>
void plain_step(bool, std::size_t, std::size_t, const PlainLimits&, const PlainLaws&, PlainColumns&,
                PlainBlock& block) noexcept {
  block.rare.fill(1.0);
}
#endif

/// The contacts of members that are not pierced.
template <class LawOf>
void fill_contacts(PlainBlock& block, std::size_t from, std::size_t n, const PlainColumns& columns,
                   const Column& top, bool same, const LawOf& law_of) noexcept {
  const double* pierced = &columns.pierced[from];
  if (std::all_of(pierced, pierced + n, [](double each) { return each > 0.0; })) return;
  for (std::size_t i = 0; i < n; ++i) {
    const double h = block.depth[i] - top[same ? 0 : from + i];
    const bool pressed = h > 0.0 && !(pierced[i] > 0.0);
    const auto& contact = law_of(from + i);
    block.contact_force[i] = pressed ? contact.force(h) : 0.0;
    block.contact_slope[i] = pressed ? contact.slope(h) : 0.0;
    block.reach[i] = contact.reach();
  }
}

/// Fills a block with the move of its members.
inline void fill(PlainBlock& block, const BatchMove& move, std::size_t from, std::size_t n) noexcept {
  const std::size_t end = (n + lanes - 1) / lanes * lanes;
  std::copy_n(move.depth + from, n, block.depth.begin());
  std::fill(block.depth.begin() + n, block.depth.begin() + end, 0.0);
  if (move.velocity) {
    std::copy_n(move.velocity + from, n, block.velocity.begin());
    std::fill(block.velocity.begin() + n, block.velocity.begin() + end, 0.0);
  }
  if (move.same_dt)
    std::fill_n(block.dt.begin(), n, move.dt[0]);
  else
    std::copy_n(move.dt + from, n, block.dt.begin());
  std::fill(block.dt.begin() + n, block.dt.begin() + end, 0.0);
}

}  // namespace needleforce::detail

#undef NEEDLEFORCE_WIDE
#ifdef NEEDLEFORCE_LANES
#undef NEEDLEFORCE_LANES
#endif
