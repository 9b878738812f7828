// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "layer_stack.hpp"
#include "module.hpp"
#include "needleforce/batch/insertion_batch.hpp"
#include "one_thread.hpp"
#include "parameters.hpp"

namespace needleforce::python {

namespace {

using Rows = nb::ndarray<double, nb::numpy, nb::ndim<2>, nb::c_contig>;
using GivenRows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Members = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

Rows new_rows(std::size_t rows, std::size_t n, double*& data) {
  data = new double[rows * n];
  nb::capsule owner(data, [](void* memory) noexcept { delete[] static_cast<double*>(memory); });
  return Rows(data, {rows, n}, owner);
}

/// Calls `work(from, to)` for parts of n members, each in a thread of its own.
template <class Work>
void shared(std::size_t n, std::size_t threads, const Work& work) {
  constexpr std::size_t least = 1024;  // members whose steps take longer than a thread to start
  const std::size_t parts = std::max<std::size_t>(1, std::min(threads, n / least));
  const std::size_t each = (n / parts + least) / least * least;
  std::vector<std::thread> others;
  for (std::size_t from = each; from < n; from += each)
    others.emplace_back([&work, from, to = std::min(n, from + each)] { work(from, to); });
  work(std::size_t{0}, std::min(n, each));
  for (std::thread& other : others) other.join();
}

void require(std::size_t found, std::size_t wanted, const char* quantity) {
  if (found != wanted)
    raise_input(std::string("the length of ") + quantity, nb::int_(found),
                "not that of the batch, " + std::to_string(wanted), "Give a number for each member.");
}

Rows step(InsertionBatch& batch, const Values& depth, const std::optional<Values>& velocity, const Values& dt,
          std::size_t threads) {
  const std::size_t n = batch.size();
  require(depth.shape(0), n, "depths");
  if (velocity) require(velocity->shape(0), n, "velocities");
  if (dt.shape(0) != 1) require(dt.shape(0), n, "dt");
  double* data;
  Rows rows = new_rows(batch_rows, n, data);
  const BatchMove move{depth.data(), velocity ? velocity->data() : nullptr, dt.data(), dt.shape(0) == 1};
  const Running running(&batch);
  nb::gil_scoped_release release;
  shared(n, threads, [&](std::size_t from, std::size_t to) { batch.step(move, {data, n}, from, to); });
  return rows;
}

/// Whole motions.
Rows run(InsertionBatch& batch, const GivenRows& depths, const Values& dt, std::size_t threads) {
  const std::size_t n = batch.size(), steps = depths.shape(0);
  require(depths.shape(1), n, "a row of depths");
  if (dt.shape(0) != steps)
    raise_input("the length of dt", nb::int_(dt.shape(0)),
                "not that of the motions, " + std::to_string(steps),
                "Give a number for each step, or one for all.");
  double* data;
  Rows rows = new_rows(steps, n, data);
  const Running running(&batch);
  nb::gil_scoped_release release;
  const BatchMove motion{depths.data(), nullptr, dt.data(), true, n};
  shared(n, threads,
         [&](std::size_t from, std::size_t to) { batch.run(motion, steps, {data, n, true}, from, to); });
  return rows;
}

/// Calls `change` for some members, or all.
template <class Change>
void each(const InsertionBatch& batch, const std::optional<Members>& members, const Change& change) {
  const auto n = static_cast<std::int64_t>(batch.size());
  for (std::size_t k = 0; members && k < members->shape(0); ++k)
    if (const std::int64_t i = members->data()[k]; i < 0 || i >= n)
      raise_input("member " + std::to_string(k), nb::int_(i), "not between 0 and " + std::to_string(n - 1),
                  "Count members from 0.");
  for (std::size_t k = 0; k < (members ? members->shape(0) : batch.size()); ++k)
    change(members ? static_cast<std::size_t>(members->data()[k]) : k);
}

}  // namespace

void bind_batch(nb::module_& module) {
  EngineClass<InsertionBatch>(module, "InsertionBatch", "Many insertions that are stepped together.")
      .def(
          "__init__",
          [](InsertionBatch* self, const std::vector<Stack>& models, std::optional<std::size_t> n,
             const Limits& limits, const Bevel& bevel) {
            std::vector<std::vector<Layer>> stacks;
            for (const Stack& each : models) stacks.push_back(stacked(each));
            if (n)
              new (self) InsertionBatch(stacks.at(0), *n, limits, bevel);
            else
              new (self) InsertionBatch(std::move(stacks), limits, bevel);
          },
          nb::arg("models"), nb::arg("n").none(), nb::arg("limits") = Limits{}, nb::arg("bevel") = Bevel{})
      .def(
          "__init__",
          [](InsertionBatch* self, const InsertionBatch& other) { new (self) InsertionBatch(other); },
          nb::arg("other"))
      .def("_step", &step, nb::arg("depths"), nb::arg("velocities").none(), nb::arg("dt"), nb::arg("threads"),
           "Rows of the samples' numbers.")
      .def("_run", &run, nb::arg("depths"), nb::arg("dt"), nb::arg("threads"), "The forces [N], as depths.")
      .def("_narrow", &InsertionBatch::narrow, nb::arg("lanes"),
           "Steps no more than so many members at a time, with the same values.")
      .def(
          "_reset",
          [](InsertionBatch& self, const std::optional<Members>& members) {
            each(self, members, [&](std::size_t i) { self.reset(i); });
          },
          nb::arg("members").none(), "Back to before the first contact.")
      .def(
          "_restore",
          [](InsertionBatch& self, const InsertionBatch& saved, const std::optional<Members>& members) {
            if (!self.of_same_models(saved))
              raise_input("snapshot", nb::str("of other models"), "not of this batch",
                          "Give what snapshot() of this batch gave, or of one made of the same models.");
            if (members)
              each(self, members, [&](std::size_t i) { self.restore(i, saved); });
            else
              self.restore(saved);
          },
          nb::arg("saved"), nb::arg("members").none(), "Back to a copy.")
      .def(
          "_replace",
          [](InsertionBatch& self, std::int64_t i, const Stack& model) {
            const auto n = static_cast<std::int64_t>(self.size());
            if (i < 0 || i >= n)
              raise_input("member", nb::int_(i), "not between 0 and " + std::to_string(n - 1),
                          "Count members from 0.");
            self.replace(static_cast<std::size_t>(i), stacked(model));
          },
          nb::arg("member"), nb::arg("model"), "Another model for a member.")
      .def_prop_ro("nbytes", &InsertionBatch::bytes, "Memory that it takes [B].")
      .def("__len__", &InsertionBatch::size);
}

}  // namespace needleforce::python
