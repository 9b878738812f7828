// SPDX-License-Identifier: Apache-2.0
// Many insertions at a time: of one model, or each of its own.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "../insertion.hpp"
#include "batch_rows.hpp"
#include "contact_rows.hpp"
#include "plain_columns.hpp"
#include "plain_step.hpp"

namespace needleforce {

/// n insertions that are stepped together, each with the values of an `Insertion` of its own. Allocates when
/// it is made and when it is copied; a step allocates nothing. Different members may be stepped by different
/// threads.
class InsertionBatch {
  using Stacks = std::vector<std::vector<Layer>>;

 public:
  /// n insertions into the same layers.
  InsertionBatch(std::span<const Layer> layers, std::size_t n, const Limits& limits = {},
                 const Bevel& bevel = {})
      : InsertionBatch(Stacks(1, std::vector<Layer>(layers.begin(), layers.end())), n, true, limits, bevel) {}
  /// One insertion for each of several stacks of layers.
  explicit InsertionBatch(Stacks stacks, const Limits& limits = {}, const Bevel& bevel = {})
      : InsertionBatch(std::move(stacks), 0, false, limits, bevel) {}

  std::size_t size() const noexcept { return size_; }
  /// Memory that it takes [B].
  std::size_t bytes() const noexcept {
    const std::size_t columns = laws_.layers.size();
    return sizeof(double) * size_ * (7 + 2 * columns) + laws_.bytes() +
           layers_.size() * columns * sizeof(Layer) + prepared_.size() * sizeof(PreparedInsertion) +
           states_.size() * sizeof(InsertionState);
  }
  /// True where members are stepped several at a time.
  bool plain() const noexcept { return plain_; }

  /// One cycle of all members.
  void step(const BatchMove& move, const BatchSamples& out) noexcept { step(move, out, 0, size_); }
  /// One cycle of the members from..to.
  void step(const BatchMove& move, const BatchSamples& out, std::size_t from, std::size_t to) noexcept {
    run(move, 1, out, from, to);
  }
  /// Whole motions of the members from..to: so many steps, of which `out` takes the force alone.
  void run(const BatchMove& motion, std::size_t steps, const BatchSamples& out, std::size_t from,
           std::size_t to) noexcept {
    if (plain_) return run_lanes(motion, steps, out, from, to);
    for (std::size_t i = from; i < to; ++i)
      for (std::size_t t = 0; t < steps; ++t)
        out.put(
            i,
            prepared(i).step(states_[i], motion.depths(t)[i], motion.velocity_of(i, t), motion.dt_of(i, t)),
            t);
  }
  /// Steps no more than so many members at a time, 1, 2 or 4: with the same values, for comparisons.
  void narrow(std::size_t lanes) noexcept {
    lanes_ = std::min(lanes_, std::size_t{lanes > 3 ? 4u : lanes > 1 ? 2u : 1u});
  }

  /// Back to before the first contact.
  void reset(std::size_t i) noexcept { return_to(i, InsertionState{}); }
  /// What a member remembers, and back to it.
  InsertionState state(std::size_t i) const noexcept {
    return plain_ ? columns_.state(i, laws_, law_of(i)) : states_[i];
  }
  void return_to(std::size_t i, const InsertionState& state) noexcept {
    if (plain_)
      columns_.remember(i, state);
    else
      states_[i] = state;
  }

  /// The member as it is in another batch of the same models, with the limits and the bevel of this one;
  /// false and unchanged if that one has others.
  bool restore(std::size_t i, const InsertionBatch& saved) noexcept {
    if (!of_same_models(saved)) return false;
    return_to(i, saved.state(i));
    return true;
  }
  /// The same of all members.
  bool restore(const InsertionBatch& saved) noexcept {
    if (!of_same_models(saved)) return false;
    if (plain_ && saved.plain_)
      columns_ = saved.columns_;
    else
      for (std::size_t i = 0; i < size_; ++i) return_to(i, saved.state(i));
    return true;
  }
  bool of_same_models(const InsertionBatch& other) const noexcept {
    return models_ == other.models_ && size_ == other.size_;
  }

