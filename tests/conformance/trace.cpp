// SPDX-License-Identifier: Apache-2.0
// The conformance set through the C++ headers; README.md describes a case.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "needleforce/solid/bent_in_solid.hpp"

namespace {

using namespace needleforce;
using bending::SpatialInsertion;
using solid::CondensedInsertion;
using BentInSolid = solid::BentInSolid<2>;
// what is stepped: rigid or bent, in layers or in a solid
using Engine = std::variant<std::monostate, Insertion, CondensedInsertion, SpatialInsertion, BentInSolid>;

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

template <class T>
void set_defaults(T& value) {
  for (const auto& parameter : T::table) value.*parameter.member = parameter.initial;
}
template <class T>
void set_named(T& value, const std::string& name, double number) {
  for (const auto& parameter : T::table)
    if (name == parameter.name) value.*parameter.member = number;
}

/// What a needle that bends is made of; there is none without a lateral layer.
struct Flexible {
  bending::FlexibleSettings settings{};
  std::vector<bending::Section> sections{};

  Flexible() { set_defaults(settings.beam.support), set_defaults(settings.lengths); }
  bool given() const { return settings.beam.layer_count > 0; }
  bool describe(const std::string& what, Words& words) {
    if (what == "lateral") return add_lateral(words), true;
    if (what == "section") {
      const double end = words.number(), stiffness = words.number();
      return sections.push_back({end, stiffness, words.number()}), true;
    }
    if (what != "bending") return false;
    const std::string name = words.word();
    const double value = words.number();
    if (name == "elements") settings.beam.elements = std::size_t(value);
    set_named(settings.beam.support, name, value);
    set_named(settings.lengths, name, value);
    return true;
  }
  void add_lateral(Words& words) {
    bending::LateralLayer& layer = settings.beam.layers[settings.beam.layer_count++];
    set_defaults(layer);
    layer.top = words.number();
    for (std::string name = words.word(); !name.empty(); name = words.word()) {
      if (name != "form") {
        set_named(layer, name, words.number());
        continue;
      }
      const std::string form = words.word();
      for (int i = 0; i < 4; ++i)
        if (form == foundation_form_names[i]) layer.form = FoundationForm(i);
    }
  }
  /// Whether the settings are valid.
  bool accepted() {
    settings.beam.sections = bending::Sections(std::span<const bending::Section>(sections));
    return !fault(settings);
  }
};

solid::CondensedTissue read_solid(Words& words) {
  solid::CondensedTissue tissue;
  tissue.spacing = words.number();
  tissue.nodes = std::size_t(words.number());
  const double scale = words.number(), fall = words.number();
  for (std::size_t i = 0; i < std::min(tissue.nodes, solid::max_path_nodes); ++i)
    for (std::size_t j = 0; j < std::min(tissue.nodes, solid::max_path_nodes); ++j) {
      const double apart = double(i) - double(j);
      tissue.compliance[i * solid::max_path_nodes + j] = scale / (1.0 + fall * (apart * apart));
    }
  return tissue;
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
    if (what == "solid") return tissue_ = read_solid(words), true;
    if (flexible_.describe(what, words)) return true;
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
    if (!made_) make();
    if (!accepted_) return;
    if (what == "at") ticks_ = std::atol(words.word().c_str());
    if (what == "go") go(words);
    if (what == "step") {
      const double depth = words.number(), velocity = words.velocity();
      step(depth, velocity, words.number());
    }
    if (what == "carry") carry(words);
    if (what == "base") base(words);
    if (what == "shape") shape();
    if (what == "nodes") nodes(std::get<CondensedInsertion>(engine_));
    std::visit([&](auto& engine) { remember(what, words, engine); }, engine_);
  }
  void remember(const std::string&, Words&, std::monostate) {}
  template <class T>
  void remember(const std::string& what, Words& words, T& engine) {
    typename T::Saved bytes;
    if (what == "reset") engine.reset();
    if (what == "keep") {
      bytes = engine.save();
      kept_.resize(sizeof bytes);
      std::memcpy(kept_.data(), &bytes, sizeof bytes);
    }
    if (what != "restore" && what != "alter") return;
    std::memcpy(&bytes, kept_.data(), sizeof bytes);
    if (what == "alter") reinterpret_cast<unsigned char*>(&bytes)[std::size_t(words.number())] ^= 1;
    std::puts(engine.restore(bytes) ? "taken" : "refused");
  }
  void make() {
    made_ = true;
    accepted_ = known_ && !first_fault(layers_).reason && valid(limits_) && !first_invalid(bevel_) &&
                !(tissue_ && CondensedInsertion::fault(*tissue_, layers_)) &&
                (!flexible_.given() || flexible_.accepted());
    if (!accepted_)
      std::puts("refused");
    else if (tissue_)
      choose_needle<BentInSolid>(CondensedInsertion(*tissue_, layers_, limits_, bevel_));
    else
      choose_needle<SpatialInsertion>(Insertion(layers_, limits_, bevel_));
  }
  template <class Bent, class Rigid>
  void choose_needle(const Rigid& rigid) {
    if (flexible_.given())
      engine_.emplace<Bent>(rigid, flexible_.settings);
    else
      engine_ = rigid;
  }
  void shape() {
    const auto print_point = [](const bending::Vector& p) {
      std::printf("point %.17g %.17g %.17g\n", p[0], p[1], p[2]);
    };
    std::visit(
        [&](const auto& engine) {
          if constexpr (requires { engine.shape(print_point); }) engine.shape(print_point);
        },
        engine_);
  }
  static void nodes(const CondensedInsertion& solid) {
    std::printf("tip %.17g\n", solid.state().tip);
    for (std::size_t i = 0; i < solid.tissue().nodes; ++i)
      std::printf("node %.17g %.17g\n", solid.node_force(i), solid.displacement(i));
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
  void step(double depth, double velocity, double dt) {
    std::visit(
        [&](auto& engine) {
          if constexpr (requires { engine.step(depth, velocity, dt); })
            print(engine.step(depth, velocity, dt));
        },
        engine_);
  }
  static void print(const Sample& s) {
    for (const double number : {s.depth, s.velocity, s.force, s.stiffness, s.friction, s.cutting, s.lateral,
                                s.force_by_depth, s.force_by_velocity})
      std::printf("%.17g ", number);
    std::printf("%s %s %d %d %d\n", phase_names[int(s.phase)], status_names[int(s.status)], s.contact,
                s.punctured, s.exit);
  }
  void carry(Words& words) {
    const int n = std::atoi(words.word().c_str());
    const double dt = words.number();
    std::array<long, 6> travel;
    for (long& each : travel) each = std::atol(words.word().c_str());
    for (int i = 0; i < n; ++i) {
      ticks_ += travel[0];
      std::array<double, 6> at{std::ldexp(double(ticks_), -30)};
      for (std::size_t k = 1; k < 6; ++k) at[k] = std::ldexp(double(base_[k] += travel[k]), -30);
      bend(at, dt);
    }
  }
  void base(Words& words) {
    std::array<double, 6> at;
    for (double& each : at) each = words.number();
    bend(at, words.number());
  }
  void bend(const std::array<double, 6>& at, double dt) {
    const bending::Base base{at[0], {at[1], at[2]}, {at[3], at[4]}, at[5]};
    std::visit(
        [&](auto& engine) {
          if constexpr (requires { engine.step(base, dt); }) print(engine.step(base, dt));
        },
        engine_);
  }
  static void print(const bending::BentSample& s) {
    print(s.axial);
    std::printf("bent");
    for (const double number : s.tip) std::printf(" %.17g", number);
    for (const double number : s.tangent) std::printf(" %.17g", number);
    for (const double number : s.wrench) std::printf(" %.17g", number);
    std::printf(" %.17g %.17g %.17g %s %d\n", s.force, s.lateral, s.unsupported, status_names[int(s.status)],
                s.buckled);
  }

  std::vector<Layer> layers_;
  Limits limits_;
  Bevel bevel_;
  std::optional<solid::CondensedTissue> tissue_;
  Flexible flexible_;
  Engine engine_;
  std::vector<unsigned char> kept_;
  bool known_ = true, made_ = false, accepted_ = false;
  long ticks_ = 0;
  std::array<long, 6> base_{};  // of a needle that bends, the same; the first is not used
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
