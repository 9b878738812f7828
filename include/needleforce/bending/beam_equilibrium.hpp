// SPDX-License-Identifier: Apache-2.0
// The needle at rest between its base, its path and its tip: EI y'''' + N y'' + p(y - Y) = q.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "beam_foundation.hpp"
#include "equilibrium_search.hpp"

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
  };

  /// Solves for the shape under a load: at most `max_iterations` solutions of linear equations, one where the
  /// foundation is linear. A needle that has buckled keeps its last shape. Wait-free.
  Outcome solve(const BeamProperties& properties, const Path& path, const Load& load) noexcept {
    Outcome outcome;
    // the newest piece of the path stays within one element
    mesh_.place(properties.sections, properties.elements, std::max(2.0 * path.spacing, 2e-4),
                load.free_length, load.embedded);
    properties.linear() ? solve_once(outcome, properties, path, load)
                        : iterate(outcome, properties, path, load);
    if (!outcome.stable) return outcome;
    react();
    if (load.rub != 0.0) press(properties, path);
    return outcome;
  }

  /// Looks at what came from outside. Wait-free.
  void check(StateCheck& check) const noexcept {
    mesh_.check(check);
    check.numbers("beam.force", force_);
    check.numbers("beam.moment", moment_);
    check.numbers("beam.pressure", pressure_);
    check.number("beam.pressing", pressing_, 0.0, largest_in_a_state);
  }

  const BeamMesh<dimension>& mesh() const noexcept { return mesh_; }
  /// Lateral force [N] and moment [N m] of the tissue on the needle at the base, in the planes of x and z, y
  /// and z.
  const Place& force() const noexcept { return force_; }
  const Place& moment() const noexcept { return moment_; }
  /// Integral of the lateral pressure's magnitude along the shaft [N], of the last solution with `rub`.
  double pressing() const noexcept { return pressing_; }

 private:
  using Equations = BeamEquations<dimension>;

  static constexpr std::size_t cautious_after = 5;  // iterations
  static constexpr double close = 1e4;              // tolerances

  void solve_once(Outcome& outcome, const BeamProperties& properties, const Path& path,
                  const Load& load) noexcept {
    Equations equations;
    assemble(equations, properties, path, load, false);
    outcome.iterations = 1;
    outcome.stable = equations.solve();
    if (outcome.stable) take(equations);
  }
  void iterate(Outcome& outcome, const BeamProperties& properties, const Path& path,
               const Load& load) noexcept {
    EquilibriumSearch<dimension> search(mesh_, close * properties.tolerance);
    double change = std::numeric_limits<double>::infinity();
    while (change > properties.tolerance && outcome.iterations < properties.max_iterations) {
      ++outcome.iterations;
      Equations equations;
      assemble(equations, properties, path, load, outcome.iterations > cautious_after);
      if (search.shortened(equations)) continue;
      outcome.stable = equations.solve();
      if (!outcome.stable) return;
      change = search.advance(equations);
    }
    outcome.converged = change <= close * properties.tolerance;
  }

  void assemble(Equations& equations, const BeamProperties& properties, const Path& path, const Load& load,
                bool cautious) noexcept {
    equations.clear(mesh_.count());
    add_free_part(equations, properties, load);
    add_embedded_part(equations, properties, path, load, cautious);
    const std::size_t last = mesh_.count() - 1;
    equations.diagonal[last].yr += load.axial.tip() / mesh_.h();  // the force at the tip follows the tangent
    equations.diagonal[last].yy += load.contact;
    for (std::size_t d = 0; d < dimension; ++d)
      equations.value[last].y[d] += load.tip_force[d] + load.contact * load.contact_place[d];
    add_surface(equations, properties, path, load);
    base_ = {equations.diagonal[0], equations.upper[0], equations.value[0]};
    hold_base(equations, properties.support, load);
  }

  /// Sections above the surface, each an exact beam-column.
  void add_free_part(Equations& equations, const BeamProperties& properties,
                     const Load& load) const noexcept {
    const double compression = load.axial.at(0.0) + load.rub * pressing_;
    for (std::size_t i = 0; i < mesh_.surface(); ++i) {
      const double length = mesh_[i + 1].travel - mesh_[i].travel;
      const double middle = 0.5 * (mesh_[i].travel + mesh_[i + 1].travel);
      const Section& section = properties.sections.list[properties.sections.at(mesh_.tip().travel - middle)];
      // beyond, it has buckled between its nodes: the equations at the limit are unstable already
      const double most = 0.999 * clamped_buckling * section.stiffness / (length * length);
      equations.add(i,
                    rescaled(beam_column(section.stiffness, length, std::min(compression, most)), mesh_.h()));
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
    const bool axial = !load.axial.none() || load.rub != 0.0, one = properties.sections.count == 1;
    const ElementMatrix bending =
        one ? bending_matrix(properties.sections.list[0].stiffness, h) : ElementMatrix{};
    BeamFoundation<dimension> foundation(properties, mesh_, path, load, bending, cautious);
    const double per_h = 1.0 / h;
    double above = axial ? load.axial.at(0.0) : 0.0, rubbed = load.rub * pressing_;
    for (std::size_t e = 0; e < mesh_.embedded(); ++e) {
      const std::size_t i = mesh_.surface() + e;
      const double from = h * static_cast<double>(e);
      ElementMatrix matrix = foundation.add(equations, e);
      if (one)
        add_bend(equations, i, properties.sections.list[0], load, {0.0, -per_h, 0.0, per_h});
      else
        add_sections(equations, matrix, i, from, properties.sections, load);
      if (axial) {
        const double below = load.axial.at(from + h), own = load.rub * pressure_[e] * h;
        const double friction = above - below + own;
        add_axial(matrix, below + rubbed - own + 0.5 * friction, friction * per_h, per_h);
        above = below, rubbed -= own;
      }
      equations.add(i, matrix);
    }
  }

  /// Bending of an element in which the needle's section may change.
  void add_sections(Equations& equations, ElementMatrix& matrix, std::size_t i, double from,
                    const Sections& sections, const Load& load) const noexcept {
    const double h = mesh_.h();
    for (std::size_t k = sections.count; k-- > 0;) {  // from the base on
      const double begin = std::max(from, load.embedded - sections.list[k].end);
      const double end = k > 0 ? std::min(from + h, load.embedded - sections.list[k - 1].end) : from + h;
      if (!(begin < end)) continue;
      const double first = (begin - from) / h, second = (end - from) / h;
      add_bending(matrix, sections.list[k].stiffness, h, first, second);
      const auto before = hermite_slope(first), after = hermite_slope(second);
      std::array<double, 4> change;
      for (std::size_t n = 0; n < 4; ++n) change[n] = (after[n] - before[n]) / h;
      add_bend(equations, i, sections.list[k], load, change);
    }
  }

  /// The pivot, and the foundation along a length too short for elements.
  void add_surface(Equations& equations, const BeamProperties& properties, const Path& path,
                   const Load& load) const noexcept {
    if (!(load.embedded > 0.0) || path.empty()) return;
    double stiffness = properties.support.pivot_stiffness;
    if (mesh_.embedded() == 0) stiffness += 0.5 * properties.layers[0].modulus * load.embedded;
    equations.diagonal[mesh_.surface()].yy += stiffness;
    for (std::size_t d = 0; d < dimension; ++d)
      equations.value[mesh_.surface()].y[d] += stiffness * path.entry()[d];
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
  void react() noexcept {
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
  }
  /// The lateral pressure in the middle of each element, for the friction of the next step.
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
      pressure_[e] = stiffness_at(properties.layers[layer], offset).secant * offset;
      pressing_ += pressure_[e] * h;
    }
  }

  /// The equation of the base before it is held.
  struct BaseEquation {
    Block own, next;
    NodeValue<dimension> load;
  };

  BeamMesh<dimension> mesh_{};
  BaseEquation base_{};
  Place force_{}, moment_{};
  std::array<double, max_elements> pressure_{};  // [N/m]
  double pressing_ = 0.0;
};

}  // namespace needleforce::bending
