// SPDX-License-Identifier: Apache-2.0
// The compiled core as `needleforce.core`.
#include "module.hpp"

#include <nanobind/nanobind.h>

#include "needleforce/version.hpp"

NB_MODULE(core, module) {
  // what is alive when Python ends is mostly its own caches, and no concern of a user
  nanobind::set_leak_warnings(false);
  module.doc() = "The compiled core of needleforce: laws, contact, foundation, insertion, guard, fit.";
  module.attr("version") = needleforce::version;
  needleforce::python::bind_tips(module);
  needleforce::python::bind_mechanics(module);
  needleforce::python::bind_laws(module);
  needleforce::python::bind_contact(module);
  needleforce::python::bind_insertion(module);
  needleforce::python::bind_flexible(module);
  needleforce::python::bind_condensed(module);
  needleforce::python::bind_estimator(module);
  needleforce::python::bind_live(module);
  needleforce::python::bind_guard(module);
  needleforce::python::bind_fit(module);
  needleforce::python::bind_fit_loading(module);
  needleforce::python::bind_scan(module);
  needleforce::python::bind_number_rows(module);
}
