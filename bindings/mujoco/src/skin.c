#include "skin.h"

#include <stdlib.h>
#include <string.h>

static const char NAME[] = "fingerpad.patches";
static const char* const KEYS[] = {"contact"};
static const mjtNum MM_PER_M = 1000, PA_PER_MPA = 1e6, MM2_PER_M2 = 1e6;

/* An instance: the instance of the contact, and the patches of its finger in the air. */
typedef struct {
  int contact, count;
  fingerpad_frame_patch at_rest[FINGERPAD_PATCHES_MAX];
} skin;

/* The sensor of an instance. */
static int sensor_of(const mjModel* m, int instance) {
  for (int i = 0; i < m->nsensor; i++) {
    if (m->sensor_type[i] == mjSENS_PLUGIN && m->sensor_plugin[i] == instance) return i;
  }
  return -1;
}

/* The instance of the contact that a sensor names; negative if there is none. */
static int find_contact(const mjModel* m, int instance, int sensor) {
  const char* name = mj_getPluginConfig(m, instance, KEYS[0]);
  int found = find_object(m, mj_id2name(m, mjOBJ_SENSOR, sensor), mjOBJ_PLUGIN, name ? name : "");
  if (found < 0) return found;
  const mjpPlugin* plugin = mjp_getPluginAtSlot(m->plugin[found]);
  return plugin && strcmp(plugin->name, CONTACT_PLUGIN) == 0 ? found : -1;
}

static int nstate(const mjModel* m, int instance) {
  (void)m;
  (void)instance;
  return 0;
}

static int nsensordata(const mjModel* m, int instance, int sensor) {
  settings s = {0};
  int contact = find_contact(m, instance, sensor);
  if (contact >= 0) settings_preview(&s, m, contact);
  return s.patches * PATCH_NUMBERS;
}

static int refuse(const mjModel* m, int instance, const char* why) {
  const char *who = mj_id2name(m, mjOBJ_SENSOR, sensor_of(m, instance)), *name = mj_getPluginConfig(m, instance, KEYS[0]);
  mju_warning("%s, sensor '%s': attribute %s = \"%s\": %s", NAME, who ? who : "", KEYS[0], name ? name : "", why);
  return -1;
}

static int init(const mjModel* m, mjData* d, int instance) {
  settings s = {0};
  fingerpad_relaxing_frame_contact fresh;
  int contact = find_contact(m, instance, sensor_of(m, instance));
  if (contact == AMBIGUOUS) return refuse(m, instance, "several instances go by this name; give the whole one");
  if (contact < 0) return refuse(m, instance, "the model has no instance of fingerpad.contact of this name");
  /* The instance may be set up later, and reports what is wrong with its attributes. */
  if (settings_read(&s, m, contact)) return -1;
  skin* data = s.is_pad ? calloc(1, sizeof(*data)) : NULL;
  if (data) {
    *data = (skin){.contact = contact, .count = s.patches};
    settings_begin(&fresh, &s, (fingerpad_shape){.kind = FINGERPAD_SHAPE_PLANE});
    fingerpad_frame_patches(&s.pad, &fresh.contact, data->at_rest, FINGERPAD_PATCHES_MAX);
  }
  int is_bed = !s.is_pad;
  settings_free(&s);
  if (is_bed) return refuse(m, instance, "its model is a bed of springs, which has no patches; a pad has them");
  d->plugin_data[instance] = (uintptr_t)data;
  return data ? 0 : -1;
}

static void destroy(mjData* d, int instance) {
  free((skin*)d->plugin_data[instance]);
  d->plugin_data[instance] = 0;
}

static void reset(const mjModel* m, mjtNum* state, void* plugin_data, int instance) {
  (void)m;
  (void)state;
  (void)plugin_data;
  (void)instance;
}

