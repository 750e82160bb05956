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
#include "semi_implicit.h"
#include "settings.h"
#include "skin.h"
#include "stability.h"

/* The name of the plugin in a model. */
const char CONTACT_PLUGIN[] = "fingerpad.contact";
/* No contact. */
static const outcome NOTHING = {.stable_step_s = 1};

/* The largest stable time step of the contacts that touched in the last forward pass, s; infinite for none. */
MUJOCO_HELPER_DLL_EXPORT double fingerpad_mujoco_stable_step(const mjModel* m, mjData* d);
/* Sets the folder of the models that ship with the plugin. */
MUJOCO_HELPER_DLL_EXPORT void fingerpad_mujoco_set_models(const char* folder);

/* One contact of an instance: what can be computed again from MuJoCo's state, kept for speed. */
typedef struct {
  /* The placement at which the present step began. */
  placement start;
  outcome now;
  /* Where it is in the present pass. */
  placement here;
  /* Whether the finger was far where the present step began; then its memory stays as it is. */
  int is_far;
  /* The memory that was read last and the numbers of the plugin's state that it was read from. */
  memory kept;
  mjtNum kept_numbers[NUMBERS_BESIDE + WORDS_MAX];
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
  /* What was warned of. */
  int warned;
  /* One for each geom of the settings. */
  contact_data* contact;
} instance_data;

static instance_data* data_of(const mjData* d, int instance) { return (instance_data*)d->plugin_data[instance]; }

static mjtNum* numbers_of(const mjModel* m, mjData* d, int instance, int contact) {
  return d->plugin_state + m->plugin_stateadr[instance] + contact * memory_numbers(&data_of(d, instance)->settings);
}

const settings* settings_of(const mjData* d, int instance) { return &data_of(d, instance)->settings; }

