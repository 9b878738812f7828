// SPDX-License-Identifier: Apache-2.0
// The needle at rest between its base, its path and its tip: EI y'''' + (N y')' + p(y - Y) = q.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "beam_foundation.hpp"
#include "equilibrium_search.hpp"
#include "section_forces.hpp"
#include "shortening.hpp"
#include "tip_face.hpp"

namespace needleforce::bending {

/// The shape of the needle, and the reaction of its base.
template <std::size_t dimension>
class BeamEquilibrium {
 public:
  using Place = std::array<double, dimension>;
  using Load = BeamLoad<dimension>;
  using Path = TissuePath<dimension>;

  struct Outcome {
    bool stable = true, converged = true;
    std::size_t iterations = 0;
    double cutting = 0.0;  ///< force at the tip [N], as its face found it
  };

  /// Solves for the shape under a load: at most `max_iterations` solutions of linear equations, one where the
  /// foundation is linear. A needle that has buckled keeps its last shape. `face` gives the cutting force of
  /// a tip with a `wedge` at a place. Wait-free.
  template <class Face = NoFace>
  Outcome solve(const BeamProperties& properties, const Path& path, const Load& load,
                const Face& face = {}) noexcept {
    Outcome outcome{.cutting = load.cutting};
    // the newest piece of the path stays within one element
    mesh_.place(properties.sections, properties.elements, std::max(2.0 * path.spacing, 2e-4),
                load.free_length, load.embedded);
    if (load.embedded > 0.0 && !path.empty()) trace(path);
    for (std::size_t i = 0; i < mesh_.surface(); ++i) columns_[i] = column(i, properties, load);
    properties.linear() ? solve_once(outcome, properties, path, load, face)
                        : iterate(outcome, properties, path, load, face);
    if (!outcome.stable) return outcome;
    react(properties, load);
    const SectionForces<dimension> sections(mesh_, columns_, properties.sections, load);
    advancing_ = sections.advancing();
    turning_ = sections.turning();
    if (load.shortens) shorten();
    if (load.rubs) press(properties, path);
    return outcome;
  }

  /// Looks at what came from outside. Wait-free.
  void check(StateCheck& check) const noexcept {
    mesh_.check(check);
    check.numbers("beam.force", force_);
    check.numbers("beam.moment", moment_);
    check.numbers("beam.pull", std::array{pull_, turning_, advancing_});
    shortening_.check(check);
    check.number("beam.pressing", pressing_, 0.0, largest_in_a_state);
  }

  const BeamMesh<dimension>& mesh() const noexcept { return mesh_; }
  /// Friction turns along the shaft that has slid. Wait-free.
  void turn_friction(double share, bool shortens) noexcept {
    turn_drag(mesh_, share);
    if (shortens) shorten_embedded(mesh_, shortening_);
  }
  void forget_friction() noexcept {
    for (BeamNode<dimension>& node : mesh_.nodes()) node.drag = node.drag_before = {};
  }
  /// Lateral force [N] and moment [N m] of the tissue on the needle at the base, in the planes of x and z, y
  /// and z.
  const Place& force() const noexcept { return force_; }
  const Place& moment() const noexcept { return moment_; }
  /// What the needle loses of energy per length that it gains at its base [N].
  double pull() const noexcept { return pull_; }
  const Shortening& shortening() const noexcept { return shortening_; }
  /// Moment [N m] on the needle about its axis, which keeps a needle that is bent by itself from turning.
  double turning() const noexcept { return turning_; }
  /// What bending gains of energy per travel of the tip, with which the needle's sections move [N].
  double advancing() const noexcept { return advancing_; }
  /// Integral of the lateral pressure's magnitude along the shaft [N], of the last solution with `rubs`.
  double pressing() const noexcept { return pressing_; }

 private:
  using Equations = BeamEquations<dimension>;

  static constexpr std::size_t cautious_after = 5;  // iterations
  static constexpr double close = 1e4;              // tolerances

