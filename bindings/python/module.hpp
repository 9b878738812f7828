// SPDX-License-Identifier: Apache-2.0
// The parts of the Python module, in the order in which they depend on one another.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <algorithm>
#include <array>

namespace needleforce::python {

using Values = nanobind::ndarray<const double, nanobind::ndim<1>, nanobind::c_contig, nanobind::device::cpu>;
using Output = nanobind::ndarray<double, nanobind::numpy, nanobind::ndim<1>, nanobind::c_contig>;

/// A new NumPy array of n doubles that owns its memory; `data` receives its address.
inline Output new_array(std::size_t n, double*& data) {
  data = new double[n];
  nanobind::capsule owner(data, [](void* memory) noexcept { delete[] static_cast<double*>(memory); });
  return Output(data, {n}, owner);
}

template <std::size_t n>
Output as_array(const std::array<double, n>& values) {
  double* data;
  Output array = new_array(n, data);
  std::copy(values.begin(), values.end(), data);
  return array;
}

using Table = nanobind::ndarray<nanobind::numpy, double, nanobind::ndim<2>>;

/// A new NumPy array of n rows and m columns; `data` receives its address.
inline Table new_rows(std::size_t n, std::size_t m, double*& data) {
  data = new double[n * m];
  nanobind::capsule owner(data, [](void* memory) noexcept { delete[] static_cast<double*>(memory); });
  return Table(data, {n, m}, owner);
}

void bind_tips(nanobind::module_& module);
void bind_mechanics(nanobind::module_& module);  // needle, tissue, foundation
void bind_laws(nanobind::module_& module);
void bind_contact(nanobind::module_& module);
void bind_insertion(nanobind::module_& module);
void bind_batch(nanobind::module_& module);
void bind_gradient(nanobind::module_& module);
void bind_flexible(nanobind::module_& module);
void bind_condensed(nanobind::module_& module);
void bind_estimator(nanobind::module_& module);
void bind_events(nanobind::module_& module);
void bind_online(nanobind::module_& module);
void bind_guard(nanobind::module_& module);
void bind_live(nanobind::module_& module);
void bind_fit(nanobind::module_& module);
void bind_fit_loading(nanobind::module_& module);
void bind_scan(nanobind::module_& module);  // over whole recordings
void bind_number_rows(nanobind::module_& module);

}  // namespace needleforce::python
