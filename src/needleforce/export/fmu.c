/* SPDX-License-Identifier: Apache-2.0
   The functions of FMI 3.0 over needleforce.h, for co-simulation. model.h, which `needleforce export
   --language fmu` writes, has the model, its name and its token. In the language that C and C++ share: one
   compiler builds it all. Co-simulation: what depth is set before fmi3DoStep is where the tip is at the end
   of that step. */
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

#if defined(_WIN32)
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif
#ifdef __cplusplus
extern "C" {
#endif

typedef enum { OK, WARNING, DISCARD, ERROR } Status;
typedef uint32_t Reference;
typedef void (*Log)(void* environment, Status status, const char* category, const char* message);
typedef enum { INSTANTIATED, INITIALIZING, STEPPING, ENDED } Mode;

/* References of values: those of modelDescription.xml. */
enum { TIME, DEPTH, VELOCITY, MEASURED }; /* and the settings */
enum { FORCE = 20, STIFFNESS, FRICTION, CUTTING, LATERAL, BY_DEPTH, BY_VELOCITY };
enum { PHASE = 40, STATUS, CONTACT, PUNCTURED, EXIT };
enum { PARAMETERS = 100 }; /* of the laws, in their order from the surface down */

/* Numbers of a state of the FMU, without the memory of the tissue; no pointers, no gaps. */
typedef struct {
  double time, dt, depth, velocity, measured;
  nf_settings settings;
  double force, stiffness, friction, cutting, lateral, by_depth, by_velocity;
  double phase, status, contact, punctured, exit, mode;
} Numbers;

typedef struct {
  Numbers now;
  nf_layer layers[MODEL_LAYERS];
  nf_insertion* insertion; /* in `memory`, from the end of the initialization on */
  void* memory;
  void* environment;
  Log log;
} Fmu;

static Status fault(Fmu* fmu, Status status, const char* format, ...) {
  char text[400];
  va_list values;
  va_start(values, format);
  vsnprintf(text, sizeof text, format, values);
  va_end(values);
  if (fmu && fmu->log) fmu->log(fmu->environment, status, "logStatusError", text);
  return status;
}

static double* parameter(Fmu* fmu, Reference reference) {
  Reference next = PARAMETERS;
  for (size_t i = 0; i < MODEL_LAYERS; ++i) {
    nf_layer* layer = &fmu->layers[i];
    nf_law* laws[] = {&layer->stiffness, &layer->puncture, &layer->friction, &layer->cutting,
                      &layer->relaxation};
    if (next++ == reference) return &layer->top;
    for (size_t k = 0; k < 5; ++k)
      for (size_t p = 0; p < 12 && laws[k]->parameters[p].name; ++p)
        if (next++ == reference) return &laws[k]->parameters[p].value;
  }
  return NULL;
}

static void start(Fmu* fmu) {
  memcpy(fmu->layers, MODEL_LAYER_VALUES, sizeof fmu->layers);
  memset(&fmu->now, 0, sizeof fmu->now);
  fmu->now.settings = nf_default_settings();
  fmu->insertion = NULL;
}

static void take(Numbers* now, const nf_sample* s) {
  now->force = s->force, now->stiffness = s->stiffness, now->friction = s->friction;
  now->cutting = s->cutting, now->lateral = s->lateral;
  now->by_depth = s->force_by_depth, now->by_velocity = s->force_by_velocity;
  now->phase = s->phase, now->status = s->status;
  now->contact = s->contact, now->punctured = s->punctured, now->exit = s->exit;
}

static double* number(Fmu* fmu, Reference reference) {
  Numbers* now = &fmu->now;
  nf_settings* s = &now->settings;
  double* const front[] = {&now->time,     &now->depth,         &now->velocity,    &now->measured,
                           &s->max_speed,  &s->hold_time,       &s->depth_noise,   &s->bevel_half_angle,
                           &s->bevel_friction_coefficient,      &s->bevel_face_share};
  if (reference < sizeof front / sizeof *front) return front[reference];
  if (reference >= FORCE && reference <= BY_VELOCITY) return &now->force + (reference - FORCE);
  if (reference >= PHASE && reference <= EXIT) return &now->phase + (reference - PHASE);
  return parameter(fmu, reference);
}

/* An input, or a parameter when it may be set. */
static Status set(Fmu* fmu, Reference reference, double value) {
  double* place = number(fmu, reference);
  const int input = reference == DEPTH || reference == VELOCITY;
  if (!place || reference == TIME || (reference >= FORCE && reference < PARAMETERS))
    return fault(fmu, ERROR, "value reference %u: not one that is set. See modelDescription.xml.",
                 (unsigned)reference);
  if (!input && fmu->now.mode >= STEPPING)
    return fault(fmu, ERROR,
                 "value reference %u: a parameter is set before the end of the initialization. "
                 "Call fmi3Reset first.",
                 (unsigned)reference);
  *place = value;
  return OK;
}

API const char* fmi3GetVersion(void) { return "3.0"; }
API Status fmi3SetDebugLogging(Fmu* fmu, bool on, size_t n, const char* const categories[]) {
  (void)fmu, (void)on, (void)n, (void)categories;
  return OK;
}

API Fmu* fmi3InstantiateCoSimulation(const char* name, const char* token, const char* resources, bool visible,
                                     bool logging, bool events, bool early, const Reference intermediate[],
                                     size_t n, void* environment, Log log, void* update) {
  (void)name, (void)resources, (void)visible, (void)logging, (void)events, (void)early, (void)intermediate,
      (void)n;
  (void)update;
  if (!token || strcmp(token, MODEL_TOKEN)) {
    if (log)
      log(environment, ERROR, "logStatusError",
          "instantiationToken: not that of this FMU. Use its own modelDescription.xml.");
    return NULL;
  }
  Fmu* fmu = (Fmu*)calloc(1, sizeof *fmu);
  if (fmu) fmu->memory = malloc(nf_size());
  if (!fmu || !fmu->memory) return free(fmu), (Fmu*)NULL;
  fmu->environment = environment;
  fmu->log = log;
  start(fmu);
  return fmu;
}
API void fmi3FreeInstance(Fmu* fmu) {
  if (!fmu) return;
  free(fmu->memory);
  free(fmu);
}

API Status fmi3EnterInitializationMode(Fmu* fmu, bool tolerance_defined, double tolerance, double begin,
                                       bool stop_defined, double stop) {
  (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
  if (fmu->now.mode != INSTANTIATED)
    return fault(fmu, ERROR, "fmi3EnterInitializationMode: called twice. Call fmi3Reset first.");
  if (!isfinite(begin)) return fault(fmu, ERROR, "startTime: not a finite number.");
  fmu->now.time = begin;
  fmu->now.mode = INITIALIZING;
  return OK;
}
static Status make(Fmu* fmu) {
  nf_fault why;
  fmu->insertion =
      nf_init(fmu->memory, nf_size(), fmu->layers, MODEL_LAYERS, &fmu->now.settings, &why);
  if (fmu->insertion) return OK;
  return fault(fmu, ERROR, "layer %u, %s %s = %g: %s. Set another value before the initialization ends.",
               (unsigned)why.layer + 1, why.law ? why.law : "", why.quantity ? why.quantity : "", why.value,
               why.reason ? why.reason : "refused");
}
API Status fmi3ExitInitializationMode(Fmu* fmu) {
  if (fmu->now.mode != INITIALIZING)
    return fault(fmu, ERROR, "fmi3ExitInitializationMode: call fmi3EnterInitializationMode first.");
  const Status made = make(fmu);
  if (made == OK) fmu->now.mode = STEPPING;
  return made;
}
API Status fmi3Terminate(Fmu* fmu) {
  fmu->now.mode = ENDED;
  return OK;
}
API Status fmi3Reset(Fmu* fmu) {
  start(fmu);
  return OK;
}

API Status fmi3DoStep(Fmu* fmu, double at, double dt, bool no_earlier, bool* event, bool* terminate,
                      bool* early, double* reached) {
  Numbers* now = &fmu->now;
  nf_sample sample;
  (void)no_earlier;
  *event = *terminate = *early = 0;
  *reached = now->time;
  if (now->mode != STEPPING)
    return fault(fmu, ERROR, "fmi3DoStep: not initialized, or terminated. Call fmi3Reset and initialize.");
  if (!(fabs(at - now->time) <= 1e-9 * (1.0 + fabs(now->time))))
    return fault(fmu, DISCARD,
                 "currentCommunicationPoint = %.17g s: %s the time of this FMU, %.17g s. %s; nothing was changed.",
                 at, at < now->time ? "before" : "not", now->time,
                 at < now->time ? "To go back, restore a state of that time with fmi3SetFMUState"
                                : "Step on from its time");
  if (!(dt > 0.0) || !isfinite(dt))
    return fault(fmu, DISCARD,
                 "communicationStepSize = %g s: not above 0. Time goes forwards; nothing was changed.", dt);
  nf_step(fmu->insertion, now->depth, now->measured != 0.0 ? now->velocity : NF_NO_VELOCITY, dt, &sample);
  take(now, &sample);
  now->time = at + dt;
  now->dt = dt;
  *reached = now->time;
  return OK;
}

/* Force by depth and velocity along the last step, of which the depth is the end. */
static Status derivative(Fmu* fmu, Reference unknown, Reference known, double* value) {
  const Numbers* now = &fmu->now;
  if (unknown != FORCE || (known != DEPTH && known != VELOCITY))
    return fault(fmu, ERROR,
                 "derivative of %u by %u: none. There are those of the force by depth and velocity.",
                 (unsigned)unknown, (unsigned)known);
  const int own =
      now->measured == 0.0 && now->dt > 0.0; /* the velocity is the change of depth over the step */
  *value = known == VELOCITY ? (own ? 0.0 : now->by_velocity)
                             : now->by_depth + (own ? now->by_velocity / now->dt : 0.0);
  return OK;
}
/* Unknowns by the seed of the knowns, or, backwards, knowns by that of the unknowns. */
static Status along(Fmu* fmu, const Reference unknowns[], size_t nu, const Reference knowns[], size_t nk,
                    const double seed[], size_t ns, double out[], size_t no, bool backwards) {
  double value;
  if (ns != (backwards ? nu : nk) || no != (backwards ? nk : nu))
    return fault(fmu, ERROR, "seed or sensitivity: as many as knowns and unknowns are needed.");
  for (size_t i = 0; i < no; ++i) out[i] = 0.0;
  for (size_t u = 0; u < nu; ++u)
    for (size_t k = 0; k < nk; ++k) {
      if (derivative(fmu, unknowns[u], knowns[k], &value) != OK) return ERROR;
      out[backwards ? k : u] += value * seed[backwards ? u : k];
    }
  return OK;
}
API Status fmi3GetDirectionalDerivative(Fmu* fmu, const Reference unknowns[], size_t nu,
                                        const Reference knowns[], size_t nk, const double seed[], size_t ns,
                                        double sensitivity[], size_t nv) {
  return along(fmu, unknowns, nu, knowns, nk, seed, ns, sensitivity, nv, false);
}
API Status fmi3GetAdjointDerivative(Fmu* fmu, const Reference unknowns[], size_t nu, const Reference knowns[],
                                    size_t nk, const double seed[], size_t ns, double sensitivity[],
                                    size_t nv) {
  return along(fmu, unknowns, nu, knowns, nk, seed, ns, sensitivity, nv, true);
}

#define ACCESS(Name, Type, of_type)                                                                      \
  API Status fmi3Get##Name(Fmu* fmu, const Reference references[], size_t n, Type values[], size_t nv) { \
    if (nv != n) return fault(fmu, ERROR, "values: as many as references are needed.");                  \
    for (size_t i = 0; i < n; ++i) {                                                                     \
      const double* place = of_type(references[i]) ? number(fmu, references[i]) : NULL;                  \
      if (!place)                                                                                        \
        return fault(fmu, ERROR, "value reference %u: none of this type.", (unsigned)references[i]);     \
      values[i] = (Type) * place;                                                                        \
    }                                                                                                    \
    return OK;                                                                                           \
  }                                                                                                      \
  API Status fmi3Set##Name(Fmu* fmu, const Reference references[], size_t n, const Type values[],        \
                           size_t nv) {                                                                  \
    if (nv != n) return fault(fmu, ERROR, "values: as many as references are needed.");                  \
    for (size_t i = 0; i < n; ++i) {                                                                     \
      if (!of_type(references[i]))                                                                       \
        return fault(fmu, ERROR, "value reference %u: none of this type.", (unsigned)references[i]);     \
      if (set(fmu, references[i], (double)values[i]) != OK) return ERROR;                                \
    }                                                                                                    \
    return OK;                                                                                           \
  }
