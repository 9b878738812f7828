// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/pair.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "fit/cycle.hpp"
#include "fit/dead_band.hpp"
#include "fit/lagged.hpp"
#include "fit/layered.hpp"
#include "fit/layered_search.hpp"
#include "module.hpp"

namespace nb = nanobind;

namespace needleforce::python {

namespace {

fit::Stroke stroke(const Values& depth, const Values& force) {
  if (depth.shape(0) != force.shape(0)) throw nb::value_error("depth and force differ in length");
  return {{depth.data(), depth.shape(0)}, {force.data(), force.shape(0)}};
}

const char* word(fit::Outcome outcome) {
  if (outcome == fit::Outcome::found) return "found";
  return outcome == fit::Outcome::not_finite ? "not_finite" : "no_room";
}

nb::list numbers(const fit::Vector& values) {
  nb::list list;
  for (const double value : values) list.append(value);
  return list;
}

using Matrices = nb::ndarray<double, nb::numpy, nb::shape<3, fit::unknowns, fit::unknowns>, nb::c_contig>;

/// J'J of the insertion and of the withdrawal, both triangles, and the inverse of their sum. A friction held
/// at its bound counts as free here: its interval is one-sided, not nil.
Matrices matrices(const fit::CycleResult& r) {
  const fit::Normal &in = r.polished.insertion, &out = r.polished.withdrawal;
  const fit::Matrix bread =
      fit::inverse(r.polished.both(), {true, true, true, true, r.free[fit::saturation], true});
  double* data;
  const Output flat = new_array(3 * fit::unknowns * fit::unknowns, data);
  for (const fit::Matrix* matrix : {&in.gram, &out.gram, &bread})
    for (std::size_t i = 0; i < fit::unknowns; ++i)
      for (std::size_t k = 0; k < fit::unknowns; ++k) *data++ = (*matrix)[std::max(i, k)][std::min(i, k)];
  return Matrices(flat.data(), {3, fit::unknowns, fit::unknowns}, nb::cast(flat));
}

nb::dict result_dict(const fit::CycleResult& r) {
  nb::list free;
  for (const bool value : r.free) free.append(value);
  nb::dict dict;
  dict["outcome"] = word(r.outcome);
  dict["unknowns"] = numbers(r.polished.x);
  dict["free"] = free;
  dict["matrices"] = matrices(r);
  dict["sse"] = r.polished.insertion.sse + r.polished.withdrawal.sse;
  dict["puncture"] = r.puncture;
  dict["admitted"] = nb::make_tuple(r.first, r.last);
  dict["first_gain"] = r.profile.first;
  dict["unconstrained_friction"] = r.unconstrained_friction;
  return dict;
}

nb::dict fit_cycle(const Values& depth_in, const Values& force_in, const Values& depth_out,
                   const Values& force_out, double saturation, bool free_saturation, std::size_t leave_out,
                   double puncture_low, double puncture_high, double margin) {
  const fit::Stroke in = stroke(depth_in, force_in), out = stroke(depth_out, force_out);
  if (in.size() == 0) throw nb::value_error("the insertion is empty");
  double *residual_in, *residual_out, *gain;
  Output residual_in_array = new_array(in.size(), residual_in);
  Output residual_out_array = new_array(out.size(), residual_out);
  const auto profile = std::make_unique_for_overwrite<double[]>(in.size());
  fit::CycleResult result;
  {
    nb::gil_scoped_release release;
    std::vector<fit::Row> rows(fit::workspace_rows(in.size(), out.size()));
    result =
        fit::fit_cycle(in, out, {saturation, free_saturation, leave_out, puncture_low, puncture_high, margin},
                       {profile.get(), in.size()}, rows);
    fit::residuals(in, out, result, residual_in, residual_out);
  }
  Output gain_array = new_array(result.profile.count, gain);
  std::copy_n(profile.get(), result.profile.count, gain);
  nb::dict dict = result_dict(result);
  dict["residual_in"] = residual_in_array;
  dict["residual_out"] = residual_out_array;
  dict["gain"] = gain_array;
  return dict;
}

Output lagged_products(const Values& residual, std::size_t lags) {
  double* products;
  Output array = new_array(lags + 1, products);
  nb::gil_scoped_release release;
  fit::lagged_products({residual.data(), residual.shape(0)}, {products, lags + 1});
  return array;
}

Output dead_band(const Values& depth, double half) {
  double* out;
  Output array = new_array(depth.shape(0), out);
  nb::gil_scoped_release release;
  fit::dead_band({depth.data(), depth.shape(0)}, half, {out, depth.shape(0)});
  return array;
}

using Rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

fit::LayeredForm form_of(std::string_view name) {
  if (name == "as_fitted") return fit::LayeredForm::as_fitted;
  if (name == "passive") return fit::LayeredForm::passive;
  if (name == "yielding") return fit::LayeredForm::yielding;
  throw nb::value_error("no such form of the layered law");
}

/// Forces (rows, n) [N], one for each row of parameters: those of a layer, then of relaxation.
nb::ndarray<nb::numpy, double, nb::ndim<2>, nb::c_contig> layer_forces(const Rows& numbers, const char* name,
                                                                       const Values& depth,
                                                                       const Values& dt) {
  struct Row {
    fit::LayerNumbers layer;
    fit::RelaxationNumbers relaxation;
  };
  const std::size_t rows = numbers.shape(0), n = depth.shape(0);
  if (numbers.shape(1) * sizeof(double) != sizeof(Row) || dt.shape(0) != n)
    throw nb::value_error("rows are not those of a layer, or depth and dt differ in length");
  const fit::LayeredForm form = form_of(name);
  double* forces;
  const Output flat = new_array(rows * n, forces);
  {
    nb::gil_scoped_release release;
    std::vector<fit::LayerStep> steps(n);
    for (std::size_t k = 0; k < rows; ++k) {
      Row row;
      std::memcpy(&row, numbers.data() + k * numbers.shape(1), sizeof row);
      fit::prepare_steps({depth.data(), n}, {dt.data(), n}, row.relaxation, steps.data());
      fit::PressedLayer pressed;
      fit::layer_force(row.layer, row.relaxation, form, steps, pressed, forces + k * n);
    }
  }
  return {flat.data(), {rows, n}, nb::cast(flat)};
}

using Problem = fit::LayeredProblem;
using Flags = nb::ndarray<const std::uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<nb::numpy, double, nb::ndim<2>, nb::c_contig>;

std::vector<double> copied(const Values& values) { return {values.data(), values.data() + values.shape(0)}; }

/// A new NumPy array with the values.
Output array_of(const std::vector<double>& values) {
  double* data;
  Output array = new_array(values.size(), data);
  std::copy(values.begin(), values.end(), data);
  return array;
}

Matrix matrix_of(const std::vector<double>& values, std::size_t rows) {
  const Output flat = array_of(values);
  return {flat.data(), {rows, rows ? values.size() / rows : 0}, nb::cast(flat)};
}

/// One repeat of depth [m], dt [s], force [N], weight [1/N], the logarithm of its speed, and columns of the
/// force zero.
fit::LayeredRun run_of(nb::handle given, const fit::LayeredSettings& settings) {
  const auto part = nb::cast<nb::tuple>(given);
  const auto depth = nb::cast<Values>(part[0]), dt = nb::cast<Values>(part[1]);
  fit::LayeredRun run;
  run.force = copied(nb::cast<Values>(part[2]));
  run.weight = copied(nb::cast<Values>(part[3]));
  run.log_speed = nb::cast<double>(part[4]);
  run.zero = copied(nb::cast<Values>(part[5]));
  const std::size_t n = depth.shape(0);
  if (n == 0 || dt.shape(0) != n || run.force.size() != n || run.weight.size() != n ||
      run.zero.size() % n != 0)
    throw nb::value_error("the arrays of a repeat differ in length");
  run.steps.resize(n);
  fit::prepare_steps({depth.data(), n}, {dt.data(), n}, {0.0, settings.time_1, 0.0, settings.time_2},
                     run.steps.data());
  return run;
}

/// Rows of what is known beforehand: place in x among the values of the layers, value and weight.
std::vector<fit::LayeredPrior> priors_of(const nb::list& rows, std::size_t layers) {
  std::vector<fit::LayeredPrior> priors;
  for (const nb::handle row : rows) {
    const auto given = nb::cast<nb::tuple>(row);
    priors.push_back(
        {nb::cast<std::size_t>(given[0]), nb::cast<double>(given[1]), nb::cast<double>(given[2])});
    if (priors.back().place >= fit::per_layer * layers) throw nb::index_error("no such value of a layer");
  }
  return priors;
}

void begin_problem(Problem* self, const char* form, std::size_t layers, std::pair<double, double> times,
                   double brittleness, double ridge, const nb::list& repeats, const nb::list& priors) {
  const fit::LayeredSettings settings{
      form_of(form), layers, times.first, times.second, brittleness, ridge, priors_of(priors, layers)};
  std::vector<fit::LayeredRun> runs;
  for (const nb::handle repeat : repeats) runs.push_back(run_of(repeat, settings));
  new (self) Problem(settings, std::move(runs));
}

Problem::X vector_of(const Problem& problem, const Values& x) {
  if (x.shape(0) != problem.size()) throw nb::value_error("x does not have the size of the problem");
  return copied(x);
}

void check_run(const Problem& problem, std::size_t run) {
  if (run >= problem.runs()) throw nb::index_error("no such repeat");
}

/// Forces (layers, n) [N] of the layers along a repeat.
Matrix forces(const Problem& problem, std::size_t run, const Values& x) {
  check_run(problem, run);
  const auto now = problem.evaluate(vector_of(problem, x));
  return matrix_of(now.forces[run], problem.layers());
}

Output residuals(const Problem& problem, std::size_t run, const Values& x) {
  check_run(problem, run);
  return array_of(problem.evaluate(vector_of(problem, x)).residuals[run]);
}

std::vector<std::uint8_t> flags_of(const Problem& problem, const Flags& free) {
  if (free.shape(0) != problem.size()) throw nb::value_error("flags do not have the size of the problem");
  return {free.data(), free.data() + free.shape(0)};
}

/// The places in x on which a repeat depends, and the derivatives (k, n) of its residuals.
nb::tuple jacobian(const Problem& problem, std::size_t run, const Values& x, const Flags& free) {
  check_run(problem, run);
  const auto vector = vector_of(problem, x);
  const auto places = problem.places(run, flags_of(problem, free));
  std::vector<double> columns;
  problem.jacobian(vector, run, places, problem.evaluate(vector), columns);
  nb::list list;
  for (const std::size_t place : places) list.append(place);
  return nb::make_tuple(list, matrix_of(columns, places.size()));
}

/// The x with the smallest cost, and the cost.
nb::tuple searched(const Problem& problem, const Values& x, const Flags& free, const Values& low,
                   const Values& high, std::size_t max_steps, bool scans) {
  const auto start = vector_of(problem, x);
  const fit::LayeredSearch search(problem, flags_of(problem, free),
                                  {vector_of(problem, low), vector_of(problem, high)});
  fit::LayeredSearch::Found found;
  {
    nb::gil_scoped_release release;
    found = scans ? search.settle(start, max_steps) : search.descend(start, max_steps);
  }
  return nb::make_tuple(array_of(found.x), found.cost);
}

Output squares_by_puncture(const Problem& problem, std::size_t run, std::size_t layer, const Values& x,
                           const Values& depths) {
  check_run(problem, run);
  if (layer >= problem.layers()) throw nb::index_error("no such layer");
  return array_of(
      problem.squares_by_puncture(vector_of(problem, x), run, layer, {depths.data(), depths.shape(0)}));
}

void bind_layered(nb::module_& module) {
  nb::class_<Problem>(module, "LayeredProblem")
      .def("__init__", &begin_problem, nb::arg("form"), nb::arg("layers"), nb::arg("times"),
           nb::arg("brittleness"), nb::arg("ridge"), nb::arg("repeats"), nb::arg("priors"))
      .def("forces", &forces, nb::arg("run"), nb::arg("x"))
      .def("residuals", &residuals, nb::arg("run"), nb::arg("x"))
      .def("jacobian", &jacobian, nb::arg("run"), nb::arg("x"), nb::arg("free"))
      .def(
          "cost", [](const Problem& problem, const Values& x) { return problem.cost(vector_of(problem, x)); },
          nb::arg("x"))
      .def("search", &searched, nb::arg("x"), nb::arg("free"), nb::arg("low"), nb::arg("high"),
           nb::arg("max_steps"), nb::arg("scans"))
      .def("squares_by_puncture", &squares_by_puncture, nb::arg("run"), nb::arg("layer"), nb::arg("x"),
           nb::arg("depths"));
}

}  // namespace

void bind_fit(nb::module_& module) {
  module.def("fit_cycle", &fit_cycle, nb::arg("depth_in"), nb::arg("force_in"), nb::arg("depth_out"),
             nb::arg("force_out"), nb::arg("saturation"), nb::arg("free_saturation"), nb::arg("leave_out"),
             nb::arg("puncture_low"), nb::arg("puncture_high"), nb::arg("margin"));
  module.def("layer_forces", &layer_forces, nb::arg("numbers"), nb::arg("form"), nb::arg("depth"),
             nb::arg("dt"));
  module.def("dead_band", &dead_band, nb::arg("depth"), nb::arg("half"));
  bind_layered(module);
  module.def("lagged_products", &lagged_products, nb::arg("residual"), nb::arg("lags"));
}

}  // namespace needleforce::python
