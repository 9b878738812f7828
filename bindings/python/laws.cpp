// SPDX-License-Identifier: Apache-2.0
#include "laws.hpp"

namespace needleforce::python {

void bind_laws(nb::module_& module) {
  nb::module_ laws = module.def_submodule("laws", "Every law, one class each.");
  bind_stiffness_and_puncture_laws(laws);
  bind_friction_and_cutting_laws(laws);
  bind_family(laws, static_cast<Relaxation*>(nullptr));
}

}  // namespace needleforce::python
