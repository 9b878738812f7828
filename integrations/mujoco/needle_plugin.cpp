// SPDX-License-Identifier: Apache-2.0
// A passive force of MuJoCo: a needle on a slide joint, or at the end of an arm, feels the tissue. Built by
// build.sh.
//
//   <extension><plugin plugin="needleforce.needle"><instance name="needle">
//     <config key="joint" value="slide"/>                        or site="tip", its z axis the needle's
//     <config key="friction" value="coulomb"/> <config key="friction.per_length" value="18.6"/> ...
//   </instance></plugin></extension>
//   <sensor><plugin name="force" plugin="needleforce.needle" instance="needle"/></sensor>      if wanted
//
// MuJoCo computes passive forces several times a step (RK4, mj_forward, finite differences, mj_inverse). The
// engine's memory is in mjData.plugin_state as bytes, with the last force: computing works on a copy, and
// `advance` moves it once a step. So mj_copyData, mj_getState with mjSTATE_PLUGIN (or FULLPHYSICS),
// mj_setState, mj_resetData and mjd_transitionFD do as documented; keyframes hold no plugin state: after
// mj_resetDataKeyframe the tissue is intact again. Columns of mjd_transitionFD do not include the memory.
#include "configuration.hpp"

namespace needleforce::mujoco {
namespace {

constexpr const char* plugin_name = "needleforce.needle";

/// The contents of plugin_state.
struct Memory {
  double force;  ///< of the last step [N], where the next search starts
  Insertion::Saved engine;
};
constexpr int state_numbers = sizeof(Memory) / sizeof(mjtNum);
static_assert(sizeof(mjtNum) == sizeof(double) && sizeof(Memory) % sizeof(mjtNum) == 0);

/// What lies behind plugin_data: nothing that plugin_state and the attributes do not give again, but for what
/// was computed and waits for `advance`.
struct Instance {
  Insertion engine;
  Place place;
  int needles = 1;     ///< on the same tree, which share its mass
  Sample sample{};     ///< of the state at the beginning of the step
  double began = 0.0;  ///< time of it [s]
  double elapsed = 0.0;
  bool computed = false;
  bool holds = false;  ///< the engine is in the state of the sample
};

Instance& instance_of(const mjData* d, int instance) {
  return *reinterpret_cast<Instance*>(d->plugin_data[instance]);
}

Memory memory_of(const mjModel* m, const mjData* d, int instance) {
  Memory memory;
  std::memcpy(&memory, d->plugin_state + m->plugin_stateadr[instance], sizeof memory);
  return memory;
}

/// The engine as it was; with bytes of another tissue or version, in whole tissue.
void recall(Insertion& engine, const Memory& memory) noexcept {
  if (!engine.restore(memory.engine)) engine.reset();
}

int count_state(const mjModel*, int) { return state_numbers; }
int count_sensor(const mjModel*, int, int) { return 8; }

/// Needles on the same tree share its mass.
int needles_beside(const mjModel* m, int instance, const Place& place) {
  int needles = 0;
  for (int i = 0; i < m->nplugin; ++i) {
    if (m->plugin[i] != m->plugin[instance]) continue;
    Values values(m, i);
    const Place other = read_place(values, m);
    needles += values.fault.empty() && other.tree(m) == place.tree(m);
  }
  return std::max(1, needles);
}

int start(const mjModel* m, mjData* d, int instance) {
  Values values(m, instance);
  const Place place = read_place(values, m);
  const Insertion engine = read_engine(values);
  if (!values.fault.empty()) {
    const char* name = mj_id2name(m, mjOBJ_PLUGIN, instance);
    mju_warning("%s '%s': %s", plugin_name, name ? name : "", values.fault.c_str());
    return -1;
  }
  auto* data = new Instance{.engine = engine, .place = place, .needles = needles_beside(m, instance, place)};
  d->plugin_data[instance] = reinterpret_cast<uintptr_t>(data);
  return 0;
}

void destroy(mjData* d, int instance) {
  delete &instance_of(d, instance);
  d->plugin_data[instance] = 0;
}

void copy(mjData* to, const mjModel*, const mjData* from, int instance) {
  instance_of(to, instance) = instance_of(from, instance);
}

void reset(const mjModel*, mjtNum* state, void* plugin_data, int) {
  Instance& data = *static_cast<Instance*>(plugin_data);
  data.engine.reset();
  data.computed = false;
  const Memory memory{0.0, data.engine.save()};
  std::memcpy(state, &memory, sizeof memory);
}

/// The later stages of RK4 lie in the step that began before: they move nothing.
bool later_stage(const mjModel* m, const mjData* d, const Instance& data) {
  const double since = d->time - data.began;
  return m->opt.integrator == mjINT_RK4 && data.computed && since > 0.0 && since < 1.001 * m->opt.timestep;
}

Sample compute_sample(const mjModel* m, mjData* d, int instance, Instance& data, double elapsed) {
  Free free = free_motion(data.place, m, d);
  free.per_force *= data.needles;
  free.elapsed = elapsed;
  const Memory memory = memory_of(m, d, instance);
  return at_end_of_step(free, memory.force, [&](double depth) noexcept {
    recall(data.engine, memory);
    return data.engine.step(depth, no_velocity, elapsed);
  });
}

void compute_force(const mjModel* m, mjData* d, int instance, Instance& data) {
  const bool later = later_stage(m, d, data);
  const double elapsed = m->opt.timestep + (later ? d->time - data.began : 0.0);
  const Sample sample = compute_sample(m, d, instance, data, elapsed);
  data.holds = !later;
  if (!later) {
    data.sample = sample;
    data.began = d->time;
    data.elapsed = elapsed;
    data.computed = true;
  }
  apply(data.place, sample, m, d);
}

void show(const mjModel* m, mjData* d, int instance, const Sample& s) {
  const double shown[] = {s.depth,   s.force,   s.stiffness,     s.friction,
                          s.cutting, s.lateral, double(s.phase), double(s.status)};
  for (int i = 0; i < m->nsensor; ++i)
    if (m->sensor_plugin[i] == instance)
      std::copy(std::begin(shown), std::end(shown), d->sensordata + m->sensor_adr[i]);
}

void compute(const mjModel* m, mjData* d, int instance, int capability) {
  Instance& data = instance_of(d, instance);
  if (capability == mjPLUGIN_PASSIVE) compute_force(m, d, instance, data);
  if (capability == mjPLUGIN_SENSOR) show(m, d, instance, data.sample);
}

void advance(const mjModel* m, mjData* d, int instance) {
  Instance& data = instance_of(d, instance);
  if (!data.computed) return;
  if (!data.holds) {
    recall(data.engine, memory_of(m, d, instance));
    data.engine.step(data.sample.depth, no_velocity, data.elapsed);
  }
  const Memory memory{data.sample.force, data.engine.save()};
  std::memcpy(d->plugin_state + m->plugin_stateadr[instance], &memory, sizeof memory);
  data.computed = data.holds = false;
}

void enroll() {
  static std::vector<const char*> names;
  for (const std::string& name : attributes()) names.push_back(name.c_str());
  mjpPlugin plugin;
  mjp_defaultPlugin(&plugin);
  plugin.name = plugin_name;
  plugin.nattribute = static_cast<int>(names.size());
  plugin.attributes = names.data();
  plugin.capabilityflags = mjPLUGIN_PASSIVE | mjPLUGIN_SENSOR;
  plugin.needstage = mjSTAGE_VEL;
  plugin.nstate = count_state;
  plugin.nsensordata = count_sensor;
  plugin.init = start;
  plugin.destroy = destroy;
  plugin.copy = copy;
  plugin.reset = reset;
  plugin.compute = compute;
  plugin.advance = advance;
  mjp_registerPlugin(&plugin);
}

}  // namespace
}  // namespace needleforce::mujoco

mjPLUGIN_LIB_INIT(needleforce) { needleforce::mujoco::enroll(); }
