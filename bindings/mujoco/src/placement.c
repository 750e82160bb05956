#include "placement.h"

#include <math.h>
#include <string.h>

/* Least cosine between the site's z axis and a face's normal: 60 degrees. Beyond, the finger does not face it. */
static const mjtNum FACING = 0.5;
/* About the radius of the pad's surface, m: how far the search for the apex of a round face goes ahead. */
static const mjtNum PAD_RADIUS = 0.02;
/* Largest depth below a face, m, to which a finger may come within one step from above it. */
static const mjtNum HOVER = 0.005;
/* How far from a round geom the finger looks for it, m. */
static const mjtNum NEAR = 0.03;
static const mjtNum DEGREES = 180 / mjPI;
static const mjtNum MM_PER_M = 1000;

/* A face of a geom in the geom's own frame: u, v and the normal are right-handed. */
typedef struct {
  mjtNum u[3], v[3], normal[3];
  /* From the geom's middle to that of the face's curvature; from there along the normal to the face. */
  mjtNum middle[3], offset;
  /* Half the face's extents, radius of its rim; depth of the geom's middle below the face (of the far side of a round one). */
  mjtNum half[2], rim, thickness;
  fingerpad_body body;
} face_frame;

static void column(mjtNum to[3], const mjtNum axes[9], int k) {
  for (int i = 0; i < 3; i++) to[i] = axes[3 * i + k];
}

static fingerpad_body body_of(uint32_t kind, mjtNum radius) {
  return (fingerpad_body){kind, (float)(MM_PER_M * radius), 0, 0};
}

static face_frame flat_frame(int axis, mjtNum side, mjtNum offset) {
  face_frame f = {.half = {INFINITY, INFINITY}, .rim = INFINITY, .thickness = INFINITY, .offset = offset};
  f.normal[axis] = side;
  f.u[(axis + 1) % 3] = 1;
  f.v[(axis + 2) % 3] = side;
  f.body = body_of(FINGERPAD_BODY_PLANE, 0);
  return f;
}

static face_frame box_frame(int face, const mjtNum size[3]) {
  int axis = (face - 1) % 3;
  face_frame f = flat_frame(axis, face <= 3 ? 1 : -1, size[axis]);
  f.thickness = size[axis];
  f.half[0] = size[(axis + 1) % 3];
  f.half[1] = size[(axis + 2) % 3];
  return f;
}

/* Axes across the normal of a round face: any will do, if they are always the same. */
static void axes_across(face_frame* f, const mjtNum normal[3]) {
  mjtNum other[3] = {0, 0, 0};
  int least = mju_abs(normal[0]) < mju_abs(normal[1]) ? 0 : 1;
  other[mju_abs(normal[2]) < mju_abs(normal[least]) ? 2 : least] = 1;
  mju_copy3(f->normal, normal);
  mju_cross(f->u, other, normal);
  mju_normalize3(f->u);
  mju_cross(f->v, f->normal, f->u);
}

/* A sphere about `middle` on the geom's z axis. */
static face_frame sphere_frame(mjtNum radius, mjtNum middle, const mjtNum apex[3]) {
  face_frame f = {
      .middle = {0, 0, middle},
      .offset = radius,
      .half = {INFINITY, INFINITY},
      .rim = INFINITY,
      .thickness = 2 * radius,
      .body = body_of(FINGERPAD_BODY_SPHERE, radius),
  };
  axes_across(&f, apex);
  return f;
}

/* An ellipsoid where its outward normal is `apex`: the sphere there of the geometric mean of both radii of curvature. With the
 * semi-axes a, b, c and the height  h = (a² nx² + b² ny² + c² nz²)^½  of the tangent plane over the geom's middle it touches at
 * (a² nx, b² ny, c² nz) / h  and has the radius  a b c / h². */
static face_frame ellipsoid_frame(const mjtNum size[3], const mjtNum apex[3]) {
  mjtNum touched[3], height;
  for (int i = 0; i < 3; i++) touched[i] = size[i] * size[i] * apex[i];
  height = sqrt(mju_max(mjMINVAL, mju_dot3(touched, apex)));
  face_frame f = sphere_frame(size[0] * size[1] * size[2] / (height * height), 0, apex);
  for (int i = 0; i < 3; i++) f.middle[i] = touched[i] / height - f.offset * apex[i];
  f.thickness = height;
  return f;
}

/* The side of a cylinder along the geom's z axis. */
static face_frame side_frame(const mjtNum size[3], const mjtNum apex[3]) {
  face_frame f = {
      .u = {0, 0, 1},
      .offset = size[0],
      .half = {size[1], INFINITY},
      .rim = INFINITY,
      .thickness = 2 * size[0],
      .body = body_of(FINGERPAD_BODY_CYLINDER, size[0]),
  };
  mju_copy3(f.normal, apex);
  mju_cross(f.v, f.normal, f.u);
  return f;
}

/* The flat end of a cylinder. */
static face_frame end_frame(const mjtNum size[3], mjtNum side) {
  face_frame f = flat_frame(2, side, size[1]);
  f.rim = size[0];
  f.thickness = size[1];
  return f;
}

