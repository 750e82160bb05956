#include "settings.h"

#include "clearance.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char* const ATTRIBUTES[] = {
    "model_file",
    "site",
    "geoms",
    "strength_factor",
    "strength_userdata",
    "damping_normal_n_s_per_m",
    "damping_slide_n_s_per_m",
    "damping_spin_n_m_s_per_rad",
    "edge_radius_mm",
    "integration",
    "pad_radius_mm",
    "size",
    "stiffness",
    "lambda",
    "relaxation",
};
const int ATTRIBUTE_COUNT = sizeof(ATTRIBUTES) / sizeof(ATTRIBUTES[0]);

/* A code beside those of the library: the reason was given in a warning. */
#define WARNED (-1)
/* Longest name of a geom, longest number; longest reason with such a name in it. */
#define WORD_MAX 256
#define REASON_MAX (WORD_MAX + 192)
static const char IS_AMBIGUOUS[] =
    "the model has an object of this name and one with a prefix or suffix of the instance's name; give the whole name, or rename one";
/* Largest ratio of the semi-axes of an ellipsoid, which counts as a sphere of its local curvature: both radii of curvature differ by
 * less than twice. */
static const mjtNum AXES_RATIO = 1.4;
static const mjtNum MM_PER_M = 1000;

/* The value of an attribute, "" if it was not given. */
static const char* value_of(const mjModel* m, int instance, const char* name) {
  const char* value = mj_getPluginConfig(m, instance, name);
  return value ? value : "";
}

/* Warns of an attribute with its value and the reason; returns -1. */
static int refuse(const mjModel* m, int instance, const char* name, const char* value, const char* why) {
  const char* who = mj_id2name(m, mjOBJ_PLUGIN, instance);
  mju_warning("fingerpad.contact, instance '%s': attribute %s = \"%s\": %s", who ? who : "", name, value, why);
  return -1;
}

/* Copies the next word of `text` and returns what follows it, or NULL at the end or for a word that is too long. */
static const char* next_word(const char* text, char word[WORD_MAX]) {
  static const char blanks[] = " \t\r\n";
  text += strspn(text, blanks);
  size_t length = strcspn(text, blanks);
  if (length == 0 || length >= WORD_MAX) return NULL;
  memcpy(word, text, length);
  word[length] = 0;
  return text + length;
}

static int count_words(const char* text) {
  char word[WORD_MAX];
  int count = 0;
  while ((text = next_word(text, word))) count++;
  return count;
}

/* Reads `count` numbers from least to most; one that was given stands for all. An attribute that was not given changes
 * nothing. */
static int read_numbers(
    const mjModel* m, int instance, const char* name, mjtNum* numbers, int count, mjtNum least, mjtNum most) {
  const char *value = value_of(m, instance, name), *rest = value;
  char word[WORD_MAX], why[REASON_MAX];
  int given = count_words(value);
  if (given == 0) return 0;
  if (given != 1 && given != count) {
    snprintf(why, sizeof(why), "holds %d numbers; give 1%s", given, count > 1 ? " or as many as there are places" : "");
    return refuse(m, instance, name, value, why);
  }
  for (int i = 0; i < given; i++) {
    char* end;
    rest = next_word(rest, word);
    double number = strtod(word, &end);
    if (*end || !isfinite(number) || number < least || number > most) {
      snprintf(why, sizeof(why), "'%s' is not a number from %g to %g", word, least, most);
      return refuse(m, instance, name, value, why);
    }
    for (int k = i; k < (given == 1 ? count : i + 1); k++) numbers[k] = number;
  }
  return 0;
}

/* Names of the types of geoms. */
static const char* const GEOM_TYPES[] = {"plane", "height field", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "SDF"};

static const char* name_of_type(int type) {
  return type >= 0 && type < (int)(sizeof(GEOM_TYPES) / sizeof(GEOM_TYPES[0])) ? GEOM_TYPES[type] : "geom of another kind";
}

static mjtNum longest_over_least(const mjtNum size[3]) {
  return mju_max(size[0], mju_max(size[1], size[2])) / mju_min(size[0], mju_min(size[1], size[2]));
}

