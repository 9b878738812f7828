// SPDX-License-Identifier: Apache-2.0
// The insertion of a needle that bends: motion of the base in, tip, shape and base wrench out.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <type_traits>

#include "../insertion.hpp"
#include "beam_equilibrium.hpp"
#include "bent_sample.hpp"
#include "flexible_settings.hpp"
#include "tip_load.hpp"

namespace needleforce::bending {

/// A needle that bends in layered tissue, in a plane (1) or in space (2). Trivially copyable: a snapshot is a
/// copy. docs/decisions/0023-bending.md
template <std::size_t dimension>
class FlexibleInsertion {
 public:
  using Place = std::array<double, dimension>;

  /// Around an insertion that gives the axial force and, with a bevel, the lateral force on the tip; its
  /// limits hold for the motion across, too. With invalid values every step gives no force and
  /// `invalid_parameter`.
  FlexibleInsertion(const Insertion& axial, const FlexibleSettings& settings) noexcept
      : axial_(axial),
        settings_(settings),
        valid_(axial.accepted() && !fault(settings)),
        yields_(settings.beam.yields()),
        path_(settings.lengths.path_spacing) {}

  /// One cycle: the base is at `base`, `dt` [s] after the last call. Wait-free; the cost is bounded by
  /// `max_travel` over `path_spacing` solutions.
  BentSample step(const Base& base, double dt) noexcept {
    const Status status = check(base, dt);
    return status == Status::ok ? accept(base, dt) : refuse(status, dt);
  }

  /// Back to before the first contact. Wait-free.
  void reset() noexcept {
    axial_.reset();
    forget();
    beam_ = {};
    sample_ = Sample{};
    last_ = BentSample{};
    waited_ = 0.0;
    started_ = false;
  }
  /// The whole object; assign it back to restore. Wait-free.
  FlexibleInsertion snapshot() const noexcept { return *this; }

  /// Calls `visit` with the points of the needle from the base to the tip [m]. Wait-free.
  template <class Visit>
  void shape(Visit visit) const noexcept {
    follow(visit);
  }
  /// Number of points of the shape. Wait-free.
  std::size_t shape_points() const noexcept { return mesh().count() + mesh().surface() * (free_pieces - 1); }
  /// The path that the tip has cut.
  const TissuePath<dimension>& path() const noexcept { return path_; }
  const BeamMesh<dimension>& mesh() const noexcept { return beam_.mesh(); }
  const FlexibleSettings& settings() const noexcept { return settings_; }

 private:
  static constexpr std::size_t free_pieces = 6;
  struct Events {
    bool contact = false, punctured = false, exit = false, converged = true;
  };

  Status check(const Base& base, double dt) const noexcept {
    if (!valid_) return Status::invalid_parameter;
    double sum = base.roll;
    for (std::size_t d = 0; d < 2; ++d) sum += base.lateral[d] + base.tilt[d];
    if (!std::isfinite(sum)) return Status::not_finite;
    if (!ordinary(base.depth, no_velocity, dt)) return refusal(base.depth, 0.0, dt);
    return in_range(base) && (!started_ || can_move(base, waited_ + dt)) ? Status::ok : Status::outside_range;
  }
  bool in_range(const Base& base) const noexcept {
    const Support& support = settings_.beam.support;
    for (std::size_t d = 0; d < 2; ++d) {
      if (std::abs(base.lateral[d]) > farthest || std::abs(base.tilt[d]) > 1.0) return false;
      if (d >= dimension && (base.lateral[d] != 0.0 || base.tilt[d] != 0.0)) return false;
    }
    return support.reaches(base.depth) && base.depth <= path_.longest() &&
           support.free_length(base.depth) + std::min(0.0, base.depth) >= 0.0;
  }
  bool can_move(const Base& base, double elapsed) const noexcept {
    const double travel = base.depth - base_.depth;
    bool possible = std::abs(travel) <= settings_.lengths.max_travel &&
                    std::abs(base.roll - base_.roll) <= std::numbers::pi * (1.0 + 1e-9) &&
                    consistent(axial_.limits(), travel, no_velocity, elapsed);
    for (std::size_t d = 0; d < dimension; ++d)
      possible &= std::abs(base.lateral[d] - base_.lateral[d]) <= settings_.lengths.max_travel &&
                  consistent(axial_.limits(), base.lateral[d] - base_.lateral[d], no_velocity, elapsed);
    return possible;
  }

