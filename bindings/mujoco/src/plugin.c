/* The plugin fingerpad.contact: passive forces of fingertips on geoms, and a sensor that reports them.
 *
 * MuJoCo calls `compute` as often as it likes, at positions that it may throw away: a trial, which leaves the memory alone.
 * `advance` comes once for each step that is taken and is the one place where the memory moves on, along the position at
 * which that step began. */

#include <mujoco/mujoco.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "contact.h"
#include "placement.h"
#include "settings.h"
#include "stability.h"

/* The name of the plugin in a model. */
static const char NAME[] = "fingerpad.contact";
/* Most words of a model's memory. */
enum { STATE_WORDS_MAX = sizeof(fingerpad_pad_state) / sizeof(uint32_t) };
/* No contact. */
static const outcome NOTHING = {.stable_step_s = 1, .shares = {1, 1}};

/* The largest stable time step of the contacts that touched in the last forward pass, s; infinite for none. */
MUJOCO_HELPER_DLL_EXPORT double fingerpad_mujoco_stable_step(const mjModel* m, mjData* d);

/* One contact of an instance: what can be computed again from MuJoCo's state, kept for speed. */
typedef struct {
  /* The placement at which the present step began, whether it is finite, and the depth there. */
  placement start;
  int start_finite;
  mjtNum start_depth_mm;
  outcome now;
  /* The memory that was read last and the numbers of the plugin's state that it was read from. */
  memory kept;
  mjtNum kept_numbers[NUMBERS_BESIDE + STATE_WORDS_MAX];
  /* `kept` after the step to `start` with this strength and time step. */
  memory after;
  float strength;
  mjtNum dt;
} contact_data;

/* An instance beside MuJoCo's state. */
typedef struct {
  settings settings;
  /* Whether `start` holds the placements at which the present step began, and the time of them. */
  int has_start;
  mjtNum start_s;
  /* Whether a time step that is too long has been reported. */
  int warned;
  /* One for each geom of the settings. */
  contact_data* contact;
} instance_data;

static instance_data* data_of(const mjData* d, int instance) { return (instance_data*)d->plugin_data[instance]; }

static mjtNum* numbers_of(const mjModel* m, mjData* d, int instance, int contact) {
  return d->plugin_state + m->plugin_stateadr[instance] + contact * memory_numbers(&data_of(d, instance)->settings);
}

static int nstate(const mjModel* m, int instance) {
  settings s;
  settings_preview(&s, m, instance);
  return settings_geom_count(m, instance) * memory_numbers(&s);
}

static int nsensordata(const mjModel* m, int instance, int sensor) {
  (void)sensor;
  return settings_geom_count(m, instance) * OUTPUT_NUMBERS;
}

static int init(const mjModel* m, mjData* d, int instance) {
  instance_data* data = calloc(1, sizeof(*data));
  if (!data) return -1;
  int failed = settings_read(&data->settings, m, instance);
  if (!failed) data->contact = calloc((size_t)data->settings.geom_count, sizeof(contact_data));
  if (failed || !data->contact) {
    settings_free(&data->settings);
    free(data);
    return -1;
  }
  d->plugin_data[instance] = (uintptr_t)data;
  return 0;
}

static void destroy(mjData* d, int instance) {
  instance_data* data = data_of(d, instance);
  if (!data) return;
  settings_free(&data->settings);
  free(data->contact);
  free(data);
  d->plugin_data[instance] = 0;
}

/* The settings of a copy are its own; MuJoCo copies the state. */
static void copy(mjData* dest, const mjModel* m, const mjData* src, int instance) {
  (void)m;
  instance_data *to = data_of(dest, instance), *from = data_of(src, instance);
  to->has_start = from->has_start;
  to->start_s = from->start_s;
  to->warned = from->warned;
  memcpy(to->contact, from->contact, (size_t)from->settings.geom_count * sizeof(contact_data));
}

static void reset(const mjModel* m, mjtNum* state, void* plugin_data, int instance) {
  (void)m;
  (void)instance;
  instance_data* data = plugin_data;
  data->has_start = 0;
  const settings* s = &data->settings;
  for (int i = 0; i < s->geom_count; i++) {
    memory past = {.status = 0};
    memory_clear(&past, s, s->strength_factor[i]);
    memory_write(&past, s, state + i * memory_numbers(s));
    data->contact[i].now = NOTHING;
  }
}

/* Whether this is a later stage of the present Runge-Kutta step: MuJoCo moves the time with the stages. */
static int is_later_stage(const instance_data* data, const mjModel* m, const mjData* d) {
  mjtNum gone = d->time - data->start_s;
  return m->opt.integrator == mjINT_RK4 && data->has_start && gone > 0 && gone <= 1.001 * m->opt.timestep;
}

