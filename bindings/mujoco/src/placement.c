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
/* Least cosine between the site's z axis and the bisector of an edge of a box: 37 degrees. A finger that lies on a face does not come to
 * the edge when it slides off. */
static const mjtNum FACING_EDGE = 0.8;
/* How far a mesh may lie off the local shape without a flag, and how far it may lie inside it before the contact ends, m. */
static const mjtNum OFF_SHAPE = 2e-4, BESIDE_MESH = 5e-4;
static const mjtNum DEGREES = 180 / mjPI;
static const mjtNum MM_PER_M = 1000;

/* A geom with a local shape, if the face has one. */
typedef struct {
  mjtGeom type;
  const mjtNum* size;
  /* NULL for a geom that is not a mesh. */
  const facets* mesh;
} geom_shape;

static geom_shape shape_of(const settings* s, const mjModel* m, int slot) {
  int geom = s->geoms[slot];
  mjtGeom type = (mjtGeom)m->geom_type[geom];
  return (geom_shape){type, m->geom_size + 3 * geom, type == mjGEOM_MESH ? &s->mesh[slot] : NULL};
}

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

/* A local shape where its outward normal is `apex`. */
static face_frame local_frame(const local_shape* shape, const mjtNum apex[3]) {
  uint32_t kind = (uint32_t)shape->kind;
  face_frame f = {
      .offset = shape->radius,
      .half = {INFINITY, INFINITY},
      .rim = INFINITY,
      .thickness = shape->thickness,
      .body = body_of(kind, shape->radius),
  };
  mju_copy3(f.middle, shape->middle);
  if (kind == FINGERPAD_BODY_PLANE || kind == FINGERPAD_BODY_SPHERE) {
    axes_across(&f, apex);
    return f;
  }
  if (kind == FINGERPAD_BODY_EDGE) f.body.angle_deg = 90;
  f.half[0] = shape->half;
  mju_copy3(f.u, shape->axis);
  mju_copy3(f.normal, apex);
  mju_cross(f.v, f.normal, f.u);
  return f;
}

static int is_local(int face, mjtGeom type) {
  return (type == mjGEOM_MESH && face == MESH_FACE) || (type == mjGEOM_BOX && face == EDGE_FACE);
}

