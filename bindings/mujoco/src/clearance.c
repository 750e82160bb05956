#include "clearance.h"

#include <math.h>

static const mjtNum MM_PER_M = 1000;
/* The fit of a pad's heights has the site this near to first touch, mm. */
static const mjtNum FIT_MM = 0.1;

/* Of distances to the sides of a body, positive outside: that to the body. */
static mjtNum outside(const mjtNum* sides, int count) {
  mjtNum square = 0, most = -INFINITY;
  for (int i = 0; i < count; i++) {
    mjtNum out = mju_max(0, sides[i]);
    square += out * out;
    most = mju_max(most, sides[i]);
  }
  return square > 0 ? sqrt(square) : most;
}

/* How far a point of the finger, mm in the site's frame, lies outside a geom, mm. At most the true distance for ellipsoids and meshes. */
static mjtNum gap_mm(const settings* s, int slot, const placement* here, const mjtNum point[3]) {
  const mjtNum* size = s->shape[slot].size_mm;
  mjtNum apart[3], back[4], at[3];
  mju_sub3(apart, point, here->geom.position_mm);
  mju_negQuat(back, here->geom.quaternion);
  mju_rotVecQuat(at, apart, back);
  mjtNum sides[3];
  const facets* mesh = &s->mesh[slot];
  if (mesh->count) {
    mju_scl3(at, at, 1 / MM_PER_M);
    for (int i = 0; i < 3; i++) sides[i] = mju_max(at[i] - mesh->most[i], mesh->least[i] - at[i]);
    mjtNum gap = MM_PER_M * outside(sides, 3);
    return gap > s->enclosing_mm + FAR_MM ? gap : MM_PER_M * facets_gap(mesh, at);
  }
  switch (s->shape[slot].kind) {
    case FINGERPAD_SHAPE_BOX:
      for (int i = 0; i < 3; i++) sides[i] = fabs(at[i]) - size[i];
      return outside(sides, 3);
    case FINGERPAD_SHAPE_SPHERE: return mju_norm3(at) - size[0];
    case FINGERPAD_SHAPE_ELLIPSOID:
      /* Beyond the plane that touches the ellipsoid where it has the normal of its scaled copy through the point. */
      for (int i = 0; i < 3; i++) sides[i] = at[i] / (size[i] * size[i]);
      mju_normalize3(sides);
      for (int i = 0; i < 3; i++) back[i] = size[i] * sides[i];
      return mju_dot3(at, sides) - mju_norm3(back);
    case FINGERPAD_SHAPE_CAPSULE:
      at[2] = mju_max(0, fabs(at[2]) - size[1]);
      return mju_norm3(at) - size[0];
    case FINGERPAD_SHAPE_CYLINDER:
      sides[0] = mju_norm(at, 2) - size[0];
      sides[1] = fabs(at[2]) - size[1];
      return outside(sides, 2);
    default: return at[2];
  }
}

/* A point on the axis of the pad, mm from the site into the finger. */
static void inside_finger(mjtNum point[3], const settings* s, mjtNum far_mm) {
  for (int k = 0; k < 3; k++) point[k] = far_mm * s->level[3 * k + 2];
}

mjtNum clearance_mm(const settings* s, int slot, const placement* here) {
  mjtNum middle[3];
  inside_finger(middle, s, s->enclosing_mm - FIT_MM);
  return gap_mm(s, slot, here, middle) - s->enclosing_mm;
}

int faces_away(const settings* s, int slot, const placement* here) {
  const mjtNum site[3] = {0, 0, 0}, step_mm = 0.1, near_mm = 0.5, deep_mm = 5, steep = 0.5;
  mjtNum point[3], gap = gap_mm(s, slot, here, site);
  if (!(gap < near_mm && gap > -deep_mm)) return 0;
  inside_finger(point, s, step_mm);
  return gap_mm(s, slot, here, point) - gap < -steep * step_mm;
}

mjtNum enclosing_radius_mm(const settings* s) {
  if (!s->is_pad) return mju_max(s->pad_radius_mm[0], s->pad_radius_mm[1]);
  fingerpad_pad_info info = {0};
  fingerpad_pad_describe(&s->pad, &info);
  enum { POSES = 12 };
  mjtNum radius = 0;
  for (int i = 0; i <= POSES; i++) {
    for (int k = -1; k <= 1; k++) {
      float pitch = info.pitch_min_deg + (info.pitch_max_deg - info.pitch_min_deg) * (float)i / POSES, at[3];
      fingerpad_pad_first_touch(&s->pad, pitch, (float)k * info.roll_max_deg, at);
      mjtNum square = at[0] * at[0] + at[1] * at[1] + at[2] * at[2];
      radius = mju_max(radius, square / (2 * (at[2] + FIT_MM)));
    }
  }
  return radius;
}
