/* The forces of a contact on both bodies, and the dampers. */

#include <math.h>

#include "contact.h"

/* Depth over which the dampers grow from nothing, so that a touch begins without a blow, mm. */
static const mjtNum DAMPING_DEPTH_MM = 0.2;
static const mjtNum MM_PER_M = 1000;
static const mjtNum RADIANS = mjPI / 180;

/* Adds a force that acts at `arm` from the site, m along x, y and z of the contact. */
static void add_at(wrench* w, const mjtNum force[3], const mjtNum arm[3]) {
  mjtNum moment[3];
  mju_cross(moment, arm, force);
  mju_addTo3(w->force, force);
  mju_addTo3(w->moment, moment);
}

/* Velocity of the finger against the geom's body at the site: turn rad/s, then m/s, along x, y and z of the contact. */
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

/* Share of the depth over which the dampers grow. */
static mjtNum grown(const outcome* now) { return mju_min(1, now->depth_mm / DAMPING_DEPTH_MM); }

/* Damping of the normal force, N; it never pulls. */
static mjtNum normal_damping(const outcome* now, const settings* s, mjtNum depth_rate) {
  return mju_max(-now->model.normal_force_n, grown(now) * s->damping_normal * depth_rate);
}

/* ---- pad ---- */

/* The normal of the face in the finger's frame at a pitch and a roll, and its derivatives by them. */
static void normal_at(mjtNum normal[3], mjtNum by_pitch[3], mjtNum by_roll[3], mjtNum pitch, mjtNum roll) {
  mjtNum ps = sin(pitch), pc = cos(pitch), rs = sin(roll), rc = cos(roll);
  mjtNum at[3][3] = {{-ps, pc * rs, pc * rc}, {-pc, -ps * rs, -ps * rc}, {0, pc * rc, -pc * rs}};
  mju_copy3(normal, at[0]);
  mju_copy3(by_pitch, at[1]);
  mju_copy3(by_roll, at[2]);
}

/* Forces of the pad on the finger, about the site. The pad's forces act at the foot of the site, with the moment of its pressures
 * about that point. Where it holds the pose at the end of its range the moment is the derivative of the depth alone, so that a pose
 * beyond the range yields no energy either. */
static void pad_forces(wrench* w, const outcome* now, const settings* s, const placement* here, const mjtNum touch_m[3]) {
  const fingerpad_response* r = &now->model;
  const fingerpad_pad_info* info = &s->pad_info;
  mjtNum neutral = info->neutral_pitch_deg * RADIANS, roll_max = info->roll_max_deg * RADIANS;
  mjtNum pitch = mju_clip(here->pitch, info->pitch_min_deg * RADIANS - neutral, info->pitch_max_deg * RADIANS - neutral);
  mjtNum roll = mju_clip(here->roll, -roll_max, roll_max);
  mjtNum normal[3], by_pitch[3], by_roll[3], held[3], held_by_pitch[3], held_by_roll[3];
  normal_at(normal, by_pitch, by_roll, here->pitch, here->roll);
  normal_at(held, held_by_pitch, held_by_roll, pitch, roll);
  mjtNum force[3] = {r->friction_x_n, r->friction_y_n, r->normal_force_n};
  /* The foot of the site in the pose that the pad follows. */
  mjtNum foot[3] = {0, 0, now->depth_mm / MM_PER_M + mju_dot3(held, touch_m)};
  add_at(w, force, foot);
  w->moment[0] += r->tilt_moment_x_n_mm / MM_PER_M;
  w->moment[1] += r->tilt_moment_y_n_mm / MM_PER_M;
  w->moment[2] += r->spin_moment_n_mm / MM_PER_M;
  if (pitch == here->pitch && roll == here->roll) return;

  /* Generalised forces of pitch, and of roll, which goes about the finger's own axis. */
  mjtNum of_pitch = w->moment[1] - force[2] * mju_dot3(held_by_pitch, touch_m);
  mjtNum of_roll = cos(pitch) * w->moment[0] - sin(pitch) * w->moment[2] - force[2] * mju_dot3(held_by_roll, touch_m);
  of_pitch = (pitch == here->pitch ? of_pitch : 0) + force[2] * mju_dot3(by_pitch, touch_m);
  of_roll = (roll == here->roll ? of_roll : 0) + force[2] * mju_dot3(by_roll, touch_m);
  w->moment[1] = of_pitch;
  w->moment[0] = (of_roll + sin(here->pitch) * w->moment[2]) / cos(here->pitch);
}

/* The forces of the pad and its dampers. Dampers act at the point of the finger that touches first, the speed of which along the
 * normal is the rate of depth. */
