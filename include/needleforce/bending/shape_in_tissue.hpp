// SPDX-License-Identifier: Apache-2.0
// The shape of a needle, the travel of its tip and its axial force as one, from one place of the base to the
// next.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "axial_drive.hpp"
#include "elementary.hpp"
#include "tip_in_tissue.hpp"

namespace needleforce::bending {

/// Base of `FlexibleInsertion`.
template <std::size_t dimension, class Axial>
class ShapeInTissue : public TipInTissue<dimension, Axial> {
 public:
  using Tip = TipInTissue<dimension, Axial>;
  using Tip::mesh;
  using typename Tip::Place;

 protected:
  using Tip::axial_;
  using Tip::coupled;
  using Tip::enter;
  using Tip::forget;
  using Tip::in_tissue;
  using Tip::layer_at;
  using Tip::lean;
  using Tip::press;
  using Tip::settings_;
  using Tip::share_friction;
  using Tip::share_left;
  using Tip::shortens_;
  using Tip::state_;
  using Tip::Tip;
  using Tip::tip_place;
  using Tip::tip_pull;
  using Tip::turn_tip;

  struct Events {
    bool contact = false, punctured = false, exit = false, converged = true;
  };

  /// The shape, the travel of the tip and the axial force at a place of the base, which are one: a needle
  /// that bends is shorter, its shaft slides less, and its axial force bends it. Writes the path where the
  /// tip is new.
  void settle(const Base& to, double dt, Events& events) noexcept {
    AxialDrive<Axial> drive(axial_, state_.slide, settings_.lengths, state_.beam.pressing(), dt);
    const Began began{shortening(), state_.reached, state_.slid, tip_place()};
    const double reached = state_.reached;
    bool inside = in_tissue();
    Shortening shape = began.shape;
    state_.reached = to.depth - shape.whole();
    drive.to(slid(began, shape, to.depth), in_tissue());  // the tip has not moved aside yet
    if (axial_.pierced_layers() > 0 && !state_.embedded && state_.reached > 0.0) enter(reached);
    press(drive.sample());
    turn_tip(to, reached, drive.sample());
    ForceSearch search;
    ShapeSearch shapes;
    double force = drive.force() + (coupled() ? state_.tip_pull : 0.0);
    BeamLoad<dimension> load = load_of(to, shape, force, drive.force());
    bool holds = true;   // the last of the tissue may push a tip out
    double bears = 0.0;  // a force at which the needle did not buckle
    const bool lost = state_.buckled;
    const auto solved = [&] {
      const double travel = drive.travel();
      load.cutting = drive.sample().cutting;
      return solve(load, events, [&](const Place& tip) noexcept {
        drive.to(travel, in_tissue(), aside(began, load, tip));
        return drive.sample().cutting;
      });
    };
    for (std::size_t tries = 1; !lost; ++tries) {
      if (!solved()) {
        if (!coupled() || tries == max_tries) break;
        force = search.back(force, bears);
        load = load_of(to, shape, force, drive.force());
        continue;
      }
      if (!coupled()) break;
      bears = force;
      inside |= in_tissue();
      const Shortening now = shortening();
      const double pull = load.compression.free - load.compression.surface;
      const double across = aside(began, load, tip_place());
      drive.to(slid(began, now, to.depth), in_tissue(), across);
      const double cutting = drive.sample().cutting;
      state_.tip_pull = tip_pull(load, drive.force(), cutting);
      const double missing = drive.force() + state_.tip_pull - force;
      const double change = now.whole() - began.shape.whole();
      const double unbalanced = std::abs(missing) + std::abs(free_pull() - pull);
      holds = tries < max_tries || load.cuts || mesh().embedded() > 0;
      if (tries == max_tries || (unbalanced * std::abs(change) <= smallest_work &&
                                 std::abs((cutting - load.cutting) * across) <= smallest_work &&
                                 std::abs(missing) <= small_force * (1.0 + std::abs(force)) &&
                                 std::abs(now.whole() - shape.whole()) <= smallest_length))
        break;
      force = search.next(force, missing, state_.slide.travel, drive.by_travel(), state_.give);
      shape = shapes.next(shape, now);
      state_.reached = to.depth - shape.whole();
      load = load_of(to, shape, force, drive.force());
    }
    if (inside && !(in_tissue() && holds)) load = spring_out(to, drive.force(), events);
    take(drive, load, events, began);
  }
  static constexpr std::size_t max_tries = 12;
  static constexpr double smallest_work = 1e-13;  // [J]
  static constexpr double small_force = 1e-3, smallest_length = 1e-7;

