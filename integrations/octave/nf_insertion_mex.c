/* SPDX-License-Identifier: Apache-2.0
   The gateway of nf_insertion.m to the C library, for Octave and MATLAB: mex nf_insertion_mex.c
   -lneedleforce. The insertions live here, by number, until `delete` or `clear`; `help nf_insertion` has the
   calls. */
#include <stdio.h>
#include <string.h>

#include "mex.h"
#include "needleforce.h"

enum { MOST = 1000, LAYERS = 8, WORD = 64, WORDS = 1024 };
static nf_insertion* insertions[MOST];
/* of the model that is being read: the library copies it */
static nf_layer layers[LAYERS + 1];
static nf_tip tips[LAYERS + 1];
static char words[WORDS][WORD];
static size_t used;

static void refuse(const char* message) { mexErrMsgIdAndTxt("needleforce:input", "%s", message); }

static const char* word(const mxArray* text) {
  if (!text || !mxIsChar(text) || used == WORDS || mxGetString(text, words[used], WORD))
    refuse("a name is missing, not a text, or longer than 63 characters: see `needleforce laws`");
  return words[used++];
}
static const char* name_of(const char* text) {
  if (used == WORDS || strlen(text) >= WORD)
    refuse("a name is longer than 63 characters: see `needleforce laws`");
  return strcpy(words[used++], text);
}
static double number(const mxArray* value, const char* name) {
  if (!value || !mxIsDouble(value) || mxIsComplex(value) || mxGetNumberOfElements(value) != 1)
    mexErrMsgIdAndTxt("needleforce:input", "%s is not a real number: give one double, in SI", name);
  return mxGetScalar(value);
}
static const mxArray* given(const mxArray* value, size_t index, const char* name) {
  return mxIsStruct(value) ? mxGetField(value, (mwIndex)index, name) : NULL;
}

