/* SPDX-License-Identifier: Apache-2.0
   The conformance set through the C header alone; README.md says what a case is. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../bindings/c/needleforce_bend.h"

enum { MAX_LAYERS = 16, MOST_KNOTS = 32, MOST_WORDS = 64, MOST_POINTS = 200, MOST_NODES = 64 };

typedef struct {
  nf_layer layers[MAX_LAYERS];
  nf_tip tips[MAX_LAYERS];
  double radii[MAX_LAYERS][MOST_KNOTS], heights[MAX_LAYERS][MOST_KNOTS];
  size_t count;
  nf_settings settings;
  void *memory, *kept;
  nf_insertion* insertion;
  double spacing, *compliance; /* of a solid, otherwise NULL */
  size_t nodes;
  nf_solid* solid;
  nf_lateral_layer lateral[MAX_LAYERS];
  nf_section sections[MAX_LAYERS];
  nf_parameter lengths[MAX_LAYERS];
  nf_bending bending;
  nf_bend* needle;
  int made, accepted;
  long ticks;
  long base[6]; /* of a needle that bends, the same; [0] is not used */
} Case;

typedef struct {
  char* word[MOST_WORDS];
  int n;
} Words;

static char* copy_of(const char* text) {
  char* copy = malloc(strlen(text) + 1);
  return copy ? strcpy(copy, text) : NULL;
}
static double number(const char* word) { return strtod(word, NULL); }
static double velocity_of(const char* word) { return strcmp(word, "-") ? number(word) : NF_NO_VELOCITY; }
static nf_layer* layer_of(Case* c) { return &c->layers[c->count - 1]; }

static void name_parameters(nf_parameter* parameters, const Words* w, int from) {
  for (int i = from; i + 1 < w->n; i += 2) {
    parameters->name = copy_of(w->word[i]);
    parameters++->value = number(w->word[i + 1]);
  }
}

static void set(nf_settings* s, const char* name, double value) {
  if (!strcmp(name, "max_speed")) s->max_speed = value;
  if (!strcmp(name, "hold_time")) s->hold_time = value;
  if (!strcmp(name, "depth_noise")) s->depth_noise = value;
  if (!strcmp(name, "bevel_half_angle")) s->bevel_half_angle = value;
  if (!strcmp(name, "bevel_friction_coefficient")) s->bevel_friction_coefficient = value;
  if (!strcmp(name, "bevel_face_share")) s->bevel_face_share = value;
}

static nf_law* law_of(Case* c, const char* family) {
  if (c->count == 0) return NULL;
  if (!strcmp(family, "stiffness")) return &layer_of(c)->stiffness;
  if (!strcmp(family, "puncture")) return &layer_of(c)->puncture;
  if (!strcmp(family, "friction")) return &layer_of(c)->friction;
  if (!strcmp(family, "cutting")) return &layer_of(c)->cutting;
  return strcmp(family, "relaxation") ? NULL : &layer_of(c)->relaxation;
}

static void choose_tip(Case* c, const Words* w) {
  nf_tip* tip = &c->tips[c->count - 1];
  tip->name = copy_of(w->word[1]);
  tip->radii = c->radii[c->count - 1];
  tip->heights = c->heights[c->count - 1];
  if (w->n > 4 && !strcmp(w->word[4], "equivalence")) {
    tip->equivalence = copy_of(w->word[5]);
    tip->parameters[0].name = copy_of(w->word[2]);
    tip->parameters[0].value = number(w->word[3]);
  } else {
    name_parameters(tip->parameters, w, 2);
  }
  layer_of(c)->stiffness.tip = tip;
}

static void add_knot(Case* c, const Words* w) {
  nf_tip* tip = &c->tips[c->count - 1];
  c->radii[c->count - 1][tip->knots] = number(w->word[1]);
  c->heights[c->count - 1][tip->knots++] = number(w->word[2]);
}

static void describe_solid(Case* c, const Words* w) {
  const double scale = number(w->word[3]), fall = number(w->word[4]);
  c->spacing = number(w->word[1]);
  c->nodes = (size_t)atol(w->word[2]);
  c->compliance = malloc(c->nodes * c->nodes * sizeof(double));
  for (size_t i = 0; i < c->nodes; ++i)
    for (size_t j = 0; j < c->nodes; ++j) {
      const double apart = (double)i - (double)j;
      c->compliance[i * c->nodes + j] = scale / (1.0 + fall * (apart * apart));
    }
}

