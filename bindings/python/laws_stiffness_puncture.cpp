// SPDX-License-Identifier: Apache-2.0
#include "laws.hpp"

namespace needleforce::python {

void bind_stiffness_and_puncture_laws(nb::module_& laws) {
  bind_family(laws, static_cast<Stiffness*>(nullptr));
  bind_family(laws, static_cast<Puncture*>(nullptr));
}

}  // namespace needleforce::python
