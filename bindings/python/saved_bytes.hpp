// SPDX-License-Identifier: Apache-2.0
// The memory of an engine as bytes of Python.
#pragma once

#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "parameters.hpp"

namespace needleforce::python {

template <class Engine>
nb::bytes saved_bytes(const Engine& self) {
  const auto saved = std::make_unique<typename Engine::Saved>(self.save());
  return nb::bytes(saved.get(), sizeof *saved);
}

/// `foreign` is the message for bytes of something else, or altered ones; of a state that no needle can have,
/// the first part that is impossible is named.
template <class Engine>
void restore_bytes(Engine& self, const nb::bytes& bytes, const char* foreign, const char* next_step) {
  const auto saved = std::make_unique<typename Engine::Saved>();
  const bool fits = bytes.size() == sizeof *saved;
  if (fits) std::memcpy(saved.get(), bytes.data(), sizeof *saved);
  const char* const fault = fits ? self.restore_fault(*saved) : "size";
  if (!fault) {
    self.restore(*saved);
    return;
  }
  const std::string_view part = fault;
  const bool other = part == "size" || part == "version" || part == "model" || part == "checksum";
  raise_input("snapshot", nb::str((std::to_string(bytes.size()) + " bytes").c_str()),
              other ? foreign : "a state that no needle can have: " + std::string(fault), next_step);
}

}  // namespace needleforce::python
