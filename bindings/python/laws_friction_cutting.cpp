// SPDX-License-Identifier: Apache-2.0
#include "laws.hpp"

namespace needleforce::python {

void bind_friction_and_cutting_laws(nb::module_& laws) {
  bind_family(laws, static_cast<Friction*>(nullptr));
  bind_family(laws, static_cast<Cutting*>(nullptr));
}

}  // namespace needleforce::python
