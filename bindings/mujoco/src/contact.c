#include "contact.h"

#include "clearance.h"

#include <math.h>
#include <string.h>

static const mjtNum MM_PER_M = 1000;
/* The largest stable time step that is reported where contacts set no limit, s. */
static const mjtNum NO_LIMIT_S = 1;
/* Half the length of a cylinder whose ends are no faces, mm. */
static const mjtNum ENDLESS_MM = 1e6;
/* About the radius of the finger's surface, and how far from it a mesh is looked for, m. */
static const mjtNum FINGER_RADIUS = 0.02, NEAR_MESH = 0.005;
/* How far a mesh may lie off its shape near the finger without a flag, and how far inside it before the contact ends, m. */
static const mjtNum OFF_SHAPE = 2e-4, BESIDE_MESH = 5e-4;

/* ---- memory ---- */

int memory_numbers(const settings* s) { return NUMBERS_BESIDE + s->words; }

void memory_clear(memory* past, const settings* s, int slot, float strength_factor) {
  memset(past, 0, sizeof(*past));
  settings_begin(&past->framed, s, s->shape[slot]);
  fingerpad_frame_set_strength_factor(&past->framed.contact, strength_factor);
}

/* A word is a number of the plugin's state: whole numbers of 32 bits are exact in a double. */
static uint32_t word_of(mjtNum number) { return number >= 0 && number <= UINT32_MAX ? (uint32_t)number : 0; }

void memory_read(memory* past, const settings* s, const mjtNum* numbers) {
  uint32_t* words = (uint32_t*)&past->framed;
  memset(past, 0, sizeof(*past));
  for (int i = 0; i < memory_numbers(s); i++) {
    if (!isfinite(numbers[i])) return;
  }
  memcpy(past, numbers, NUMBERS_BESIDE * sizeof(mjtNum));
  for (int i = 0; i < s->words; i++) words[i] = word_of(numbers[NUMBERS_BESIDE + i]);
}

void memory_write(const memory* past, const settings* s, mjtNum* numbers) {
  const uint32_t* words = (const uint32_t*)&past->framed;
  memcpy(numbers, past, NUMBERS_BESIDE * sizeof(mjtNum));
  for (int i = 0; i < s->words; i++) numbers[NUMBERS_BESIDE + i] = words[i];
}

/* ---- meshes ---- */

/* The frame of the shape of a mesh in the geom's. The z axis is the normal of a plane or the axis of a cylinder. */
static fingerpad_pose frame_of(const local_shape* local) {
  fingerpad_pose frame = {.quaternion = {1, 0, 0, 0}};
  mju_scl3(frame.position_mm, local->middle, MM_PER_M);
  if (mju_norm3(local->axis) > 0.5) mju_quatZ2Vec(frame.quaternion, local->axis);
  return frame;
}

/* The site in the geom's frame: its place, m, and its level axes. */
static void site_of(mjtNum at[3], mjtNum level[9], const settings* s, const placement* here) {
  const fingerpad_pose origin = {.quaternion = {1, 0, 0, 0}};
  fingerpad_pose site = seen_from(&here->geom, &origin);
  mjtNum axes[9];
  mju_scl3(at, site.position_mm, 1 / MM_PER_M);
  mju_quat2Mat(axes, site.quaternion);
  mju_mulMatMat(level, axes, s->level, 3, 3, 3);
}

/* The point of the shape under a place, m in the geom's frame. */
static void project(mjtNum to[3], const local_shape* local, const mjtNum place[3]) {
  mjtNum out[3];
  mju_sub3(out, place, local->middle);
  mjtNum up = mju_dot3(out, local->axis);
  if (local->kind == FINGERPAD_SHAPE_PLANE) {
    mju_addScl3(to, place, local->axis, -up);
    return;
  }
  mju_addToScl3(out, local->axis, -up);
  mjtNum far = mju_normalize3(out);
  mju_addScl3(to, place, out, local->radius - far);
}

/* Whether a place lies beside the mesh: over a part of the shape where the mesh ends. */
static int is_beside(const local_shape* local, const facets* mesh, const mjtNum at[3]) {
  mjtNum below[3];
  project(below, local, at);
  return !(facets_gap(mesh, below) < BESIDE_MESH);
}

/* The shape of a mesh where the finger comes next to it; where it comes to none, a plane that it does not face. */
static void find_local(local_shape* local, const facets* mesh, const mjtNum at[3], const mjtNum z[3]) {
  mjtNum from[3], arm[3], apex[3] = {0, 0, 0};
  mju_addScl3(from, at, z, FINGER_RADIUS);
  if (facets_local(local, apex, mesh, from, z, FINGER_RADIUS + NEAR_MESH) && !is_beside(local, mesh, at)) {
    mju_sub3(arm, at, local->middle);
    /* Behind the middle of the geom the finger stands with its back to it. */
    if (mju_dot3(arm, apex) > local->radius - local->thickness) return;
  }
  *local = (local_shape){.kind = FINGERPAD_SHAPE_PLANE, .axis = {-z[0], -z[1], -z[2]}};
}