  /// Gives a member another model and returns it to before the first contact; the others continue. False and
  /// unchanged if there is no such member or the model is invalid. Allocates; not while another thread steps.
  bool replace(std::size_t i, std::span<const Layer> layers) {
    if (i >= size_ || first_fault(layers).reason) return false;
    if (same_) separate();
    const Stacks stack(1, std::vector<Layer>(layers.begin(), layers.end()));
    if (plain_ && !(layers.size() == laws_.layers.size() && are_plain(stack, limits_, bevel_)))
      leave_columns();
    models_ -= at_its_place(i);
    prints_[i] = fingerprint(layers);
    models_ += at_its_place(i);
    if (plain_) {
      laws_.put(i, layers, same_tip(layers, layers_[i]) ? laws_.tips[i] : table(layers));
      layers_[i] = stack[0];
    } else {
      prepared_[i] = PreparedInsertion(layers, limits_, bevel_);
    }
    reset(i);
    return true;
  }

 private:
  InsertionBatch(Stacks stacks, std::size_t n, bool same, const Limits& limits, const Bevel& bevel)
      : size_(same ? n : stacks.size()),
        same_(same),
        limits_(limits),
        bevel_(bevel),
        lateral_ratio_(bevel.lateral_ratio()),
        plain_(are_plain(stacks, limits, bevel)),
        columns_(plain_ ? size_ : 0, plain_ ? stacks[0].size() : 0),
        laws_(0, 0) {
    for (const auto& stack : stacks) prints_.push_back(fingerprint(stack));
    add_up();
    if (!plain_) {
      states_.resize(size_);
      for (const auto& stack : stacks) prepared_.emplace_back(stack, limits, bevel);
      return;
    }
    layers_ = std::move(stacks);
    find_laws();
    if (same) prepared_.push_back(prepared_again(0));
  }

  /// Members next to each other with the same tip have one table.
  void find_laws() {
    laws_ = PlainLaws(same_ ? most_lanes : size_, layers_.empty() ? 0 : layers_[0].size());
    for (std::size_t i = 0; i < laws_.tips.size(); ++i) {
      const auto &stack = layers_[same_ ? 0 : i], &above = layers_[same_ || i == 0 ? 0 : i - 1];
      laws_.put(i, stack, i > 0 && same_tip(stack, above) ? laws_.tips[i - 1] : table(stack));
    }
  }
  static PlainLaws::Tip table(std::span<const Layer> layers) {
    return std::make_shared<const TipTable>(table_of_tip(layers));
  }
  /// The layers of a member in columns, of which the table, which takes longest, was made before.
  PreparedInsertion prepared_again(std::size_t i) const noexcept {
    return PreparedInsertion(layers_[i], limits_, bevel_, laws_.tips[i].get());
  }
  std::size_t law_of(std::size_t i) const noexcept { return same_ ? 0 : i; }

  /// What a model adds to the number that distinguishes all of them.
  std::uint64_t at_its_place(std::size_t i) const noexcept {
    Fingerprint print;
    print.add(prints_[i]);
    print.add(static_cast<std::uint64_t>(i));
    return print.value();
  }
  void add_up() noexcept {
    models_ = 0;
    for (std::size_t i = 0; i < prints_.size(); ++i) models_ += at_its_place(i);
  }
  /// Each member gets a copy of the model of all.
  void separate() {
    same_ = false;
    if (plain_) {
      const std::vector<Layer> all = layers_[0];
      layers_.assign(size_, all);
      find_laws();
      prepared_.clear();
    } else {
      const PreparedInsertion all = prepared_[0];
      prepared_.assign(size_, all);
    }
    const std::uint64_t of_all = prints_[0];
    prints_.assign(size_, of_all);
    add_up();
  }
  /// From columns to members that are stepped one after the other, for laws that do not stand in columns.
  void leave_columns() {
    for (std::size_t i = 0; i < size_; ++i) {
      states_.push_back(state(i));
      prepared_.push_back(prepared_again(i));
    }
    plain_ = false;
    columns_ = PlainColumns(0, 0);
    laws_ = PlainLaws(0, 0);
    layers_.clear();
  }