static size_t bytes_of(const settings* s) { return (size_t)memory_numbers(s) * sizeof(mjtNum); }

/* Whether the numbers of a contact in the plugin's state are those that `kept` was read from. */
static int is_kept(const contact_data* contact, const settings* s, const mjtNum* numbers) {
  return memcmp(contact->kept_numbers, numbers, bytes_of(s)) == 0;
}

/* The memory of a contact in the plugin's state. */
static void read(memory* past, const contact_data* contact, const settings* s, const mjtNum* numbers) {
  if (is_kept(contact, s, numbers)) {
    memcpy(past, &contact->kept, sizeof(*past));
  } else {
    memory_read(past, s, numbers);
  }
}

static void keep(contact_data* contact, const settings* s, const memory* past, const mjtNum* numbers) {
  memcpy(&contact->kept, past, sizeof(*past));
  memcpy(contact->kept_numbers, numbers, bytes_of(s));
}

/* The memory of contact `i` where the present step began. */
static void to_start(memory* past, instance_data* data, const mjModel* m, mjData* d, int instance, int i) {
  const settings* s = &data->settings;
  contact_data* contact = &data->contact[i];
  const mjtNum* numbers = numbers_of(m, d, instance, i);
  float strength = settings_strength(s, d, i);
  if (strength == contact->strength && m->opt.timestep == contact->dt && is_kept(contact, s, numbers)) {
    memcpy(past, &contact->after, sizeof(*past));
  } else {
    memory_read(past, s, numbers);
    contact_step(past, s, &contact->start, contact->start_finite, strength, m->opt.timestep);
  }
}

/* Forces of all contacts at the present position, as a trial on a copy of the memory. A later stage of a step continues from where
 * the step began. */
static void try_step(const mjModel* m, mjData* d, int instance) {
  instance_data* data = data_of(d, instance);
  const settings* s = &data->settings;
  int later = is_later_stage(data, m, d);
  for (int i = 0; i < s->geom_count; i++) {
    contact_data* contact = &data->contact[i];
    float strength = settings_strength(s, d, i);
    memory past;
    placement here;
    if (later) {
      to_start(&past, data, m, d, instance, i);
    } else {
      const mjtNum* numbers = numbers_of(m, d, instance, i);
      read(&past, contact, s, numbers);
      keep(contact, s, &past, numbers);
    }
    int finite = place(&here, s, m, d, s->geoms[i], &past.last) == 0;
    contact->now = contact_step(&past, s, &here, finite, strength, m->opt.timestep);
    contact_apply(&contact->now, s, &here, m, d, s->geoms[i]);
    if (!later) {
      contact->start = here;
      contact->start_finite = finite;
      contact->start_depth_mm = contact->now.depth_mm;
      memcpy(&contact->after, &past, sizeof(past));
      contact->strength = strength;
      contact->dt = m->opt.timestep;
    }
  }
  if (!later) {
    data->has_start = 1;
    data->start_s = d->time;
  }
}

/* ---- stability ---- */

/* Whether a contact of the model touched where the present step began. */
static int touched(const contact_data* contact) { return contact->start_finite && contact->after.last.touches; }

/* The instances of this plugin follow one another through `next_instance`: -1 before the first and after the last. */
static int next_instance(const mjModel* m, const mjData* d, int instance) {
  for (instance++; instance < m->nplugin; instance++) {
    const mjpPlugin* plugin = mjp_getPluginAtSlot(m->plugin[instance]);
    if (plugin && plugin->name && strcmp(plugin->name, NAME) == 0 && d->plugin_data[instance]) return instance;
  }
  return -1;
}

/* Number of contacts of all instances that touch. */
static int count_touching(const mjModel* m, const mjData* d) {
  int count = 0;
  for (int k = next_instance(m, d, -1); k >= 0; k = next_instance(m, d, k)) {
    const instance_data* data = data_of(d, k);
    for (int i = 0; i < data->settings.geom_count; i++) count += touched(&data->contact[i]);
  }
  return count;
}

/* The limits of stability of the whole model with all contacts that touch. */
static stability whole_stability(const mjModel* m, mjData* d, int count) {
  linear_contact* contacts = malloc((size_t)(count ? count : 1) * sizeof(*contacts));
  if (!contacts) return (stability){INFINITY, {1, 1}};
  int filled = 0;
  for (int k = next_instance(m, d, -1); k >= 0; k = next_instance(m, d, k)) {
    const instance_data* data = data_of(d, k);
    for (int i = 0; i < data->settings.geom_count && filled < count; i++) {
      if (!touched(&data->contact[i])) continue;
      linearise(&contacts[filled++], &data->settings, m, data->settings.geoms[i], &data->contact[i].start);
    }
  }
  stability limits = stability_of(m, d, contacts, filled);
  free(contacts);
  return limits;
}