static int can_touch(const settings* s, int type) {
  int is_round = type == mjGEOM_SPHERE || type == mjGEOM_ELLIPSOID || type == mjGEOM_CAPSULE || type == mjGEOM_CYLINDER;
  return type == mjGEOM_PLANE || type == mjGEOM_BOX || (s->is_pad && (is_round || type == mjGEOM_MESH));
}

/* Why a geom cannot be touched, in `why`; 0 if it can. Reads a mesh into the next place of the settings. */
static int is_refused(settings* s, const mjModel* m, int geom, const char* word, char why[REASON_MAX]) {
  int type = geom < 0 ? 0 : m->geom_type[geom];
  char reason[160];
  if (geom < 0) {
    snprintf(why, REASON_MAX, "the model has no geom '%s'", word);
  } else if (!can_touch(s, type)) {
    snprintf(why, REASON_MAX, "geom '%s' is of type %s; %s", word, name_of_type(type),
             s->is_pad ? "a pad touches planes, boxes, spheres, ellipsoids, cylinders, capsules and convex meshes"
                       : "a bed of springs touches planes and boxes, a pad also spheres, ellipsoids, cylinders, capsules and convex meshes");
  } else if (type == mjGEOM_ELLIPSOID && longest_over_least(m->geom_size + 3 * geom) > AXES_RATIO) {
    snprintf(why, REASON_MAX, "geom '%s' is an ellipsoid whose longest semi-axis is %g times its least; a pad takes up to %g", word,
             longest_over_least(m->geom_size + 3 * geom), AXES_RATIO);
  } else if (m->geom_bodyid[geom] == m->site_bodyid[s->site]) {
    snprintf(why, REASON_MAX, "geom '%s' belongs to the body of the site", word);
  } else if (type == mjGEOM_MESH && facets_read(&s->mesh[s->geom_count], m, m->geom_dataid[geom], reason, sizeof(reason))) {
    snprintf(why, REASON_MAX, "geom '%s' %s", word, reason);
  } else {
    return 0;
  }
  return 1;
}

int find_object(const mjModel* m, const char* who, mjtObj type, const char* name) {
  int found = mj_name2id(m, type, name), length = who ? (int)strlen(who) : 0;
  char whole[2 * WORD_MAX];
  if (length >= WORD_MAX || strlen(name) >= WORD_MAX) return found;
  for (int before = 0; before < length; before++) {
    for (int after = 0; before + after < length; after++) {
      snprintf(whole, sizeof(whole), "%.*s%s%s", before, who, name, who + length - after);
      int other = mj_name2id(m, type, whole);
      if (other < 0 || other == found) continue;
      if (found >= 0) return AMBIGUOUS;
      found = other;
    }
  }
  return found;
}

/* The site and the geoms, by name. */
static int read_places(settings* s, const mjModel* m, int instance) {
  const char *site = value_of(m, instance, "site"), *who = mj_id2name(m, mjOBJ_PLUGIN, instance);
  s->site = find_object(m, who, mjOBJ_SITE, site);
  if (s->site == AMBIGUOUS) return refuse(m, instance, "site", site, IS_AMBIGUOUS);
  if (s->site < 0) return refuse(m, instance, "site", site, "the model has no site of this name");

  const char *geoms = value_of(m, instance, "geoms"), *rest = geoms;
  char word[WORD_MAX], why[REASON_MAX];
  if (count_words(geoms) == 0) return refuse(m, instance, "geoms", geoms, "name the geoms that are touched");
  if (count_words(geoms) > GEOMS_MAX) return refuse(m, instance, "geoms", geoms, "more than 32 geoms in one instance");
  while ((rest = next_word(rest, word))) {
    int geom = find_object(m, who, mjOBJ_GEOM, word);
    if (geom == AMBIGUOUS) return refuse(m, instance, "geoms", word, IS_AMBIGUOUS);
    if (is_refused(s, m, geom, word, why)) return refuse(m, instance, "geoms", geoms, why);
    s->geoms[s->geom_count++] = geom;
  }
  return 0;
}