  /// The last force for a bounded time, then none; the needle stays where it was.
  BentSample refuse(Status status, double dt) noexcept {
    if (dt > 0.0 && std::isfinite(dt)) waited_ += dt;
    BentSample sample = last_;
    if (!(valid_ && waited_ <= axial_.limits().hold_time)) {
      sample.force = sample.lateral = 0.0;
      sample.wrench = {};
      sample.axial = Sample{};
    }
    sample.axial.contact = sample.axial.punctured = sample.axial.exit = false;
    sample.status = status;
    return sample;
  }

  BentSample accept(const Base& base, double dt) noexcept {
    const double elapsed = waited_ + dt;
    waited_ = 0.0;
    Events events{};
    started_ ? advance(base, elapsed, events) : start(base, elapsed, events);
    base_ = base;
    last_ = sample(events);
    return last_;
  }

  /// The first step: a needle that is in the tissue already is straight, in its own hole.
  void start(const Base& base, double dt, Events& events) noexcept {
    started_ = true;
    base_ = base;
    press(base, dt, events);
    if (axial_.pierced_layers() > 0 && base.depth > 0.0) {
      const double above = settings_.beam.support.free_length(base.depth);
      embedded_ = true;
      while (path_.empty() || path_.next_node() <= base.depth)
        path_.write(path_.next_node(), straight(base, above + path_.next_node()));
      path_.write(base.depth, straight(base, above + base.depth));
      ahead_ = path_.front_place();
    }
    settle(base, events);
  }
  static Place straight(const Base& base, double distance) noexcept {
    Place place;
    for (std::size_t d = 0; d < dimension; ++d) place[d] = base.lateral[d] + base.tilt[d] * distance;
    return place;
  }

  /// Moves to each node of the path that the tip cuts on its way, and where tissue yields to each tenth of a
  /// millimetre across, then to the end: what the tissue remembers does not depend on the length of the
  /// steps.
  void advance(const Base& base, double dt, Events& events) noexcept {
    const Base from = base_;
    const double travel = base.depth - from.depth, across = yields_ ? across_of(from, base) : 0.0;
    double done = 0.0;
    while (done < 1.0) {
      const double next = travel > 0.0 ? next_node(base_.depth) : base.depth;
      const bool last_node = !(next < base.depth - 1e-9 * path_.spacing);
      const double by_node = last_node ? 1.0 : (next - from.depth) / travel;
      const double left = path_.spacing - moved_across_;
      const double by_motion = across * (1.0 - done) > left ? done + left / across : 1.0;
      const bool aside = by_motion < by_node;
      const double share = aside ? by_motion : by_node;
      const double depth = aside ? from.depth + share * travel : next;
      moved_across_ += (share - done) * across;
      const bool on_node = travel > 0.0 && next < base.depth + 1e-9 * path_.spacing;
      const bool remembers = aside || on_node;
      if (remembers) moved_across_ = 0.0;
      move(share == 1.0 ? base : between(from, base, share, depth), dt * (share - done), events, remembers);
      done = share;
    }
  }
  /// Motion of the base across [m], at the surface.
  double across_of(const Base& from, const Base& to) const noexcept {
    const double above = settings_.beam.support.free_length(to.depth);
    double square = 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      const double moved = to.lateral[d] - from.lateral[d] + above * (to.tilt[d] - from.tilt[d]);
      square += moved * moved;
    }
    return std::sqrt(square);
  }
  /// Where the path takes its next node, or the surface [m].
  double next_node(double depth) const noexcept {
    if (depth < 0.0) return 0.0;
    const double front = embedded_ ? std::max(path_.front(), depth) : depth;
    return path_.spacing * (std::floor(front / path_.spacing + 1e-6) + 1.0);
  }
  void move(const Base& to, double dt, Events& events, bool remembers) noexcept {
    press(to, dt, events);
    if (axial_.pierced_layers() > 0 && !embedded_ && to.depth > 0.0) enter(base_.depth);
    if (embedded_ && to.depth > 0.0) {
      turn_tip(to);
      rub_ = std::clamp(rub_ + (to.depth - base_.depth) / settings_.lengths.presliding, -1.0, 1.0);
    }
    settle(to, events);
    if (remembers && yields_ && embedded_ && to.depth > 0.0) yield();
    base_ = to;
  }
  void press(const Base& to, double dt, Events& events) noexcept {
    sample_ = axial_.step(to.depth, no_velocity, dt);
    events.contact |= sample_.contact;
    events.punctured |= sample_.punctured;
    events.exit |= sample_.exit;
  }
  /// The surface is punctured: the tissue closes around the shaft, whose tip stood where it touched.
  void enter(double depth) noexcept {
    embedded_ = true;
    const double reached = std::max(0.0, depth);
    while (path_.empty() || path_.next_node() <= reached) path_.write(path_.next_node(), touch_);
    path_.write(reached, touch_);
    ahead_ = touch_;
  }
  /// The tip's lateral force follows the bevel while the tip cuts.
  void turn_tip(const Base& to) noexcept {
    const double cut = to.depth - std::max(path_.front(), base_.depth);
    if (!(cut > 0.0)) return;
    const double share = cut / (to.depth - base_.depth);
    const double left = 1.0 - std::exp(-cut / settings_.lengths.tip_memory);
    for (std::size_t d = 0; d < dimension; ++d) ahead_[d] += left * (path_.front_place()[d] - ahead_[d]);
    tip_load_.advance(cut, settings_.lengths.bevel_length, to.roll - share * (to.roll - base_.roll), to.roll);
  }