  template <class Face>
  void solve_once(Outcome& outcome, const BeamProperties& properties, const Path& path, const Load& load,
                  const Face& face) noexcept {
    Equations equations;
    assemble(equations, properties, path, load, outcome.cutting, false);
    outcome.iterations = 1;
    outcome.stable = equations.solve();
    if (!outcome.stable) return;
    if (pushes(load)) outcome.cutting = push_face(equations, mesh_.count() - 1, load, outcome.cutting, face);
    take(equations);
  }
  bool pushes(const Load& load) const noexcept { return load.has_face() && mesh_.embedded() > 0; }
  template <class Face>
  void iterate(Outcome& outcome, const BeamProperties& properties, const Path& path, const Load& load,
               const Face& face) noexcept {
    EquilibriumSearch<dimension> search(mesh_, close * properties.tolerance);
    double change = std::numeric_limits<double>::infinity();
    while (change > properties.tolerance && outcome.iterations < properties.max_iterations) {
      ++outcome.iterations;
      Equations equations;
      if (pushes(load)) outcome.cutting = face(mesh_.tip().place);
      assemble(equations, properties, path, load, outcome.cutting, outcome.iterations > cautious_after);
      if (search.shortened(equations)) continue;
      outcome.stable = equations.solve();
      if (!outcome.stable) return;
      if (pushes(load))
        outcome.cutting = push_face(equations, mesh_.count() - 1, load, outcome.cutting, face);
      change = search.advance(equations);
    }
    outcome.converged = change <= close * properties.tolerance;
  }

  /// The path at the nodes, without its newest piece, which is not yet where it stays.
  void trace(const Path& path) noexcept {
    for (BeamNode<dimension>& node : mesh_.nodes().subspan(mesh_.surface())) {
      const double travel = std::min(node.travel, path.last_node());
      node.path = path.at(travel);
      node.along = path.direction(travel);
    }
  }

  void assemble(Equations& equations, const BeamProperties& properties, const Path& path, const Load& load,
                double cutting, bool cautious) noexcept {
    equations.clear(mesh_.count());
    add_free_part(equations, properties, load);
    add_embedded_part(equations, properties, path, load, cautious);
    add_tip(equations, load, cutting);
    add_surface(equations, properties, path, load);
    base_ = {equations.diagonal[0], equations.upper[0], equations.value[0]};
    hold_base(equations, properties.support, load);
  }

  /// Forces on the tip. That of the axial force follows the needle, as far as it slid on.
  void add_tip(Equations& equations, const Load& load, double face) const noexcept {
    const std::size_t last = mesh_.count() - 1;
    equations.diagonal[last].yy += load.contact;
    const bool along = mesh_.embedded() > 0;
    const double force = along ? load.compression.tip : 0.0, cutting = along ? load.compression.cutting : 0.0;
    for (std::size_t d = 0; d < dimension; ++d)
      equations.value[last].y[d] += load.tip_force[d] + load.contact * load.contact_place[d] -
                                    force * mesh_.tip().along[d] - cutting * mesh_.tip().drag[d];
    if (!pushes(load)) return;
    for (std::size_t d = 0; d < dimension; ++d) equations.value[last].y[d] += load.wedge[d] * face;
  }

  Column column(std::size_t i, const BeamProperties& properties, const Load& load) const noexcept {
    const double length = mesh_[i + 1].travel - mesh_[i].travel;
    const double middle = 0.5 * (mesh_[i].travel + mesh_[i + 1].travel);
    const std::size_t section = properties.sections.at(mesh_.tip().travel - middle);
    // beyond, it has buckled between its nodes: the equations at the limit are unstable already
    const double p = load.compression.free * length * length / properties.sections.list[section].stiffness;
    return {section, length, column_stiffness(std::min(p, 0.999 * clamped_buckling))};
  }
  void add_free_part(Equations& equations, const BeamProperties& properties,
                     const Load& load) const noexcept {
    for (std::size_t i = 0; i < mesh_.surface(); ++i) {
      const Column& own = columns_[i];
      const Section& section = properties.sections.list[own.section];
      equations.add(i, rescaled(beam_column(section.stiffness, own.length, own.stiffness), mesh_.h()));
      add_bend(equations, i, section, load, {0.0, -1.0 / mesh_.h(), 0.0, 1.0 / mesh_.h()});
    }
  }
  /// The load of a section's own curvature, whose weights are the change of the shape functions' slope.
  static void add_bend(Equations& equations, std::size_t i, const Section& section, const Load& load,
                       const std::array<double, 4>& slopes) noexcept {
    if (section.curvature == 0.0) return;
    add_force(equations, i, section.stiffness * section.curvature, slopes, load.bend);
  }

