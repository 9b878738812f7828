// SPDX-License-Identifier: Apache-2.0
#include "needleforce/contact.hpp"

#include <nanobind/stl/tuple.h>
#include <nanobind/stl/variant.h>

#include <cmath>
#include <tuple>

#include "module.hpp"
#include "needleforce/laws/tip_contact.hpp"
#include "parameters.hpp"

namespace needleforce::python {

namespace {

using Columns = std::tuple<Output, Output, Output>;

/// Depth, contact radius and force of `evaluate` at each value.
template <class Evaluate>
Columns columns(const Values& values, const Evaluate& evaluate) {
  const std::size_t n = values.shape(0);
  double *depth, *radius, *force;
  Columns result{new_array(n, depth), new_array(n, radius), new_array(n, force)};
  nb::gil_scoped_release release;
  for (std::size_t i = 0; i < n; ++i) {
    const auto [h, a, f] = evaluate(values.data()[i]);
    depth[i] = h;
    radius[i] = a;
    force[i] = f;
  }
  return result;
}

struct Row {
  double depth, contact_radius, force;
};

/// Rows at depths. Where a contact radius costs an inversion, a table of F(h) gives it to about 1e-7, and
/// what is left follows to first order: 1e-12 for one quadrature a point.
template <class TipShape>
struct AtDepth {
  const TipShape& shape;
  double modulus, limit;
  laws::TipContact::Prepared table;
  bool tabulated;

  Row operator()(double h) const {
    if (!(h > 0.0)) return {h, 0.0, 0.0};
    if (tabulated) {
      const double u = std::sqrt(h), a = std::min(0.5 * table.slope(h), limit), nudge = 1e-4 * h;
      const double by_depth = 0.25 * (table.slope(h + nudge) - table.slope(h - nudge)) / nudge;
      const sneddon::Touch touch = detail::touch(shape, a);
      const double left = h - touch.depth, nearer = a + left * by_depth;
      if (u < table.table.last_root() && std::abs(left) < 1e-6 * h && nearer < limit)
        return {h, nearer, modulus * (touch.force + (a + nearer) * left)};
    }
    const Reach reach = reach_at_depth(shape, h, limit);
    return {h, reach.contact_radius, modulus * reach.force};
  }
};

template <class TipShape>
AtDepth<TipShape> at_depth(const TipShape& shape, double modulus, double shank, std::size_t n) {
  const double limit = saturation_radius(shape, shank);
  if constexpr (requires { shape.touch(limit); })
    if (n > 1000 && std::isfinite(limit))
      return {shape, modulus, limit, laws::TipContact{1.0, limit, shape}.prepare(), true};
  return {shape, modulus, limit, {}, false};
}

/// A value for each pair of depth and contact radius.
template <class Evaluate>
Output each_pair(const Values& depth, const Values& radius, const Evaluate& evaluate) {
  double* values;
  Output result = new_array(depth.shape(0), values);
  nb::gil_scoped_release release;
  for (std::size_t i = 0; i < depth.shape(0); ++i)
    values[i] = depth.data()[i] > 0.0 ? evaluate(depth.data()[i], radius.data()[i]) : 0.0;
  return result;
}

void bind_columns(nb::module_& module) {
  module.def(
      "contact_at_depth",
      [](const Tip& tip, const Values& depth, double modulus, double shank) {
        return std::visit(
            [&](const auto& shape) {
              return columns(depth, at_depth(shape, modulus, shank, depth.shape(0)));
            },
            tip);
      },
      nb::arg("tip"), nb::arg("depth"), nb::arg("reduced_modulus"), nb::arg("shank_radius") = no_shank);
  module.def(
      "contact_at_radius",
      [](const Tip& tip, const Values& radius, double modulus) {
        return std::visit(
            [&](const auto& shape) {
              return columns(radius, [&](double a) {
                const sneddon::Touch edge = detail::touch(shape, a);
                return Row{edge.depth, a, modulus * edge.force};
              });
            },
            tip);
      },
      nb::arg("tip"), nb::arg("contact_radius"), nb::arg("reduced_modulus"));
}

}  // namespace

void bind_contact(nb::module_& module) {
  bind_columns(module);
  module.def(
      "contact_energy",
      [](const Tip& tip, const Values& depth, const Values& radius, double modulus) {
        return std::visit(
            [&](const auto& shape) {
              return each_pair(depth, radius, [&](double h, double a) {
                const sneddon::Touch edge = detail::touch(shape, a);
                const double beyond = h - edge.depth;
                return modulus * (shape.energy(a) + beyond * (edge.force + a * beyond));
              });
            },
            tip);
      },
      nb::arg("tip"), nb::arg("depth"), nb::arg("contact_radius"), nb::arg("reduced_modulus"),
      "Stored energy [J] at each depth and its contact radius.");
  module.def(
      "contact_pressure",
      [](const Tip& tip, double depth, double contact_radius, double modulus, const Values& radius) {
        return std::visit(
            [&](const auto& shape) {
              double* values;
              Output result = new_array(radius.shape(0), values);
              for (std::size_t i = 0; i < radius.shape(0); ++i)
                values[i] = contact_pressure(shape, depth, contact_radius, modulus, radius.data()[i]);
              return result;
            },
            tip);
      },
      nb::arg("tip"), nb::arg("depth"), nb::arg("contact_radius"), nb::arg("reduced_modulus"),
      nb::arg("radius"), "Pressure [Pa] at each radius [m] of one contact.");
}

}  // namespace needleforce::python
