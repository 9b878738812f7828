// SPDX-License-Identifier: Apache-2.0
// Binds any struct with a parameter table: keywords, ranges, text and equality all come from the table.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <string>
#include <type_traits>

#include "needleforce/law.hpp"

namespace nb = nanobind;

namespace needleforce::python {

[[noreturn]] inline void raise_input(const std::string& quantity, nb::object value, const std::string& limit,
                                     const std::string& next_step) {
  nb::object type = nb::module_::import_("needleforce.errors").attr("InputError");
  nb::object error = type(quantity, value, limit, "", next_step);
  PyErr_SetObject(type.ptr(), error.ptr());
  throw nb::python_error();
}

/// "cone_cylinder" -> "ConeCylinder": a law's class is named after the law.
inline std::string class_name(const std::string& name) {
  std::string result;
  bool upper = true;
  for (char letter : name) {
    if (letter == '_') {
      upper = true;
    } else {
      result += upper ? static_cast<char>(letter - 'a' + 'A') : letter;
      upper = false;
    }
  }
  return result;
}

inline std::string number(double value) { return nb::cast<std::string>(nb::repr(nb::float_(value))); }

template <class T>
void check_range(const T& value) {
  const Parameter<T>* bad = first_invalid(value);
  if (!bad) return;
  raise_input(std::string(T::name) + "." + bad->name, nb::float_(value.*bad->member),
              "outside " + number(bad->low) + " to " + number(bad->high) + " " + bad->unit,
              std::string("It is the ") + bad->meaning + ".");
}

/// A Python number as a double; anything else is told with the parameter's name.
template <class T>
double as_number(nb::handle object, const Parameter<T>& parameter) {
  double number = 0.0;
  if (nb::try_cast(object, number)) return number;
  raise_input(std::string(T::name) + "." + parameter.name, nb::repr(object), "not a number",
              std::string("Give the ") + parameter.meaning + " in " + parameter.unit + ".");
}

/// Fills `value` from positional arguments in table order, then keywords, then defaults.
template <class T>
void fill(T& value, const nb::tuple& args, const nb::dict& kwargs) {
  std::size_t used = 0, position = 0;
  for (const Parameter<T>& parameter : T::table) {
    const bool by_name = kwargs.contains(parameter.name);
    if (position < args.size()) {
      if (by_name) throw nb::type_error(parameter.name);
      value.*parameter.member = as_number(args[position++], parameter);
    } else if (by_name) {
      value.*parameter.member = as_number(kwargs[parameter.name], parameter);
      ++used;
    } else if (parameter.initial == parameter.initial) {
      value.*parameter.member = parameter.initial;
    } else {
      raise_input(std::string(T::name) + "." + parameter.name, nb::str("missing"),
                  std::string("needed in ") + parameter.unit,
                  std::string("Give the ") + parameter.meaning + ".");
    }
  }
  if (position < args.size() || used < kwargs.size()) {
    std::string known;
    for (const Parameter<T>& parameter : T::table) known += std::string(" ") + parameter.name;
    raise_input(std::string("an argument of ") + T::name, nb::repr(kwargs), "not all known",
                "It takes:" + known + ".");
  }
  check_range(value);
}

template <class T>
nb::list table_rows() {
  nb::list rows;
  for (const Parameter<T>& parameter : T::table) {
    nb::dict row;
    row["name"] = parameter.name;
    row["unit"] = parameter.unit;
    row["low"] = parameter.low;
    row["high"] = parameter.high;
    row["default"] = parameter.initial == parameter.initial ? nb::cast(parameter.initial) : nb::none();
    row["symbol"] = parameter.symbol;
    row["meaning"] = parameter.meaning;
    row["source"] = parameter.source;
    rows.append(row);
  }
  return rows;
}

template <class T>
nb::dict as_dict(const T& value) {
  nb::dict result;
  for (const Parameter<T>& parameter : T::table) result[parameter.name] = value.*parameter.member;
  return result;
}

template <class T>
std::string described(const T& value, const std::string& type) {
  std::string text = type + "(";
  for (const Parameter<T>& parameter : T::table) {
    if (text.back() != '(') text += ", ";
    text += std::string(parameter.name) + "=" + number(value.*parameter.member);
  }
  return text + ")";
}

template <class T>
bool equal(const T& left, const T& right) {
  for (const Parameter<T>& parameter : T::table)
    if (left.*parameter.member != right.*parameter.member) return false;
  return true;
}

/// The constructor's signature for type checkers; `more` are arguments beyond the table, each with a leading
/// comma.
template <class T>
std::string signature(const std::string& more = "") {
  std::string text = "def __init__(self";
  bool optional = false;
  for (const Parameter<T>& parameter : T::table) {
    const bool has_default = parameter.initial == parameter.initial;
    text += std::string(", ") + parameter.name + ": float";
    // the table's order is the caller's; Python wants a default behind a default
    if (has_default || optional)
      text += " = " + (has_default ? number(parameter.initial) : std::string("..."));
    optional = optional || has_default;
  }
  return text + more + ") -> None";
}

/// Binds T as `type` with everything but its constructor.
template <class T>
nb::class_<T> bind_values(nb::module_& module, const std::string& type) {
  nb::class_<T> bound(module, type.c_str(), T::summary);
  for (const Parameter<T>& parameter : T::table) {
    const std::string text = std::string(parameter.meaning) + " [" + parameter.unit + "]";
    bound.def_prop_ro(
        parameter.name, [member = parameter.member](const T& self) { return self.*member; },
        nb::sig(("def " + std::string(parameter.name) + "(self) -> float").c_str()), text.c_str());
  }
  bound.def("parameters", &as_dict<T>, "Every number by name, in SI.");
  bound.def_static("table", &table_rows<T>, "The parameter table: name, unit, range, meaning, source.");
  bound.def("__repr__", [type](const T& self) { return described(self, type); });
  bound.attr("name") = T::name;
  bound.attr("summary") = T::summary;
  if constexpr (Law<T>) {
    bound.attr("family") = family_names[static_cast<int>(T::family)];
    bound.attr("source") = T::source;
    bound.attr("validity") = T::validity;
  }
  return bound;
}

/// Binds T with a constructor that takes its table's names.
template <class T>
nb::class_<T> bind_parameters(nb::module_& module, const std::string& type) {
  nb::class_<T> bound = bind_values<T>(module, type);
  bound.def(
      "__init__",
      [](T* self, const nb::args& args, const nb::kwargs& kwargs) {
        T value{};
        fill(value, args, kwargs);
        new (self) T(value);
      },
      nb::sig(signature<T>().c_str()));
  bound.def(
      "replace",
      [](const T& self, const nb::kwargs& changes) {
        nb::dict merged = as_dict(self);
        merged.update(changes);
        T value{};
        fill(value, nb::tuple(), merged);
        return value;
      },
      "A copy with the given numbers changed.");
  bound.def("__eq__", [](const T& self, const T& other) { return equal(self, other); });
  bound.def("__getstate__", &as_dict<T>);
  bound.def("__setstate__", [](T& self, const nb::dict& state) {
    T value{};
    fill(value, nb::tuple(), state);
    new (&self) T(value);
  });
  return bound;
}

}  // namespace needleforce::python