/* Face `face` of a geom, `apex` the normal of a round one. */
static face_frame frame_of(int face, mjtGeom type, const mjtNum size[3], const mjtNum apex[3]) {
  mjtNum side = face == 2 ? 1 : -1;
  switch (type) {
    case mjGEOM_BOX: return box_frame(face, size);
    case mjGEOM_SPHERE: return sphere_frame(size[0], 0, apex);
    case mjGEOM_ELLIPSOID: return ellipsoid_frame(size, apex);
    case mjGEOM_CAPSULE: return face == 1 ? side_frame(size, apex) : sphere_frame(size[0], side * size[1], apex);
    case mjGEOM_CYLINDER: return face == 1 ? side_frame(size, apex) : end_frame(size, side);
    default: return flat_frame(2, 1, 0);
  }
}

static int face_count(mjtGeom type) {
  switch (type) {
    case mjGEOM_BOX: return 6;
    case mjGEOM_CAPSULE:
    case mjGEOM_CYLINDER: return 3;
    default: return 1;
  }
}

static int is_round(int face, mjtGeom type) {
  return type == mjGEOM_SPHERE || type == mjGEOM_ELLIPSOID || type == mjGEOM_CAPSULE || (type == mjGEOM_CYLINDER && face == 1);
}

/* Angle of the site within the face, pitch and roll, and the axes that go with it, in the geom's frame. */
static void against(placement* here, mjtNum along[3], mjtNum across[3], const face_frame* f, const seen_site* site) {
  mjtNum x[3], y[3], z[3];
  column(x, site->axes, 0);
  column(y, site->axes, 1);
  column(z, site->axes, 2);
  mjtNum cosine = mju_dot3(x, f->u), sine = mju_dot3(x, f->v), flat = sqrt(cosine * cosine + sine * sine);
  here->angle = atan2(sine, cosine);
  cosine = cos(here->angle);
  sine = sin(here->angle);
  for (int i = 0; i < 3; i++) {
    along[i] = cosine * f->u[i] + sine * f->v[i];
    across[i] = cosine * f->v[i] - sine * f->u[i];
  }
  here->pitch = atan2(-mju_dot3(x, f->normal), flat);
  here->roll = atan2(-mju_dot3(z, across), mju_dot3(y, across));
}

void first_touch(mjtNum place_mm[3], const settings* s, mjtNum pitch, mjtNum roll) {
  float place[3] = {0, 0, 0};
  fingerpad_pad_first_touch(&s->pad, (float)(s->pad_info.neutral_pitch_deg + DEGREES * pitch), (float)(DEGREES * roll), place);
  for (int i = 0; i < 3; i++) place_mm[i] = place[i];
}

/* Finds the apex of a round face: the point of it under which the pad touches first. It lies on the line from the middle of the
 * geom's curvature to that of the pad's surface, which is about the same for all poses near the one sought. */
static int find_apex(mjtNum apex[3], int face, mjtGeom type, const mjtNum size[3], const seen_site* site, const settings* s) {
  int is_side = face == 1 && (type == mjGEOM_CAPSULE || type == mjGEOM_CYLINDER);
  column(apex, site->axes, 2);
  face_frame f = frame_of(face, type, size, apex);
  mjtNum touch[3] = {0, 0, 0};
  for (int round = 0; round < 60; round++) {
    mjtNum along[3], across[3], local[3], to[3], turn = 0;
    placement there;
    if (is_side) apex[2] = 0;
    if (mju_normalize3(apex) < mjMINVAL) return 0;
    f = frame_of(face, type, size, apex);
    against(&there, along, across, &f, site);
    first_touch(local, s, there.pitch, there.roll);
    mju_mulMatVec3(touch, site->axes, local);
    for (int i = 0; i < 3; i++) {
      touch[i] = site->at[i] + touch[i] / MM_PER_M - f.middle[i];
      to[i] = touch[i] + PAD_RADIUS * apex[i];
    }
    if (is_side) to[2] = 0;
    if (mju_normalize3(to) < mjMINVAL) return 0;
    for (int i = 0; i < 3; i++) turn += mju_abs(to[i] - apex[i]);
    mju_copy3(apex, to);
    if (turn < 1e-9) break;
  }
  /* Beyond the end of a capsule's side its cap is touched, and the other way round. */
  if (type == mjGEOM_CAPSULE) return is_side ? mju_abs(touch[2]) <= size[1] : touch[2] * f.middle[2] >= 0;
  return 1;
}

/* Whether the site lies within the extents of a face, the finger faces it, and the site is no deeper below it than `reach`, m. */
static int stands_over(const face_frame* f, const seen_site* site, mjtNum reach) {
  mjtNum at[3], z[3];
  mju_sub3(at, site->at, f->middle);
  column(z, site->axes, 2);
  mjtNum u = mju_dot3(at, f->u), v = mju_dot3(at, f->v);
  return mju_dot3(z, f->normal) > FACING && mju_abs(u) <= f->half[0] && mju_abs(v) <= f->half[1] &&
         u * u + v * v <= f->rim * f->rim && mju_dot3(at, f->normal) > f->offset - reach;
}

