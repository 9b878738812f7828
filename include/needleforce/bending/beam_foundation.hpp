// SPDX-License-Identifier: Apache-2.0
// The foundation along the embedded needle, attached to the cut path: stiffness and load of its elements.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "beam_load.hpp"
#include "beam_mesh.hpp"
#include "block_chain.hpp"

namespace needleforce::bending {

template <std::size_t dimension>
using BeamEquations = BlockChain<dimension, max_nodes>;

/// A load of factor times `place` on the shape functions of element i.
template <std::size_t dimension>
inline void add_force(BeamEquations<dimension>& equations, std::size_t i, double factor,
                      const std::array<double, 4>& shape,
                      const std::array<double, dimension>& place) noexcept {
  auto &first = equations.value[i], &second = equations.value[i + 1];
  for (std::size_t d = 0; d < dimension; ++d) {
    const double force = factor * place[d];
    first.y[d] += force * shape[0];
    first.r[d] += force * shape[1];
    second.y[d] += force * shape[2];
    second.r[d] += force * shape[3];
  }
}

/// Adds the foundation of one solution to the equations, element by element from the surface down.
template <std::size_t dimension>
class BeamFoundation {
 public:
  using Place = std::array<double, dimension>;
  using Equations = BeamEquations<dimension>;

  BeamFoundation(const BeamProperties& properties, const BeamMesh<dimension>& mesh,
                 const TissuePath<dimension>& path, const BeamLoad<dimension>& load) noexcept
      : properties_(properties), mesh_(mesh), path_(path), load_(load) {
    for (std::size_t j = 0; j < properties.layer_count; ++j) {
      stiffness_[j] = properties.layers[j].modulus * mesh.h();
      uniform_[j] = ElementMatrix{};
      for (std::size_t g = 0; g < gauss_count; ++g)
        add_product(uniform_[j], gauss_weights[g] * stiffness_[j], shapes[g], shapes[g]);
    }
  }

  /// Adds the foundation of element e, counted from the surface, to its matrix, and its load.
  void add(Equations& equations, ElementMatrix& matrix, std::size_t e) noexcept {
    const double from = mesh_.h() * static_cast<double>(e), to = from + mesh_.h();
    const bool last = e + 1 == mesh_.embedded();
    while (layer_ + 1 < properties_.layer_count && properties_.layers[layer_ + 1].top <= from) ++layer_;
    const bool whole = layer_ + 1 >= properties_.layer_count || properties_.layers[layer_ + 1].top >= to;
    if (whole && !(last && load_.cuts) && properties_.layers[layer_].linear())
      add_uniform(equations, matrix, e, from);
    else
      add_pieces(equations, matrix, e, from, last ? load_.embedded : to);
  }

 private:
  /// An element in one linear layer, behind the front of the path.
  void add_uniform(Equations& equations, ElementMatrix& matrix, std::size_t e, double from) const noexcept {
    const ElementMatrix& uniform = uniform_[layer_];
    matrix.first += uniform.first, matrix.upper += uniform.upper;
    matrix.lower += uniform.lower, matrix.second += uniform.second;
    for (std::size_t g = 0; g < gauss_count; ++g)
      add_force(equations, mesh_.surface() + e, stiffness_[layer_] * gauss_weights[g], shapes[g],
                path_.at(from + mesh_.h() * gauss_points[g]));
  }

  /// A part of an element in one layer, behind the last node of the path or in front of it.
  struct Piece {
    std::size_t element;
    double begin, end;
    bool newest;  ///< between the last node of the path and the tip, which writes it
  };

  /// An element with an interface, a nonlinear foundation or the front of the path in it.
  void add_pieces(Equations& equations, ElementMatrix& matrix, std::size_t e, double from,
                  double to) const noexcept {
    const bool front = load_.cuts && e + 1 == mesh_.embedded();
    std::size_t layer = layer_;
    double begin = from;
    while (begin < to) {
      const bool newest = front && begin >= path_.last_node();
      double end = front && !newest ? std::min(to, path_.last_node()) : to;
      if (layer + 1 < properties_.layer_count) {
        const double next = properties_.layers[layer + 1].top;
        if (next <= begin) {
          ++layer;
          continue;
        }
        end = std::min(end, next);
      }
      add_piece(equations, matrix, properties_.layers[layer], {e, begin, end, newest});
      begin = end;
    }
  }

  void add_piece(Equations& equations, ElementMatrix& matrix, const LateralLayer& layer,
                 const Piece& piece) const noexcept {
    const double from = mesh_.h() * static_cast<double>(piece.element), length = piece.end - piece.begin;
    for (std::size_t g = 0; g < gauss_count; ++g) {
      const double travel = piece.begin + length * gauss_points[g];
      const std::array<double, 4> shape = hermite((travel - from) / mesh_.h());
      double by_tip = 0.0;  // derivative of the path by the deflection of the tip
      Place place = piece.newest ? newest_place(travel, by_tip) : path_.at(travel);
      double stiffness = layer.modulus;
      if (!layer.linear()) stiffness = linearise(layer, piece.element, shape, by_tip, place);
      const double factor = gauss_weights[g] * length * stiffness;
      add_product(matrix, factor, shape, {shape[0], shape[1], shape[2] - by_tip, shape[3]});
      add_force(equations, mesh_.surface() + piece.element, factor, shape, place);
    }
  }
  /// The path between its last node and the tip, without what the tip adds.
  Place newest_place(double travel, double& by_tip) const noexcept {
    const auto weights = path_.newest(travel, load_.embedded);
    by_tip = weights.front;
    const std::size_t last = path_.nodes() - 1;
    const Place &before = path_.node(last > 0 ? last - 1 : 0), &node = path_.node(last);
    Place place;
    for (std::size_t d = 0; d < dimension; ++d)
      place[d] = weights.before * before[d] + weights.last * node[d];
    return place;
  }
  /// The stiffness of the foundation at the offset of the last solution; `place` becomes the place of the
  /// path that gives its force with that stiffness. In space the stiffness is the mean of those along and
  /// across the offset.
  double linearise(const LateralLayer& layer, std::size_t e, const std::array<double, 4>& shape,
                   double by_tip, Place& place) const noexcept {
    const auto &a = mesh_[mesh_.surface() + e], &b = mesh_[mesh_.surface() + e + 1];
    const double h = mesh_.h();
    Place offset;
    double square = 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      offset[d] = shape[0] * a.place[d] + shape[1] * h * a.slope[d] + shape[2] * b.place[d] +
                  shape[3] * h * b.slope[d] - place[d] - by_tip * mesh_.tip().place[d];
      square += offset[d] * offset[d];
    }
    const Secant at = stiffness_at(layer, std::sqrt(square));
    const double mean = dimension == 1 ? at.tangent : 0.5 * (at.tangent + at.secant);
    const double stiffness = std::max(mean, 1e-9 * layer.modulus);
    for (std::size_t d = 0; d < dimension; ++d) place[d] += (1.0 - at.secant / stiffness) * offset[d];
    return stiffness;
  }

  static constexpr std::array<std::array<double, 4>, gauss_count> shapes{
      hermite(gauss_points[0]), hermite(gauss_points[1]), hermite(gauss_points[2])};

  const BeamProperties& properties_;
  const BeamMesh<dimension>& mesh_;
  const TissuePath<dimension>& path_;
  const BeamLoad<dimension>& load_;
  std::array<ElementMatrix, max_lateral_layers> uniform_;
  std::array<double, max_lateral_layers> stiffness_;
  std::size_t layer_ = 0;
};

}  // namespace needleforce::bending
