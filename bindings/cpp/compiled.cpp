// SPDX-License-Identifier: Apache-2.0
// What programs that link needleforce::compiled do not compile themselves.
#include "needleforce/insertion_definitions.hpp"

template class needleforce::BasicPreparedInsertion<double>;