/* The folder of the models that ship, "" for none. */
static char models[4096];

void settings_set_models(const char* folder) { snprintf(models, sizeof(models), "%s", folder); }

/* A model of that name among those that ship. */
static FILE* open_shipped(const char* name) {
  char path[sizeof(models) + WORD_MAX];
  if (!*models || !*name || strchr(name, '/') || strlen(name) >= WORD_MAX) return NULL;
  snprintf(path, sizeof(path), "%s/%s", models, name);
  return fopen(path, "rb");
}

/* The whole of a file in memory aligned for the model, or NULL. */
static void* read_file(const char* path, size_t* length) {
  FILE* file = fopen(path, "rb");
  if (!file) file = open_shipped(path);
  if (!file) return NULL;
  char* bytes = NULL;
  long size = -1;
  if (fseek(file, 0, SEEK_END) == 0) size = ftell(file);
  /* A model file has some ten kB; whatever has more is none. */
  if (size >= 0 && size < (1 << 24)) bytes = malloc((size_t)size + 1);
  rewind(file);
  *length = bytes ? fread(bytes, 1, (size_t)size, file) : 0;
  fclose(file);
  return bytes;
}

int settings_begin(fingerpad_relaxing_frame_contact* framed, const settings* s, fingerpad_shape shape) {
  if (s->relaxes) return fingerpad_relaxing_frame_init_pad(&s->pad, shape, framed);
  if (s->is_pad) return fingerpad_frame_init_pad(&s->pad, shape, &framed->contact);
  int code = fingerpad_frame_init_bed(&s->bed, shape, &framed->contact);
  if (code == FINGERPAD_OK) fingerpad_frame_set_bed_radius(&framed->contact, (float)s->pad_radius_mm[0], (float)s->pad_radius_mm[1]);
  return code;
}

/* The level axes of a finger in its own frame, as columns: those of a plane in the neutral pose. */
static void find_level(settings* s) {
  mjtNum pitch = s->neutral_deg[0] * mjPI / 180, roll = s->neutral_deg[1] * mjPI / 180;
  mjtNum ps = sin(pitch), pc = cos(pitch), rs = sin(roll), rc = cos(roll);
  const mjtNum level[9] = {pc, -ps * rs, -ps * rc, 0, rc, -rs, ps, pc * rs, pc * rc};
  mju_copy(s->level, level, 9);
}

/* Gives a pad the branches of the attribute `relaxation`; -1 after a warning. */
static int relax(settings* s, const mjModel* m, int instance) {
  static const fingerpad_branch assumed[] = {{1, 0.004f}, {0.6f, 0.07f}, {0.6f, 1.4f}};
  enum { ASSUMED = sizeof(assumed) / sizeof(assumed[0]) };
  const char *name = "relaxation", *value = value_of(m, instance, name), *rest = value;
  fingerpad_branch branches[FINGERPAD_BRANCHES_MAX];
  char word[WORD_MAX], why[REASON_MAX];
  size_t count = 0;
  if (!*value) return 0;
  if (!s->is_pad) return refuse(m, instance, name, value, "the plugin lets the tissue of pads relax, not of beds");
  if (strcmp(value, "human-assumed") == 0) return fingerpad_pad_relax(&s->pad, assumed, ASSUMED) == FINGERPAD_OK ? 0 : -1;
  if (strcmp(value, "none") == 0) return fingerpad_pad_relax(&s->pad, assumed, 0) == FINGERPAD_OK ? 0 : -1;
  while ((rest = next_word(rest, word))) {
    char *colon, *end;
    float share = strtof(word, &colon), time_s = *colon == ':' ? strtof(colon + 1, &end) : 0;
    if (*colon != ':' || end == colon + 1 || *end || count == FINGERPAD_BRANCHES_MAX) {
      snprintf(why, sizeof(why), "'%s': expected human-assumed, none, or up to %d words SHARE:TIME_S, as in 1:0.004 0.6:0.07", word, FINGERPAD_BRANCHES_MAX);
      return refuse(m, instance, name, value, why);
    }
    branches[count++] = (fingerpad_branch){share, time_s};
  }
  if (fingerpad_pad_relax(&s->pad, branches, count) == FINGERPAD_OK) return 0;
  return refuse(m, instance, name, value, "a share is outside 0 to 100, or a time outside 1e-5 to 1e5 s");
}

