// SPDX-License-Identifier: Apache-2.0
// An engine and its place from the attributes of a plugin instance. For use before the loop.
#pragma once

#include <cstdio>

#include "place.hpp"
#include "values.hpp"

namespace needleforce::mujoco {

inline std::string in_words(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

/// The parameters of a family or tip that are given, as the C header takes them.
template <std::size_t most>
void read_parameters(Values& values, const std::string& prefix, const Names& names,
                     nf_parameter (&parameters)[most]) {
  std::size_t count = 0;
  for (const char* name : names)
    if (const auto value = values.number(prefix + name); value && count < most)
      parameters[count++] = {name, *value};
}

/// A tip, and the knots it points into.
struct NamedTip {
  nf_tip tip{};
  std::vector<double> radii, heights;

  NamedTip(Values& values, const std::string& prefix)
      : radii(values.numbers(prefix + ".radii")), heights(values.numbers(prefix + ".heights")) {
    tip.name = values.text(prefix);
    Names known = tip_parameters();
    known.insert(known.end(), std::begin(tip_words), std::end(tip_words));
    values.check_carried(prefix, known);
    read_parameters(values, prefix + ".", tip_parameters(), tip.parameters);
    tip.equivalence = values.text(prefix + ".equivalence");
    tip.radii = radii.data();
    tip.heights = heights.data();
    tip.knots = radii.size();
    if (radii.size() != heights.size())
      values.refuse(prefix + ".heights", std::to_string(heights.size()) + " numbers", "not as many as radii",
                    "Give a height for each radius.");
  }
  NamedTip(const NamedTip&) = delete;
};

inline Layer read_layer(Values& values, std::size_t number, nf_fault& why) {
  const std::string prefix = layer_prefix(number);
  const NamedTip tip(values, prefix + "stiffness.tip");
  nf_layer named{};
  if (number > 0) named.top = values.number(prefix + "top").value_or(0.0);
  for (const FamilyNames& family : families()) {
    nf_law& law = named.*family.law;
    law.name = values.text(prefix + family.name);
    values.check_carried(prefix + family.name, family.parameters);
    read_parameters(values, prefix + family.name + ".", family.parameters, law.parameters);
    if (!law.name && law.parameters[0].name)
      values.refuse(prefix + family.name, "",
                    "left out, but " + std::string(law.parameters[0].name) + " is given", "Name the law.");
  }
  if (tip.tip.name) named.stiffness.tip = &tip.tip;
  Layer layer;
  why.layer = number;
  c::read_layer(named, layer, why);
  return layer;
}

/// A fault of the C face, in the words of the attributes: a law is named by its family.
inline void report(Values& values, const nf_fault& why) {
  const auto is_family = [&](const FamilyNames& family) { return c::same(family.name, why.quantity); };
  const bool law = std::any_of(families().begin(), families().end(), is_family);
  const bool range = why.low != 0.0 || why.high != 0.0;
  const bool shown = std::isfinite(why.value) && (range || why.value != 0.0);  // a fault in words has none
  std::string quantity = law || !why.law ? why.quantity : std::string(why.law) + "." + why.quantity;
  std::string value = law ? (why.law ? why.law : "") : shown ? in_words(why.value) : "";
  std::string reason = why.reason;
  if (reason.starts_with("is ")) reason = reason.substr(3);
  if (range) reason += " of " + in_words(why.low) + " to " + in_words(why.high);
  values.refuse(layer_prefix(why.layer) + quantity, value, reason,
                "`needleforce laws` lists every law with its numbers.");
}

inline std::vector<Layer> read_layers(Values& values) {
  std::vector<Layer> layers;
  nf_fault why{};
  for (std::size_t i = 0; i < max_layers && !why.reason; ++i)
    if (i == 0 || values.text(layer_prefix(i) + "top")) {
      if (layers.size() < i)
        values.refuse(layer_prefix(layers.size()) + "top", "", "left out", "Number the layers without gaps.");
      layers.push_back(read_layer(values, i, why));
    }
  if (why.reason) report(values, why);
  if (!values.fault.empty()) return layers;
  const Fault fault = first_fault(layers);
  if (fault.reason)
    values.refuse(layer_prefix(fault.layer) + fault.quantity, "refused", fault.reason,
                  "Change it or the layer above; depths count from the surface.");
  return layers;
}

inline int named(Values& values, const mjModel* m, mjtObj type, const char* attribute) {
  const char* name = values.text(attribute);
  const int id = name ? mj_name2id(m, type, name) : -1;
  if (name && id < 0)
    values.refuse(attribute, name, "no such name in the model", "Give that of a joint or site.");
  return id;
}

inline void read_surface(Values& values, const mjModel* m, Place& place) {
  place.surface = named(values, m, mjOBJ_SITE, "surface.site");
  place.height = values.number("surface.height").value_or(0.0);
  const std::vector<double> normal = values.numbers("surface.normal");
  const bool moves = place.surface >= 0 && m->body_weldid[m->site_bodyid[place.surface]] != 0;
  if (moves)
    values.refuse("surface.site", values.text("surface.site"), "on a body that moves",
                  "Fix it to the world.");
  if (place.joint >= 0 && (place.surface >= 0 || !normal.empty()))
    values.refuse("surface", "a site or normal", "not for a joint",
                  "Give surface.height, the joint's position.");
  if (place.surface >= 0 && (values.text("surface.height") || !normal.empty()))
    values.refuse("surface", "a site and a height or normal", "given twice", "Give one.");
  if (normal.empty()) return;
  const bool plane = normal.size() == 3 && mju_norm3(normal.data()) > 1e-6;
  if (!plane)
    return values.refuse("surface.normal", values.whole("surface.normal"), "no direction", "Give x y z.");
  mju_copy3(place.normal, normal.data());
  mju_normalize3(place.normal);
}

inline Place read_place(Values& values, const mjModel* m) {
  Place place;
  place.joint = named(values, m, mjOBJ_JOINT, "joint");
  place.site = named(values, m, mjOBJ_SITE, "site");
  if (!values.text("joint") == !values.text("site"))
    values.refuse("joint or site", values.text("joint") ? "both" : "neither", "not one of them",
                  "Give a slide joint, or the site of the tip.");
  if (place.joint >= 0 && m->jnt_type[place.joint] != mjJNT_SLIDE)
    values.refuse("joint", values.text("joint"), "not a slide joint", "Give the site of the tip.");
  read_surface(values, m, place);
  return place;
}

inline Insertion read_engine(Values& values) {
  Limits limits;
  Bevel bevel;
  limits.max_speed = values.number("max_speed").value_or(limits.max_speed);
  bevel.half_angle = values.number("bevel.half_angle").value_or(bevel.half_angle);
  bevel.friction_coefficient =
      values.number("bevel.friction_coefficient").value_or(bevel.friction_coefficient);
  bevel.face_share = values.number("bevel.face_share").value_or(bevel.face_share);
  if (!valid(limits))
    values.refuse("max_speed", in_words(limits.max_speed), "not above 0 m/s", "Give it in m/s.");
  if (const auto* bad = first_invalid(bevel))
    values.refuse(std::string("bevel.") + bad->name, in_words(bevel.*bad->member),
                  "outside " + in_words(bad->low) + " to " + in_words(bad->high),
                  std::string("It is the ") + bad->meaning + ".");
  const std::vector<Layer> layers = read_layers(values);
  return Insertion(layers, limits, bevel);
}

}  // namespace needleforce::mujoco
