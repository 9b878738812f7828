// SPDX-License-Identifier: Apache-2.0
// The conformance set through the C++ headers; README.md describes a case.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "needleforce/insertion.hpp"

namespace {

using namespace needleforce;

struct Words : std::istringstream {
  using std::istringstream::istringstream;
  std::string word() {
    std::string next;
    *this >> next;
    return next;
  }
  double number() { return std::strtod(word().c_str(), nullptr); }
  double velocity() {
    const std::string next = word();
    return next == "-" ? no_velocity : std::strtod(next.c_str(), nullptr);
  }
};

template <class T>
T filled(Words& words) {
  T value{};
  if constexpr (requires { T::table; }) {
    for (const auto& parameter : T::table) value.*parameter.member = parameter.initial;
    for (std::string name = words.word(); !name.empty(); name = words.word()) {
      if constexpr (requires { value.equivalence; })
        if (name == "equivalence") {
          const std::string word = words.word();
          for (int i = 0; i < 4; ++i)
            if (word == tips::bevel_equivalence_names[i]) value.equivalence = tips::BevelEquivalence(i);
        }
      for (const auto& parameter : T::table)
        if (name == parameter.name) value.*parameter.member = words.number();
    }
  }
  return value;
}

/// False if no value of the list has this name.
template <class... T>
bool choose(std::variant<T...>& chosen, Words& words) {
  const std::string name = words.word();
  return ((name == T::name && (chosen = filled<T>(words), true)) || ...);
}

class Case {
 public:
  void read(const std::string& line) {
    Words words(line);
    const std::string what = words.word();
    if (what.empty() || what[0] == '#') return;
    if (!describe(what, words)) move(what, words);
  }

 private:
  /// True for a line of the model.
  bool describe(const std::string& what, Words& words) {
    if (what == "layer") return layers_.push_back({words.number(), {}}), true;
    if (what == "set") return set(words), true;
    if (layers_.empty()) return false;
    Model& laws = layers_.back().laws;
    if (what == "stiffness") return known_ &= choose(laws.stiffness, words), true;
    if (what == "puncture") return known_ &= choose(laws.puncture, words), true;
    if (what == "friction") return known_ &= choose(laws.friction, words), true;
    if (what == "cutting") return known_ &= choose(laws.cutting, words), true;
    if (what == "relaxation") return known_ &= choose(laws.relaxation, words), true;
    if (what == "tip") return known_ &= choose(std::get<laws::TipContact>(laws.stiffness).tip, words), true;
    if (what != "knot") return false;
    auto& profile = std::get<tips::Profile>(std::get<laws::TipContact>(laws.stiffness).tip);
    profile.radius[profile.count] = words.number();
    profile.rise[profile.count++] = words.number();
    return true;
  }
  void set(Words& words) {
    const std::string name = words.word();
    const double value = words.number();
    if (name == "max_speed") limits_.max_speed = value;
    if (name == "hold_time") limits_.hold_time = value;
    if (name == "depth_noise") limits_.depth_noise = value;
    if (name == "bevel_half_angle") bevel_.half_angle = value;
    if (name == "bevel_friction_coefficient") bevel_.friction_coefficient = value;
    if (name == "bevel_face_share") bevel_.face_share = value;
  }

  void move(const std::string& what, Words& words) {
    if (!insertion_) make();
    if (!accepted_) return;
    if (what == "at") ticks_ = std::atol(words.word().c_str());
    if (what == "go") go(words);
    if (what == "step") {
      const double depth = words.number(), velocity = words.velocity();
      step(depth, velocity, words.number());
    }
    if (what == "reset") insertion_->reset();
    if (what == "keep") kept_ = insertion_->save();
    if (what == "restore") std::puts(insertion_->restore(kept_) ? "taken" : "refused");
    if (what == "alter") alter(std::size_t(words.number()));
  }
  void make() {
    accepted_ = known_ && !first_fault(layers_).reason && valid(limits_);
    insertion_.emplace(layers_, limits_, bevel_);
    if (!accepted_) std::puts("refused");
  }
  void go(Words& words) {
    const int n = std::atoi(words.word().c_str());
    const double dt = words.number(), velocity = words.velocity();
    std::vector<long> travels;
    for (std::string next = words.word(); !next.empty(); next = words.word())
      travels.push_back(std::atol(next.c_str()));
    for (int i = 0; i < n; ++i)
      step(std::ldexp(double(ticks_ += travels[i % travels.size()]), -30), velocity, dt);
  }
  void alter(std::size_t where) {
    Insertion::Saved altered = kept_;
    reinterpret_cast<unsigned char*>(&altered)[where] ^= 1;
    std::puts(insertion_->restore(altered) ? "taken" : "refused");
  }
  void step(double depth, double velocity, double dt) {
    const Sample s = insertion_->step(depth, velocity, dt);
    for (const double number : {s.depth, s.velocity, s.force, s.stiffness, s.friction, s.cutting, s.lateral,
                                s.force_by_depth, s.force_by_velocity})
      std::printf("%.17g ", number);
    std::printf("%s %s %d %d %d\n", phase_names[int(s.phase)], status_names[int(s.status)], s.contact,
                s.punctured, s.exit);
  }

  std::vector<Layer> layers_;
  Limits limits_;
  Bevel bevel_;
  std::optional<Insertion> insertion_;
  Insertion::Saved kept_{};
  bool known_ = true, accepted_ = false;
  long ticks_ = 0;
};

}  // namespace

int main(int count, char** paths) {
  for (int i = 1; i < count; ++i) {
    std::printf("case %s\n", paths[i]);
    std::ifstream file(paths[i]);
    Case one;
    for (std::string line; std::getline(file, line);) one.read(line);
  }
}