/* Adds a patch that touches a geom to those of other geoms. The place is that of the largest force, and so is the stick ratio. */
static void add(fingerpad_frame_patch* sum, const fingerpad_frame_patch* one) {
  const float *force = one->force_n, *at = one->place_mm;
  if (!(one->contact_area_mm2 > 0)) return;
  if (!(sum->contact_area_mm2 > 0)) {
    *sum = *one;
    return;
  }
  int is_larger = one->pressure_mpa > sum->pressure_mpa;
  const float *place = is_larger ? at : sum->place_mm, *other = is_larger ? sum->place_mm : at;
  const float* moves = is_larger ? sum->force_n : force;
  const float arm[3] = {other[0] - place[0], other[1] - place[1], other[2] - place[2]};
  for (int k = 0; k < 3; k++) {
    int a = (k + 1) % 3, b = (k + 2) % 3;
    sum->moment_n_mm[k] += one->moment_n_mm[k] + arm[a] * moves[b] - arm[b] * moves[a];
  }
  for (int k = 0; k < 3; k++) sum->force_n[k] += force[k];
  for (int k = 0; k < 2; k++) sum->shear_mpa[k] += one->shear_mpa[k];
  sum->pressure_mpa += one->pressure_mpa;
  sum->contact_area_mm2 += one->contact_area_mm2;
  if (is_larger) {
    memcpy(sum->place_mm, at, sizeof(sum->place_mm));
    sum->stick_ratio = one->stick_ratio;
  }
}

/* The numbers of a patch in SI units. */
static void write(const fingerpad_frame_patch* p, mjtNum to[PATCH_NUMBERS]) {
  for (int k = 0; k < 3; k++) {
    to[k] = p->place_mm[k] / MM_PER_M;
    to[3 + k] = p->force_n[k];
    to[6 + k] = p->moment_n_mm[k] / MM_PER_M;
  }
  to[9] = p->pressure_mpa * PA_PER_MPA;
  to[10] = p->shear_mpa[0] * PA_PER_MPA;
  to[11] = p->shear_mpa[1] * PA_PER_MPA;
  to[12] = p->area_mm2 / MM2_PER_M2;
  to[13] = p->contact_area_mm2 / MM2_PER_M2;
  to[14] = p->stick_ratio;
}

static void compute(const mjModel* m, mjData* d, int instance, int capability) {
  (void)capability;
  const skin* data = (const skin*)d->plugin_data[instance];
  const settings* s = settings_of(d, data->contact);
  fingerpad_frame_patch all[FINGERPAD_PATCHES_MAX], own[FINGERPAD_PATCHES_MAX];
  memcpy(all, data->at_rest, sizeof(all));
  for (int slot = 0; slot < s->geom_count && !is_switched_off(m); slot++) {
    const memory* past = touching_memory(d, data->contact, slot);
    if (!past || fingerpad_frame_patches(&s->pad, &past->framed.contact, own, FINGERPAD_PATCHES_MAX) != FINGERPAD_OK) continue;
    for (int i = 0; i < data->count; i++) add(&all[i], &own[i]);
  }
  for (int sensor = 0; sensor < m->nsensor; sensor++) {
    if (m->sensor_type[sensor] != mjSENS_PLUGIN || m->sensor_plugin[sensor] != instance) continue;
    for (int i = 0; i < data->count; i++) write(&all[i], d->sensordata + m->sensor_adr[sensor] + i * PATCH_NUMBERS);
  }
}

void register_skin(void) {
  mjpPlugin plugin;
  mjp_defaultPlugin(&plugin);
  plugin.name = NAME;
  plugin.nattribute = sizeof(KEYS) / sizeof(KEYS[0]);
  plugin.attributes = KEYS;
  plugin.capabilityflags = mjPLUGIN_SENSOR;
  plugin.needstage = mjSTAGE_VEL;
  plugin.nstate = nstate;
  plugin.nsensordata = nsensordata;
  plugin.init = init;
  plugin.destroy = destroy;
  plugin.reset = reset;
  plugin.compute = compute;
  mjp_registerPlugin(&plugin);
}
