#include "contact.h"

#include <math.h>
#include <string.h>

/* Depth over which the dampers grow from nothing, so that a touch begins without a blow, mm. */
static const mjtNum DAMPING_DEPTH_MM = 0.2;
/* Range of the model's poses, degrees. */
static const mjtNum PITCH_RANGE[] = {10, 70}, ROLL_RANGE[] = {-30, 30};
static const mjtNum DEGREES = 180 / mjPI;
static const mjtNum MM_PER_M = 1000;

/* ---- memory ---- */

void memory_clear(memory* past, float strength_factor) {
  memset(past, 0, sizeof(*past));
  fingerpad_spin_state_init(&past->model);
  fingerpad_spin_state_set_strength_factor(&past->model, strength_factor);
}

/* A word of the reduced model's memory is a number of the plugin's state: whole numbers of 32 bits are exact in a double. */
void memory_read(memory* past, const mjtNum numbers[MEMORY_NUMBERS]) {
  uint32_t words[MODEL_WORDS];
  memset(past, 0, sizeof(*past));
  for (int i = 0; i < MEMORY_NUMBERS; i++) {
    if (!isfinite(numbers[i])) return;
  }
  for (int i = 0; i < MODEL_WORDS; i++) words[i] = (uint32_t)mju_clip(numbers[8 + i], 0, UINT32_MAX);
  past->face = (int)mju_clip(numbers[0], 0, 6);
  past->status = (int)mju_clip(numbers[7], 0, 65535);
  mju_copy(past->foot, numbers + 1, 2);
  past->angle = numbers[3];
  mju_copy(past->rest, numbers + 4, 3);
  memcpy(&past->model, words, sizeof(words));
}

void memory_write(const memory* past, mjtNum numbers[MEMORY_NUMBERS]) {
  uint32_t words[MODEL_WORDS];
  memcpy(words, &past->model, sizeof(words));
  numbers[0] = past->face;
  mju_copy(numbers + 1, past->foot, 2);
  numbers[3] = past->angle;
  mju_copy(numbers + 4, past->rest, 3);
  numbers[7] = past->status;
  for (int i = 0; i < MODEL_WORDS; i++) numbers[8 + i] = words[i];
}

/* ---- one step ---- */

/* Depth of the pad's lowest point below the face, mm; the pad is round with the radii of the settings and touches at the site
 * when it lies flat. */
static mjtNum depth_mm(const settings* s, const placement* here) {
  mjtNum sinks = s->pad_radius_mm[0] * (1 - cos(here->pitch)) + s->pad_radius_mm[1] * (1 - cos(here->roll));
  return sinks - MM_PER_M * here->height;
}

/* Slide of the plane seen from the finger, mm, and its spin, rad, from the last step to here. */
static void motion_of(const memory* past, const placement* here, mjtNum motion[3]) {
  mjtNum turn = remainder(here->angle - past->angle, 2 * mjPI), middle = past->angle + turn / 2;
  mjtNum u = MM_PER_M * (here->foot[0] - past->foot[0]), v = MM_PER_M * (here->foot[1] - past->foot[1]);
  /* The plane goes one way when the finger goes the other. */
  motion[0] = -(u * cos(middle) + v * sin(middle));
  motion[1] = -(v * cos(middle) - u * sin(middle));
  motion[2] = -turn;
}

/* The motion in single precision; what that leaves out is kept and told with the next step, so that nothing adds up. */
static fingerpad_motion told(memory* past, const mjtNum motion[3], float depth, mjtNum dt) {
  float single[3];
  for (int i = 0; i < 3; i++) {
    mjtNum whole = motion[i] + past->rest[i];
    single[i] = (float)whole;
    past->rest[i] = whole - single[i];
  }
  return (fingerpad_motion){depth, single[0], single[1], single[2], (float)dt};
}

/* The model in the pose of the finger; beyond its range the pose is held and flagged. */
static int bring_into_pose(fingerpad_model* model, const settings* s, const placement* here) {
  mjtNum pitch = s->fitted_pitch_deg + DEGREES * here->pitch, roll = DEGREES * here->roll;
  mjtNum held_pitch = mju_clip(pitch, PITCH_RANGE[0], PITCH_RANGE[1]);
  mjtNum held_roll = mju_clip(roll, ROLL_RANGE[0], ROLL_RANGE[1]);
  fingerpad_model_pose(model, (float)held_pitch, (float)held_roll);
  return held_pitch == pitch && held_roll == roll ? 0 : STATUS_POSE_HELD;
}

outcome contact_step(memory* past, const settings* s, const placement* here, int finite, float strength_factor, mjtNum dt) {
  outcome now = {.face = here->face};
  if (fingerpad_spin_state_set_strength_factor(&past->model, strength_factor) == FINGERPAD_NOT_SET_UP) {
    /* Someone wrote into the plugin's state what no step leaves there. */
    memory_clear(past, strength_factor);
    now.status = FINGERPAD_STATUS_MEMORY_LOST;
  }
  if (!finite) {
    /* The reduced model holds what it remembers and flags it; no force goes to bodies whose place is unknown. */
    fingerpad_motion nowhere = {NAN, 0, 0, 0, (float)dt};
    fingerpad_spin_step(&s->model, &past->model, nowhere, &now.model);
    now = (outcome){.face = NO_FACE, .status = now.model.status};
    past->status = now.status;
    return now;
  }
  mjtNum motion[3] = {0, 0, 0};
  if (past->face != here->face || here->face == NO_FACE) {
    memory_clear(past, strength_factor);
  } else {
    motion_of(past, here, motion);
  }
  past->face = here->face;
  mju_copy(past->foot, here->foot, 2);
  past->angle = here->angle;
  if (here->face == NO_FACE) {
    past->status = now.status;
    return now;
  }
  const fingerpad_model* model = &s->model;
  fingerpad_model posed;
  if (s->follows_pose) {
    posed = s->model;
    now.status |= bring_into_pose(&posed, s, here);
    model = &posed;
  }
  now.depth_mm = (float)depth_mm(s, here);
  fingerpad_spin_step(model, &past->model, told(past, motion, now.depth_mm, dt), &now.model);
  past->status = now.status |= now.model.status;
  return now;
}

