// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "layer_stack.hpp"
#include "module.hpp"
#include "needleforce/gradient/gradient_insertion.hpp"
#include "parameters.hpp"

namespace needleforce::python {

namespace {

constexpr std::size_t width = 8;  // derivatives at a time
using Steps = GradientInsertion<width>;
using Places = std::vector<std::tuple<std::size_t, std::size_t, std::size_t>>;
using Table = nb::ndarray<double, nb::numpy, nb::ndim<2>, nb::c_contig>;

/// A matrix of (rows, columns) doubles that owns its memory.
Table new_table(std::size_t rows, std::size_t columns, double*& data) {
  data = new double[rows * columns];
  nb::capsule owner(data, [](void* memory) noexcept { delete[] static_cast<double*>(memory); });
  return Table(data, {rows, columns}, owner);
}

/// An event with the sample it lies before, and a row of numbers for each part of the derivatives.
struct Row {
  Steps::Event first;
  std::size_t sample;
  std::vector<double> by_depth, before, after;
};

/// Adds some columns of the derivatives of all events; every pass over the motion finds the same events.
void add_columns(Row& row, const Steps::Event& event, std::size_t count) {
  const auto columns = static_cast<std::ptrdiff_t>(count);
  row.by_depth.insert(row.by_depth.end(), event.by_depth.begin(), event.by_depth.begin() + columns);
  row.before.insert(row.before.end(), event.before.begin(), event.before.begin() + columns);
  row.after.insert(row.after.end(), event.after.begin(), event.after.begin() + columns);
}

/// Adds the events of the last step, which took the needle to a sample.
[[gnu::noinline]] void collect(const Steps& steps, std::size_t sample, std::size_t count,
                               std::vector<Row>& events, std::size_t& found) {
  for (const auto& event : steps.events()) {
    if (found == events.size()) events.push_back({event, sample, {}, {}, {}});
    add_columns(events[found++], event, count);
  }
}

/// One pass: the force, and its derivatives along up to eight parameters into columns from `first` on. The
/// steps are inlined, so that nobody writes the parts of a force that this loop does not read.
[[gnu::flatten]] void pass(Steps& steps, const double* depth, const double* dt, std::size_t n, double* force,
                           double* gradient, std::size_t columns, std::size_t count,
                           std::vector<Row>& events) {
  std::size_t found = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Steps::Number now = steps.step(depth[i], no_velocity, dt[i]).force;
    force[i] = now.value;
    const auto by = now.derivatives();
    double* row = gradient + i * columns;
    count == width ? std::copy_n(by.data(), width, row) : std::copy_n(by.data(), count, row);  // all at once
    if (!steps.events().empty()) collect(steps, i, count, events, found);
  }
}

std::vector<Direction> directions(const Places& places) {
  std::vector<Direction> along;
  for (const auto& [layer, part, index] : places) along.push_back({layer, part, index});
  return along;
}

nb::list listed(const std::vector<Row>& events) {
  nb::list rows;
  for (const Row& row : events)
    rows.append(nb::make_tuple(force_event_names[static_cast<int>(row.first.kind)], row.first.layer,
                               row.sample, row.first.depth, row.first.jump, nb::cast(row.by_depth),
                               nb::cast(row.before), nb::cast(row.after)));
  return rows;
}

nb::tuple force_gradient(const Stack& stack, const Values& depth, const Values& dt, const Places& places) {
  const std::vector<Layer> layers = stacked(stack);
  const std::vector<Direction> along = directions(places);
  const std::size_t n = depth.shape(0), columns = along.size();
  double *force, *gradient;
  Output forces = new_array(n, force);
  Table table = new_table(n, columns, gradient);
  std::vector<Row> events;
  {
    nb::gil_scoped_release release;
    const Limits limits{.max_speed = std::numeric_limits<double>::infinity()};
    for (std::size_t first = 0; first == 0 || first < columns; first += width) {
      const std::size_t count = std::min(width, columns - first);
      const auto steps =
          std::make_unique<Steps>(layers, std::span<const Direction>(along).subspan(first, count), limits);
      pass(*steps, depth.data(), dt.data(), n, force, gradient + first, columns, count, events);
    }
  }
  return nb::make_tuple(forces, table, listed(events));
}

nb::list gradient_parameters(const Stack& stack) {
  const std::vector<Layer> layers = stacked(stack);
  nb::list rows;
  each_parameter(layers, [&](const Direction& at, const char* name) {
    rows.append(nb::make_tuple(at.layer, at.part, at.index, name));
  });
  return rows;
}

}  // namespace

void bind_gradient(nb::module_& module) {
  module.def("force_gradient", &force_gradient, nb::arg("layers"), nb::arg("depth"), nb::arg("dt"),
             nb::arg("along"), "Forces, their derivatives along parameters, and events.");
  module.def("gradient_parameters", &gradient_parameters, nb::arg("layers"),
             "(layer, part, index, name) of every parameter that a gradient may have.");
}

}  // namespace needleforce::python
