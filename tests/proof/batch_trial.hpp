// SPDX-License-Identifier: Apache-2.0
// The same model as members of a batch: each with the values of the engine, to the last bit but for the sign
// of a zero, also where one was put back.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "needleforce/batch/insertion_batch.hpp"
#include "planted.hpp"

namespace needleforce::proof {

class BatchTrial {
 public:
  BatchTrial(std::span<const Layer> layers, const Limits& limits, const Bevel& bevel)
      : same_(layers, members, limits, bevel),
        own_(std::vector(members, std::vector<Layer>(layers.begin(), layers.end())), limits, bevel),
        moved_(same_),
        kept_(same_) {
    own_.narrow(2);
  }

  void reset() {
    for (std::size_t i = 0; i < members; ++i) same_.reset(i), own_.reset(i), moved_.reset(i);
  }
  void keep() { kept_ = same_; }
  void restore() {
    for (std::size_t i = 0; i < members; ++i)
      require(same_.restore(i, kept_) && own_.restore(i, kept_) == own_.of_same_models(kept_),
              "a member is put back"),
          own_.return_to(i, kept_.state(i));
    require(moved_.restore(kept_), "all members are put back");
  }
  /// `numbers` are those of the engine's sample.
  void step(double depth, double velocity, double dt, const std::array<double, batch_rows>& numbers) {
    std::array<double, members> depths, velocities;
    depths.fill(depth), velocities.fill(velocity);
    const BatchMove move{depths.data(), velocities.data(), &dt, true};
    // of whole motions, which have no velocities of their own
    const bool alone = velocity == no_velocity;
    moved_.run({depths.data(), alone ? nullptr : velocities.data(), &dt, true, members}, 1,
               {rows_.data(), members, true}, 0, members);
    for (std::size_t i = 0; i < members; ++i)
      require(rows_[i] == numbers[static_cast<std::size_t>(BatchRow::force)], "a motion has the same force");
    for (InsertionBatch* batch : {&same_, &own_}) {
      batch->step(move, {rows_.data(), members});
      for (std::size_t k = 0; k < batch_rows; ++k)
        for (std::size_t i = 0; i < members; ++i)
          require(rows_[k * members + i] == numbers[k], "a member of a batch has the values of an insertion");
    }
  }

 private:
  static constexpr std::size_t members = 6;  // more than are worked on at a time, and not whole lanes
  InsertionBatch same_, own_, moved_, kept_;
  std::array<double, batch_rows * members> rows_{};
};

}  // namespace needleforce::proof