/* Loads the file as that of a pad or of a bed, whichever it is, and counts the words of a contact. */
static int load(settings* s, const mjModel* m, int instance, size_t length) {
  fingerpad_pad_info pad = {0};
  fingerpad_model_info bed = {0};
  fingerpad_relaxing_frame_contact framed;
  int code = fingerpad_relaxing_pad_load(&s->pad, s->file, length);
  s->is_pad = code == FINGERPAD_OK;
  /* Of a file that is no pad the reader of beds says what is wrong. */
  if (code == FINGERPAD_SECTION) code = fingerpad_model_load(&s->bed, s->file, length);
  if (code != FINGERPAD_OK) return code;
  if (relax(s, m, instance)) return WARNED;
  code = s->is_pad ? fingerpad_pad_describe(&s->pad, &pad) : fingerpad_model_describe(&s->bed, &bed);
  s->neutral_deg[0] = s->is_pad ? pad.neutral_pitch_deg : bed.pitch_deg;
  s->neutral_deg[1] = bed.roll_deg;
  s->patches = (int)pad.patches;
  s->relaxes = pad.branches > 0;
  find_level(s);
  if (settings_begin(&framed, s, (fingerpad_shape){.kind = FINGERPAD_SHAPE_PLANE}) == FINGERPAD_OK) {
    s->words = (int)(fingerpad_frame_bytes(&framed.contact) / sizeof(uint32_t));
  }
  return code;
}

/* Refuses an attribute that the kind of model has no use for. */
static int read_none(const mjModel* m, int instance, const char* name, const char* why) {
  const char* value = value_of(m, instance, name);
  return *value ? refuse(m, instance, name, value, why) : 0;
}

/* The finger that the attributes make of the model. */
static int tune(settings* s, const mjModel* m, int instance) {
  mjtNum size = 1, stiffness = 1, lambda = 1;
  if (read_numbers(m, instance, "size", &size, 1, 0.5, 2) || read_numbers(m, instance, "stiffness", &stiffness, 1, 0.2, 5) ||
      read_numbers(m, instance, "lambda", &lambda, 1, 0.1, 10)) {
    return -1;
  }
  int code;
  if (s->is_pad) {
    if (read_none(m, instance, "pad_radius_mm", "a pad has a shape of its own; leave it out")) {
      return -1;
    }
    code = fingerpad_pad_tune(&s->pad, (float)size, (float)stiffness, (float)lambda);
  } else {
    if (read_none(m, instance, "edge_radius_mm", "a bed touches no edges; leave it out") ||
        read_numbers(m, instance, "pad_radius_mm", s->pad_radius_mm, 2, 0, 1000)) {
      return -1;
    }
    code = fingerpad_model_tune(&s->bed, (float)size, (float)stiffness, (float)lambda);
  }
  return code == FINGERPAD_OK ? 0 : refuse(m, instance, "size", value_of(m, instance, "size"), fingerpad_error_text(code));
}

static int is_less(const void* a, const void* b) {
  mjtNum x = *(const mjtNum*)a, y = *(const mjtNum*)b;
  return (x > y) - (x < y);
}

/* The stiffness of the patches of a pad over the area in contact, N/m per mm², against motions within the tolerance of its equilibrium, in
 * which the bulk does not move. Such a motion may still start a new equilibrium, so the upper quartile of many is taken. */