/* Face `face` of a geom, `apex` the normal of a round one or of a local shape. */
static face_frame frame_of(int face, const geom_shape* g, const mjtNum apex[3], const local_shape* local) {
  mjtNum side = face == 2 ? 1 : -1;
  const mjtNum* size = g->size;
  if (is_local(face, g->type)) return local_frame(local, apex);
  switch (g->type) {
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
static int find_apex(mjtNum apex[3], int face, const geom_shape* g, const local_shape* local, const seen_site* site, const settings* s) {
  static const mjtNum Z[3] = {0, 0, 1};
  int is_side = face == 1 && (g->type == mjGEOM_CAPSULE || g->type == mjGEOM_CYLINDER);
  const mjtNum* axis = is_side ? Z : g->type == mjGEOM_MESH && local->kind == FINGERPAD_BODY_CYLINDER ? local->axis : NULL;
  column(apex, site->axes, 2);
  face_frame f = frame_of(face, g, apex, local);
  mjtNum touch[3] = {0, 0, 0};
  for (int round = 0; round < 60; round++) {
    mjtNum along[3], across[3], touched[3], to[3], turn = 0;
    placement there;
    if (axis) mju_addToScl3(apex, axis, -mju_dot3(apex, axis));
    if (mju_normalize3(apex) < mjMINVAL) return 0;
    f = frame_of(face, g, apex, local);
    against(&there, along, across, &f, site);
    first_touch(touched, s, there.pitch, there.roll);
    mju_mulMatVec3(touch, site->axes, touched);
    for (int i = 0; i < 3; i++) {
      touch[i] = site->at[i] + touch[i] / MM_PER_M - f.middle[i];
      to[i] = touch[i] + PAD_RADIUS * apex[i];
    }
    if (axis) mju_addToScl3(to, axis, -mju_dot3(to, axis));
    if (mju_normalize3(to) < mjMINVAL) return 0;
    for (int i = 0; i < 3; i++) turn += mju_abs(to[i] - apex[i]);
    mju_copy3(apex, to);
    if (turn < 1e-9) break;
  }
  /* Beyond the end of a capsule's side its cap is touched, and the other way round. */
  if (g->type == mjGEOM_CAPSULE) return is_side ? mju_abs(touch[2]) <= g->size[1] : touch[2] * f.middle[2] >= 0;
  return 1;
}

/* The point of the face at coordinates along its axes, in the geom's frame: over the tangent plane at a round face's apex. */
static void point_of(mjtNum to[3], const face_frame* f, mjtNum u, mjtNum v) {
  mjtNum out[3];
  int bent = f->body.kind != FINGERPAD_BODY_PLANE, along = f->body.kind == FINGERPAD_BODY_CYLINDER;
  for (int i = 0; i < 3; i++) out[i] = v * f->v[i] + (along ? 0 : u) * f->u[i] + (bent ? f->offset * f->normal[i] : 0);
  if (bent) {
    mju_normalize3(out);
    mju_scl3(out, out, f->offset);
  }
  for (int i = 0; i < 3; i++) to[i] = f->middle[i] + out[i] + (along ? u * f->u[i] : 0) + (bent ? 0 : f->offset * f->normal[i]);
}

/* Whether the site lies within the extents of a face, the finger faces it, and the site is no deeper below it than `reach`, m. */
static int stands_over(const face_frame* f, const facets* mesh, const seen_site* site, mjtNum reach) {
  mjtNum at[3], z[3];
  mju_sub3(at, site->at, f->middle);
  column(z, site->axes, 2);
  mjtNum u = mju_dot3(at, f->u), v = mju_dot3(at, f->v);
  int over = mju_dot3(z, f->normal) > FACING && mju_abs(u) <= f->half[0] && mju_abs(v) <= f->half[1] &&
             u * u + v * v <= f->rim * f->rim && mju_dot3(at, f->normal) > f->offset - reach;
  if (!over || !mesh) return over;
  mjtNum below[3];
  point_of(below, f, u, v);
  return facets_gap(mesh, below) < BESIDE_MESH;
}

int reaches_beyond(const placement* here, const settings* s, const mjtNum at[2], mjtNum radius) {
  enum { ROUND = 8 };
  mjtNum u = at[0], v = at[1];
  if (mju_abs(u) + radius > here->half[0] || mju_abs(v) + radius > here->half[1] || sqrt(u * u + v * v) + radius > here->rim) return 1;
  const facets* mesh = &s->mesh[here->slot];
  if (!mesh->count) return 0;
  face_frame f = local_frame(&here->local, here->apex);
  for (int i = 0; i < ROUND; i++) {
    mjtNum point[3], angle = 2 * mjPI * i / ROUND;
    point_of(point, &f, u + radius * cos(angle), v + radius * sin(angle));
    if (!(mju_abs(facets_gap(mesh, point)) < OFF_SHAPE)) return 1;
  }
  return 0;
}

/* How deep below a face the site may be, m. Depth is compression of the pad: a finger that touches a face may sink in deeper than
 * the object is thick. A finger that was above the face in the last step may pass HOVER in one step. Any other must be in front of
 * the geom's middle: behind it the finger stands with its back to the geom. */
static mjtNum reach_of(const face_frame* f, int is_old, int touches) {
  if (is_old && touches) return INFINITY;
  return is_old ? mju_max(f->thickness, HOVER) : f->thickness;
}

/* About the middle of the round surface of the pad, in the geom's frame. */
static void middle_of_pad(mjtNum to[3], const seen_site* site, const settings* s) {
  mjtNum local[3], touch[3], z[3];
  first_touch(local, s, 0, 0);
  mju_mulMatVec3(touch, site->axes, local);
  column(z, site->axes, 2);
  for (int i = 0; i < 3; i++) to[i] = site->at[i] + touch[i] / MM_PER_M + PAD_RADIUS * z[i];
}

/* The shape of a mesh where the pad comes next to it. */
static int choose_mesh(mjtNum apex[3], local_shape* local, const settings* s, const geom_shape* g, const seen_site* site) {
  mjtNum from[3], z[3];
  middle_of_pad(from, site, s);
  column(z, site->axes, 2);
  if (!facets_local(local, apex, g->mesh, from, z, PAD_RADIUS + HOVER)) return NO_FACE;
  if (local->kind != FINGERPAD_BODY_PLANE && !find_apex(apex, MESH_FACE, g, local, site, s)) return NO_FACE;
  face_frame f = local_frame(local, apex);
  return stands_over(&f, g->mesh, site, local->thickness) ? MESH_FACE : NO_FACE;
}

/* The edge of a box to which the pad comes next: its middle lies beyond two of the box's faces. */
static int choose_edge(mjtNum apex[3], local_shape* local, const settings* s, const mjtNum size[3], const seen_site* site) {
  mjtNum from[3], z[3];
  middle_of_pad(from, site, s);
  column(z, site->axes, 2);
  int along = -1, beyond = 0;
  *local = (local_shape){.kind = FINGERPAD_BODY_EDGE, .radius = s->edge_radius, .thickness = INFINITY};
  for (int i = 0; i < 3; i++) {
    if (mju_abs(from[i]) <= size[i]) {
      along = i;
      continue;
    }
    mjtNum side = from[i] > 0 ? 1 : -1;
    beyond++;
    apex[i] = side * sqrt(0.5);
    local->middle[i] = side * (size[i] - s->edge_radius);
    local->thickness = mju_min(local->thickness, size[i]);
    if (s->edge_radius > size[i]) return NO_FACE;
  }
  if (beyond != 2 || mju_dot3(z, apex) < FACING_EDGE) return NO_FACE;
  local->axis[along] = 1;
  local->half = size[along];
  face_frame f = local_frame(local, apex);
  return stands_over(&f, NULL, site, local->thickness) ? EDGE_FACE : NO_FACE;
}

/* The face over which a site stands: the old one, else an edge that the pad comes next to, else the face that it faces most. */
static int choose_face(
    mjtNum apex[3], local_shape* local, const settings* s, const geom_shape* g, const seen_site* site, const last_face* old) {
  mjtGeom type = g->type;
  mju_zero3(apex);
  *local = (local_shape){0};
  if ((old->face >= 1 && old->face <= face_count(type)) || is_local(old->face, type)) {
    face_frame f = frame_of(old->face, g, old->apex, &old->local);
    if (stands_over(&f, g->mesh, site, reach_of(&f, 1, old->touches))) {
      mju_copy3(apex, old->apex);
      *local = old->local;
      return old->face;
    }
  }
  if (type == mjGEOM_MESH) return choose_mesh(apex, local, s, g, site);
  if (type != mjGEOM_PLANE && type != mjGEOM_BOX && mju_norm3(site->at) > g->size[0] + g->size[1] + NEAR) return NO_FACE;
  if (type == mjGEOM_BOX && s->is_pad && choose_edge(apex, local, s, g->size, site) == EDGE_FACE) return EDGE_FACE;
  mju_zero3(apex);
  *local = (local_shape){0};
  int best = NO_FACE;
  mjtNum most = 0, z[3];
  column(z, site->axes, 2);
  for (int face = 1; face <= face_count(type); face++) {
    mjtNum tried[3] = {0, 0, 0};
    if (is_round(face, type) && !find_apex(tried, face, g, local, site, s)) continue;
    face_frame f = frame_of(face, g, tried, local);
    mjtNum facing = mju_dot3(z, f.normal);
    if (stands_over(&f, NULL, site, reach_of(&f, 0, 0)) && facing > most) {
      best = face;
      most = facing;
      mju_copy3(apex, tried);
    }
  }
  return best;
}

int has_local(int face, const settings* s, int slot) { return face == EDGE_FACE || (face == MESH_FACE && s->mesh[slot].count); }

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

int place(placement* here, const settings* s, const mjModel* m, const mjData* d, int slot, const last_face* old) {
  int geom = s->geoms[slot];
  const mjtNum *tip = d->site_xpos + 3 * s->site, *axes = d->site_xmat + 9 * s->site, *turn = d->geom_xmat + 9 * geom;
  *here = (placement){.face = NO_FACE, .slot = slot};
  if (!(is_finite(tip, 3) && is_finite(axes, 9) && is_finite(d->geom_xpos + 3 * geom, 3) && is_finite(turn, 9))) return -1;

  seen_site site;
  mjtNum apart[3], own[9];
  mju_sub3(apart, tip, d->geom_xpos + 3 * geom);
  mju_mulMatTVec3(site.at, turn, apart);
  mju_mulMatTMat(own, turn, axes, 3, 3, 3);
  mju_mulMatMat(site.axes, own, s->level, 3, 3, 3);
  geom_shape g = shape_of(s, m, slot);
  here->face = choose_face(here->apex, &here->local, s, &g, &site, old);
  if (here->face == NO_FACE) {
    mju_zero3(here->apex);
    here->local = (local_shape){0};
    return 0;
  }
  face_frame f = frame_of(here->face, &g, here->apex, &here->local);
  place_over(here, &f, &site, turn);
  return 0;
}

void place_moved(
    placement* there, const placement* here, const settings* s, const mjModel* m, const mjtNum shift[3], const mjtNum turn[3]) {
  static const mjtNum SAME[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  mjtNum along[3], across[3], about[3], turned[9], quat[4];
  geom_shape g = shape_of(s, m, here->slot);
  face_frame f = frame_of(here->face, &g, here->apex, &here->local);
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
