// SPDX-License-Identifier: Apache-2.0
// The foundation along the embedded needle, attached to the cut path: stiffness and load of its elements.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

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

  /// `bending` is what all elements have in addition; `cautious` takes stiffer ones.
  BeamFoundation(const BeamProperties& properties, const BeamMesh<dimension>& mesh,
                 const TissuePath<dimension>& path, const BeamLoad<dimension>& load,
                 const ElementMatrix& bending, bool cautious) noexcept
      : properties_(properties),
        mesh_(mesh),
        path_(path),
        load_(load),
        bending_(bending),
        cautious_(cautious) {
    for (std::size_t j = 0; j < properties.layer_count; ++j) {
      stiffness_[j] = properties.layers[j].modulus * mesh.h();
      uniform_[j] = bending;
      for (std::size_t g = 0; g < gauss_count; ++g)
        add_product(uniform_[j], gauss_weights[g] * stiffness_[j], shapes[g], shapes[g]);
    }
  }

  /// The matrix of element e, counted from the surface; adds its load to the equations.
  ElementMatrix add(Equations& equations, std::size_t e) noexcept {
    const double from = mesh_.h() * static_cast<double>(e), to = from + mesh_.h();
    const bool last = e + 1 == mesh_.embedded();
    while (layer_ + 1 < properties_.layer_count && properties_.layers[layer_ + 1].top <= from) ++layer_;
    const bool whole = layer_ + 1 >= properties_.layer_count || properties_.layers[layer_ + 1].top >= to;
    if (whole && !(last && load_.cuts) && properties_.layers[layer_].linear()) {
      add_path(equations, e, from);
      return uniform_[layer_];
    }
    ElementMatrix matrix = bending_;
    if (whole && !(last && load_.cuts))
      add_whole(equations, matrix, e, from);
    else
      add_pieces(equations, matrix, e, from, last ? load_.embedded : to);
    return matrix;
  }

 private:
  /// The load of the path on an element in one linear layer.
  void add_path(Equations& equations, std::size_t e, double from) const noexcept {
    const bool inside = from + mesh_.h() <= path_.last_node();
    auto &first = equations.value[mesh_.surface() + e], &second = equations.value[mesh_.surface() + e + 1];
    std::array<std::array<double, gauss_count>, dimension> place;
    for (std::size_t g = 0; g < gauss_count; ++g) {
      const double travel = from + mesh_.h() * gauss_points[g];
      const Place at = inside ? path_.between_nodes(travel) : path_.at(travel);
      for (std::size_t d = 0; d < dimension; ++d) place[d][g] = stiffness_[layer_] * at[d];
    }
    for (std::size_t d = 0; d < dimension; ++d) {
      const double a = place[d][0], b = place[d][1], c = place[d][2];
      first.y[d] += weighted[0][0] * a + weighted[1][0] * b + weighted[2][0] * c;
      first.r[d] += weighted[0][1] * a + weighted[1][1] * b + weighted[2][1] * c;
      second.y[d] += weighted[0][2] * a + weighted[1][2] * b + weighted[2][2] * c;
      second.r[d] += weighted[0][3] * a + weighted[1][3] * b + weighted[2][3] * c;
    }
  }

  /// An element in one nonlinear layer, behind the front of the path.
  void add_whole(Equations& equations, ElementMatrix& matrix, std::size_t e, double from) const noexcept {
    std::array<double, gauss_count> factor;
    for (std::size_t g = 0; g < gauss_count; ++g) {
      const double travel = from + mesh_.h() * gauss_points[g];
      Place place = path_.at(travel);
      factor[g] = mesh_.h() * linearise(layer_, e, shapes[g], travel, place);
      add_force(equations, mesh_.surface() + e, factor[g], weighted[g], place);
    }
    std::array<double, 10> sum{};
    for (std::size_t n = 0; n < 10; ++n)
      sum[n] = factor[0] * products[0][n] + factor[1] * products[1][n] + factor[2] * products[2][n];
    const auto& [aa, ab, ac, ad, bb, bc, bd, cc, cd, dd] = sum;
    matrix.first += {aa, ab, ab, bb};
    matrix.upper += {ac, ad, bc, bd};
    matrix.lower += {ac, bc, ad, bd};
    matrix.second += {cc, cd, cd, dd};
  }

  /// A part of an element in one layer, behind the last node of the path or in front of it.
  struct Piece {
    std::size_t element, layer;
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
      add_piece(equations, matrix, {e, layer, begin, end, newest});
      begin = end;
    }
  }

  void add_piece(Equations& equations, ElementMatrix& matrix, const Piece& piece) const noexcept {
    const LateralLayer& layer = properties_.layers[piece.layer];
    const double from = mesh_.h() * static_cast<double>(piece.element), length = piece.end - piece.begin;
    for (std::size_t g = 0; g < gauss_count; ++g) {
      const double travel = piece.begin + length * gauss_points[g];
      const std::array<double, 4> shape = hermite((travel - from) / mesh_.h());
      double by_tip = 0.0;  // derivative of the path by the deflection of the tip
      Place place = piece.newest ? newest_place(travel, by_tip) : path_.at(travel);
      double stiffness = layer.modulus + layer.yielding_modulus;  // ahead of the last node nothing yields
      if (!layer.linear())
        stiffness = piece.newest
                        ? linearise_newest(layer, mesh_.place_in(piece.element, shape), by_tip, place)
                        : linearise(piece.layer, piece.element, shape, travel, place);
      const double factor = gauss_weights[g] * length * stiffness;
      const std::array<double, 4> offset{shape[0], shape[1], shape[2] - by_tip, shape[3]};
      // what pulls the shaft towards the newest piece of path pulls the tip, which moves that, back
      const auto& pulled = load_.pulls_back ? offset : shape;
      add_product(matrix, factor, pulled, offset);
      add_force(equations, mesh_.surface() + piece.element, factor, pulled, place);
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
  /// path that gives its force with that stiffness.
  double linearise(std::size_t number, std::size_t e, const std::array<double, 4>& shape, double travel,
                   Place& place) const noexcept {
    const LateralLayer& layer = properties_.layers[number];
    const Place shaft = mesh_.place_in(e, shape);
    const double first = linearised(
        shaft, place, [&](double offset) { return stiffness_at(layer, offset); }, 1e-9 * layer.modulus);
    if (!layer.yields()) return first;
    Place yielded = path_.yielded(travel, layer.top, bottom_of(number));
    const double modulus = layer.yielding_modulus, limit = layer.yield_offset();
    const double second = linearised(
        shaft, yielded,
        [&](double offset) {
          return offset <= limit ? Secant{modulus, modulus} : Secant{modulus * limit / offset, 0.0};
        },
        2e-3 * modulus);
    const double sum = first + second;
    for (std::size_t d = 0; d < dimension; ++d) place[d] = (first * place[d] + second * yielded[d]) / sum;
    return sum;
  }
  /// The same where the tip moves the path, by a share of its own deflection: nothing has yielded there.
  double linearise_newest(const LateralLayer& layer, const Place& shaft, double by_tip,
                          Place& place) const noexcept {
    Place whole;
    for (std::size_t d = 0; d < dimension; ++d) whole[d] = place[d] + by_tip * mesh_.tip().place[d];
    Place shifted = whole;
    const double first = linearised(
        shaft, shifted, [&](double offset) { return stiffness_at(layer, offset); }, 1e-9 * layer.modulus);
    const double sum = first + layer.yielding_modulus;
    for (std::size_t d = 0; d < dimension; ++d) place[d] += first * (shifted[d] - whole[d]) / sum;
    return sum;
  }
  double bottom_of(std::size_t layer) const noexcept {
    return layer + 1 < properties_.layer_count ? properties_.layers[layer + 1].top
                                               : std::numeric_limits<double>::infinity();
  }
  /// One of them, with a stiffness of no less than `least`: that along the offset; in space, and after
  /// several iterations, the mean of it and the one across, which is the secant.
  template <class Law>
  double linearised(const Place& shaft, Place& place, Law law, double least) const noexcept {
    Place offset;
    double square = 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      offset[d] = shaft[d] - place[d];
      square += offset[d] * offset[d];
    }
    const Secant at = law(std::sqrt(square));
    const bool along = dimension == 1 && !cautious_;
    const double mean = along ? at.tangent : 0.5 * (at.tangent + at.secant);
    const double stiffness = std::max(mean, std::max(least, 1e-12));
    for (std::size_t d = 0; d < dimension; ++d) place[d] += (1.0 - at.secant / stiffness) * offset[d];
    return stiffness;
  }

  static constexpr std::array<std::array<double, 4>, gauss_count> shapes{
      hermite(gauss_points[0]), hermite(gauss_points[1]), hermite(gauss_points[2])};
  /// The same times their weights.
  static constexpr auto weighted = [] {
    auto result = shapes;
    for (std::size_t g = 0; g < gauss_count; ++g)
      for (double& value : result[g]) value *= gauss_weights[g];
    return result;
  }();

  /// Their products with the weights: the upper triangle of each outer product, row by row.
  static constexpr auto products = [] {
    std::array<std::array<double, 10>, gauss_count> result{};
    for (std::size_t g = 0; g < gauss_count; ++g)
      for (std::size_t i = 0, n = 0; i < 4; ++i)
        for (std::size_t j = i; j < 4; ++j) result[g][n++] = weighted[g][i] * shapes[g][j];
    return result;
  }();

  const BeamProperties& properties_;
  const BeamMesh<dimension>& mesh_;
  const TissuePath<dimension>& path_;
  const BeamLoad<dimension>& load_;
  const ElementMatrix& bending_;
  bool cautious_;
  std::array<ElementMatrix, max_lateral_layers> uniform_;
  std::array<double, max_lateral_layers> stiffness_;
  std::size_t layer_ = 0;
};

