/* The plugin fingerpad.contact: passive forces of fingertips on geoms, and a sensor that tells of them.
 *
 * MuJoCo calls `compute` as often as it likes, at positions that it may throw away: a trial, which leaves the memory alone.
 * `advance` comes once for each step that is taken and is the one place where the memory moves on, along the position at
 * which that step began. */

#include <mujoco/mujoco.h>
#include <stdlib.h>
#include <string.h>

#include "contact.h"
#include "placement.h"
#include "settings.h"

/* What an instance keeps beside the state; all of it but the settings can be computed again from MuJoCo's state. */
typedef struct {
  settings settings;
  /* Whether `start` holds the placements at which the present step began, and the time of them. */
  int begun;
  mjtNum begun_s;
  struct {
    placement start;
    int start_finite;
    outcome now;
    /* The memory before and after the step to `start` with this strength, so that it is computed once. */
    memory before, after;
    float strength;
    mjtNum dt;
  } contact[GEOMS_MAX];
} instance_data;

/* No contact. */
static const outcome NOTHING = {0};

static instance_data* data_of(const mjData* d, int instance) { return (instance_data*)d->plugin_data[instance]; }

static mjtNum* numbers_of(const mjModel* m, mjData* d, int instance, int contact) {
  int is_pad = data_of(d, instance)->settings.is_pad;
  return d->plugin_state + m->plugin_stateadr[instance] + contact * memory_numbers(is_pad);
}

static int nstate(const mjModel* m, int instance) {
  return settings_geom_count(m, instance) * memory_numbers(settings_is_pad(m, instance));
}

static int nsensordata(const mjModel* m, int instance, int sensor) {
  (void)sensor;
  return settings_geom_count(m, instance) * OUTPUT_NUMBERS;
}

static int init(const mjModel* m, mjData* d, int instance) {
  instance_data* data = calloc(1, sizeof(*data));
  if (!data) return -1;
  if (settings_read(&data->settings, m, instance)) {
    settings_free(&data->settings);
    free(data);
    return -1;
  }
  d->plugin_data[instance] = (uintptr_t)data;
  return 0;
}

static void destroy(mjData* d, int instance) {
  instance_data* data = data_of(d, instance);
  if (data) settings_free(&data->settings);
  free(data);
  d->plugin_data[instance] = 0;
}

/* The settings of a copy are its own; MuJoCo copies the state. */
static void copy(mjData* dest, const mjModel* m, const mjData* src, int instance) {
  (void)m;
  instance_data *to = data_of(dest, instance), *from = data_of(src, instance);
  settings own = to->settings;
  *to = *from;
  to->settings = own;
}

static void reset(const mjModel* m, mjtNum* state, void* plugin_data, int instance) {
  (void)m;
  (void)instance;
  instance_data* data = plugin_data;
  data->begun = 0;
  const settings* s = &data->settings;
  for (int i = 0; i < s->geom_count; i++) {
    memory past;
    memory_clear(&past, s, s->strength_factor[i]);
    memory_write(&past, s, state + i * memory_numbers(s->is_pad));
    data->contact[i].now = NOTHING;
  }
}

/* Whether this is a later stage of a Runge-Kutta step that has begun: MuJoCo moves the time with the stages. */
static int is_later_stage(const instance_data* data, const mjModel* m, const mjData* d) {
  mjtNum gone = d->time - data->begun_s;
  return m->opt.integrator == mjINT_RK4 && data->begun && gone > 0 && gone <= 1.001 * m->opt.timestep;
}

/* Brings the memory of contact `i` to where the present step began. */
static void to_start(memory* past, instance_data* data, const mjModel* m, const mjData* d, int i) {
  const settings* s = &data->settings;
  float strength = settings_strength(s, d, i);
  int is_known = strength == data->contact[i].strength && m->opt.timestep == data->contact[i].dt &&
                 memcmp(past, &data->contact[i].before, sizeof(*past)) == 0;
  if (is_known) {
    memcpy(past, &data->contact[i].after, sizeof(*past));
  } else {
    contact_step(past, s, &data->contact[i].start, data->contact[i].start_finite, strength, m->opt.timestep);
  }
}

/* Forces of all contacts at the present position, as a trial on a copy of the memory. A later stage of a step goes by way of
 * where the step began. */
static void try_step(const mjModel* m, mjData* d, int instance) {
  instance_data* data = data_of(d, instance);
  const settings* s = &data->settings;
  int later = is_later_stage(data, m, d);
  for (int i = 0; i < s->geom_count; i++) {
    float strength = settings_strength(s, d, i);
    memory past, before;
    placement here;
    memory_read(&past, s, numbers_of(m, d, instance, i));
    if (later) to_start(&past, data, m, d, i);
    int finite = place(&here, s, m, d, s->geoms[i], past.face, past.apex) == 0;
    outcome* now = &data->contact[i].now;
    memcpy(&before, &past, sizeof(past));
    *now = contact_step(&past, s, &here, finite, strength, m->opt.timestep);
    contact_apply(now, s, &here, m, d, s->geoms[i]);
    if (!later) {
      data->contact[i].start = here;
      data->contact[i].start_finite = finite;
      memcpy(&data->contact[i].before, &before, sizeof(before));
      memcpy(&data->contact[i].after, &past, sizeof(past));
      data->contact[i].strength = strength;
      data->contact[i].dt = m->opt.timestep;
    }
  }
  if (!later) {
    data->begun = 1;
    data->begun_s = d->time;
  }
}

/* Whether passive forces are switched off as a whole: then MuJoCo asks for none. */
static int is_switched_off(const mjModel* m) {
  return (m->opt.disableflags & mjDSBL_SPRING) && (m->opt.disableflags & mjDSBL_DAMPER);
}

static void tell(const mjModel* m, mjData* d, int instance) {
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
    tell(m, d, instance);
  }
}

/* The step is taken: the memory goes to where it began. */
static void advance(const mjModel* m, mjData* d, int instance) {
  instance_data* data = data_of(d, instance);
  const settings* s = &data->settings;
  if (is_switched_off(m) || !data->begun) {
    reset(m, numbers_of(m, d, instance, 0), data, instance);
    return;
  }
  for (int i = 0; i < s->geom_count; i++) {
    memory past;
    mjtNum* numbers = numbers_of(m, d, instance, i);
    memory_read(&past, s, numbers);
    to_start(&past, data, m, d, i);
    memory_write(&past, s, numbers);
  }
  data->begun = 0;
}

mjPLUGIN_LIB_INIT(fingerpad) {
  mjpPlugin plugin;
  mjp_defaultPlugin(&plugin);
  plugin.name = "fingerpad.contact";
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