#define BOOLEAN(r) ((r) == MEASURED || ((r) >= CONTACT && (r) <= EXIT))
#define WORD(r) ((r) == PHASE || (r) == STATUS)
#define REAL(r) (!BOOLEAN(r) && !WORD(r))
ACCESS(Float64, double, REAL)
ACCESS(Int32, int32_t, WORD)
ACCESS(Boolean, bool, BOOLEAN)

/* A state of the FMU, as bytes that need no change to be written to a file; the memory of the tissue follows.
 */
typedef struct {
  uint64_t model, sum;
  Numbers now;
  double parameters[61 * MODEL_LAYERS];
} State;
static size_t state_size(void) { return sizeof(State) + nf_snapshot_size(); }
static uint64_t hash(const void* bytes, size_t size) {
  uint64_t value = 14695981039346656037ull;
  for (size_t i = 0; i < size; ++i) value = (value ^ ((const unsigned char*)bytes)[i]) * 1099511628211ull;
  return value;
}
static uint64_t sum_of(const State* state) {
  return hash((const char*)state + 2 * sizeof(uint64_t), state_size() - 2 * sizeof(uint64_t));
}
API Status fmi3GetFMUState(Fmu* fmu, void** out) {
  State* state = (State*)(*out ? *out : malloc(state_size()));
  double* value;
  if (!state) return fault(fmu, ERROR, "fmi3GetFMUState: no memory.");
  memset(state, 0, state_size());
  state->model = hash(MODEL_TOKEN, strlen(MODEL_TOKEN));
  state->now = fmu->now;
  for (Reference i = 0; (value = parameter(fmu, PARAMETERS + i)) != NULL; ++i) state->parameters[i] = *value;
  if (fmu->insertion) nf_snapshot(fmu->insertion, state + 1, nf_snapshot_size());
  state->sum = sum_of(state);
  *out = state;
  return OK;
}
API Status fmi3SetFMUState(Fmu* fmu, void* from) {
  const State* state = (const State*)from;
  double* value;
  if (!state || state->model != hash(MODEL_TOKEN, strlen(MODEL_TOKEN)) || state->sum != sum_of(state))
    return fault(fmu, ERROR, "FMUState: of another model or version, or altered. Nothing was changed.");
  fmu->now = state->now;
  for (Reference i = 0; (value = parameter(fmu, PARAMETERS + i)) != NULL; ++i) *value = state->parameters[i];
  fmu->insertion = NULL;
  if (fmu->now.mode < STEPPING) return OK;
  if (make(fmu) != OK) return ERROR;
  if (nf_restore(fmu->insertion, state + 1, nf_snapshot_size())) return OK;
  return fault(fmu, ERROR, "FMUState: no state that a needle can have. Call fmi3Reset.");
}
API Status fmi3FreeFMUState(Fmu* fmu, void** state) {
  (void)fmu;
  if (state) free(*state), *state = NULL;
  return OK;
}
API Status fmi3SerializedFMUStateSize(Fmu* fmu, void* state, size_t* size) {
  (void)fmu, (void)state;
  *size = state_size();
  return OK;
}
API Status fmi3SerializeFMUState(Fmu* fmu, void* state, uint8_t bytes[], size_t size) {
  if (!state || size < state_size()) return fault(fmu, ERROR, "size: below fmi3SerializedFMUStateSize.");
  memcpy(bytes, state, state_size());
  return OK;
}
API Status fmi3DeserializeFMUState(Fmu* fmu, const uint8_t bytes[], size_t size, void** out) {
  State* state = size == state_size() ? (State*)(*out ? *out : malloc(size)) : NULL;
  if (!state) return fault(fmu, ERROR, "size: not that of a state of this FMU.");
  memcpy(state, bytes, size);
  *out = state;
  return OK;
}

