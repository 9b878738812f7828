// SPDX-License-Identifier: Apache-2.0
// The compiled core as `needleforce.core`.
#include "module.hpp"

#include <nanobind/nanobind.h>

#include "needleforce/version.hpp"

namespace {

/// Objects are kept from a second thread by the interpreter's lock, which a free-threaded Python brings back
/// when it loads this module, unless it was started to run without.
void require_lock() {
  const nanobind::object flags = nanobind::module_::import_("sys").attr("flags");
  if (nanobind::hasattr(flags, "gil") && flags.attr("gil").equal(nanobind::int_(0)))
    throw nanobind::import_error(
        "needleforce needs the interpreter's lock, and this Python was started without it: start it without "
        "PYTHON_GIL=0 and -X gil=0.");
}

}  // namespace

NB_MODULE(core, module) {
  require_lock();
  // what is alive when Python ends is mostly its own caches, and no concern of a user
  nanobind::set_leak_warnings(false);
  module.doc() = "The compiled core of needleforce: laws, contact, foundation, insertion, guard, fit.";
  module.attr("version") = needleforce::version;
  needleforce::python::bind_tips(module);
  needleforce::python::bind_mechanics(module);
  needleforce::python::bind_laws(module);
  needleforce::python::bind_contact(module);
  needleforce::python::bind_insertion(module);
  needleforce::python::bind_batch(module);
  needleforce::python::bind_gradient(module);
  needleforce::python::bind_flexible(module);
  needleforce::python::bind_condensed(module);
  needleforce::python::bind_estimator(module);
  needleforce::python::bind_live(module);
  needleforce::python::bind_events(module);
  needleforce::python::bind_online(module);
  needleforce::python::bind_guard(module);
  needleforce::python::bind_fit(module);
  needleforce::python::bind_fit_loading(module);
  needleforce::python::bind_scan(module);
  needleforce::python::bind_number_rows(module);
}