const memory* touching_memory(const mjData* d, int instance, int slot) {
  const contact_data* contact = &data_of(d, instance)->contact[slot];
  return contact->now.felt.response.regime == FINGERPAD_NO_CONTACT ? NULL : &contact->after;
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
    memory past;
    memory_clear(&past, s, i, s->strength_factor[i]);
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

static void keep(contact_data* contact, const settings* s, const memory* past, const mjtNum* numbers) {
  memcpy(&contact->kept, past, sizeof(*past));
  memcpy(contact->kept_numbers, numbers, bytes_of(s));
}

/* Brings `after` of contact `i` to where the present step began, should the plugin's state, the strength or the time step have changed
 * since its trial. */
static void to_start(instance_data* data, const mjModel* m, mjData* d, int instance, int i) {
  const settings* s = &data->settings;
  contact_data* contact = &data->contact[i];
  const mjtNum* numbers = numbers_of(m, d, instance, i);
  float strength = settings_strength(s, d, i);
  if (strength == contact->strength && m->opt.timestep == contact->dt && is_kept(contact, s, numbers)) return;
  memory_read(&contact->after, s, numbers);
  contact_step(&contact->after, &contact->start, s, i, strength, m->opt.timestep);
}

/* The instances of this plugin follow one another through `next_instance`: -1 before the first and after the last. */
static int next_instance(const mjModel* m, const mjData* d, int instance) {
  for (instance++; instance < m->nplugin; instance++) {
    const mjpPlugin* plugin = mjp_getPluginAtSlot(m->plugin[instance]);
    if (plugin && plugin->name && strcmp(plugin->name, CONTACT_PLUGIN) == 0 && d->plugin_data[instance]) return instance;
  }
  return -1;
}

/* ---- all contacts of a pass ---- */

/* A contact that touches, and the settings of its instance. */
typedef struct {
  contact_data* contact;
  const settings* s;
  /* Place of the geom in the settings. */
  int slot;
} touching;

/* The contacts of all instances that touch in the present pass; returns their number. With a list of NULL it counts alone. */
static int find_touching(touching* list, const mjModel* m, const mjData* d) {
  int count = 0;
  for (int k = next_instance(m, d, -1); k >= 0; k = next_instance(m, d, k)) {
    instance_data* data = data_of(d, k);
    for (int i = 0; i < data->settings.geom_count; i++) {
      contact_data* contact = &data->contact[i];
      if (contact->now.felt.response.regime == FINGERPAD_NO_CONTACT) continue;
      if (list) list[count] = (touching){contact, &data->settings, i};
      count++;
    }
  }
  return count;
}

static void* room_for(int count, size_t size) {
  void* room = malloc((size_t)count * size);
  if (!room) mju_error("fingerpad.contact: no memory for %d contacts", count);
  return room;
}

/* Whether the stability of a contact has to be computed: it begins, its depth has changed by 15 % and 0.05 mm, or more contacts of the
 * model touch than before. */
static int is_outdated(const contact_data* contact, int count) {
  const known_stability* last = &contact->after.stable;
  return count > last->touching || !(fabs(contact->now.felt.depth_mm - last->depth_mm) <= 0.15 * last->depth_mm + 0.05);
}

/* Computes the limits of stability and the stiffness of all contacts where those of one are outdated. */
static void update_stability(const mjModel* m, mjData* d, const touching* list, int count) {
  int is_needed = 0;
  for (int i = 0; i < count; i++) is_needed |= is_outdated(list[i].contact, count);
  if (!is_needed) return;
  linear_contact* linear = room_for(count, sizeof(*linear));
  for (int i = 0; i < count; i++) linearise(&linear[i], &list[i].contact->after, list[i].s, list[i].slot, &list[i].contact->here);
  stability limits = stability_of(m, d, linear, count);
  for (int i = 0; i < count; i++) {
    known_stability* stable = &list[i].contact->after.stable;
    *stable = (known_stability){
        mju_min(1, limits.step_s), mju_min(1, limits.calm_s), list[i].contact->now.felt.depth_mm, count, {0}};
    if (!list[i].s->is_pad) positive_part(stable->stiffness, linear[i].stiffness);
  }
  free(linear);
}

/* Finds and applies the forces of all contacts that touch: explicit ones each by itself, semi-implicit ones together. A later stage of
 * a step uses the stiffness with which it began. */
static void apply_all(const mjModel* m, mjData* d, int later) {
  int count = find_touching(NULL, m, d), coupled_count = 0;
  if (count == 0) return;
  touching* list = room_for(count, sizeof(*list));
  coupled_contact* coupled = room_for(count, sizeof(*coupled));
  find_touching(list, m, d);
  if (!later) update_stability(m, d, list, count);
  for (int i = 0; i < count; i++) {
    contact_data* contact = list[i].contact;
    report_stability(&contact->now, list[i].s, &contact->after.stable, m->opt.timestep);
    if (contact->now.is_semi_implicit) {
      coupled[coupled_count++] = (coupled_contact){
          .s = list[i].s, .geom = list[i].s->geoms[list[i].slot], .here = contact->here, .now = &contact->now,
          .stiffness = contact->after.stable.stiffness,
      };
    } else {
      contact_apply(&contact->now, list[i].s, &contact->here, m, d, list[i].s->geoms[list[i].slot]);
    }
  }
  if (coupled_count) apply_coupled(m, d, coupled, coupled_count);
  free(coupled);
  free(list);
}

/* The forces of an instance at the present position, as a trial on a copy of the memory. A later stage of a step continues from where
 * the step began. */
static void try_step(const mjModel* m, mjData* d, int instance) {
  instance_data* data = data_of(d, instance);
  const settings* s = &data->settings;
  int later = is_later_stage(data, m, d);
  for (int i = 0; i < s->geom_count; i++) {
    contact_data* contact = &data->contact[i];
    float strength = settings_strength(s, d, i);
    const mjtNum* numbers = numbers_of(m, d, instance, i);
    memory stage;
    place(&contact->here, s, d, s->geoms[i]);
    if (!later) contact->is_far = contact_is_far(&contact->now, numbers, s, i, &contact->here);
    if (contact->is_far) continue;
    if (later) {
      to_start(data, m, d, instance, i);
      memcpy(&stage, &contact->after, sizeof(stage));
      contact->now = contact_step(&stage, &contact->here, s, i, strength, m->opt.timestep);
      continue;
    }
    if (!is_kept(contact, s, numbers)) {
      memory_read(&contact->kept, s, numbers);
      memcpy(contact->kept_numbers, numbers, bytes_of(s));
    }
    memcpy(&contact->after, &contact->kept, sizeof(contact->kept));
    contact->now = contact_step(&contact->after, &contact->here, s, i, strength, m->opt.timestep);
    contact->start = contact->here;
    contact->strength = strength;
    contact->dt = m->opt.timestep;
  }
  if (!later) {
    data->has_start = 1;
    data->start_s = d->time;
  }
  /* The last instance applies the forces, since those of some contacts depend on others. */
  if (next_instance(m, d, instance) < 0) apply_all(m, d, later);
}

/* Whether MuJoCo's own contact acts between the finger's body and the geom on the side of the pad, and before the pad is compressed
 * beyond its range: it carries the load in the pad's place. */
static int own_contact(const mjModel* m, const mjData* d, const settings* s, int slot, const contact_data* contact) {
  int finger = m->body_weldid[m->site_bodyid[s->site]];
  const mjtNum* site = d->site_xmat + 9 * s->site;
  if (contact->now.status & FINGERPAD_STATUS_DEPTH_ABOVE_RANGE) return 0;
  for (int i = 0; i < d->ncon; i++) {
    const mjContact* own = d->contact + i;
    int second = own->geom[1] == s->geoms[slot], other = own->geom[second ? 0 : 1];
    if (own->efc_address < 0 || other < 0 || (!second && own->geom[0] != s->geoms[slot])) continue;
    if (m->body_weldid[m->geom_bodyid[other]] != finger) continue;
    /* Out of the pad along the contact's normal, which points from the first geom to the second. */
    mjtNum out = 0;
    for (int k = 0; k < 3; k++) out -= mju_dot3(site + 3 * k, (const mjtNum[3]){s->level[2], s->level[5], s->level[8]}) * own->frame[k];
    if ((second ? out : -out) > 0.5) return 1;
  }
  return 0;
}

/* What an instance warns of, each once: bits of `warned`. */
enum { TOO_LONG = 1, TOO_FAST = 2, TURNED_ROUND = 4, OWN_CONTACT = 8 };

static int is_first(instance_data* data, int what, int is_so) {
  if (!is_so || (data->warned & what)) return 0;
  data->warned |= what;
  return 1;
}

static void warn(const mjModel* m, const mjData* d, int instance) {
  instance_data* data = data_of(d, instance);
  const settings* s = &data->settings;
  const char *who = mj_id2name(m, mjOBJ_PLUGIN, instance), *site = mj_id2name(m, mjOBJ_SITE, s->site);
  for (int i = 0; i < s->geom_count; i++) {
    const outcome* now = &data->contact[i].now;
    const char* geom = mj_id2name(m, mjOBJ_GEOM, s->geoms[i]);
    int is_long = (now->status & STATUS_STEP_TOO_LONG) != 0, is_explicit = m->opt.timestep > now->stable_step_s && !now->is_semi_implicit;
    if (is_first(data, TOO_LONG, is_long && is_explicit)) {
      mju_warning("fingerpad.contact, instance '%s': timestep = %g s is longer than %g s, the largest stable step of explicit forces at "
                  "%g s of simulated time; light objects will vibrate or be lost", who ? who : "", m->opt.timestep, now->stable_step_s,
                  d->time);
    }
    if (is_first(data, TOO_FAST, is_long && !is_explicit)) {
      mju_warning("fingerpad.contact, instance '%s': the finger comes closer to geom '%s' by more than %d mm in a step of %g s, at %g s of "
                  "simulated time; it may go through: take shorter steps or come more slowly", who ? who : "", geom ? geom : "", TOO_FAST_MM,
                  m->opt.timestep, d->time);
    }
    if (is_first(data, TURNED_ROUND, now->faces_away)) {
      mju_warning("fingerpad.contact, instance '%s': site '%s' reaches geom '%s' with its back, at %g s of simulated time, and does not touch; "
                  "the site's x axis points along the finger to its tip, z from the pad to the nail", who ? who : "", site ? site : "",
                  geom ? geom : "", d->time);
    }
    int is_near = !data->contact[i].is_far && !(data->warned & OWN_CONTACT);
    if (is_near && is_first(data, OWN_CONTACT, own_contact(m, d, s, i, &data->contact[i]))) {
      mju_warning("fingerpad.contact, instance '%s': MuJoCo's own contact acts between the finger and geom '%s' in front of the pad, at %g s of "
                  "simulated time, and carries the load; switch it off (contype, conaffinity), or let the finger's geom end 6 mm behind the "
                  "site", who ? who : "", geom ? geom : "", d->time);
    }
  }
}

void fingerpad_mujoco_set_models(const char* folder) { settings_set_models(folder); }

double fingerpad_mujoco_stable_step(const mjModel* m, mjData* d) {
  int count = find_touching(NULL, m, d);
  if (count == 0) return INFINITY;
  touching* list = room_for(count, sizeof(*list));
  linear_contact* linear = room_for(count, sizeof(*linear));
  find_touching(list, m, d);
  for (int i = 0; i < count; i++) linearise(&linear[i], &list[i].contact->after, list[i].s, list[i].slot, &list[i].contact->here);
  stability limits = stability_of(m, d, linear, count);
  free(linear);
  free(list);
  return limits.step_s;
}

/* ---- what MuJoCo calls ---- */

int is_switched_off(const mjModel* m) {
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
  warn(m, d, instance);
  for (int i = 0; i < s->geom_count; i++) {
    mjtNum* numbers = numbers_of(m, d, instance, i);
    if (data->contact[i].is_far) {
      contact_stay_far(&data->contact[i].now, numbers);
      continue;
    }
    to_start(data, m, d, instance, i);
    memory_write(&data->contact[i].after, s, numbers);
    keep(&data->contact[i], s, &data->contact[i].after, numbers);
  }
  data->has_start = 0;
}

mjPLUGIN_LIB_INIT(fingerpad) {
  mjpPlugin plugin;
  mjp_defaultPlugin(&plugin);
  plugin.name = CONTACT_PLUGIN;
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
  register_skin();
}
