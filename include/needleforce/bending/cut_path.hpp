// SPDX-License-Identifier: Apache-2.0
// The path that the tip has cut, as lateral positions over the travel in tissue.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "../state_check.hpp"

namespace needleforce::bending {

/// Nodes at fixed places in the tissue, and the front, which the tip writes. Between nodes the path is
/// straight; from the last node to the front it is a parabola through the node before, so that a front close
/// to a node never extrapolates.
template <std::size_t dimension, std::size_t capacity>
class CutPath {
 public:
  using Place = std::array<double, dimension>;

  /// How the path at one place follows from the last two nodes and the front.
  struct Newest {
    double before, last, front;  ///< weights
  };

  explicit CutPath(double apart = 1e-4) noexcept : spacing(apart), per_spacing_(1.0 / apart) {}

  double spacing;  ///< of the nodes [m]

  /// Deepest travel [m] that has room. Wait-free.
  double longest() const noexcept { return spacing * static_cast<double>(capacity - 1); }
  bool empty() const noexcept { return count_ == 0; }
  /// Travel [m] of the last node. Wait-free.
  double last_node() const noexcept { return spacing * static_cast<double>(count_ - 1); }
  /// Travel [m] where the next node will be. Wait-free.
  double next_node() const noexcept { return spacing * static_cast<double>(count_); }
  /// Deepest travel [m] of the tip. Wait-free.
  double front() const noexcept { return front_; }
  const Place& front_place() const noexcept { return front_place_; }
  const Place& entry() const noexcept { return nodes_[0]; }
  /// A node by its number from the surface. Wait-free.
  const Place& node(std::size_t number) const noexcept { return nodes_[number]; }
  std::size_t nodes() const noexcept { return count_; }

  void clear() noexcept { count_ = 0, front_ = 0.0; }

  /// Looks at a path from outside: it has nodes so far `apart` [m] and ends after the last of them.
  /// Wait-free.
  void check(StateCheck& check, double apart) const noexcept {
    check.require("path.spacing", spacing == apart && per_spacing_ == 1.0 / apart);
    check.require("path.count", count_ <= capacity);
    check.require("path.front", count_ == 0
                                    ? front_ == 0.0
                                    : front_ >= last_node() - spacing && front_ <= next_node() + spacing);
    check.numbers("path.nodes", nodes_);
    check.numbers("path.yielded", yielded_);
    check.numbers("path.front_place", front_place_);
    check.numbers("path.directions", directions_);
    check.numbers("path.turns", turns_);
  }