/* How deep below a face the site may be, m. Depth is compression of the pad: a finger that touches a face may sink in deeper than
 * the object is thick. A finger that was above the face in the last step may pass HOVER in one step. Any other must be in front of
 * the geom's middle: behind it the finger stands with its back to the geom. */
static mjtNum reach_of(const face_frame* f, int is_old, int touches) {
  if (is_old && touches) return INFINITY;
  return is_old ? mju_max(f->thickness, HOVER) : f->thickness;
}

/* The face over which a site stands: the old one, else the one that it faces most. */
static int choose_face(
    mjtNum apex[3], const settings* s, mjtGeom type, const mjtNum size[3], const seen_site* site, const last_face* old) {
  if (old->face >= 1 && old->face <= face_count(type)) {
    face_frame f = frame_of(old->face, type, size, old->apex);
    mju_copy3(apex, old->apex);
    if (stands_over(&f, site, reach_of(&f, 1, old->touches))) return old->face;
  }
  if (type != mjGEOM_PLANE && type != mjGEOM_BOX && mju_norm3(site->at) > size[0] + size[1] + NEAR) return NO_FACE;
  int best = NO_FACE;
  mjtNum most = 0, z[3];
  column(z, site->axes, 2);
  for (int face = 1; face <= face_count(type); face++) {
    mjtNum tried[3] = {0, 0, 0};
    if (is_round(face, type) && !find_apex(tried, face, type, size, site, s)) continue;
    face_frame f = frame_of(face, type, size, tried);
    mjtNum facing = mju_dot3(z, f.normal);
    if (stands_over(&f, site, reach_of(&f, 0, 0)) && facing > most) {
      best = face;
      most = facing;
      mju_copy3(apex, tried);
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

/* Fills in a placement over a face; `turn` leads from the geom's frame to that of the directions. */
static void place_over(placement* here, const face_frame* f, const seen_site* site, const mjtNum turn[9]) {
  mjtNum at[3], along[3], across[3];
  here->body = f->body;
  here->site = *site;
  mju_sub3(at, site->at, f->middle);
  here->foot[0] = mju_dot3(at, f->u);
  here->foot[1] = mju_dot3(at, f->v);
  here->height = mju_dot3(at, f->normal) - f->offset;
  mju_copy(here->half, f->half, 2);
  here->rim = f->rim;
  against(here, along, across, f, site);
  mju_mulMatVec3(here->along, turn, along);
  mju_mulMatVec3(here->across, turn, across);
  mju_mulMatVec3(here->normal, turn, f->normal);
}

int place(placement* here, const settings* s, const mjModel* m, const mjData* d, int geom, const last_face* old) {
  const mjtNum *tip = d->site_xpos + 3 * s->site, *axes = d->site_xmat + 9 * s->site, *size = m->geom_size + 3 * geom;
  const mjtNum* turn = d->geom_xmat + 9 * geom;
  mjtGeom type = (mjtGeom)m->geom_type[geom];
  *here = (placement){.face = NO_FACE};
  if (!(is_finite(tip, 3) && is_finite(axes, 9) && is_finite(d->geom_xpos + 3 * geom, 3) && is_finite(turn, 9))) return -1;

  seen_site site;
  mjtNum apart[3];
  mju_sub3(apart, tip, d->geom_xpos + 3 * geom);
  mju_mulMatTVec3(site.at, turn, apart);
  mju_mulMatTMat(site.axes, turn, axes, 3, 3, 3);
  here->face = choose_face(here->apex, s, type, size, &site, old);
  if (here->face == NO_FACE) {
    mju_zero3(here->apex);
    return 0;
  }
  face_frame f = frame_of(here->face, type, size, here->apex);
  place_over(here, &f, &site, turn);
  return 0;
}

void place_moved(placement* there, const placement* here, const mjModel* m, int geom, const mjtNum shift[3], const mjtNum turn[3]) {
  static const mjtNum SAME[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  mjtNum along[3], across[3], about[3], turned[9], quat[4];
  face_frame f = frame_of(here->face, (mjtGeom)m->geom_type[geom], m->geom_size + 3 * geom, here->apex);
  seen_site site = here->site;
  *there = *here;
  against(there, along, across, &f, &site);
  for (int i = 0; i < 3; i++) {
    site.at[i] += shift[0] * along[i] + shift[1] * across[i] + shift[2] * f.normal[i];
    about[i] = turn[0] * along[i] + turn[1] * across[i] + turn[2] * f.normal[i];
  }
  mjtNum angle = mju_normalize3(about);
  mju_axisAngle2Quat(quat, about, angle);
  mju_quat2Mat(turned, quat);
  mju_mulMatMat(site.axes, turned, here->site.axes, 3, 3, 3);
  place_over(there, &f, &site, SAME);
}