static mjtNum patch_stiffness(const settings* s, float dt_s) {
  fingerpad_pad_info info = {0};
  fingerpad_pad_describe(&s->pad, &info);
  enum { DEPTHS = 12, MOTIONS = 4 };
  const float tiny_mm = 5e-5f, sticks = 5, relaxed_s = 1e3f;
  const fingerpad_body plane = {FINGERPAD_BODY_PLANE, 0, 0, 0};
  mjtNum found[DEPTHS * MOTIONS];
  for (int i = 0; i < DEPTHS; i++) {
    fingerpad_relaxing_pad_state start, state;
    fingerpad_response rest, moved;
    float depth = info.depth_max_mm * (float)(i + 1) / (DEPTHS + 1);
    fingerpad_pad_motion motion = {depth, 0, 0, 0, info.neutral_pitch_deg, 0, relaxed_s};
    fingerpad_relaxing_pad_state_init(&s->pad, &start);
    fingerpad_pad_state_set_strength_factor(&start.state, sticks);
    for (int k = 0; k < 2; k++) fingerpad_pad_step(&s->pad, &start.state, plane, motion, &rest);
    for (int k = 0; k < MOTIONS; k++) {
      float way = k % 2 ? -tiny_mm : tiny_mm;
      motion = (fingerpad_pad_motion){depth, 0, 0, 0, info.neutral_pitch_deg, 0, dt_s};
      *(k < 2 ? &motion.depth_mm : &motion.slide_x_mm) += way;
      memcpy(&state, &start, sizeof(start));
      fingerpad_pad_step(&s->pad, &state.state, plane, motion, &moved);
      mjtNum more = k < 2 ? (mjtNum)moved.normal_force_n - rest.normal_force_n : (mjtNum)moved.friction_x_n - rest.friction_x_n;
      found[MOTIONS * i + k] = 1000 * more / (motion.depth_mm - depth + motion.slide_x_mm) / mju_max(rest.contact_area_mm2, mjMINVAL);
    }
  }
  qsort(found, DEPTHS * MOTIONS, sizeof(*found), is_less);
  return mju_max(0, found[3 * DEPTHS * MOTIONS / 4]);
}

/* The model file, and the finger that the attributes make of it. */
static int read_model(settings* s, const mjModel* m, int instance) {
  const char* path = value_of(m, instance, "model_file");
  char why[REASON_MAX];
  size_t length;
  s->file = read_file(path, &length);
  if (!s->file) {
    snprintf(why, sizeof(why), "cannot be read (%s); a relative path counts from the working directory, and no model of this name ships", strerror(errno));
    return refuse(m, instance, "model_file", path, *path ? why : "give the path of a .fpm file");
  }
  int code = load(s, m, instance, length);
  if (code == WARNED) return -1;
  if (code == FINGERPAD_OK) {
    if (tune(s, m, instance)) return -1;
    if (s->is_pad) s->patch_stiffness = patch_stiffness(s, (float)m->opt.timestep);
    /* Tissue that relaxes damps by itself. */
    if (s->relaxes) s->damping_normal = s->damping_slide = s->damping_spin = 0;
    return 0;
  }
  return refuse(m, instance, "model_file", path, fingerpad_error_text(code));
}

void settings_preview(settings* s, const mjModel* m, int instance) {
  size_t length;
  *s = (settings){0};
  s->file = read_file(value_of(m, instance, "model_file"), &length);
  if (s->file) load(s, m, instance, length);
  settings_free(s);
}

int settings_geom_count(const mjModel* m, int instance) {
  int count = count_words(value_of(m, instance, "geoms"));
  return count < GEOMS_MAX ? count : GEOMS_MAX;
}

/* How the forces enter a time step. */
static int read_integration(settings* s, const mjModel* m, int instance) {
  const char* value = value_of(m, instance, "integration");
  s->is_explicit = strcmp(value, "explicit") == 0;
  if (s->is_explicit || !*value || strcmp(value, "auto") == 0) return 0;
  return refuse(m, instance, "integration", value, "neither 'auto' nor 'explicit'");
}