/* Every field that is a number but no other part of a law or tip. */
static void read_numbers(nf_parameter* room, size_t most, const mxArray* value) {
  size_t n = 0;
  for (int i = 0; i < mxGetNumberOfFields(value); ++i) {
    const char* name = mxGetFieldNameByNumber(value, i);
    const mxArray* field = mxGetFieldByNumber(value, 0, i);
    const char* const others[] = {"name", "tip", "equivalence", "radii", "heights"};
    int other = !field || mxIsEmpty(field); /* as in an array of structs of other laws */
    for (size_t k = 0; k < sizeof others / sizeof *others; ++k) other |= !strcmp(name, others[k]);
    if (other) continue;
    if (n == most) refuse("a law has more parameters than any law takes: see `needleforce laws`");
    room[n].name = name_of(name);
    room[n++].value = number(field, name);
  }
}
static void read_tip(nf_tip* tip, const mxArray* value) {
  const mxArray *radii = given(value, 0, "radii"), *heights = given(value, 0, "heights");
  if (!mxIsStruct(value)) refuse("tip is not a struct: give its name and parameters as fields");
  tip->name = word(given(value, 0, "name"));
  read_numbers(tip->parameters, sizeof tip->parameters / sizeof *tip->parameters, value);
  if (given(value, 0, "equivalence")) tip->equivalence = word(given(value, 0, "equivalence"));
  if (!radii && !heights) return;
  if (!radii || !heights || !mxIsDouble(radii) || !mxIsDouble(heights) ||
      mxGetNumberOfElements(radii) != mxGetNumberOfElements(heights))
    refuse("radii and heights of a profile are not of one length: give both as real arrays, in m");
  tip->radii = mxGetPr(radii);
  tip->heights = mxGetPr(heights);
  tip->knots = mxGetNumberOfElements(radii);
}
static void read_law(nf_law* law, nf_tip* tip, const mxArray* value, const char* family) {
  if (!value || mxIsEmpty(value)) return;
  if (!mxIsStruct(value))
    mexErrMsgIdAndTxt("needleforce:input", "%s is not a struct: give its name and parameters as fields",
                      family);
  law->name = word(given(value, 0, "name"));
  read_numbers(law->parameters, sizeof law->parameters / sizeof *law->parameters, value);
  if (!given(value, 0, "tip")) return;
  read_tip(tip, given(value, 0, "tip"));
  law->tip = tip;
}
/* A struct array, or a cell array of structs; how many there are. */
static size_t read_layers(const mxArray* value) {
  const size_t count = mxGetNumberOfElements(value), read = count < LAYERS ? count : LAYERS;
  if (!mxIsStruct(value) && !mxIsCell(value))
    refuse("layers are not a struct array: see `help nf_insertion`");
  memset(layers, 0, sizeof layers);
  memset(tips, 0, sizeof tips);
  used = 0;
  for (size_t i = 0; i < read; ++i) {
    const mxArray* one = mxIsCell(value) ? mxGetCell(value, (mwIndex)i) : value;
    const size_t at = mxIsCell(value) ? 0 : i;
    nf_layer* layer = &layers[i];
    nf_law* const laws[] = {&layer->stiffness, &layer->puncture, &layer->friction, &layer->cutting,
                            &layer->relaxation};
    const char* const families[] = {"stiffness", "puncture", "friction", "cutting", "relaxation"};
    if (!one) refuse("a layer is not a struct: see `help nf_insertion`");
    if (given(one, at, "top")) layer->top = number(given(one, at, "top"), "top");
    for (int k = 0; k < 5; ++k) read_law(laws[k], &tips[i], given(one, at, families[k]), families[k]);
  }
  return count;
}
static nf_settings read_settings(const mxArray* value) {
  nf_settings s = nf_default_settings();
  const struct {
    const char* name;
    double* at;
  } known[] = {{"max_speed", &s.max_speed},
               {"hold_time", &s.hold_time},
               {"velocity_slack", &s.velocity_slack},
               {"velocity_slack_ratio", &s.velocity_slack_ratio},
               {"bevel_half_angle", &s.bevel_half_angle},
               {"bevel_friction_coefficient", &s.bevel_friction_coefficient},
               {"bevel_face_share", &s.bevel_face_share},
               {"depth_noise", &s.depth_noise}};
  if (!value || mxIsEmpty(value)) return s;
  if (!mxIsStruct(value)) refuse("settings are not a struct: give those of `nf_settings` as fields");
  for (int i = 0; i < mxGetNumberOfFields(value); ++i) {
    const char* name = mxGetFieldNameByNumber(value, i);
    size_t k = 0;
    while (k < sizeof known / sizeof *known && strcmp(name, known[k].name)) ++k;
    if (k == sizeof known / sizeof *known)
      mexErrMsgIdAndTxt("needleforce:input", "%s is no setting: `help nf_insertion` has them", name);
    *known[k].at = number(mxGetFieldByNumber(value, 0, i), name);
  }
  return s;
}

static void create(mxArray** out, int n, const mxArray** in) {
  nf_fault why;
  int slot = 0;
  if (n < 1) refuse("layers are missing: nf_insertion('create', layers)");
  while (slot < MOST && insertions[slot]) ++slot;
  if (slot == MOST) refuse("1000 insertions exist: delete some, nf_insertion('delete', handle)");
  const size_t count = read_layers(in[0]);
  const nf_settings settings = read_settings(n > 1 ? in[1] : NULL);
  void* memory = mxMalloc(nf_size());
  mexMakeMemoryPersistent(memory);
  insertions[slot] = nf_init(memory, nf_size(), layers, count, &settings, &why);
  if (!insertions[slot]) {
    mxFree(memory);
    char range[64] = "";
    if (why.low != 0.0 || why.high != 0.0) snprintf(range, sizeof range, ": %g to %g", why.low, why.high);
    mexErrMsgIdAndTxt("needleforce:input",
                      "layer %d, %s %s (%g) %s%s. `needleforce laws` lists names and ranges",
                      (int)why.layer + 1, why.law, why.quantity, why.value, why.reason, range);
  }
  *out = mxCreateDoubleScalar(slot + 1);
}
static nf_insertion** called(int n, const mxArray** in) {
  const double slot = n ? number(in[0], "handle") : 0.0;
  if (!(slot >= 1 && slot <= MOST) || slot != (int)slot || !insertions[(int)slot - 1])
    refuse(
        "handle is of no insertion: nf_insertion('create', layers) gives one, 'delete' and `clear` end it");
  return &insertions[(int)slot - 1];
}

