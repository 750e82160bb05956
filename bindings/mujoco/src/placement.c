#include "placement.h"

#include <math.h>

static const mjtNum MM_PER_M = 1000;
static const mjtNum RADIANS = mjPI / 180;

static int is_finite(const mjtNum* x, int count) {
  for (int i = 0; i < count; i++) {
    if (!isfinite(x[i])) return 0;
  }
  return 1;
}

fingerpad_pose carried_by(const fingerpad_pose* frame, const fingerpad_pose* pose) {
  fingerpad_pose whole;
  mju_mulPose(whole.position_mm, whole.quaternion, frame->position_mm, frame->quaternion, pose->position_mm, pose->quaternion);
  mju_normalize4(whole.quaternion);
  return whole;
}

fingerpad_pose seen_from(const fingerpad_pose* frame, const fingerpad_pose* pose) {
  fingerpad_pose back;
  mju_negPose(back.position_mm, back.quaternion, frame->position_mm, frame->quaternion);
  return carried_by(&back, pose);
}

void place(placement* here, const settings* s, const mjData* d, int geom) {
  const mjtNum *tip = d->site_xpos + 3 * s->site, *axes = d->site_xmat + 9 * s->site;
  const mjtNum *at = d->geom_xpos + 3 * geom, *turn = d->geom_xmat + 9 * geom;
  mjtNum apart[3], own[9];
  *here = (placement){.finite = is_finite(tip, 3) && is_finite(axes, 9) && is_finite(at, 3) && is_finite(turn, 9)};
  mju_copy(here->site, axes, 9);
  mju_sub3(apart, at, tip);
  mju_mulMatTVec3(here->geom.position_mm, axes, apart);
  mju_scl3(here->geom.position_mm, here->geom.position_mm, MM_PER_M);
  mju_mulMatTMat(own, axes, turn, 3, 3, 3);
  mju_mat2Quat(here->geom.quaternion, own);
  if (!here->finite) here->geom.position_mm[0] = NAN;
}

void place_moved(placement* there, const placement* here, const mjtNum shift[3], const mjtNum turn[3]) {
  const mjtNum* axes[3] = {here->along, here->across, here->normal};
  mjtNum shifted[3] = {0, 0, 0}, about[3] = {0, 0, 0}, turned[9];
  fingerpad_pose moved;
  for (int k = 0; k < 3; k++) {
    mju_addToScl3(shifted, axes[k], MM_PER_M * shift[k]);
    mju_addToScl3(about, axes[k], turn[k]);
  }
  mju_mulMatTVec3(moved.position_mm, here->site, shifted);
  mju_mulMatTVec3(about, here->site, about);
  mjtNum angle = mju_normalize3(about);
  mju_axisAngle2Quat(moved.quaternion, about, angle);
  *there = *here;
  there->geom = seen_from(&moved, &here->geom);
  mju_quat2Mat(turned, moved.quaternion);
  mju_mulMatMat(there->site, here->site, turned, 3, 3, 3);
}

/* The point of the finger that touches first in a pose, m along the axes of the face. A bed's finger is round;
 * its place follows from the slopes of depth, where roll goes about the finger's own axis, which pitch inclines. */
static void touch_of(mjtNum touch[3], const settings* s, const fingerpad_frame_response* felt, const mjtNum turned[9]) {
  if (s->is_pad) {
    float place_mm[3] = {0, 0, 0};
    fingerpad_pad_first_touch(&s->pad, felt->pitch_deg, felt->roll_deg, place_mm);
    const mjtNum level[3] = {place_mm[0] / MM_PER_M, place_mm[1] / MM_PER_M, place_mm[2] / MM_PER_M};
    mju_mulMatVec3(touch, turned, level);
    return;
  }
  mjtNum pitch = (felt->pitch_deg - s->neutral_deg[0]) * RADIANS, roll = (felt->roll_deg - s->neutral_deg[1]) * RADIANS;
  touch[0] = s->pad_radius_mm[0] / MM_PER_M * sin(pitch);
  touch[1] = -s->pad_radius_mm[1] / MM_PER_M * sin(roll) / cos(pitch);
  touch[2] = -(s->pad_radius_mm[0] * (1 - cos(pitch)) + s->pad_radius_mm[1] * (1 - cos(roll))) / MM_PER_M;
}

void stand(placement* here, const settings* s, const fingerpad_frame_response* felt) {
  mjtNum pitch = (felt->pitch_deg - s->neutral_deg[0]) * RADIANS, roll = (felt->roll_deg - s->neutral_deg[1]) * RADIANS;
  mjtNum ps = sin(pitch), pc = cos(pitch), rs = sin(roll), rc = cos(roll), level[9], axes[9];
  /* From the finger's level axes to those of the face. */
  const mjtNum turned[9] = {pc, ps * rs, ps * rc, 0, rc, -rs, -ps, pc * rs, pc * rc};
  touch_of(here->touch, s, felt, turned);
  mju_mulMatMat(level, here->site, s->level, 3, 3, 3);
  mju_mulMatMatT(axes, turned, level, 3, 3, 3);
  mju_copy3(here->along, axes);
  mju_copy3(here->across, axes + 3);
  mju_copy3(here->normal, axes + 6);
}