/* The shape of a geom. A mesh counts as a plane until the finger comes next to it. */
static fingerpad_shape shape_of(const settings* s, const mjModel* m, int geom) {
  fingerpad_shape shape = {.kind = FINGERPAD_SHAPE_PLANE, .edge_radius_mm = s->edge_radius_mm};
  mju_scl3(shape.size_mm, m->geom_size + 3 * geom, MM_PER_M);
  switch (m->geom_type[geom]) {
    case mjGEOM_BOX: shape.kind = FINGERPAD_SHAPE_BOX; break;
    case mjGEOM_SPHERE: shape.kind = FINGERPAD_SHAPE_SPHERE; break;
    case mjGEOM_ELLIPSOID: shape.kind = FINGERPAD_SHAPE_ELLIPSOID; break;
    case mjGEOM_CAPSULE: shape.kind = FINGERPAD_SHAPE_CAPSULE; break;
    case mjGEOM_CYLINDER: shape.kind = FINGERPAD_SHAPE_CYLINDER; break;
    default: break;
  }
  return shape;
}

/* The shapes of the geoms. */
static int read_shapes(settings* s, const mjModel* m, int instance) {
  char why[REASON_MAX];
  for (int i = 0; i < s->geom_count; i++) {
    fingerpad_relaxing_frame_contact framed;
    int geom = s->geoms[i];
    const mjtNum* size = m->geom_size + 3 * geom;
    const char* name = mj_id2name(m, mjOBJ_GEOM, geom);
    s->shape[i] = shape_of(s, m, geom);
    if (settings_begin(&framed, s, s->shape[i]) == FINGERPAD_OK) continue;
    snprintf(why, sizeof(why), "geom '%s' has the sizes %g %g %g m; a finger touches bodies with sizes of 0.0001 to 1000 m", name ? name : "", size[0],
             size[1], size[2]);
    return refuse(m, instance, "geoms", value_of(m, instance, "geoms"), why);
  }
  return 0;
}

int settings_read(settings* s, const mjModel* m, int instance) {
  *s = (settings){
      .damping_normal = 2,
      .damping_slide = 2,
      .damping_spin = 2e-5,
      .pad_radius_mm = {21, 21},
      .edge_radius_mm = 2,
      .strength_userdata = -1,
  };
  mjtNum strength[GEOMS_MAX], userdata = -1;
  for (int i = 0; i < GEOMS_MAX; i++) strength[i] = 1;
  const mjtNum most = 1e6;
  if (read_model(s, m, instance) || read_places(s, m, instance) ||
      read_numbers(m, instance, "strength_factor", strength, s->geom_count, 0.1, 5) ||
      read_numbers(m, instance, "strength_userdata", &userdata, 1, 0, m->nuserdata - s->geom_count) ||
      read_numbers(m, instance, "damping_normal_n_s_per_m", &s->damping_normal, 1, 0, most) ||
      read_numbers(m, instance, "damping_slide_n_s_per_m", &s->damping_slide, 1, 0, most) ||
      read_numbers(m, instance, "damping_spin_n_m_s_per_rad", &s->damping_spin, 1, 0, most) ||
      read_numbers(m, instance, "edge_radius_mm", &s->edge_radius_mm, 1, 0.1, 10) || read_integration(s, m, instance) ||
      read_shapes(s, m, instance)) {
    return -1;
  }
  if (userdata != floor(userdata)) {
    return refuse(m, instance, "strength_userdata", value_of(m, instance, "strength_userdata"), "not a whole number");
  }
  s->enclosing_mm = enclosing_radius_mm(s);
  s->strength_userdata = (int)userdata;
  for (int i = 0; i < GEOMS_MAX; i++) s->strength_factor[i] = (float)strength[i];
  return 0;
}

void settings_free(settings* s) {
  free(s->file);
  s->file = NULL;
  for (int i = 0; i < GEOMS_MAX; i++) facets_free(&s->mesh[i]);
}

float settings_strength(const settings* s, const mjData* d, int i) {
  /* A 0, which a reset leaves behind, stands for 1. */
  mjtNum more = s->strength_userdata < 0 ? 1 : d->userdata[s->strength_userdata + i];
  return s->strength_factor[i] * (float)(more == 0 ? 1 : more);
}
