// SPDX-License-Identifier: Apache-2.0
// Binds any struct with a parameter table: keywords, ranges, text and equality all come from the table.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>

#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <variant>

#include "needleforce/foundation.hpp"
#include "needleforce/law.hpp"
#include "needleforce/tip.hpp"

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

/// A text without some of its parts.
inline std::string without(std::string text, const std::string& part, const std::string& instead = "") {
  const std::size_t at = text.find(part);
  return at == std::string::npos ? text : text.replace(at, part.size(), instead);
}

/// The type's name in C++, as "needleforce::laws::ConeCylinder": that of its alias, where it is a template
/// over the kind of number.
template <class T>
std::string cpp_name() {
  const std::string text = __PRETTY_FUNCTION__;  // "... cpp_name() [with T = <name>; std::string = ...]"
  const std::size_t start = text.find("T = ") + 4;
  const std::string name = text.substr(start, text.find_first_of(";]", start) - start);
  return without(without(without(name, "::Basic", "::"), "<double>"), ", double>", ">");
}

inline std::string number(double value) { return nb::cast<std::string>(nb::repr(nb::float_(value))); }

/// Calls `visit` with each member of T that is no number; nothing where T lists none.
template <class T, class Visit>
void for_each_part(Visit visit) {
  if constexpr (requires { T::parts; })
    std::apply([&](const auto&... part) { (visit(part), ...); }, T::parts);
}

/// How a part looks to Python: words for a choice, the value itself for anything else. Overloaded for each
/// choice, with `has_words`.
template <class Value>
inline constexpr bool has_words = false;
template <>
inline constexpr bool has_words<tips::BevelEquivalence> = true;
inline const auto& words_of(tips::BevelEquivalence) { return tips::bevel_equivalence_names; }
template <>
inline constexpr bool has_words<FoundationForm> = true;
inline const auto& words_of(FoundationForm) { return foundation_form_names; }

template <class Value>
nb::object to_python(const Value& value) {
  if constexpr (has_words<Value>)
    return nb::str(words_of(value)[static_cast<std::size_t>(value)]);
  else
    return nb::cast(value);
}

/// False if the object is none of the words, or of another type.
template <class Value>
bool from_python(nb::handle object, Value& value) {
  if constexpr (has_words<Value>) {
    const auto& words = words_of(value);
    for (std::size_t i = 0; i < words.size(); ++i)
      if (nb::isinstance<nb::str>(object) && nb::cast<std::string>(object) == words[i]) {
        value = static_cast<Value>(i);
        return true;
      }
    return false;
  } else {
    return nb::try_cast(object, value);
  }
}

/// What a part may be, for a message.
template <class Value>
std::string choices(const Value& value) {
  std::string text;
  if constexpr (has_words<Value>)
    for (const char* word : words_of(value)) text += (text.empty() ? " One of " : ", ") + std::string(word);
  return text.empty() ? text : text + ".";
}

template <class T>
void check_flaw(const T& value) {
  const tips::Flaw flaw = flaw_of(value);
  if (!flaw.limit) return;
  const std::string place = flaw.index < 0 ? "" : "[" + std::to_string(flaw.index) + "]";
  raise_input(std::string(T::name) + "." + flaw.quantity + place, nb::float_(flaw.value), flaw.limit,
              flaw.next_step);
}

template <class T>
std::string described(const T& value, const std::string& type) {
  std::string text = type + "(";
  for (const Parameter<T>& parameter : T::table) {
    if (text.back() != '(') text += ", ";
    text += std::string(parameter.name) + "=" + number(value.*parameter.member);
  }
  for_each_part<T>([&](const auto& part) {
    text +=
        std::string(", ") + part.name + "=" + nb::cast<std::string>(nb::repr(to_python(value.*part.member)));
  });
  return text + ")";
}

inline bool begins_with_the(std::string_view meaning) { return meaning.starts_with("the "); }

template <class T>
void check_range(const T& value) {
  if (const Parameter<T>* bad = first_invalid(value))
    raise_input(std::string(T::name) + "." + bad->name, nb::float_(value.*bad->member),
                "outside " + number(bad->low) + " to " + number(bad->high) + " " + bad->unit,
                std::string(begins_with_the(bad->meaning) ? "It is " : "It is the ") + bad->meaning + ".");
  check_flaw(value);
  if constexpr (requires { value.contradiction(); }) {
    if (const char* words = value.contradiction())
      raise_input(T::name, nb::str(described(value, "").c_str()), words, "Change one of these numbers.");
  }
}