static void add_lateral(Case* c, const Words* w) {
  nf_lateral_layer* layer = &c->lateral[c->bending.layer_count++];
  const Words numbers = {{NULL}, 0};
  Words given = numbers;
  for (int i = 0; i < w->n; ++i) {
    if (!strcmp(w->word[i], "form"))
      layer->form = copy_of(w->word[++i]);
    else
      given.word[given.n++] = w->word[i];
  }
  given.word[0] = "top";
  name_parameters(layer->parameters, &given, 0);
}

static void set_bending(Case* c, const char* name, const char* value) {
  if (!strcmp(name, "elements")) {
    c->bending.elements = atoi(value);
  } else {
    c->lengths[c->bending.parameter_count].name = copy_of(name);
    c->lengths[c->bending.parameter_count++].value = number(value);
  }
}

/* 1 for a line of the model */
static int describe(Case* c, const Words* w) {
  nf_law* law = law_of(c, w->word[0]);
  if (law) {
    law->name = copy_of(w->word[1]);
    name_parameters(law->parameters, w, 2);
  } else if (!strcmp(w->word[0], "layer")) {
    c->layers[c->count++].top = number(w->word[1]);
  } else if (!strcmp(w->word[0], "set")) {
    set(&c->settings, w->word[1], number(w->word[2]));
  } else if (!strcmp(w->word[0], "tip")) {
    choose_tip(c, w);
  } else if (!strcmp(w->word[0], "knot")) {
    add_knot(c, w);
  } else if (!strcmp(w->word[0], "solid")) {
    describe_solid(c, w);
  } else if (!strcmp(w->word[0], "lateral")) {
    add_lateral(c, w);
  } else if (!strcmp(w->word[0], "section")) {
    const nf_section section = {number(w->word[1]), number(w->word[2]), number(w->word[3])};
    c->sections[c->bending.section_count++] = section;
  } else if (!strcmp(w->word[0], "bending")) {
    set_bending(c, w->word[1], w->word[2]);
  } else {
    return 0;
  }
  return 1;
}

static void print(nf_sample s) {
  printf("%.17g %.17g %.17g %.17g %.17g ", s.depth, s.velocity, s.force, s.stiffness, s.friction);
  printf("%.17g %.17g %.17g %.17g ", s.cutting, s.lateral, s.force_by_depth, s.force_by_velocity);
  printf("%s %s %d %d %d\n", nf_phase_name(s.phase), nf_status_name(s.status), s.contact, s.punctured,
         s.exit);
}
static void step(Case* c, double depth, double velocity, double dt) {
  nf_sample s;
  if (c->solid)
    nf_solid_step(c->solid, depth, velocity, dt, &s);
  else
    nf_step(c->insertion, depth, velocity, dt, &s);
  print(s);
}

static void go(Case* c, const Words* w) {
  for (int i = 0, n = atoi(w->word[1]); i < n; ++i) {
    c->ticks += atol(w->word[4 + i % (w->n - 4)]);
    step(c, ldexp((double)c->ticks, -30), velocity_of(w->word[3]), number(w->word[2]));
  }
}

static void bend(Case* c, nf_base base, double dt) {
  nf_bent s;
  nf_bend_step(c->needle, &base, dt, &s);
  print(s.axial);
  printf("bent");
  for (int i = 0; i < 3; ++i) printf(" %.17g", s.tip[i]);
  for (int i = 0; i < 3; ++i) printf(" %.17g", s.tangent[i]);
  for (int i = 0; i < 6; ++i) printf(" %.17g", s.wrench[i]);
  printf(" %.17g %.17g %.17g %s %d\n", s.force, s.lateral, s.unsupported, nf_status_name(s.status),
         s.buckled);
}

static void carry(Case* c, const Words* w) {
  for (int i = 0, n = atoi(w->word[1]); i < n; ++i) {
    double at[6];
    c->ticks += atol(w->word[3]);
    for (int k = 1; k < 6; ++k) c->base[k] += atol(w->word[3 + k]);
    for (int k = 0; k < 6; ++k) at[k] = ldexp((double)(k ? c->base[k] : c->ticks), -30);
    const nf_base base = {at[0], {at[1], at[2]}, {at[3], at[4]}, at[5]};
    bend(c, base, number(w->word[2]));
  }
}

static void one_base(Case* c, const Words* w) {
  double at[7];
  for (int k = 0; k < 7; ++k) at[k] = number(w->word[1 + k]);
  const nf_base base = {at[0], {at[1], at[2]}, {at[3], at[4]}, at[5]};
  bend(c, base, at[6]);
}

