// SPDX-License-Identifier: Apache-2.0
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <vector>

#include "module.hpp"
#include "needleforce/bending/tip_estimator.hpp"
#include "one_thread.hpp"
#include "parameters.hpp"

namespace needleforce::python {

namespace {

using bending::PathUncertainty;
using bending::SpatialInsertion;
using bending::TipEstimate;
using bending::TipEstimator;

using Pairs = nb::ndarray<const double, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;

void expect(TipEstimator& self, const Pairs& errors, double spacing) {
  std::vector<TipEstimator::Plane> nodes(errors.shape(0));
  for (std::size_t k = 0; k < nodes.size(); ++k) nodes[k] = {errors.data()[2 * k], errors.data()[2 * k + 1]};
  if (!self.expect(nodes, spacing))
    raise_input("errors or their spacing", nb::float_(spacing),
                "not finite, above 1 m, or closer than 1e-6 m",
                "Give errors [m] at depths every `spacing` [m].");
}

Output modes_of(const TipEstimator& self) {
  double* data;
  Output array = new_array(self.modes(), data);
  for (std::size_t m = 0; m < self.modes(); ++m) data[m] = self.mode(m);
  return array;
}

Table shape_of(const TipEstimator& self) {
  std::vector<double> points;
  self.shape([&](const bending::Vector& point) { points.insert(points.end(), point.begin(), point.end()); });
  double* data;
  auto rows = new_rows(points.size() / 3, 3, data);
  std::copy(points.begin(), points.end(), data);
  return rows;
}

}  // namespace

void bind_estimator(nb::module_& module) {
  bind_parameters<PathUncertainty>(module, "PathUncertainty");
  nb::class_<TipEstimate>(module, "TipEstimate", "Where the tip is, and how sure that is.")
      .def_prop_ro(
          "tip", [](const TipEstimate& self) { return as_array(self.tip); }, nb::rv_policy::move)
      .def_prop_ro(
          "slope", [](const TipEstimate& self) { return as_array(self.slope); }, nb::rv_policy::move)
      .def_ro("covariance", &TipEstimate::covariance, "xx, xy, yy [m^2]")
      .def_ro("sample", &TipEstimate::sample, "of the likeliest needle");
  EngineClass<TipEstimator>(module, "TipEstimator", "Tip and shape estimated in the loop.")
      .def(
          "__init__",
          [](TipEstimator* self, const SpatialInsertion& likely, const std::vector<SpatialInsertion>& varied,
             const PathUncertainty& uncertainty) { new (self) TipEstimator(likely, varied, uncertainty); },
          nb::arg("likely"), nb::arg("varied"), nb::arg("uncertainty"))
      .def("expect", &expect, nb::arg("errors"), nb::arg("spacing"))
      .def(
          "step",
          [](TipEstimator& self, double depth, const std::array<double, 2>& lateral,
             const std::array<double, 2>& tilt, double roll,
             double dt) { return self.step(bending::Base{depth, lateral, tilt, roll}, dt); },
          nb::arg("depth"), nb::arg("lateral"), nb::arg("tilt"), nb::arg("roll"), nb::arg("dt"))
      .def(
          "tip",
          [](TipEstimator& self, const std::array<double, 2>& across, double age,
             const std::vector<double>& slopes) {
            if (slopes.size() != 2) return self.tip(across, age);
            const TipEstimator::Plane both{slopes[0], slopes[1]};
            return self.tip(across, age, &both);
          },
          nb::arg("across"), nb::arg("age"), nb::arg("slopes"))
      .def("wrench", &TipEstimator::wrench, nb::arg("reading"))
      .def("estimate", &TipEstimator::estimate)
      .def("shape", &shape_of, "(n, 3) points of the needle from the base to the tip [m]")
      .def("modes", &modes_of, "(k,) in standard deviations")
      .def("rejected", &TipEstimator::rejected)
      .def("reset", &TipEstimator::reset);
}

}  // namespace needleforce::python