  static bool are_plain(const Stacks& stacks, const Limits& limits, const Bevel& bevel) {
    return detail::lanes_here() > 0 && valid(limits) && !first_invalid(bevel) && limits.depth_noise == 0.0 &&
           limits.hold_time == 0.0 && !stacks.empty() && std::ranges::all_of(stacks, [&](const auto& stack) {
             return stack.size() == stacks[0].size() && !first_fault(stack).reason &&
                    std::ranges::all_of(stack,
                                        [](const Layer& each) { return needleforce::plain(each.laws); });
           });
  }
  const PreparedInsertion& prepared(std::size_t i) const noexcept { return prepared_[same_ ? 0 : i]; }

  /// Steps several members at a time. While one of them is not pierced, its contacts are found before its
  /// steps.
  void run_lanes(const BatchMove& motion, std::size_t steps, const BatchSamples& out, std::size_t from,
                 std::size_t to) noexcept {
    const bool one = laws_.layers.size() == 1;
    const auto kernel = out.force_alone
                            ? (one ? detail::plain_steps<true, false> : detail::plain_steps<false, false>)
                            : (one ? detail::plain_steps<true, true> : detail::plain_steps<false, true>);
    const detail::PlainLimits limits = this->limits();
    const bool may_be_usual = one && out.force_alone && motion.same_dt && !motion.velocity;
    detail::ContactRows rows;
    detail::PlainTask task{motion, out, limits, laws_, columns_, {}, from, 0, 0, 0};
    for (std::size_t width; task.at < to; task.at += width) {
      width = to - task.at < lanes_ ? 1 : lanes_;
      task.law = law_of(task.at), task.usual = may_be_usual;
      for (task.from = 0; task.from < steps;) {
        task.contacts = rows.find(task, width, steps);
        const auto [reached, rare] = kernel(width, task);
        if (rare) step_alone(task, reached - 1, rare);
        task.usual = may_be_usual && reached == task.to;
        task.from = reached;
      }
    }
  }
  detail::PlainLimits limits() const noexcept {
    return {std::min(limits_.max_speed, fastest), limits_.velocity_slack, limits_.velocity_slack_ratio,
            lateral_ratio_};
  }
  /// Steps the members of which `rare` has a bit.
  [[gnu::noinline]] void step_alone(const detail::PlainTask& task, std::size_t t, unsigned rare) noexcept {
    for (std::size_t i = task.at; rare; ++i, rare >>= 1) {
      if (!(rare & 1u)) continue;
      InsertionState remembered = state(i);
      const auto stepped = [&](const PreparedInsertion& prepared) {
        return prepared.step(remembered, task.motion.depths(t)[i], task.motion.velocity_of(i, t),
                             task.motion.dt_of(i, t));
      };
      task.out.put(i, same_ ? stepped(prepared_[0]) : stepped(prepared_again(i)), t);
      columns_.remember(i, remembered);
    }
  }

  std::size_t size_;
  std::vector<std::uint64_t> prints_;  // a number that distinguishes each model
  std::uint64_t models_ = 0;           // and one of them together
  bool same_;
  Limits limits_;
  Bevel bevel_;
  double lateral_ratio_;
  bool plain_;
  std::size_t lanes_ = detail::lanes_here();
  PlainColumns columns_;
  PlainLaws laws_;
  Stacks layers_;
  std::vector<PreparedInsertion> prepared_;
  std::vector<InsertionState> states_;
};

}  // namespace needleforce
