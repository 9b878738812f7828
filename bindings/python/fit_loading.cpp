// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "fit/loading.hpp"
#include "module.hpp"

namespace nb = nanobind;

namespace needleforce::python {

namespace {

using Curve = fit::LoadingResult (*)(const fit::Stroke&, const fit::LoadingSearch&,
                                     std::span<double>) noexcept;

Curve curve_of(std::string_view law) {
  if (law == "cone") return &fit::fit_loading<fit::ConeCurve>;
  if (law == "cone_cylinder") return &fit::fit_loading<fit::ConeCylinderCurve>;
  if (law == "power_law") return &fit::fit_loading<fit::PowerCurve>;
  if (law == "polynomial") return &fit::fit_loading<fit::PolynomialCurve>;
  if (law == "exponential") return &fit::fit_loading<fit::ExponentialCurve>;
  throw nb::value_error("no such loading curve");
}

/// Amplitudes, contact depth, shape and zero in SI, then the sum of squares.
nb::tuple fit_loading(const Values& depth, const Values& force, const char* law, double contact,
                      double indentation, const Values& places, const Values& shapes,
                      std::pair<double, double> place_range, std::pair<double, double> shape_range) {
  const std::size_t n = depth.shape(0);
  if (n == 0 || force.shape(0) != n) throw nb::value_error("depth and force are empty or differ in length");
  const Curve curve = curve_of(law);
  const fit::LoadingSearch search{contact,
                                  indentation,
                                  {{places.data(), places.shape(0)}, place_range.first, place_range.second},
                                  {{shapes.data(), shapes.shape(0)}, shape_range.first, shape_range.second}};
  fit::LoadingResult r;
  {
    nb::gil_scoped_release release;
    std::array<double, fit::loading_workspace(fit::search_blocks + 1)> workspace;
    r = curve({{depth.data(), n}, {force.data(), n}}, search,
              std::span(workspace).first(fit::loading_workspace(n)));
  }
  return nb::make_tuple(nb::make_tuple(r.amplitudes[0], r.amplitudes[1]), r.contact_depth, r.shape, r.offset,
                        r.sse);
}

/// Sums of squares [N²] with the contact held at each of `places`, the shape searched from `shapes`.
std::vector<double> loading_profile(const Values& depth, const Values& force, const char* law, double contact,
                                    double indentation, const Values& places, const Values& shapes,
                                    std::pair<double, double> shape_range) {
  const std::size_t n = depth.shape(0), count = places.shape(0);
  if (n == 0 || force.shape(0) != n) throw nb::value_error("depth and force are empty or differ in length");
  const Curve curve = curve_of(law);
  std::vector<double> squares(count);
  const fit::LoadingRange shape{{shapes.data(), shapes.shape(0)}, shape_range.first, shape_range.second};
  nb::gil_scoped_release release;
  std::array<double, fit::loading_workspace(fit::search_blocks + 1)> workspace;
  for (std::size_t k = 0; k < count; ++k) {
    const double at = places.data()[k];
    const fit::LoadingSearch search{contact, indentation, {{&at, 1}, at, at}, shape};
    const auto r = curve({{depth.data(), n}, {force.data(), n}}, search,
                         std::span(workspace).first(fit::loading_workspace(n)));
    squares[k] = r.sse;
  }
  return squares;
}

}  // namespace

void bind_fit_loading(nb::module_& module) {
  module.def("fit_loading", &fit_loading, nb::arg("depth"), nb::arg("force"), nb::arg("law"),
             nb::arg("contact"), nb::arg("indentation"), nb::arg("places"), nb::arg("shapes"),
             nb::arg("place_range"), nb::arg("shape_range"));
  module.def("loading_profile", &loading_profile, nb::arg("depth"), nb::arg("force"), nb::arg("law"),
             nb::arg("contact"), nb::arg("indentation"), nb::arg("places"), nb::arg("shapes"),
             nb::arg("shape_range"));
}

}  // namespace needleforce::python