static mxArray* table(size_t rows, double* columns[14]) {
  const char* names[] = {
      "depth",          "velocity",          "force", "stiffness", "friction", "cutting",   "lateral",
      "force_by_depth", "force_by_velocity", "phase", "status",    "contact",  "punctured", "exit"};
  mxArray* samples = mxCreateStructMatrix(1, 1, 14, names);
  for (int k = 0; k < 14; ++k) {
    mxArray* column = mxCreateDoubleMatrix((mwSize)rows, 1, mxREAL);
    columns[k] = mxGetPr(column);
    mxSetFieldByNumber(samples, 0, k, column);
  }
  return samples;
}
static void put(double* columns[14], size_t row, const nf_sample* s) {
  const double numbers[] = {
      s->depth,          s->velocity,          s->force, s->stiffness, s->friction, s->cutting,   s->lateral,
      s->force_by_depth, s->force_by_velocity, s->phase, s->status,    s->contact,  s->punctured, s->exit};
  for (int k = 0; k < 14; ++k) columns[k][row] = numbers[k];
}
/* An array of as many numbers as there are depths, or one number for all, or nothing. */
static double at(const mxArray* value, size_t row, double without) {
  const size_t length = value ? mxGetNumberOfElements(value) : 0;
  return length ? mxGetPr(value)[length == 1 ? 0 : row] : without;
}
static void run(mxArray** out, int n, const mxArray** in) {
  nf_insertion* insertion = *called(n, in);
  double* columns[14];
  for (int i = 1; i < n; ++i)
    if (!mxIsDouble(in[i]) || mxIsComplex(in[i])) refuse("depth, dt or velocity is not of real doubles");
  if (n < 3) refuse("depth or dt is missing: nf_insertion('run', handle, depth, dt)");
  const size_t rows = mxGetNumberOfElements(in[1]);
  for (int i = 2; i < n; ++i) {
    const size_t length = mxGetNumberOfElements(in[i]);
    if (length != rows && length != 1 && (i == 2 || length))
      refuse("dt or velocity has another length than depth: give one number, or one for each depth");
  }
  *out = table(rows, columns);
  for (size_t i = 0; i < rows; ++i) {
    nf_sample sample;
    nf_step(insertion, mxGetPr(in[1])[i], at(n > 3 ? in[3] : NULL, i, NF_NO_VELOCITY), at(in[2], i, 0.0),
            &sample);
    put(columns, i, &sample);
  }
}
static void save(mxArray** out, int n, const mxArray** in) {
  nf_insertion* insertion = *called(n, in);
  *out = mxCreateNumericMatrix(1, (mwSize)nf_snapshot_size(), mxUINT8_CLASS, mxREAL);
  nf_snapshot(insertion, mxGetData(*out), nf_snapshot_size());
}
static void restore(mxArray** out, int n, const mxArray** in) {
  nf_insertion* insertion = *called(n, in);
  const int bytes = n > 1 && mxIsUint8(in[1]);
  *out =
      mxCreateLogicalScalar(bytes && nf_restore(insertion, mxGetData(in[1]), mxGetNumberOfElements(in[1])));
}
static void end_of(nf_insertion** insertion) {
  mxFree(*insertion);
  *insertion = NULL;
}
static void end_of_all(void) {
  for (int i = 0; i < MOST; ++i)
    if (insertions[i]) end_of(&insertions[i]);
}

void mexFunction(int n_out, mxArray* out[], int n, const mxArray* in[]) {
  char what[16];
  (void)n_out;
  if (nf_abi_version() != NF_ABI_VERSION)
    mexErrMsgIdAndTxt("needleforce:abi",
                      "the C library has ABI %d, and this was compiled for %d: compile it again",
                      nf_abi_version(), NF_ABI_VERSION);
  mexAtExit(end_of_all);
  if (n < 1 || !mxIsChar(in[0]) || mxGetString(in[0], what, sizeof what)) what[0] = '\0';
  --n, ++in;
  if (!strcmp(what, "create"))
    create(out, n, in);
  else if (!strcmp(what, "run"))
    run(out, n, in);
  else if (!strcmp(what, "reset"))
    nf_reset(*called(n, in));
  else if (!strcmp(what, "snapshot"))
    save(out, n, in);
  else if (!strcmp(what, "restore"))
    restore(out, n, in);
  else if (!strcmp(what, "delete"))
    end_of(called(n, in));
  else
    refuse("the first argument is none of create, run, reset, snapshot, restore, delete");
}
