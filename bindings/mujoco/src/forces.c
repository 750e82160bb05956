/* The forces of a contact on both bodies, and the dampers. */

#include <math.h>

#include "contact.h"

/* Depth over which the dampers grow from nothing, so that a touch begins without a blow, mm. */
static const mjtNum DAMPING_DEPTH_MM = 0.2;
static const mjtNum MM_PER_M = 1000;

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

/* The dampers act at the point of the finger that touches first, the speed of which along the normal is the rate of depth: on that rate,
 * and as far as the contact sticks on slide and spin. */
void contact_wrench(
    wrench* w, outcome* now, const settings* s, const placement* here, const mjtNum turn[3], const mjtNum speed[3]) {
  const fingerpad_wrench* felt = &now->felt.on_finger;
  const mjtNum* axes[3] = {here->along, here->across, here->normal};
  mjtNum swept[3], own[3];
  for (int i = 0; i < 3; i++) {
    mju_mulMatTVec3(own, here->site, axes[i]);
    w->force[i] = own[0] * felt->force_n[0] + own[1] * felt->force_n[1] + own[2] * felt->force_n[2];
    w->moment[i] = (own[0] * felt->moment_n_mm[0] + own[1] * felt->moment_n_mm[1] + own[2] * felt->moment_n_mm[2]) / MM_PER_M;
  }
  mju_cross(swept, turn, here->touch);
  mju_addTo3(swept, speed);
  mjtNum share = mju_min(1, now->felt.depth_mm / DAMPING_DEPTH_MM), stuck = share * now->felt.response.stick_ratio;
  now->damping[0] = -stuck * s->damping_slide * swept[0];
  now->damping[1] = -stuck * s->damping_slide * swept[1];
  /* It never pulls. */
  now->damping[2] = mju_max(-now->felt.response.normal_force_n, -share * s->damping_normal * swept[2]);
  now->damping[3] = -stuck * s->damping_spin * turn[2] * MM_PER_M;
  add_at(w, now->damping, here->touch);
  w->moment[0] -= share * s->damping_spin * turn[0];
  w->moment[1] -= share * s->damping_spin * turn[1];
  w->moment[2] += now->damping[3] / MM_PER_M;
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
  if (now->felt.response.regime == FINGERPAD_NO_CONTACT) return;
  mjtNum turn[3], speed[3];
  wrench w;
  relative_velocity(turn, speed, s, here, m, d, geom);
  contact_wrench(&w, now, s, here, turn, speed);
  wrench_apply(&w, s, here, m, d, geom);
}
