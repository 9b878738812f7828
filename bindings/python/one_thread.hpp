// SPDX-License-Identifier: Apache-2.0
// An engine that runs in one thread refuses the calls of another, instead of two of them changing its memory.
#pragma once

#include <nanobind/nanobind.h>

#include <utility>

#include "parameters.hpp"

namespace needleforce::python {

/// An engine while it runs without the interpreter's lock. Made and destroyed with the lock held: declare it
/// before the lock is released.
class Running {
 public:
  explicit Running(const void* engine) : engine_(engine), next_(first) {
    refuse(engine);
    first = this;
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running() {
    Running** place = &first;
    while (*place != this) place = &(*place)->next_;
    *place = next_;
  }

  static bool any() noexcept { return first != nullptr; }

  /// Raises InputError if the engine runs in another thread. The lock must be held.
  static void refuse(const void* engine) {
    for (const Running* one = first; one; one = one->next_)
      if (one->engine_ == engine)
        raise_input("engine", nb::str("running"), "in use by another thread",
                    "Wait until that run has ended, or give each thread an engine of its own (copy()).");
  }

 private:
  inline static Running* first = nullptr;
  const void* engine_;
  Running* next_;
};

/// Before a call: none of its arguments may be an engine that runs in another thread.
struct NoneRunning {
  template <class Count>
  static void precall(PyObject** arguments, Count count, nb::detail::cleanup_list*) {
    if (!Running::any()) return;
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