/* ---- forces ---- */

/* Velocity of the site against the geom's body where the site is: turn rad/s, then m/s, along x, y and z of the contact. */
static void relative_velocity(
    mjtNum turn[3], mjtNum speed[3], const settings* s, const placement* here, const mjModel* m, const mjData* d, int geom) {
  mjtNum finger[6], plane[6], arm[3], carried[3], by[3], at[3];
  mj_objectVelocity(m, d, mjOBJ_SITE, s->site, finger, 0);
  mj_objectVelocity(m, d, mjOBJ_GEOM, geom, plane, 0);
  mju_sub3(arm, d->site_xpos + 3 * s->site, d->geom_xpos + 3 * geom);
  mju_cross(carried, plane, arm);
  mju_sub3(by, finger, plane);
  for (int i = 0; i < 3; i++) at[i] = finger[3 + i] - plane[3 + i] - carried[i];
  const mjtNum* axes[3] = {here->along, here->across, here->normal};
  for (int i = 0; i < 3; i++) {
    turn[i] = mju_dot3(axes[i], by);
    speed[i] = mju_dot3(axes[i], at);
  }
}

/* The dampers: on the rate of depth, and as far as the contact sticks on slide and spin. They never yield work, and never pull. */
static void damp(
    outcome* now, const settings* s, const placement* here, const mjModel* m, const mjData* d, int geom) {
  mjtNum turn[3], speed[3];
  relative_velocity(turn, speed, s, here, m, d, geom);
  mjtNum roll_rate = turn[0] / cos(here->pitch), spin_rate = turn[2] + sin(here->pitch) * roll_rate;
  mjtNum depth_rate = -speed[2] + (s->pad_radius_mm[0] * sin(here->pitch) * turn[1] +
                                   s->pad_radius_mm[1] * sin(here->roll) * roll_rate) / MM_PER_M;
  mjtNum share = mju_min(1, now->depth_mm / DAMPING_DEPTH_MM), stuck = share * now->model.stick_ratio;
  now->damping[0] = -stuck * s->damping_slide * speed[0];
  now->damping[1] = -stuck * s->damping_slide * speed[1];
  now->damping[2] = mju_max(-now->model.normal_force_n, share * s->damping_normal * depth_rate);
  now->damping[3] = -stuck * s->damping_spin * spin_rate * MM_PER_M;
}

/* Moment on the finger about the site, N m along x, y and z of the contact. The normal force acts below the pad's lowest
 * point, or at the model's centre of pressure if the pose is followed. */
static void moment_of(
    mjtNum moment[3], mjtNum normal_n, mjtNum spin_n_mm, const outcome* now, const settings* s, const placement* here) {
  mjtNum spin = spin_n_mm / MM_PER_M, normal = normal_n / MM_PER_M;
  moment[2] = spin;
  if (s->follows_pose) {
    moment[0] = normal * now->model.pressure_centre_y_mm;
    moment[1] = -normal * now->model.pressure_centre_x_mm;
    return;
  }
  /* The derivatives of depth by pitch and roll; roll goes about the finger's own axis, which pitch inclines. */
  moment[1] = -normal * s->pad_radius_mm[0] * sin(here->pitch);
  moment[0] = (spin * sin(here->pitch) - normal * s->pad_radius_mm[1] * sin(here->roll)) / cos(here->pitch);
}

void contact_apply(outcome* now, const settings* s, const placement* here, const mjModel* m, mjData* d, int geom) {
  if (now->model.regime == FINGERPAD_NO_CONTACT) return;
  damp(now, s, here, m, d, geom);
  mjtNum of_contact[3] = {
      now->model.friction_x_n + now->damping[0],
      now->model.friction_y_n + now->damping[1],
      now->model.normal_force_n + now->damping[2],
  };
  mjtNum moment[3], force[3], torque[3];
  moment_of(moment, of_contact[2], now->model.spin_moment_n_mm + now->damping[3], now, s, here);
  for (int i = 0; i < 3; i++) {
    force[i] = of_contact[0] * here->along[i] + of_contact[1] * here->across[i] + of_contact[2] * here->normal[i];
    torque[i] = moment[0] * here->along[i] + moment[1] * here->across[i] + moment[2] * here->normal[i];
  }
  const mjtNum* at = d->site_xpos + 3 * s->site;
  mj_applyFT(m, d, force, torque, at, m->site_bodyid[s->site], d->qfrc_passive);
  mju_scl3(force, force, -1);
  mju_scl3(torque, torque, -1);
  mj_applyFT(m, d, force, torque, at, m->geom_bodyid[geom], d->qfrc_passive);
}

void outcome_write(const outcome* now, mjtNum numbers[OUTPUT_NUMBERS]) {
  const fingerpad_response* r = &now->model;
  mjtNum all[OUTPUT_NUMBERS] = {
      r->normal_force_n, r->friction_x_n,      r->friction_y_n,          r->spin_moment_n_mm,
      now->depth_mm,     r->stick_ratio,       r->slip_margin,           r->friction_limit_n,
      r->contact_area_mm2, r->pressure_centre_x_mm, r->pressure_centre_y_mm, r->regime,
      now->status,       now->face,            now->damping[0],          now->damping[1],
      now->damping[2],   now->damping[3],
  };
  mju_copy(numbers, all, OUTPUT_NUMBERS);
}