  Shortening shortening() const noexcept { return coupled() ? state_.beam.shortening() : Shortening{}; }
  /// Where a part of a step began.
  struct Began {
    Shortening shape;
    double reached, slid;
    Place tip;
  };
  /// Travel of the shaft [m]: that of its friction, which is the mean along it, and of what cuts, at the tip,
  /// by their shares of the axial force.
  double slid(const Began& began, const Shortening& now, double depth) noexcept {
    const double reached = depth - now.whole(), tip = reached - began.reached;
    double& wanted = state_.slid;
    wanted = began.slid + tip;
    if (coupled() && !state_.buckled && in_tissue() && mesh().embedded() > 0) {
      const auto per_length = [](double of, double length) { return length > 0.0 ? of / length : 0.0; };
      const Shortening& was = began.shape;
      const double grows =
          0.5 * (per_length(was.weighted, began.reached) + per_length(now.weighted, reached));
      const double shaft = now.weighted - was.weighted + now.aside - was.aside +
                           (grows - 0.5 * (now.passing + was.passing)) * tip;
      double aside = 0.0;
      const auto& node = mesh().tip();
      for (std::size_t d = 0; d < dimension; ++d)
        aside +=
            0.5 * (node.drag[d] + node.drag_before[d]) * (node.place[d] - began.tip[d] - node.along[d] * tip);
      wanted += state_.slide.share * shaft + (1.0 - state_.slide.share) * aside;
    }
    return std::min(wanted, std::min(state_.path.longest(), axial_.reach()));
  }
  /// How far the tip has moved from its path to a place as its face pushes it, times the lateral over the
  /// cutting force [m].
  double aside(const Began& began, const BeamLoad<dimension>& load, const Place& tip) const noexcept {
    if (!in_tissue() || mesh().embedded() == 0) return 0.0;
    const double way = state_.reached - began.reached;
    double sum = 0.0;
    for (std::size_t d = 0; d < dimension; ++d)
      sum += 0.5 * (load.wedge[d] + state_.wedged[d]) * (tip[d] - began.tip[d] - mesh().tip().along[d] * way);
    return sum;
  }
  /// What the part above the surface is compressed by more than the rest: the needle at the surface bears the
  /// axial part of the lateral forces of the tissue [N].
  double free_pull() const noexcept { return mesh().embedded() > 0 ? state_.beam.pull() : 0.0; }

