// SPDX-License-Identifier: Apache-2.0
// A chain of 2 x 2 blocks, eliminated from both ends.
#pragma once

#include <array>
#include <cstddef>

#include "beam_element.hpp"

namespace needleforce::bending {

/// Deflection and rotation of a node, in the plane (1) or in space (2).
template <std::size_t dimension>
struct NodeValue {
  std::array<double, dimension> y, r;
};

/// The linear equations of up to `capacity` nodes, each of which knows its two neighbours, for one or two
/// right-hand sides with the same matrix.
template <std::size_t dimension, std::size_t capacity>
class BlockChain {
 public:
  using Value = NodeValue<dimension>;

  /// Empties the equations of `count` nodes. Wait-free.
  void clear(std::size_t count) noexcept {
    count_ = count;
    for (std::size_t i = 0; i < count; ++i) {
      diagonal[i] = upper[i] = lower[i] = Block{};
      value[i] = Value{};
    }
  }
  /// Adds an element between nodes i and i + 1.
  void add(std::size_t i, const ElementMatrix& element) noexcept {
    diagonal[i] += element.first;
    upper[i] += element.upper;
    lower[i] += element.lower;
    diagonal[i + 1] += element.second;
  }
  /// Solves in place: `value` holds the right-hand side before and the solution after. False if a block that
  /// was eliminated is not positive definite: the structure has lost its stability. Wait-free.
  bool solve() noexcept {
    const std::size_t middle = count_ / 2, last = count_ - 1;
    bool stable = true;
    // both halves in one loop: neither waits for the other
    for (std::size_t i = 0, j = last; i < middle || j > middle;) {
      if (i < middle) stable &= eliminate(i, upper[i], i + 1, lower[i]), ++i;
      if (j > middle) stable &= eliminate(j, lower[j - 1], j - 1, upper[j - 1]), --j;
    }
    Block inverse;
    stable &= invert(diagonal[middle], inverse);
    value[middle] = times(inverse, value[middle]);
    for (std::size_t i = middle, j = middle; i > 0 || j < last;) {
      if (i > 0) subtract(upper[i - 1], value[i], value[i - 1]), --i;
      if (j < last) subtract(lower[j], value[j], value[j + 1]), ++j;
    }
    return stable;
  }

  /// After `solve`, the solution for a unit force on the last node alone. Wait-free.
  void unit_at_last(std::array<NodeValue<1>, capacity>& unit) const noexcept {
    const std::size_t middle = count_ / 2, last = count_ - 1;
    const auto at = [](const Block& block, const NodeValue<1>& of) {
      return NodeValue<1>{{block.yy * of.y[0] + block.yr * of.r[0]},
                          {block.ry * of.y[0] + block.rr * of.r[0]}};
    };
    NodeValue<1> load{{1.0}, {0.0}};
    for (std::size_t i = last;; --i) {
      Block inverse;
      invert(diagonal[i], inverse);
      unit[i] = at(inverse, load);
      if (i == middle) break;
      load = at(upper[i - 1], unit[i]);
      load = {{-load.y[0]}, {-load.r[0]}};
    }
    for (std::size_t i = middle; i > 0; --i) {
      const NodeValue<1> by = at(upper[i - 1], unit[i]);
      unit[i - 1] = {{-by.y[0]}, {-by.r[0]}};
    }
    for (std::size_t i = middle; i < last; ++i) {
      const NodeValue<1> by = at(lower[i], unit[i]);
      unit[i + 1].y[0] -= by.y[0];
      unit[i + 1].r[0] -= by.r[0];
    }
  }

  std::array<Block, capacity> diagonal, upper, lower;  // upper[i]: row i, column i + 1; lower[i]: reversed
  std::array<Value, capacity> value;

 private:
  static bool invert(const Block& block, Block& inverse) noexcept {
    const double determinant = block.yy * block.rr - block.yr * block.ry;
    const double one = 1.0 / determinant;
    inverse = {block.rr * one, -block.yr * one, -block.ry * one, block.yy * one};
    return determinant > 0.0 && block.yy > 0.0;
  }
  static Value times(const Block& block, const Value& value) noexcept {
    Value result;
    for (std::size_t d = 0; d < dimension; ++d) {
      result.y[d] = block.yy * value.y[d] + block.yr * value.r[d];
      result.r[d] = block.ry * value.y[d] + block.rr * value.r[d];
    }
    return result;
  }
  static void subtract(const Block& block, const Value& from, Value& value) noexcept {
    for (std::size_t d = 0; d < dimension; ++d) {
      value.y[d] -= block.yy * from.y[d] + block.yr * from.r[d];
      value.r[d] -= block.ry * from.y[d] + block.rr * from.r[d];
    }
  }
  static Block product(const Block& a, const Block& b) noexcept {
    return {a.yy * b.yy + a.yr * b.ry, a.yy * b.yr + a.yr * b.rr, a.ry * b.yy + a.rr * b.ry,
            a.ry * b.yr + a.rr * b.rr};
  }
  /// Removes node i from the equations of its neighbour: `across` is in its row, `back` in the neighbour's.
  /// `across` becomes what the solution of the neighbour takes from that of i.
  bool eliminate(std::size_t i, Block& across, std::size_t neighbour, const Block& back) noexcept {
    Block inverse;
    const bool stable = invert(diagonal[i], inverse);
    across = product(inverse, across);
    value[i] = times(inverse, value[i]);
    const Block less = product(back, across);
    diagonal[neighbour].yy -= less.yy, diagonal[neighbour].yr -= less.yr;
    diagonal[neighbour].ry -= less.ry, diagonal[neighbour].rr -= less.rr;
    subtract(back, value[i], value[neighbour]);
    return stable;
  }
  std::size_t count_ = 0;
};

}  // namespace needleforce::bending