static void shape(const Case* c) {
  double points[3 * MOST_POINTS];
  for (size_t i = 0, n = nf_bend_shape(c->needle, points, MOST_POINTS); i < n; ++i)
    printf("point %.17g %.17g %.17g\n", points[3 * i], points[3 * i + 1], points[3 * i + 2]);
}

static void nodes(const Case* c) {
  double forces[MOST_NODES], displacements[MOST_NODES];
  const size_t n = nf_solid_forces(c->solid, forces, MOST_NODES);
  nf_solid_displacements(c->solid, displacements, MOST_NODES);
  printf("tip %.17g\n", nf_solid_tip(c->solid));
  for (size_t i = 0; i < n; ++i) printf("node %.17g %.17g\n", forces[i], displacements[i]);
}

static size_t kept_size(const Case* c) {
  return c->needle ? nf_bend_snapshot_size() : c->solid ? nf_solid_snapshot_size() : nf_snapshot_size();
}
static void reset(Case* c) {
  if (c->needle)
    nf_bend_reset(c->needle);
  else if (c->solid)
    nf_solid_reset(c->solid);
  else
    nf_reset(c->insertion);
}
static void keep(Case* c) {
  if (c->needle)
    nf_bend_snapshot(c->needle, c->kept, kept_size(c));
  else if (c->solid)
    nf_solid_snapshot(c->solid, c->kept, kept_size(c));
  else
    nf_snapshot(c->insertion, c->kept, kept_size(c));
}
static void restore(Case* c) {
  const size_t size = kept_size(c);
  const int taken = c->needle  ? nf_bend_restore(c->needle, c->kept, size)
                    : c->solid ? nf_solid_restore(c->solid, c->kept, size)
                               : nf_restore(c->insertion, c->kept, size);
  puts(taken ? "taken" : "refused");
}

static int make_axial(Case* c) {
  const size_t size = c->compliance ? nf_solid_size() : nf_size();
  c->memory = malloc(size);
  if (c->compliance)
    c->solid = nf_solid_init(c->memory, size, c->layers, c->count, &c->settings, c->spacing, c->nodes,
                             c->compliance, NULL);
  else
    c->insertion = nf_init(c->memory, size, c->layers, c->count, &c->settings, NULL);
  return c->solid || c->insertion;
}
static int make_needle(Case* c) {
  const size_t size = nf_bend_size();
  void* memory = malloc(size);
  c->bending.layers = c->lateral, c->bending.sections = c->sections, c->bending.parameters = c->lengths;
  c->needle = c->solid ? nf_bend_init_in_solid(memory, size, c->solid, &c->bending, NULL)
                       : nf_bend_init(memory, size, c->insertion, &c->bending, NULL);
  return c->needle != NULL;
}
static void make(Case* c) {
  c->made = 1;
  c->accepted = make_axial(c) && (!c->bending.layer_count || make_needle(c));
  c->kept = malloc(kept_size(c));
  if (!c->accepted) puts("refused");
}

static void move(Case* c, const Words* w) {
  const char* what = w->word[0];
  if (!c->made) make(c);
  if (!c->accepted) return;
  if (!strcmp(what, "at")) c->ticks = atol(w->word[1]);
  if (!strcmp(what, "go")) go(c, w);
  if (!strcmp(what, "step")) step(c, number(w->word[1]), velocity_of(w->word[2]), number(w->word[3]));
  if (!strcmp(what, "carry")) carry(c, w);
  if (!strcmp(what, "base")) one_base(c, w);
  if (!strcmp(what, "shape")) shape(c);
  if (!strcmp(what, "nodes")) nodes(c);
  if (!strcmp(what, "reset")) reset(c);
  if (!strcmp(what, "keep")) keep(c);
  if (!strcmp(what, "restore")) restore(c);
  if (!strcmp(what, "alter")) {
    unsigned char* byte = (unsigned char*)c->kept + atol(w->word[1]);
    *byte ^= 1;
    restore(c);
    *byte ^= 1;
  }
}

int main(int count, char** paths) {
  for (int i = 1; i < count; ++i) {
    char line[1024];
    Case* c = calloc(1, sizeof *c);
    FILE* file = fopen(paths[i], "r");
    if (!c || !file) return 1;
    printf("case %s\n", paths[i]);
    c->settings = nf_default_settings();
    while (fgets(line, sizeof line, file)) {
      Words w = {{NULL}, 0};
      for (char* word = strtok(line, " \n"); word && w.n < MOST_WORDS; word = strtok(NULL, " \n"))
        w.word[w.n++] = word;
      if (w.n == 0 || w.word[0][0] == '#') continue;
      if (!describe(c, &w)) move(c, &w);
    }
    fclose(file);
  }
  return 0;
}
