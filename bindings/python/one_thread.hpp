// SPDX-License-Identifier: Apache-2.0
// An engine that runs in one thread refuses the calls of another, instead of two of them changing its memory.
#pragma once

#include <nanobind/nanobind.h>

#include <utility>

#include "parameters.hpp"
#include "running_engine.hpp"

namespace needleforce::python {

/// An engine that begins to run, unless it runs in another thread.
class Running {
 public:
  explicit Running(const void* engine) : running_((refuse(engine), engine)) {}

  /// Raises InputError if the engine runs in another thread. The lock must be held.
  static void refuse(const void* engine) {
    if (RunningEngine::runs(engine))
      raise_input("engine", nb::str("running"), "in use by another thread",
                  "Wait until that run has ended, or give each thread an engine of its own (copy()).");
  }

 private:
  RunningEngine running_;
};

/// Before a call: none of its arguments may be an engine that runs in another thread.
struct NoneRunning {
  template <class Count>
  static void precall(PyObject** arguments, Count count, nb::detail::cleanup_list*) {
    if (!RunningEngine::any()) return;
    for (std::size_t i = 0; i < count; ++i)
      if (nb::inst_check(arguments[i])) Running::refuse(nb::inst_ptr<void>(arguments[i]));
  }
  template <class Count>
  static void postcall(PyObject**, Count, nb::handle) noexcept {}
};

/// A class of engines, each of whose functions refuses one that runs in another thread.
template <class Engine>
class EngineClass : public nb::class_<Engine> {
  using Base = nb::class_<Engine>;

 public:
  using Base::Base;

  template <class Function, class... Extra>
  EngineClass& def(const char* name, Function&& function, const Extra&... extra) {
    Base::def(name, std::forward<Function>(function), extra..., nb::call_policy<NoneRunning>());
    return *this;
  }
  template <class Getter, class... Extra>
  EngineClass& def_prop_ro(const char* name, Getter&& getter, const Extra&... extra) {
    Base::def_prop_ro(name, std::forward<Getter>(getter), extra..., nb::call_policy<NoneRunning>());
    return *this;
  }
};

}  // namespace needleforce::python