  /// Solves for the shape; writes the path where the tip is new.
  void settle(const Base& base, Events& events) noexcept {
    const BeamLoad<dimension> load = load_of(base);
    if (!buckled_) {
      const auto outcome = beam_.solve(settings_.beam, path_, load);
      buckled_ = !outcome.stable;
      events.converged &= outcome.converged;
    }
    if (!(base.depth > 0.0)) leave();
    if (load.cuts) path_.write(base.depth, mesh().tip().place);
    tip_force_ = load.tip_force;
  }
  /// Tissue whose strength the shaft exceeds is pushed aside, until it is no longer exceeded.
  void yield() noexcept {
    const BeamProperties& beam = settings_.beam;
    std::size_t k = 0;
    for (std::size_t layer = 0; layer < beam.layer_count; ++layer) {
      const bool below = layer + 1 < beam.layer_count;
      const std::size_t end =
          std::min(path_.nodes(), below ? path_.first_node(beam.layers[layer + 1].top) : path_.nodes());
      if (!beam.layers[layer].yields()) k = std::max(k, end);
      const double limit = beam.layers[layer].yield_offset();
      for (; k < end && path_.spacing * static_cast<double>(k) < mesh().tip().travel; ++k) yield(k, limit);
    }
  }
  /// A node of the tissue, whose shaft may be off by a limit [m].
  void yield(std::size_t k, double limit) noexcept {
    const double place = path_.spacing * static_cast<double>(k) / mesh().h();
    const std::size_t e = std::min(static_cast<std::size_t>(place), mesh().embedded() - 1);
    const Place shaft = mesh().place_in(e, hermite(place - static_cast<double>(e)));
    Place& yielded = path_.yielded_node(k);
    double square = 0.0;
    for (std::size_t d = 0; d < dimension; ++d) square += (shaft[d] - yielded[d]) * (shaft[d] - yielded[d]);
    if (!(square > limit * limit)) return;
    const double share = 1.0 - limit / std::sqrt(square);
    for (std::size_t d = 0; d < dimension; ++d) yielded[d] += share * (shaft[d] - yielded[d]);
  }
  /// Out of the tissue: a needle that comes back elsewhere makes a hole of its own.
  void leave() noexcept {
    touch_ = mesh().tip().place;
    buckled_ = false;
    rub_ = 0.0;
    if (!embedded_) return;
    double square = 0.0;
    for (std::size_t d = 0; d < dimension; ++d)
      square += (touch_[d] - path_.entry()[d]) * (touch_[d] - path_.entry()[d]);
    if (square <= settings_.lengths.hole_radius * settings_.lengths.hole_radius) return;
    forget();
    axial_.reset();
  }
  void forget() noexcept {
    embedded_ = buckled_ = false;
    rub_ = 0.0;
    path_.clear();
    tip_load_.clear();
  }