/// A Python number as a double; anything else is refused with the parameter's name.
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
  for_each_part<T>([&](const auto& part) {
    const bool by_name = kwargs.contains(part.name);
    if (position < args.size() && by_name) throw nb::type_error(part.name);
    nb::object given = nb::none();
    if (position < args.size()) given = args[position++];
    if (by_name) given = kwargs[part.name];
    used += by_name;
    if (from_python(given, value.*part.member) || (given.is_none() && part.optional)) return;
    raise_input(std::string(T::name) + "." + part.name,
                given.is_none() ? nb::str("missing") : nb::repr(given),
                given.is_none() ? "needed" : "not one of those it may be",
                std::string("Give the ") + part.meaning + "." + choices(value.*part.member));
  });
  if (position < args.size() || used < kwargs.size()) {
    std::string known;
    for (const Parameter<T>& parameter : T::table) known += std::string(" ") + parameter.name;
    for_each_part<T>([&](const auto& part) { known += std::string(" ") + part.name; });
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

/// Every number and part by name: what makes the value again.
template <class T>
nb::dict whole_dict(const T& value) {
  nb::dict result = as_dict(value);
  for_each_part<T>([&](const auto& part) { result[part.name] = to_python(value.*part.member); });
  return result;
}

template <class T>
bool equal(const T& left, const T& right) {
  for (const Parameter<T>& parameter : T::table)
    if (left.*parameter.member != right.*parameter.member) return false;
  bool same = true;
  for_each_part<T>([&](const auto& part) {
    same = same && to_python(left.*part.member).equal(to_python(right.*part.member));
  });
  return same;
}

/// How type checkers read a part: "tips.Cone | tips.Sphere | None", or str for a word.
template <class Value>
struct Annotation {
  static std::string text() { return "str"; }
};
template <class... Shape>
struct Annotation<std::variant<Shape...>> {
  static std::string text() {
    std::string all;
    ((all += (all.empty() ? "tips." : " | tips.") + class_name(Shape::name)), ...);
    return all;
  }
};
template <class Value>
struct Annotation<std::optional<Value>> {
  static std::string text() { return Annotation<Value>::text() + " | None"; }
};

/// The constructor's signature for type checkers.
template <class T>
std::string signature() {
  std::string text = "def __init__(self";
  bool optional = false;
  for (const Parameter<T>& parameter : T::table) {
    const bool has_default = parameter.initial == parameter.initial;
    text += std::string(", ") + parameter.name + ": float";
    // the table's order is the caller's; Python wants a default behind a default
    if (has_default || optional)
      text += " = " + (std::isfinite(parameter.initial) ? number(parameter.initial) : std::string("..."));
    optional = optional || has_default;
  }
  for_each_part<T>([&]<class Value>(const Part<T, Value>& part) {
    text += std::string(", ") + part.name + ": " + Annotation<Value>::text();
    if (part.optional || optional) text += " = ...";
  });
  return text + ") -> None";
}

/// What a notebook shows; made where all tables are made.
template <class T>
void show_in_notebooks(nb::class_<T>& bound) {
  bound.def("_repr_html_", [](nb::handle self) {
    return nb::module_::import_("needleforce.display.tables").attr("parameters_html")(self);
  });
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
  nb::list parts;
  for_each_part<T>([&]<class Value>(const Part<T, Value>& part) {
    parts.append(part.name);
    bound.def_prop_ro(
        part.name, [member = part.member](const T& self) { return to_python(self.*member); },
        nb::sig(("def " + std::string(part.name) + "(self) -> " + Annotation<Value>::text()).c_str()),
        part.meaning);
  });
  bound.attr("parts") = nb::tuple(parts);
  bound.def("parameters", &as_dict<T>, "Every number by name, in SI.");
  bound.def_static("table", &table_rows<T>, "The parameter table: name, unit, range, meaning, source.");
  bound.def("__repr__", [type](const T& self) { return described(self, type); });
  show_in_notebooks(bound);
  bound.attr("name") = T::name;
  bound.attr("cpp_name") = cpp_name<T>();
  bound.attr("summary") = T::summary;
  if constexpr (Law<T>) {
    bound.attr("family") = family_names[static_cast<int>(T::family)];
    bound.attr("source") = T::source;
    bound.attr("validity") = T::validity;
    bound.attr("steps_exactly") = steps_exactly<T>;
    bound.attr("is_passive") = is_passive<T>;
    bound.attr("is_monotone") = is_monotone<T>;
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
        nb::dict merged = whole_dict(self);
        merged.update(changes);
        T value{};
        fill(value, nb::tuple(), merged);
        return value;
      },
      "A copy with the given values changed.");
  bound.def("__eq__", [](const T& self, const T& other) { return equal(self, other); }, nb::is_operator());
  bound.def("__hash__", [](const T& self) {
    nb::list values;
    values.append(nb::str(T::name));
    for (nb::handle value : whole_dict(self).values()) values.append(value);
    return nb::hash(nb::tuple(values));
  });
  bound.def("__getstate__", &whole_dict<T>);
  bound.def("__setstate__", [](T& self, const nb::dict& state) {
    T value{};
    fill(value, nb::tuple(), state);
    new (&self) T(value);
  });
  return bound;
}

}  // namespace needleforce::python
