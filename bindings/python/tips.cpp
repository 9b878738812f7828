// SPDX-License-Identifier: Apache-2.0
// Every tip on the list, with its profile; the profile from arrays takes columns in place of numbers.
#include <variant>

#include "module.hpp"
#include "needleforce/tip.hpp"
#include "parameters.hpp"

namespace needleforce::python {

namespace {

/// f of each radius [m], for a number or an array.
template <class T, class Function>
void over_radii(nb::class_<T>& bound, const char* name, Function function, const char* text) {
  bound.def(name, function, nb::arg("radius"), text);
  bound.def(
      name,
      [function](const T& self, const Values& radius) {
        double* values;
        Output result = new_array(radius.shape(0), values);
        for (std::size_t i = 0; i < radius.shape(0); ++i) values[i] = function(self, radius.data()[i]);
        return result;
      },
      nb::arg("radius"));
}

template <class T>
void bind_profile(nb::class_<T>& bound) {
  over_radii(
      bound, "height", [](const T& self, double r) { return self.height(r); },
      "Height [m] of the profile above the apex at a radius [m], or at each of an array.");
  over_radii(
      bound, "slope", [](const T& self, double r) { return self.slope(r); },
      "Slope df/dr of the profile at a radius [m], or at each of an array.");
  bound.def_prop_ro("end", &T::end, "Radius [m] where the profile ends; infinity if never.");
  bound.def_prop_ro("flat", &T::flat, "Radius [m] of the flat face that touches first; 0 for none.");
}

template <class T>
void bind_tip(nb::module_& module) {
  nb::class_<T> bound = bind_parameters<T>(module, class_name(T::name));
  bind_profile(bound);
  if constexpr (std::is_same_v<T, tips::Cone>) {
    bound.def("length", &tips::Cone::length, nb::arg("radius"),
              "Length [m] from the apex to the section of a given radius [m].");
    bound.def_prop_ro(
        "representative_strain", [](const tips::Cone& tip) { return 0.2 * tip.cotangent(); },
        "Johnson's 0.2 cot(half_angle): far above 0.1 the linear theory is a scaling law.");
    bound.def(
        "mean_pressure",
        [](const tips::Cone& tip, double modulus) { return 0.5 * modulus * tip.cotangent(); },
        nb::arg("reduced_modulus"), "Mean contact pressure [Pa], the same at every depth.");
    bound.def("equivalent_cone", [](const tips::Cone& tip) { return tip; }, "Itself.");
  }
  if constexpr (std::is_same_v<T, tips::LancetBevel>)
    bound
        .def(
            "equivalent_cone", &tips::LancetBevel::equivalent_cone,
            "The cone that stands for the bevel: tan(half_angle) as it is, halved, a third, or the bisector.")
        .def(
            "lateral_force", &tips::LancetBevel::lateral_force, nb::arg("axial"),
            nb::arg("friction_coefficient") = 0.0, nb::arg("share") = 1.0,
            "Lateral force [N] of an axial one [N] on the face: share * axial * cot(half_angle + atan(mu)).");
}

tips::Profile make_profile(const nb::object& radius, const nb::object& height) {
  Values columns[2];
  const nb::object given[2] = {radius, height};
  const char* const names[2] = {"profile.radii", "profile.heights"};
  nb::object as_array = nb::module_::import_("numpy").attr("ascontiguousarray");
  for (int i = 0; i < 2; ++i) {
    try {
      columns[i] = nb::cast<Values>(as_array(given[i], nb::arg("dtype") = "float64"));
    } catch (const std::exception&) {
      raise_input(names[i], nb::repr(given[i]), "not a column of numbers", "Give a list or an array in m.");
    }
  }
  const std::size_t n = columns[0].shape(0);
  if (columns[1].shape(0) != n)
    raise_input("the length of profile.heights", nb::int_(columns[1].shape(0)),
                "not that of radii, " + std::to_string(n), "Give one height for each radius.");
  tips::Profile profile;
  profile.count = static_cast<int>(n);
  profile.radius.fill(tips::endless);
  for (std::size_t i = 0; i < n && i < tips::Profile::capacity; ++i) {
    profile.radius[i] = columns[0].data()[i];
    profile.rise[i] = columns[1].data()[i];
  }
  check_flaw(profile);
  return profile;
}

nb::tuple column(const std::array<double, tips::Profile::capacity>& values, int count) {
  nb::list result;
  for (int i = 0; i < count; ++i) result.append(values[i]);
  return nb::tuple(result);
}

nb::dict profile_dict(const tips::Profile& self) {
  nb::dict result;
  result["radii"] = column(self.radius, self.count);
  result["heights"] = column(self.rise, self.count);
  return result;
}

nb::dict column_row(const char* name, const char* symbol, const char* meaning) {
  nb::dict row;
  row["name"] = name;
  row["unit"] = "m";
  row["low"] = 0.0;
  row["high"] = 1.0;
  row["default"] = nb::none();
  row["symbol"] = symbol;
  row["meaning"] = meaning;
  row["source"] = "Sneddon 1965";
  return row;
}

void bind_knots(nb::module_& module) {
  nb::class_<tips::Profile> bound(module, "Profile", tips::Profile::summary);
  bind_profile(bound);
  show_in_notebooks(bound);
  bound
      .def(
          "__init__",
          [](tips::Profile* self, const nb::object& radii, const nb::object& heights) {
            new (self) tips::Profile(make_profile(radii, heights));
          },
          nb::arg("radii"), nb::arg("heights"),
          nb::sig("def __init__(self, radii: collections.abc.Sequence[float], heights: "
                  "collections.abc.Sequence[float]) -> None"),
          "Heights [m] above the apex at radii [m], from (0, 0) on: 2 to 32 knots, convex. InputError names "
          "the "
          "knot that is not.")
      .def_prop_ro(
          "radii", [](const tips::Profile& self) { return column(self.radius, self.count); }, "[m]")
      .def_prop_ro(
          "heights", [](const tips::Profile& self) { return column(self.rise, self.count); }, "[m]")
      .def("parameters", &profile_dict, "Every column by name, in SI.")
      .def_static(
          "table",
          [] {
            nb::list rows;
            rows.append(column_row("radii", "r_k", "radii of the knots, from 0 on"));
            rows.append(column_row("heights", "f_k", "heights of the knots above the apex"));
            return rows;
          },
          "The columns: name, unit, meaning.")
      .def("__repr__",
           [](const tips::Profile& self) {
             return nb::str("Profile(radii={}, heights={})")
                 .format(column(self.radius, self.count), column(self.rise, self.count));
           })
      .def(
          "__eq__",
          [](const tips::Profile& a, const tips::Profile& b) {
            return a.count == b.count && profile_dict(a).equal(profile_dict(b));
          },
          nb::is_operator())
      .def("__hash__", [](const tips::Profile& self) { return nb::hash(nb::repr(nb::cast(self))); })
      .def("__getstate__", &profile_dict)
      .def("__setstate__", [](tips::Profile& self, const nb::dict& state) {
        new (&self) tips::Profile(make_profile(state["radii"], state["heights"]));
      });
  bound.attr("name") = tips::Profile::name;
  bound.attr("cpp_name") = cpp_name<tips::Profile>();
  bound.attr("summary") = tips::Profile::summary;
  bound.attr("parts") = nb::tuple();
  bound.attr("columns") = true;
}

template <class T>
void bind_any(nb::module_& module) {
  if constexpr (Parameterised<T>)
    bind_tip<T>(module);
  else
    bind_knots(module);
}

template <class... T>
void bind_all(nb::module_& module, std::variant<T...>*) {
  (bind_any<T>(module), ...);
}

}  // namespace

void bind_tips(nb::module_& module) {
  nb::module_ shapes = module.def_submodule("tips", "Tips of needles: axisymmetric profiles.");
  bind_all(shapes, static_cast<Tip*>(nullptr));
  nb::list words;
  for (const char* word : tips::bevel_equivalence_names) words.append(word);
  shapes.attr("equivalences") = nb::tuple(words);
}

}  // namespace needleforce::python