static fingerpad_shape shape_of(const local_shape* local) {
  return (fingerpad_shape){.kind = (uint32_t)local->kind, .size_mm = {MM_PER_M * local->radius, ENDLESS_MM, 0}};
}

/* In the air the shape of a mesh goes along with the finger. Returns 0 if the memory was overwritten. */
static int follow_mesh(memory* past, const settings* s, const facets* mesh, const placement* here) {
  mjtNum at[3], level[9];
  if (!here->finite) return 1;
  site_of(at, level, s, here);
  if (past->touches && !is_beside(&past->local, mesh, at)) return 1;
  const mjtNum z[3] = {level[2], level[5], level[8]};
  fingerpad_pose before = frame_of(&past->local), after, moved;
  find_local(&past->local, mesh, at, z);
  after = frame_of(&past->local);
  moved = seen_from(&before, &after);
  past->touches = 0;
  return fingerpad_frame_reshape(&past->framed.contact, shape_of(&past->local), &moved) == FINGERPAD_OK;
}

/* Flags a contact that reaches to where the mesh is not this shape: a disk of its area about the
 * centre of pressure. */
static int check_mesh(
    const local_shape* local, const settings* s, const facets* mesh, const placement* here, const fingerpad_response* r) {
  enum { ROUND = 8 };
  const mjtNum* axes[3] = {here->along, here->across, here->normal};
  mjtNum own[3], geom[9], in_geom[3][3], at[3], level[9], arm[3], centre[3];
  mju_quat2Mat(geom, here->geom.quaternion);
  for (int k = 0; k < 3; k++) {
    mju_mulMatTVec3(own, here->site, axes[k]);
    mju_mulMatTVec3(in_geom[k], geom, own);
  }
  site_of(at, level, s, here);
  mju_sub3(arm, at, local->middle);
  mjtNum radius = sqrt(r->contact_area_mm2 / mjPI) / MM_PER_M;
  mju_addScl3(centre, at, in_geom[2], local->radius - mju_dot3(arm, in_geom[2]));
  mju_addToScl3(centre, in_geom[0], r->pressure_centre_x_mm / MM_PER_M);
  mju_addToScl3(centre, in_geom[1], r->pressure_centre_y_mm / MM_PER_M);
  for (int i = 0; i < ROUND; i++) {
    mjtNum point[3], angle = 2 * mjPI * i / ROUND;
    mju_addScl3(point, centre, in_geom[0], radius * cos(angle));
    mju_addToScl3(point, in_geom[1], radius * sin(angle));
    project(point, local, point);
    if (!(mju_abs(facets_gap(mesh, point)) < OFF_SHAPE)) return FINGERPAD_STATUS_BEYOND_EDGE;
  }
  return 0;
}

/* ---- one step ---- */

void report_stability(outcome* now, const settings* s, const known_stability* stable, mjtNum dt) {
  if (!(stable->step_s > 0 && stable->step_s < NO_LIMIT_S)) return;
  now->stable_step_s = stable->step_s;
  now->is_semi_implicit = !s->is_explicit && dt > stable->calm_s;
  if (dt > stable->step_s && !now->is_semi_implicit) now->status |= STATUS_STEP_TOO_LONG;
}

/* Flag of a finger that reaches the geom, or may in the next step, so fast that a contact would begin too deep or not at all. */
static int too_fast(mjtNum placed, mjtNum before_mm, mjtNum clearance) {
  mjtNum closer = before_mm - clearance;
  return placed && closer > TOO_FAST_MM && clearance < closer ? STATUS_STEP_TOO_LONG : 0;
}

int contact_is_far(outcome* now, const mjtNum* numbers, const settings* s, int slot, const placement* here) {
  const memory* past = (const memory*)numbers;
  /* In the air tissue recovers, which takes steps. */
  if (s->relaxes || past->touches != 0 || past->placed != 1 || !isfinite(past->clearance_mm) || !here->finite) return 0;
  mjtNum clearance = clearance_mm(s, slot, here);
  if (!(clearance > FAR_MM)) return 0;
  *now = (outcome){.stable_step_s = NO_LIMIT_S, .status = too_fast(past->placed, past->clearance_mm, clearance)};
  now->felt.depth_mm = (float)-clearance;
  return 1;
}

void contact_stay_far(const outcome* now, mjtNum* numbers) {
  memory* past = (memory*)numbers;
  past->clearance_mm = -now->felt.depth_mm;
  past->status = now->status;
}

/* What goes before a step of the library: whether the finger has come too fast or has its back to the geom. A finger that was far begins
 * as on a face that it never met. */