/* The other kinds of FMU are refused when one is made; what belongs to them, and types without variables. */
static Fmu* no_such_kind(void* environment, Log log) {
  if (log)
    log(environment, ERROR, "logStatusError",
        "This FMU is for co-simulation alone: call fmi3InstantiateCoSimulation.");
  return NULL;
}
API Fmu* fmi3InstantiateModelExchange(const char* name, const char* token, const char* resources,
                                      bool visible, bool logging, void* environment, Log log) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging;
  return no_such_kind(environment, log);
}
API Fmu* fmi3InstantiateScheduledExecution(const char* name, const char* token, const char* resources,
                                           bool visible, bool logging, void* environment, Log log,
                                           void* update, void* lock, void* unlock) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)update, (void)lock,
      (void)unlock;
  return no_such_kind(environment, log);
}
#define NONE(name)                                                                                    \
  API Status name(Fmu* fmu) {                                                                         \
    return fault(fmu, ERROR, #name ": this FMU has nothing of that kind. See modelDescription.xml."); \
  }
#define NONE_OF(Name) \
  NONE(fmi3Get##Name) \
  NONE(fmi3Set##Name)
/* clang-format off */
NONE_OF(Float32) NONE_OF(Int8) NONE_OF(UInt8) NONE_OF(Int16) NONE_OF(UInt16) NONE_OF(UInt32) NONE_OF(Int64)
NONE_OF(UInt64) NONE_OF(String) NONE_OF(Binary) NONE_OF(Clock) NONE_OF(IntervalDecimal)
NONE_OF(IntervalFraction) NONE_OF(ShiftDecimal) NONE_OF(ShiftFraction) NONE_OF(ContinuousStates)
NONE(fmi3GetNumberOfVariableDependencies) NONE(fmi3GetVariableDependencies) NONE(fmi3EnterConfigurationMode)
NONE(fmi3ExitConfigurationMode) NONE(fmi3EnterEventMode) NONE(fmi3EvaluateDiscreteStates)
NONE(fmi3UpdateDiscreteStates) NONE(fmi3EnterContinuousTimeMode) NONE(fmi3CompletedIntegratorStep)
NONE(fmi3SetTime) NONE(fmi3GetContinuousStateDerivatives) NONE(fmi3GetEventIndicators)
NONE(fmi3GetNominalsOfContinuousStates) NONE(fmi3GetNumberOfEventIndicators)
NONE(fmi3GetNumberOfContinuousStates) NONE(fmi3EnterStepMode) NONE(fmi3GetOutputDerivatives)
NONE(fmi3ActivateModelPartition)
/* clang-format on */

#ifdef __cplusplus
}
#endif