  BeamLoad<dimension> load_of(const Base& base) const noexcept {
    BeamLoad<dimension> load;
    const bool in_tissue = embedded_ && base.depth > 0.0;
    load.embedded = in_tissue ? base.depth : 0.0;
    load.free_length = settings_.beam.support.free_length(base.depth) + (in_tissue ? 0.0 : base.depth);
    const std::array<double, 2> bevel{std::cos(base.roll), std::sin(base.roll)};
    const double full = in_tissue ? full_tip_force(base.depth) : 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      load.lateral[d] = base.lateral[d];
      load.tilt[d] = base.tilt[d];
      load.bend[d] = bevel[d];
      load.tip_force[d] = full * tip_load_.share()[d];
    }
    load.axial = AxialLoad(axial_, sample_);
    if (in_tissue) {
      load.cuts = base.depth >= path_.front();
      load.rub = settings_.lengths.pressure_friction * rub_;
      load.contact = load.cuts ? layer_at(base.depth).tip_stiffness : 0.0;
      load.contact_place = ahead_;
    } else if (base.depth > 0.0) {
      // a tip that presses on a half space of nu = 1/2 is held across by 2/3 of the axial stiffness (Mindlin)
      load.contact = 2.0 / 3.0 * std::max(0.0, sample_.force_by_depth);
      load.contact_place = touch_;
    }
    return load;
  }
  /// The lateral force of the bevel's face, and of the layer that the tip cuts, which falls to zero on
  /// withdrawal.
  double full_tip_force(double depth) const noexcept {
    const double behind = std::max(0.0, path_.front() - depth);
    const double left = std::max(0.0, 1.0 - behind / settings_.lengths.unloading);
    return sample_.lateral + layer_at(depth).tip_force * left;
  }
  const LateralLayer& layer_at(double depth) const noexcept {
    const BeamProperties& beam = settings_.beam;
    std::size_t layer = 0;
    while (layer + 1 < beam.layer_count && beam.layers[layer + 1].top < depth) ++layer;
    return beam.layers[layer];
  }

  BentSample sample(const Events& events) const noexcept {
    BentSample result;
    result.axial = sample_;
    result.axial.contact = events.contact;
    result.axial.punctured = events.punctured;
    result.axial.exit = events.exit;
    result.force = sample_.force + settings_.lengths.pressure_friction * rub_ * beam_.pressing();
    result.unsupported = -mesh().base().travel;
    result.buckled = buckled_;
    for (double force : tip_force_) result.lateral += force * force;
    result.lateral = std::sqrt(result.lateral);
    result.status = sample_.status;
    if (result.status == Status::ok && (buckled_ || !events.converged || too_steep()))
      result.status = Status::outside_range;
    place_tip(result);
    add_wrench(result);
    return result;
  }
  bool too_steep() const noexcept {
    double largest = 0.0;
    for (const auto& node : mesh().nodes())
      for (std::size_t d = 0; d < dimension; ++d)
        largest = std::max(largest, std::abs(node.slope[d] - mesh().base().slope[d]));
    return largest > settings_.lengths.max_slope;
  }
  /// The second component of a value, 0 in a plane.
  static double second(const Place& value) noexcept {
    if constexpr (dimension > 1)
      return value[1];
    else
      return 0.0;
  }
  void place_tip(BentSample& result) const noexcept {
    if (settings_.small_slopes) {
      const auto& tip = mesh().tip();
      result.tip = {tip.place[0], second(tip.place), tip.travel};
      result.tangent = {tip.slope[0], second(tip.slope), 1.0};
    } else {
      Development<dimension> end = follow([](const Vector&) noexcept {});
      result.tip = end.position();
      result.tangent = end.tangent(mesh().tip().slope);
    }
  }
  /// Forces and moments in the frame of the tissue, turned by the slope at the base. Lateral forces have no
  /// moment about the axis: a round needle takes them by bending alone, x' S y = y' S x.
  void add_wrench(BentSample& result) const noexcept {
    const double fx = beam_.force()[0], fy = second(beam_.force()), fz = -result.force;
    const double mx = -second(beam_.moment()), my = beam_.moment()[0];
    const double tx = mesh().base().slope[0], ty = second(mesh().base().slope);
    result.wrench = {fx - tx * fz, fy - ty * fz, fz + tx * fx + ty * fy, mx, my, tx * mx + ty * my};
  }

  /// Follows the needle from the base to the tip, chord by chord; a chord is shorter than its arc. Above the
  /// surface an element is long, and follows in pieces.
  template <class Visit>
  Development<dimension> follow(Visit visit) const noexcept {
    const auto& first = mesh().base();
    Development<dimension> curve({first.place[0], second(first.place), first.travel});
    visit(curve.position());
    for (std::size_t i = 0; i + 1 < mesh().count(); ++i) {
      const std::size_t count = i < mesh().surface() ? free_pieces : 1;
      for (std::size_t k = 0; k < count; ++k) {
        follow_piece(curve, i, k, count);
        visit(curve.position());
      }
    }
    return curve;
  }
  void follow_piece(Development<dimension>& curve, std::size_t i, std::size_t k,
                    std::size_t count) const noexcept {
    const auto &a = mesh()[i], &b = mesh()[i + 1];
    const double whole = i < mesh().surface() ? b.travel - a.travel : mesh().h();
    const double share = 1.0 / static_cast<double>(count), length = whole * share;
    Place chord;
    double square = 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      const double change = (b.slope[d] - a.slope[d]) * share;
      chord[d] = (b.place[d] - a.place[d]) / whole;
      if (count > 1) chord[d] = cubic_chord(a, b, d, whole, static_cast<double>(k) * share, share);
      square += change * change;
    }
    curve.advance(square < 1.0 ? length * (1.0 - square * (1.0 / 24.0)) : length, chord);
  }
  /// Mean slope of a cubic element between xi and xi + share.
  static double cubic_chord(const BeamNode<dimension>& a, const BeamNode<dimension>& b, std::size_t d,
                            double length, double xi, double share) noexcept {
    const auto before = hermite(xi), after = hermite(xi + share);
    const std::array<double, 4> value{a.place[d], length * a.slope[d], b.place[d], length * b.slope[d]};
    double change = 0.0;
    for (std::size_t n = 0; n < 4; ++n) change += (after[n] - before[n]) * value[n];
    return change / (length * share);
  }

  Insertion axial_;
  FlexibleSettings settings_;
  bool valid_, yields_;

  TissuePath<dimension> path_;
  BeamEquilibrium<dimension> beam_{};
  TipLoad tip_load_{};
  Sample sample_{};
  BentSample last_{};
  Base base_{};
  Place touch_{}, tip_force_{};
  Place ahead_{};  // where the tissue ahead of the tip is unloaded
  double waited_ = 0.0;
  double moved_across_ = 0.0;  // since the tissue yielded [m]
  double rub_ = 0.0;           // share of the friction of the lateral pressure, -1 to 1
  bool started_ = false, embedded_ = false, buckled_ = false;
};

using PlanarInsertion = FlexibleInsertion<1>;
using SpatialInsertion = FlexibleInsertion<2>;

static_assert(std::is_trivially_copyable_v<PlanarInsertion>);
static_assert(std::is_trivially_copyable_v<SpatialInsertion>);

}  // namespace needleforce::bending