static void approach(outcome* now, memory* past, const settings* s, int slot, const placement* here) {
  const fingerpad_pose same = {.quaternion = {1, 0, 0, 0}};
  if (!here->finite) return;
  if (past->clearance_mm > FAR_MM && !s->relaxes && !s->mesh[slot].count) fingerpad_frame_reshape(&past->framed.contact, s->shape[slot], &same);
  mjtNum clearance = past->touches ? 0 : clearance_mm(s, slot, here);
  if (!past->touches) {
    now->status |= too_fast(past->placed, past->clearance_mm, clearance);
    now->faces_away = faces_away(s, slot, here);
  }
  past->placed = 1;
  past->clearance_mm = clearance;
}

/* Far beyond its range a pad loses force with depth, and pulls at last: its patches leave a thin object on both sides. From where it loses force
 * the contact pushes on with the mean stiffness up to there. */
static void push_on(outcome* now, memory* past, const placement* here) {
  mjtNum depth = now->felt.depth_mm, normal = now->felt.response.normal_force_n, moment[3];
  mjtNum more = (past->rises_mm > 0 ? past->rises_n * depth / past->rises_mm : 0) - normal;
  if (!(now->status & FINGERPAD_STATUS_DEPTH_ABOVE_RANGE) || depth <= past->rises_mm || !(more > 0)) {
    past->rises_mm = depth;
    past->rises_n = normal;
    return;
  }
  const mjtNum force[3] = {0, 0, more};
  mju_cross(moment, here->touch, force);
  const mjtNum* axes[3] = {here->along, here->across, here->normal};
  for (int i = 0; i < 3; i++) {
    mjtNum own[3];
    mju_mulMatTVec3(own, here->site, axes[i]);
    for (int k = 0; k < 3; k++) {
      now->felt.on_finger.force_n[k] += (float)(force[i] * own[k]);
      now->felt.on_finger.moment_n_mm[k] += (float)(MM_PER_M * moment[i] * own[k]);
    }
  }
  now->felt.response.normal_force_n = (float)(normal + more);
}

outcome contact_step(memory* past, placement* here, const settings* s, int slot, float strength_factor, mjtNum dt) {
  const facets* mesh = s->mesh[slot].count ? &s->mesh[slot] : NULL;
  outcome now = {.stable_step_s = NO_LIMIT_S};
  int kept = fingerpad_frame_set_strength_factor(&past->framed.contact, strength_factor) != FINGERPAD_NOT_SET_UP;
  if (!(kept && (!mesh || follow_mesh(past, s, mesh, here)))) {
    /* The plugin's state was overwritten with numbers that no step leaves there. */
    memory_clear(past, s, slot, strength_factor);
    now.status = FINGERPAD_STATUS_MEMORY_LOST;
    if (mesh) follow_mesh(past, s, mesh, here);
  }
  approach(&now, past, s, slot, here);
  fingerpad_pose body = here->geom;
  if (mesh) {
    fingerpad_pose frame = frame_of(&past->local);
    body = carried_by(&here->geom, &frame);
  }
  if (s->is_pad) {
    fingerpad_frame_step_pad(&s->pad, &past->framed.contact, &body, (float)dt, &now.felt);
  } else {
    fingerpad_frame_step_bed(&s->bed, &past->framed.contact, &body, (float)dt, &now.felt);
  }
  now.status |= now.felt.response.status;
  if (!here->finite) {
    /* The contact keeps its memory; no force acts on bodies whose place is unknown. */
    past->status = now.status;
    return (outcome){.status = now.status, .stable_step_s = NO_LIMIT_S};
  }
  past->touches = now.felt.depth_mm > 0;
  if (!past->touches) past->rises_mm = 0;
  if (now.felt.response.regime != FINGERPAD_NO_CONTACT) {
    stand(here, s, &now.felt);
    if (s->is_pad) push_on(&now, past, here);
    if (mesh) now.status |= check_mesh(&past->local, s, mesh, here, &now.felt.response);
  }
  past->status = now.status;
  return now;
}

void outcome_write(const outcome* now, mjtNum numbers[OUTPUT_NUMBERS]) {
  const fingerpad_response* r = &now->felt.response;
  mjtNum all[OUTPUT_NUMBERS] = {
      r->normal_force_n, r->friction_x_n,      r->friction_y_n,          r->spin_moment_n_mm,
      now->felt.depth_mm, r->stick_ratio,      r->slip_margin,           r->friction_limit_n,
      r->contact_area_mm2, r->pressure_centre_x_mm, r->pressure_centre_y_mm, r->regime,
      now->status,       now->felt.face,       now->damping[0],          now->damping[1],
      now->damping[2],   now->damping[3],      now->stable_step_s,    now->is_semi_implicit,
  };
  mju_copy(numbers, all, OUTPUT_NUMBERS);
}