static void pad_wrench(
    wrench* w, outcome* now, const settings* s, const placement* here, const mjtNum turn[3], const mjtNum speed[3]) {
  mjtNum local[3], touch[3], swept[3];
  mjtNum ps = sin(here->pitch), pc = cos(here->pitch), rs = sin(here->roll), rc = cos(here->roll);
  mjtNum turned[9] = {pc, ps * rs, ps * rc, 0, rc, -rs, -ps, pc * rs, pc * rc};
  first_touch(local, s, here->pitch, here->roll);
  mju_scl3(local, local, 1 / MM_PER_M);
  pad_forces(w, now, s, here, local);

  mju_mulMatVec3(touch, turned, local);
  mju_cross(swept, turn, touch);
  mju_addTo3(swept, speed);
  mjtNum share = grown(now), stuck = share * now->model.stick_ratio;
  now->damping[0] = -stuck * s->damping_slide * swept[0];
  now->damping[1] = -stuck * s->damping_slide * swept[1];
  now->damping[2] = normal_damping(now, s, -swept[2]);
  now->damping[3] = -stuck * s->damping_spin * turn[2] * MM_PER_M;
  add_at(w, now->damping, touch);
  w->moment[0] -= share * s->damping_spin * turn[0];
  w->moment[1] -= share * s->damping_spin * turn[1];
  w->moment[2] += now->damping[3] / MM_PER_M;
}

/* ---- bed ---- */

/* The forces of the bed and its dampers, on the rate of depth and as far as the contact sticks on slide and spin. The normal force
 * acts below the pad's lowest point: the moments are the derivatives of depth by pitch and roll. Roll goes about the finger's own
 * axis, which pitch inclines. */
static void bed_wrench(
    wrench* w, outcome* now, const settings* s, const placement* here, const mjtNum turn[3], const mjtNum speed[3]) {
  const fingerpad_response* r = &now->model;
  mjtNum by_pitch = s->pad_radius_mm[0] * sin(here->pitch) / MM_PER_M;
  mjtNum by_roll = s->pad_radius_mm[1] * sin(here->roll) / MM_PER_M;
  mjtNum roll_rate = turn[0] / cos(here->pitch), spin_rate = turn[2] + sin(here->pitch) * roll_rate;
  mjtNum share = grown(now), stuck = share * r->stick_ratio;
  now->damping[0] = -stuck * s->damping_slide * speed[0];
  now->damping[1] = -stuck * s->damping_slide * speed[1];
  now->damping[2] = normal_damping(now, s, -speed[2] + by_pitch * turn[1] + by_roll * roll_rate);
  now->damping[3] = -stuck * s->damping_spin * spin_rate * MM_PER_M;
  mjtNum normal = r->normal_force_n + now->damping[2], spin = (r->spin_moment_n_mm + now->damping[3]) / MM_PER_M;
  w->force[0] = r->friction_x_n + now->damping[0];
  w->force[1] = r->friction_y_n + now->damping[1];
  w->force[2] = normal;
  w->moment[0] = (spin * sin(here->pitch) - normal * by_roll) / cos(here->pitch);
  w->moment[1] = -normal * by_pitch;
  w->moment[2] = spin;
}

/* ---- both ---- */

void contact_wrench(
    wrench* w, outcome* now, const settings* s, const placement* here, const mjtNum turn[3], const mjtNum speed[3]) {
  *w = (wrench){{0, 0, 0}, {0, 0, 0}};
  (s->is_pad ? pad_wrench : bed_wrench)(w, now, s, here, turn, speed);
}

void wrench_apply(const wrench* w, const settings* s, const placement* here, const mjModel* m, mjData* d, int geom) {
  mjtNum force[3], torque[3];
  for (int i = 0; i < 3; i++) {
    force[i] = w->force[0] * here->along[i] + w->force[1] * here->across[i] + w->force[2] * here->normal[i];
    torque[i] = w->moment[0] * here->along[i] + w->moment[1] * here->across[i] + w->moment[2] * here->normal[i];
  }
  const mjtNum* at = d->site_xpos + 3 * s->site;
  mj_applyFT(m, d, force, torque, at, m->site_bodyid[s->site], d->qfrc_passive);
  mju_scl3(force, force, -1);
  mju_scl3(torque, torque, -1);
  mj_applyFT(m, d, force, torque, at, m->geom_bodyid[geom], d->qfrc_passive);
}

void contact_apply(outcome* now, const settings* s, const placement* here, const mjModel* m, mjData* d, int geom) {
  if (now->model.regime == FINGERPAD_NO_CONTACT) return;
  mjtNum turn[3], speed[3];
  wrench w;
  relative_velocity(turn, speed, s, here, m, d, geom);
  contact_wrench(&w, now, s, here, turn, speed);
  wrench_apply(&w, s, here, m, d, geom);
}