/* Whether the stability of a contact has to be computed: it begins, its depth has changed by 15 % and 0.05 mm, or more contacts of the
 * model touch than before. */
static int is_outdated(const contact_data* contact, int touching) {
  const known_stability* last = &contact->after.stable;
  return touching > last->touching || !(fabs(contact->start_depth_mm - last->depth_mm) <= 0.15 * last->depth_mm + 0.05);
}

/* Computes the limits of stability where they are outdated, and warns once if the time step is longer. */
static void update_stability(const mjModel* m, mjData* d, int instance) {
  instance_data* data = data_of(d, instance);
  int count = data->settings.geom_count, is_needed = 0, touching = count_touching(m, d);
  for (int i = 0; i < count; i++) is_needed |= touched(&data->contact[i]) && is_outdated(&data->contact[i], touching);
  if (!is_needed) return;
  stability limits = whole_stability(m, d, touching);
  for (int i = 0; i < count; i++) {
    if (touched(&data->contact[i])) {
      contact_data* contact = &data->contact[i];
      contact->after.stable = (known_stability){mju_min(1, limits.step_s), limits.shares, contact->start_depth_mm, touching};
    }
  }
  if (limits.step_s < m->opt.timestep && !data->warned) {
    const char* who = mj_id2name(m, mjOBJ_PLUGIN, instance);
    data->warned = 1;
    mju_warning("fingerpad.contact, instance '%s': timestep = %g s is longer than %g s, the largest stable step of the contacts at "
                "%g s of simulated time; light objects will vibrate or be lost", who ? who : "", m->opt.timestep, limits.step_s, d->time);
  }
}

double fingerpad_mujoco_stable_step(const mjModel* m, mjData* d) { return whole_stability(m, d, count_touching(m, d)).step_s; }

/* ---- what MuJoCo calls ---- */

/* Whether passive forces are switched off as a whole: then MuJoCo calls for none. */
static int is_switched_off(const mjModel* m) {
  return (m->opt.disableflags & mjDSBL_SPRING) && (m->opt.disableflags & mjDSBL_DAMPER);
}

static void write_sensors(const mjModel* m, mjData* d, int instance) {
  instance_data* data = data_of(d, instance);
  for (int i = 0; is_switched_off(m) && i < data->settings.geom_count; i++) data->contact[i].now = NOTHING;
  for (int sensor = 0; sensor < m->nsensor; sensor++) {
    if (m->sensor_type[sensor] != mjSENS_PLUGIN || m->sensor_plugin[sensor] != instance) continue;
    mjtNum* to = d->sensordata + m->sensor_adr[sensor];
    for (int i = 0; i < data->settings.geom_count; i++) outcome_write(&data->contact[i].now, to + i * OUTPUT_NUMBERS);
  }
}

static void compute(const mjModel* m, mjData* d, int instance, int capability) {
  if (capability == mjPLUGIN_PASSIVE) {
    try_step(m, d, instance);
  } else {
    write_sensors(m, d, instance);
  }
}

/* The step is taken: the memory moves on to where it began. */
static void advance(const mjModel* m, mjData* d, int instance) {
  instance_data* data = data_of(d, instance);
  const settings* s = &data->settings;
  if (is_switched_off(m) || !data->has_start) {
    reset(m, numbers_of(m, d, instance, 0), data, instance);
    return;
  }
  for (int i = 0; i < s->geom_count; i++) {
    memory past;
    to_start(&past, data, m, d, instance, i);
    memcpy(&data->contact[i].after, &past, sizeof(past));
  }
  update_stability(m, d, instance);
  for (int i = 0; i < s->geom_count; i++) {
    mjtNum* numbers = numbers_of(m, d, instance, i);
    memory_write(&data->contact[i].after, s, numbers);
    keep(&data->contact[i], s, &data->contact[i].after, numbers);
  }
  data->has_start = 0;
}

mjPLUGIN_LIB_INIT(fingerpad) {
  mjpPlugin plugin;
  mjp_defaultPlugin(&plugin);
  plugin.name = NAME;
  plugin.nattribute = ATTRIBUTE_COUNT;
  plugin.attributes = ATTRIBUTES;
  plugin.capabilityflags = mjPLUGIN_PASSIVE | mjPLUGIN_SENSOR;
  plugin.needstage = mjSTAGE_VEL;
  plugin.nstate = nstate;
  plugin.nsensordata = nsensordata;
  plugin.init = init;
  plugin.destroy = destroy;
  plugin.copy = copy;
  plugin.reset = reset;
  plugin.compute = compute;
  plugin.advance = advance;
  mjp_registerPlugin(&plugin);
}