/// A node of the tissue that yields follows the shaft to within a limit [m].
template <std::size_t dimension>
void push_aside(const BeamMesh<dimension>& mesh, std::size_t k, double limit,
                TissuePath<dimension>& path) noexcept {
  const double place = path.spacing * static_cast<double>(k) / mesh.h();
  const std::size_t e = std::min(static_cast<std::size_t>(place), mesh.embedded() - 1);
  const auto shaft = mesh.place_in(e, hermite(place - static_cast<double>(e)));
  auto& yielded = path.yielded_node(k);
  double square = 0.0;
  for (std::size_t d = 0; d < dimension; ++d) square += (shaft[d] - yielded[d]) * (shaft[d] - yielded[d]);
  if (!(square > limit * limit)) return;
  const double share = 1.0 - limit / std::sqrt(square);
  for (std::size_t d = 0; d < dimension; ++d) yielded[d] += share * (shaft[d] - yielded[d]);
}

/// Tissue whose strength the shaft exceeds is pushed aside, until it is no longer exceeded. Wait-free.
template <std::size_t dimension>
void push_aside(const BeamProperties& beam, const BeamMesh<dimension>& mesh,
                TissuePath<dimension>& path) noexcept {
  if (mesh.embedded() == 0) return;
  std::size_t k = 0;
  for (std::size_t layer = 0; layer < beam.layer_count; ++layer) {
    const bool below = layer + 1 < beam.layer_count;
    const std::size_t end =
        std::min(path.nodes(), below ? path.first_node(beam.layers[layer + 1].top) : path.nodes());
    if (!beam.layers[layer].yields()) k = std::max(k, end);
    const double limit = beam.layers[layer].yield_offset();
    for (; k < end && path.spacing * static_cast<double>(k) < mesh.tip().travel; ++k)
      push_aside(mesh, k, limit, path);
  }
}

}  // namespace needleforce::bending
