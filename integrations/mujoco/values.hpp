// SPDX-License-Identifier: Apache-2.0
// The values of a plugin instance's attributes, and what is wrong with them, in words. For use before the
// loop.
#pragma once

#include <cmath>
#include <cstdlib>
#include <optional>
#include <sstream>

#include "attributes.hpp"

namespace needleforce::mujoco {

/// Reads attributes and keeps the first fault it meets.
class Values {
 public:
  Values(const mjModel* m, int instance) : m_(m), instance_(instance) {}

  /// All of an attribute's text, empty if it is not given.
  std::string whole(const std::string& name) const {
    const char* value = mj_getPluginConfig(m_, instance_, name.c_str());
    return value ? value : "";
  }
  /// The first word of an attribute, or the text of a parameter given with its law; nullptr if it is not
  /// given.
  const char* text(const std::string& name) {
    if (const std::string value = first_word(name); !value.empty()) return kept(value);
    const std::size_t dot = name.rfind('.');
    if (dot == std::string::npos) return nullptr;
    for (const auto& [key, value] : carried(name.substr(0, dot)))
      if (key == name.substr(dot + 1)) return kept(value);
    return nullptr;
  }
  /// Refuses a parameter given with a law that no law of the family has, or that is given twice.
  void check_carried(const std::string& name, const Names& known) {
    const auto pairs = carried(name);
    for (const auto& [key, value] : pairs) {
      const auto is_key = [&](const std::string& other) { return key == other; };
      if (std::none_of(known.begin(), known.end(), is_key))
        refuse(name + "." + key, value, "of no known name",
               "`needleforce laws` lists every law with its numbers.");
      const auto times =
          std::count_if(pairs.begin(), pairs.end(), [&](const auto& pair) { return is_key(pair.first); });
      if (times > 1 || !first_word(name + "." + key).empty())
        refuse(name + "." + key, value, "given twice", "Give it next to the law or as a key of its own.");
    }
  }
  std::optional<double> number(const std::string& name) {
    const std::vector<double> all = numbers(name);
    if (all.size() > 1) refuse(name, whole(name), "more than one number", "Give one number in SI.");
    return all.empty() ? std::nullopt : std::optional(all[0]);
  }
  /// Numbers with spaces between them, or commas.
  std::vector<double> numbers(const std::string& name) {
    std::string given = whole(name);
    if (const char* one = given.empty() ? text(name) : nullptr) given = one;
    std::vector<double> result;
    for (const char* rest = given.c_str(); *rest;) {
      char* end = nullptr;
      result.push_back(std::strtod(rest, &end));
      if (end == rest || !std::isfinite(result.back())) {
        refuse(name, given, "not a finite number", "Give it in SI, without its unit.");
        return {};
      }
      for (rest = end; *rest == ' ' || *rest == ',';) ++rest;
    }
    return result;
  }
  /// Quantity, value, limit, next step; an empty value is left out. The first fault stays.
  void refuse(const std::string& quantity, const std::string& value, const std::string& limit,
              const std::string& next_step) {
    if (fault.empty())
      fault = quantity + " is " + (value.empty() ? "" : value + ", ") + limit + ". " + next_step;
  }

  std::string fault;

 private:
  std::string first_word(const std::string& name) const {
    std::string word;
    std::istringstream(whole(name)) >> word;
    return word;
  }
  /// The pairs name=value after the first word of an attribute.
  std::vector<std::pair<std::string, std::string>> carried(const std::string& name) const {
    std::vector<std::pair<std::string, std::string>> pairs;
    std::istringstream words(whole(name));
    std::string word;
    for (words >> word; words >> word;) {
      const std::size_t equals = std::min(word.find('='), word.size());
      pairs.emplace_back(word.substr(0, equals), word.substr(std::min(equals + 1, word.size())));
    }
    return pairs;
  }
  /// Texts that outlive their reading.
  const char* kept(const std::string& value) { return texts_.emplace_back(value).c_str(); }

  const mjModel* m_;
  int instance_;
  std::deque<std::string> texts_;
};

}  // namespace needleforce::mujoco
