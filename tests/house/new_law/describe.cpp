// SPDX-License-Identifier: Apache-2.0
// Prints what the places for a law must have of each law on the lists, a JSON object a line.
#include <cstdio>
#include <variant>

#include "needleforce/laws/all.hpp"

using namespace needleforce;

template <class L>
void describe() {
  std::printf("{\"name\": \"%s\", \"family\": \"%s\", \"sources\": [\"%s\"", L::name,
              family_names[static_cast<int>(L::family)], L::source);
  for (const auto& parameter : L::table) std::printf(", \"%s\"", parameter.source);
  std::printf("], \"parameters\": [");
  const char* comma = "";
  for (const auto& parameter : L::table) std::printf("%s\"%s\"", comma, parameter.name), comma = ", ";
  std::printf("]}\n");
}
template <class... L>
void describe_each(std::variant<L...>*) {
  (describe<L>(), ...);
}

int main() {
  describe_each(static_cast<Stiffness*>(nullptr));
  describe_each(static_cast<Puncture*>(nullptr));
  describe_each(static_cast<Friction*>(nullptr));
  describe_each(static_cast<Cutting*>(nullptr));
  describe_each(static_cast<Relaxation*>(nullptr));
}