  /// Writes the front, and the nodes to which it comes: a tip that is close to one counts as there. The first
  /// has the direction of the needle that enters. Wait-free.
  void write(double travel, const Place& place, const Place& entering = {}) noexcept {
    while (count_ < capacity && travel >= next_node() - close * spacing) {
      const Place node = count_ > 0 ? newest_place(next_node(), travel, place) : place;
      turn(node, entering);
      yielded_[count_] = node;
      nodes_[count_++] = node;
    }
    front_ = travel;
    front_place_ = place;
  }
  static constexpr double close = 1e-3;     ///< to a node, in spacings
  static constexpr double sharpest = 50.0;  ///< curvature that the direction of the path follows [1/m]
  static constexpr double taken_up = 0.02;  ///< share of a node that its direction takes up
  /// The slope of the path at a travel [m]: that of its nodes, without the steps that a tip leaves which is
  /// moved aside at rest. Wait-free.
  Place direction(double travel) const noexcept {
    if (count_ < 2) return {};
    const double place = std::clamp(travel * per_spacing_, 0.0, static_cast<double>(count_ - 1));
    const std::size_t k = std::min(static_cast<std::size_t>(static_cast<long>(place)), count_ - 2);
    return along(directions_, k, place - static_cast<double>(k));
  }
  /// The weights of the last two nodes and the front for a place between the last node and a front at
  /// `front`. Wait-free.
  Newest newest(double travel, double front) const noexcept {
    const double last = last_node(), length = front - last;
    const double t = length > 0.0 ? (travel - last) / length : 1.0;
    if (count_ < 2) return {0.0, 1.0 - t, t};
    const double reach = travel - last + spacing;
    return {-(1.0 - t) * length * (travel - last) / (spacing * (length + spacing)),
            (1.0 - t) * reach / spacing, t * reach / (length + spacing)};
  }
  /// The path [m] at a travel between the surface and the last node. Wait-free.
  Place between_nodes(double travel) const noexcept { return between(nodes_, travel); }
  /// The same for the tissue that yields, in a layer from `top` to `bottom` [m]: it is where the tip cut it
  /// until the shaft pushes it aside. Layers yield by different offsets: each has its own nodes alone.
  Place yielded(double travel, double top, double bottom) const noexcept {
    if (!(travel < last_node())) return at(travel);
    const std::size_t first = first_node(top), end = std::min(first_node(bottom), count_);
    if (first + 1 >= end) return first < end ? yielded_[first] : at(travel);
    const double place = std::max(0.0, travel) * per_spacing_;
    const std::size_t k = std::clamp(static_cast<std::size_t>(place), first, end - 2);
    return along(yielded_, k, place - static_cast<double>(k));
  }
  /// Number of the first node at or below a travel [m]. Wait-free.
  std::size_t first_node(double travel) const noexcept {
    const double place = std::max(0.0, travel) * per_spacing_ - 1e-6;
    return place < static_cast<double>(capacity) ? static_cast<std::size_t>(std::max(0.0, place + 1.0))
                                                 : capacity;
  }
  Place& yielded_node(std::size_t number) noexcept { return yielded_[number]; }
  /// The path [m] at a travel between the surface and the front. Wait-free.
  Place at(double travel) const noexcept {
    const double place = std::max(0.0, travel) * per_spacing_;
    const std::size_t k = static_cast<std::size_t>(place);
    return k + 1 < count_ ? between_nodes(std::max(0.0, travel)) : behind_front(travel);
  }

 private:
  using Nodes = std::array<Place, capacity>;
  Place between(const Nodes& nodes, double travel) const noexcept {
    const double place = travel * per_spacing_;
    const std::size_t k = static_cast<std::size_t>(static_cast<long>(place));
    return along(nodes, k, place - static_cast<double>(static_cast<long>(place)));
  }
  static Place along(const Nodes& nodes, std::size_t k, double t) noexcept {
    Place result;
    for (std::size_t d = 0; d < dimension; ++d) result[d] = nodes[k][d] + t * (nodes[k + 1][d] - nodes[k][d]);
    return result;
  }
  Place behind_front(double travel) const noexcept {
    return newest_place(std::min(travel, front_), front_, front_place_);
  }
  /// The parabola through the last two nodes and a front.
  Place newest_place(double travel, double front, const Place& front_place) const noexcept {
    const Newest weights = newest(travel, front);
    const Place& last = nodes_[count_ - 1];
    const Place& before = count_ < 2 ? last : nodes_[count_ - 2];
    Place result;
    for (std::size_t d = 0; d < dimension; ++d)
      result[d] = weights.before * before[d] + weights.last * last[d] + weights.front * front_place[d];
    return result;
  }

  void turn(const Place& node, const Place& entering) noexcept {
    if (count_ == 0) {
      directions_[0] = entering;
      return;
    }
    // A force along a chord moves the next node: directions follow a few millimetres of chords, a path that
    // turns evenly without lag.
    Place turned;
    double square = 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      turned[d] = taken_up *
                  ((node[d] - nodes_[count_ - 1][d]) * per_spacing_ - directions_[count_ - 1][d] - turns_[d]);
      square += turned[d] * turned[d];
    }
    const double most = sharpest * spacing, share = square > most * most ? most / std::sqrt(square) : 1.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      directions_[count_][d] = directions_[count_ - 1][d] + turns_[d] + share * turned[d];
      turns_[d] = std::clamp(turns_[d] + 0.25 * taken_up * share * turned[d], -most, most);
    }
  }

  Nodes nodes_{}, yielded_{}, directions_{};
  double per_spacing_;
  std::size_t count_ = 0;
  double front_ = 0.0;
  Place front_place_{}, turns_{};  // how the direction turns from node to node
};

}  // namespace needleforce::bending