  void add_embedded_part(Equations& equations, const BeamProperties& properties, const Path& path,
                         const Load& load, bool cautious) const noexcept {
    const double h = mesh_.h();
    const Compression& force = load.compression;
    const bool axial = force.surface != 0.0 || force.tip != 0.0, one = properties.sections.count == 1;
    const ElementMatrix bending =
        one ? bending_matrix(properties.sections.list[0].stiffness, h) : ElementMatrix{};
    BeamFoundation<dimension> foundation(properties, mesh_, path, load, bending, cautious);
    const double per_h = 1.0 / h;
    const double change =
        mesh_.embedded() > 0 ? (force.tip - force.surface) / static_cast<double>(mesh_.embedded()) : 0.0;
    for (std::size_t e = 0; e < mesh_.embedded(); ++e) {
      const std::size_t i = mesh_.surface() + e;
      const double from = h * static_cast<double>(e);
      ElementMatrix matrix = foundation.add(equations, e);
      if (one)
        add_bend(equations, i, properties.sections.list[0], load, {0.0, -per_h, 0.0, per_h});
      else
        add_sections(equations, matrix, i, from, properties.sections, load);
      if (axial) {
        add_compression(matrix, force.surface + (static_cast<double>(e) + 0.5) * change, change, per_h);
        if (change != 0.0) add_friction(equations, i, change);
      }
      equations.add(i, matrix);
    }
  }
  /// Friction pushes the shaft aside where it is not along the axis.
  void add_friction(Equations& equations, std::size_t i, double change) const noexcept {
    Place along;
    for (std::size_t d = 0; d < dimension; ++d)
      along[d] = 0.5 * (mesh_[i].along[d] + mesh_[i + 1].along[d]) + mesh_[i].drag[d];
    add_force(equations, i, change, {0.5, 1.0 / 12.0, 0.5, -1.0 / 12.0}, along);
  }

  /// Bending of an element in which the needle's section may change.
  void add_sections(Equations& equations, ElementMatrix& matrix, std::size_t i, double from,
                    const Sections& sections, const Load& load) const noexcept {
    const double h = mesh_.h();
    each_section(sections, from, h, load.embedded, [&](const Section& section, double first, double second) {
      add_bending(matrix, section.stiffness, h, first, second);
      add_bend(equations, i, section, load, change_of_slope(first, second, h));
    });
  }
  /// The pivot, and the foundation along a length too short for elements.
  void add_surface(Equations& equations, const BeamProperties& properties, const Path& path,
                   const Load& load) const noexcept {
    if (!(load.embedded > 0.0) || path.empty()) return;
    const std::size_t surface = mesh_.surface();
    const double pivot = load.pivot * properties.support.pivot_stiffness;
    equations.diagonal[surface].yy += pivot;
    for (std::size_t d = 0; d < dimension; ++d) equations.value[surface].y[d] += pivot * path.entry()[d];
    if (mesh_.embedded() == 0) add_short_part(equations, properties.layers[0], path, load);
  }

  /// The foundation along a length too short for elements; a path that the tip writes goes along.
  void add_short_part(Equations& equations, const LateralLayer& layer, const Path& path,
                      const Load& load) const noexcept {
    const std::size_t surface = mesh_.surface();
    const double length = load.embedded * (load.cuts ? 1.0 / 3.0 : 1.0);
    Place offset;
    double square = 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      offset[d] = mesh_[surface].place[d] - path.entry()[d];
      square += offset[d] * offset[d];
    }
    const Secant at = stiffness_at(layer, std::sqrt(square));
    const double stiffness = std::max(0.5 * (at.tangent + at.secant), 1e-9 * layer.modulus + 1e-12);
    equations.diagonal[surface].yy += length * stiffness;
    for (std::size_t d = 0; d < dimension; ++d)
      equations.value[surface].y[d] +=
          length * (stiffness * path.entry()[d] + (stiffness - at.secant) * offset[d]);
  }

