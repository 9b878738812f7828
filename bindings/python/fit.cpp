// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>
#include <memory>
#include <string_view>
#include <vector>

#include "module.hpp"
#include "needleforce/fit/cycle.hpp"
#include "needleforce/fit/dead_band.hpp"
#include "needleforce/fit/lagged.hpp"
#include "needleforce/fit/layered.hpp"

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
  dict["backtrack"] = r.backtrack;
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

/// Forces (rows, n) [N], one for each row of numbers: those of a layer, then of relaxation.
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
    for (std::size_t k = 0; k < rows; ++k) {
      Row row;
      std::memcpy(&row, numbers.data() + k * numbers.shape(1), sizeof row);
      fit::layer_force(row.layer, row.relaxation, form, {depth.data(), n}, {dt.data(), n}, forces + k * n);
    }
  }
  return {flat.data(), {rows, n}, nb::cast(flat)};
}

}  // namespace

void bind_fit(nb::module_& module) {
  module.def("fit_cycle", &fit_cycle, nb::arg("depth_in"), nb::arg("force_in"), nb::arg("depth_out"),
             nb::arg("force_out"), nb::arg("saturation"), nb::arg("free_saturation"), nb::arg("leave_out"),
             nb::arg("puncture_low"), nb::arg("puncture_high"), nb::arg("margin"));
  module.def("layer_forces", &layer_forces, nb::arg("numbers"), nb::arg("form"), nb::arg("depth"),
             nb::arg("dt"));
  module.def("dead_band", &dead_band, nb::arg("depth"), nb::arg("half"));
  module.def("lagged_products", &lagged_products, nb::arg("residual"), nb::arg("lags"));
}

}  // namespace needleforce::python
