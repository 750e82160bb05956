#include "placement.h"

#include <math.h>

/* Least cosine between the site's z axis and a face's normal: 60 degrees. Beyond, the pad does not look at the face. */
static const mjtNum FACING = 0.5;

/* A face of a geom in the geom's own frame: u, v and the normal are right-handed. */
typedef struct {
  mjtNum u[3], v[3], normal[3];
  /* Distance from the geom's middle; half the face's extents; largest depth that is still on this side of the geom. */
  mjtNum offset, half[2], thickness;
} face_frame;

/* Face `face` of a geom. */
static face_frame frame_of(int face, mjtGeom type, const mjtNum size[3]) {
  face_frame f = {{0}, {0}, {0}, 0, {INFINITY, INFINITY}, INFINITY};
  if (type == mjGEOM_PLANE) {
    f.u[0] = f.v[1] = f.normal[2] = 1;
    return f;
  }
  int axis = (face - 1) % 3, next = (axis + 1) % 3, last = (axis + 2) % 3;
  mjtNum side = face <= 3 ? 1 : -1;
  f.normal[axis] = side;
  f.u[next] = 1;
  f.v[last] = side;
  f.offset = f.thickness = size[axis];
  f.half[0] = size[next];
  f.half[1] = size[last];
  return f;
}

/* Whether a site at `at` with the outward axis `z`, both in the geom's frame, stands over a face and looks at it. */
static int stands_over(const face_frame* f, const mjtNum at[3], const mjtNum z[3]) {
  return mju_dot3(z, f->normal) > FACING && mju_abs(mju_dot3(at, f->u)) <= f->half[0] &&
         mju_abs(mju_dot3(at, f->v)) <= f->half[1] && mju_dot3(at, f->normal) > f->offset - f->thickness;
}

/* The face over which a site stands: the old one, else the one at which it looks most. */
static int choose_face(mjtGeom type, const mjtNum size[3], const mjtNum at[3], const mjtNum z[3], int old) {
  int count = type == mjGEOM_PLANE ? 1 : 6, best = NO_FACE;
  mjtNum most = 0;
  for (int face = 1; face <= count; face++) {
    face_frame f = frame_of(face, type, size);
    mjtNum facing = mju_dot3(z, f.normal);
    if (stands_over(&f, at, z) && (face == old || facing > most)) {
      best = face;
      most = face == old ? INFINITY : facing;
    }
  }
  return best;
}

static int is_finite(const mjtNum* x, int count) {
  for (int i = 0; i < count; i++) {
    if (!isfinite(x[i])) return 0;
  }
  return 1;
}

int place(placement* here, const mjModel* m, const mjData* d, int site, int geom, int face) {
  const mjtNum *tip = d->site_xpos + 3 * site, *axes = d->site_xmat + 9 * site;
  const mjtNum *middle = d->geom_xpos + 3 * geom, *turn = d->geom_xmat + 9 * geom;
  *here = (placement){.face = NO_FACE};
  if (!(is_finite(tip, 3) && is_finite(axes, 9) && is_finite(middle, 3) && is_finite(turn, 9))) return -1;

  /* The site in the geom's frame. */
  mjtNum apart[3], at[3], seen[9];
  mju_sub3(apart, tip, middle);
  mju_mulMatTVec3(at, turn, apart);
  mju_mulMatTMat(seen, turn, axes, 3, 3, 3);
  mjtNum x[3] = {seen[0], seen[3], seen[6]}, y[3] = {seen[1], seen[4], seen[7]}, z[3] = {seen[2], seen[5], seen[8]};
  here->face = choose_face((mjtGeom)m->geom_type[geom], m->geom_size + 3 * geom, at, z, face);
  if (here->face == NO_FACE) return 0;

  face_frame f = frame_of(here->face, (mjtGeom)m->geom_type[geom], m->geom_size + 3 * geom);
  here->foot[0] = mju_dot3(at, f.u);
  here->foot[1] = mju_dot3(at, f.v);
  here->height = mju_dot3(at, f.normal) - f.offset;
  mjtNum cosine = mju_dot3(x, f.u), sine = mju_dot3(x, f.v), flat = sqrt(cosine * cosine + sine * sine);
  here->angle = atan2(sine, cosine);
  cosine = cos(here->angle);
  sine = sin(here->angle);
  mjtNum along[3], across[3];
  for (int i = 0; i < 3; i++) {
    along[i] = cosine * f.u[i] + sine * f.v[i];
    across[i] = cosine * f.v[i] - sine * f.u[i];
  }
  here->pitch = atan2(-mju_dot3(x, f.normal), flat);
  here->roll = atan2(-mju_dot3(z, across), mju_dot3(y, across));
  mju_mulMatVec3(here->along, turn, along);
  mju_mulMatVec3(here->across, turn, across);
  mju_mulMatVec3(here->normal, turn, f.normal);
  return 0;
}