  /// The base where it is held, or on its springs.
  void hold_base(Equations& equations, const Support& support, const Load& load) const noexcept {
    const double h = mesh_.h();
    Block &own = equations.diagonal[0], &next = equations.upper[0];
    auto& value = equations.value[0];
    if (support.lateral_compliance > 0.0) {
      const double stiffness = 1.0 / support.lateral_compliance;
      own.yy += stiffness;
      for (std::size_t d = 0; d < dimension; ++d) value.y[d] += stiffness * load.lateral[d];
    } else {
      own.yy = 1.0, own.yr = next.yy = next.yr = 0.0;
      value.y = load.lateral;
    }
    if (support.rotational_compliance > 0.0) {
      const double stiffness = 1.0 / (support.rotational_compliance * h * h);
      own.rr += stiffness;
      for (std::size_t d = 0; d < dimension; ++d) value.r[d] += stiffness * h * load.tilt[d];
    } else {
      own.rr = 1.0, own.ry = next.ry = next.rr = 0.0;
      for (std::size_t d = 0; d < dimension; ++d) value.r[d] = h * load.tilt[d];
    }
  }

  void take(const Equations& equations) noexcept {
    const auto nodes = mesh_.nodes();
    for (std::size_t i = 0; i < nodes.size(); ++i)
      for (std::size_t d = 0; d < dimension; ++d) {
        nodes[i].place[d] = equations.value[i].y[d];
        nodes[i].slope[d] = equations.value[i].r[d] / mesh_.h();
      }
  }
  /// The reaction of the base is what its own equation leaves.
  void react(const BeamProperties& properties, const Load& load) noexcept {
    const double h = mesh_.h();
    const auto &own = mesh_[0], &next = mesh_[mesh_.count() > 1 ? 1 : 0];
    for (std::size_t d = 0; d < dimension; ++d) {
      const double y = own.place[d], r = h * own.slope[d];
      double force = base_.own.yy * y + base_.own.yr * r - base_.load.y[d];
      double moment = base_.own.ry * y + base_.own.rr * r - base_.load.r[d];
      if (mesh_.count() > 1) {
        force += base_.next.yy * next.place[d] + base_.next.yr * h * next.slope[d];
        moment += base_.next.ry * next.place[d] + base_.next.rr * h * next.slope[d];
      }
      force_[d] = -force;
      moment_[d] = -moment * h;
    }
    pull_ = 0.0;
    const Section& section =
        properties.sections.list[properties.sections.at(mesh_.tip().travel - own.travel)];
    for (std::size_t d = 0; d < dimension && mesh_.surface() > 0; ++d)
      pull_ += own.slope[d] * (force_[d] + 0.5 * load.compression.free * own.slope[d]) +
               moment_[d] * (0.5 * moment_[d] / section.stiffness + section.curvature * load.bend[d]);
  }
  void shorten() noexcept {
    shortening_ = {};
    for (std::size_t i = 0; i < mesh_.surface(); ++i) {
      const Column& own = columns_[i];
      const auto &a = mesh_[i], &b = mesh_[i + 1];
      for (std::size_t d = 0; d < dimension; ++d)
        shortening_.free +=
            column_shortening(own.stiffness, own.length, b.place[d] - a.place[d], a.slope[d], b.slope[d]);
    }
    shorten_embedded(mesh_, shortening_);
  }
  /// The lateral pressure, from that in the middle of each element.
  void press(const BeamProperties& properties, const Path& path) noexcept {
    const double h = mesh_.h();
    pressing_ = 0.0;
    std::size_t layer = 0;
    for (std::size_t e = 0; e < mesh_.embedded(); ++e) {
      const auto &a = mesh_[mesh_.surface() + e], &b = mesh_[mesh_.surface() + e + 1];
      const double middle = 0.5 * (a.travel + b.travel);
      while (layer + 1 < properties.layer_count && properties.layers[layer + 1].top <= middle) ++layer;
      const Place place = path.at(middle);
      double square = 0.0;
      for (std::size_t d = 0; d < dimension; ++d) {
        const double y = 0.5 * (a.place[d] + b.place[d]) + 0.125 * h * (a.slope[d] - b.slope[d]);
        square += (y - place[d]) * (y - place[d]);
      }
      const double offset = std::sqrt(square);
      pressing_ += h * stiffness_at(properties.layers[layer], offset).secant * offset;
    }
  }

  /// The equation of the base before it is held.
  struct BaseEquation {
    Block own, next;
    NodeValue<dimension> load;
  };

  BeamMesh<dimension> mesh_{};
  Columns columns_{};
  BaseEquation base_{};
  Place force_{}, moment_{};
  Shortening shortening_{};
  double pull_ = 0.0, turning_ = 0.0, advancing_ = 0.0;
  double pressing_ = 0.0;
};

}  // namespace needleforce::bending
