// SPDX-License-Identifier: Apache-2.0
// The C face for JavaScript, without structs: a model is given piece by piece, a sample read as
// parameters. One instance of the module holds one insertion; its memory only grows, before the loop.
#include "pieces.hpp"

#include <__verbose_abort>
#include <cstddef>
#include <cstring>

// the library's own prints, for which it would import files; what cannot happen traps instead
_LIBCPP_BEGIN_NAMESPACE_STD
[[noreturn]] void __libcpp_verbose_abort(const char*, ...) { __builtin_trap(); }
_LIBCPP_END_NAMESPACE_STD

extern "C" unsigned char __heap_base;

namespace {

constexpr std::size_t page = 65536, max_layers = 9,
                      max_knots = 33;  // one more than is accepted, to be refused

nf_tip tips[max_layers];
double radii[max_layers][max_knots], heights[max_layers][max_knots];
nf_parameter* parameters;  // of the law or tip given last
std::size_t given, room_left;
unsigned char* snapshot;

struct Setting {
  const char* name;
  double nf_settings::* member;
};
constexpr Setting known[] = {{"max_speed", &nf_settings::max_speed},
                             {"hold_time", &nf_settings::hold_time},
                             {"depth_noise", &nf_settings::depth_noise},
                             {"velocity_slack", &nf_settings::velocity_slack},
                             {"velocity_slack_ratio", &nf_settings::velocity_slack_ratio},
                             {"bevel_half_angle", &nf_settings::bevel_half_angle},
                             {"bevel_friction_coefficient", &nf_settings::bevel_friction_coefficient},
                             {"bevel_face_share", &nf_settings::bevel_face_share}};

nf_layer& layer() { return pieces::layers[pieces::count - 1]; }
nf_tip& tip() { return tips[pieces::count - 1]; }

}  // namespace

namespace pieces {

nf_layer layers[max_layers];
std::size_t count;
nf_settings settings;
nf_insertion* insertion;
nf_sample sample;
nf_fault fault;

void open(nf_parameter* list, std::size_t most) {
  parameters = list;
  given = 0;
  room_left = most - 1;
}

}  // namespace pieces

using namespace pieces;

// pieces.mjs reads samples so: nine doubles, then five integers
static_assert(offsetof(nf_sample, phase) == 9 * sizeof(double) && sizeof(int) == 4);

extern "C" {

void* EXPORT(room)(std::size_t bytes) {
  static unsigned char* next = &__heap_base;
  next += -reinterpret_cast<std::size_t>(next) % alignof(double);
  unsigned char* here = next;
  next += bytes;
  const std::size_t end = __builtin_wasm_memory_size(0) * page, needed = reinterpret_cast<std::size_t>(next);
  if (needed > end) __builtin_wasm_memory_grow(0, (needed - end + page - 1) / page);
  return here;
}

void EXPORT(begin)() { settings = nf_default_settings(); }
int EXPORT(set)(const char* name, double value) {
  for (const Setting& setting : known)
    if (std::strcmp(name, setting.name) == 0) return settings.*setting.member = value, 1;
  return 0;
}
int EXPORT(add_layer)(double top) {
  if (count == max_layers) return 0;
  layers[count++].top = top;
  return 1;
}
void EXPORT(choose_law)(int family, const char* name) {
  nf_law* laws[] = {&layer().stiffness, &layer().puncture, &layer().friction, &layer().cutting,
                    &layer().relaxation};
  laws[family]->name = name;
  open(laws[family]->parameters);
}
void EXPORT(choose_tip)(const char* name, const char* equivalence) {
  tip() = {name, {}, equivalence, radii[count - 1], heights[count - 1], 0};
  layer().stiffness.tip = &tip();
  open(tip().parameters);
}
int EXPORT(give)(const char* name, double value) {
  if (given == room_left) return 0;
  parameters[given++] = {name, value};
  return 1;
}
int EXPORT(add_knot)(double radius, double height) {
  if (tip().knots == max_knots) return 0;
  radii[count - 1][tip().knots] = radius;
  heights[count - 1][tip().knots++] = height;
  return 1;
}

/// 1, or 0 and a fault with the reason.
int EXPORT(make)() {
  void* memory = room(nf_size());
  snapshot = static_cast<unsigned char*>(room(nf_snapshot_size()));
  insertion = nf_init(memory, nf_size(), layers, count, &settings, &fault);
  return insertion != nullptr;
}
const char* EXPORT(fault_text)(int which) {
  return which == 0 ? fault.law : which == 1 ? fault.quantity : fault.reason;
}
double EXPORT(fault_number)(int which) {
  return which == 0 ? double(fault.layer) : which == 1 ? fault.value : which == 2 ? fault.low : fault.high;
}

const nf_sample* EXPORT(sample_at)() { return &sample; }
unsigned char* EXPORT(snapshot_at)() { return snapshot; }
void EXPORT(step)(double depth, double velocity, double dt) {
  nf_step(insertion, depth, velocity, dt, &sample);
}
void EXPORT(reset)() { nf_reset(insertion); }
void EXPORT(save)() { nf_snapshot(insertion, snapshot, nf_snapshot_size()); }
int EXPORT(restore)(std::size_t size) { return nf_restore(insertion, snapshot, size); }
std::size_t EXPORT(snapshot_size)() { return nf_snapshot_size(); }
const char* EXPORT(phase_name)(int phase) { return nf_phase_name(phase); }
const char* EXPORT(status_name)(int status) { return nf_status_name(status); }
const char* EXPORT(version)() { return nf_version(); }

}  // extern "C"