  template <class Face = NoFace>
  bool solve(BeamLoad<dimension>& load, Events& events, const Face& face = {}) noexcept {
    const auto outcome = state_.beam.solve(settings_.beam, state_.path, load, face);
    load.cutting = outcome.cutting;
    state_.buckled = !outcome.stable;
    events.converged &= outcome.converged;
    return outcome.stable;
  }
  /// The tip has left the tissue, which held it aside up to then.
  BeamLoad<dimension> spring_out(const Base& to, double force, Events& events) noexcept {
    state_.buckled = false;
    state_.tip_pull = 0.0;
    BeamLoad<dimension> load = load_of(to, {}, force, force);
    solve(load, events);
    state_.reached = to.depth - shortening().whole();
    if (!(state_.reached > 0.0)) return load;
    state_.reached = 0.0;  // it lies on the surface: where it goes in again is another hole
    forget();
    axial_.reset();
    return load;
  }
  /// What remains of the step. A needle that has buckled gives nothing back of what bent it.
  void take(const AxialDrive<Axial>& drive, const BeamLoad<dimension>& load, Events& events,
            const Began& began) noexcept {
    state_.sample = drive.sample();
    events.contact |= state_.sample.contact;
    events.punctured |= state_.sample.punctured;
    events.exit |= state_.sample.exit;
    const bool bends = coupled() && !state_.buckled;
    state_.wedged = load.wedge;
    state_.along = drive.force() + (bends ? state_.tip_pull + free_pull() : 0.0);
    state_.force = state_.along - (bends && guided() ? state_.beam.pull() : 0.0);
    if (mesh().embedded() > 0)
      state_.beam.turn_friction(1.0 - falling(std::abs(state_.slid - began.slid) / state_.path.spacing),
                                shortens_);
    if (!(state_.reached > 0.0)) leave();
    if (load.cuts) {
      const std::size_t nodes = state_.path.nodes();
      share_friction();
      const double piece = std::max(0.0, state_.reached - state_.path.last_node());
      for (std::size_t d = 0; d < dimension; ++d)
        state_.owed += load.tip_force[d] * (mesh().tip().place[d] - state_.path.front_place()[d]);
      state_.path.write(state_.reached, mesh().tip().place);
      if (state_.path.nodes() > nodes) lean(piece);
    }
  }
  /// Out of the tissue: a needle that comes back elsewhere makes a hole of its own.
  void leave() noexcept {
    state_.touch = mesh().tip().place;
    state_.buckled = false;
    state_.slide.rub = state_.slide.most = 0.0;
    state_.slid = state_.reached;
    state_.beam.forget_friction();
    if (!state_.embedded) return;
    double square = 0.0;
    for (std::size_t d = 0; d < dimension; ++d)
      square += (state_.touch[d] - state_.path.entry()[d]) * (state_.touch[d] - state_.path.entry()[d]);
    if (square <= settings_.lengths.hole_radius * settings_.lengths.hole_radius) return;
    forget();
    axial_.reset();
  }

  BeamLoad<dimension> load_of(const Base& base, const Shortening& shape, double force,
                              double axial) const noexcept {
    BeamLoad<dimension> load;
    const bool inside = in_tissue();
    load.shortens = shortens_;
    load.embedded = inside ? state_.reached : 0.0;
    load.free_length =
        std::max(0.0, settings_.beam.support.free_length(base.depth) + (inside ? shape.free : base.depth));
    load.compression = {force + (coupled() && inside ? free_pull() : 0.0), force,
                        force - state_.slide.share * axial, (1.0 - state_.slide.share) * axial};
    const std::array<double, 2> bevel = cos_sin(base.roll);
    const std::array<double, 2> turns{-bevel[1], bevel[0]};
    const double left = inside ? share_left(state_.reached) : 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      load.lateral[d] = base.lateral[d];
      load.tilt[d] = base.tilt[d];
      load.bend[d] = bevel[d];
      load.bend_turns[d] = turns[d];
      load.tip_force[d] = left * (state_.push[d] + state_.lean[d]);
      load.wedge[d] = inside && coupled() ? left * state_.wedge[d] : 0.0;
    }
    if (inside) {
      load.cuts = state_.reached >= state_.path.front();
      load.pulls_back = coupled();
      load.rubs = settings_.lengths.pressure_friction > 0.0;
      load.contact = left * layer_at(state_.reached).tip_stiffness;
      load.contact_place = state_.ahead;
      load.pivot = coupled() ? std::min(1.0, state_.reached / settings_.lengths.tip_memory) : 1.0;
    } else {
      load.contact = state_.grip;
      load.contact_place = state_.touch;
    }
    return load;
  }
  bool guided() const noexcept { return settings_.beam.support.guide_distance != Support::no_guide; }
};

}  // namespace needleforce::bending
