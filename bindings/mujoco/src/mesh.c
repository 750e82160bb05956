#include "mesh.h"

#include <fingerpad.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* How far a corner may lie above the plane of a facet, over the radius of the mesh: rounding of files. */
static const mjtNum CONVEX = 1e-4;
/* Sum of the facets' normals, weighted by area, over the area: 0 for a closed mesh. */
static const mjtNum CLOSED = 1e-3;
/* Radii of the disks in which a shape is fitted, m, and how far the mesh may lie off the shape there. The first is about the radius of a
 * contact. */
static const mjtNum DISKS[] = {5e-3, 3.5e-3, 2.5e-3, 1.75e-3, 1.25e-3, 0.9e-3};
enum { DISK_COUNT = sizeof(DISKS) / sizeof(DISKS[0]) };
static const mjtNum FITS = 1.5e-4;
/* Deepest drop of the surface at the rim of a disk, over its radius. */
static const mjtNum DROP = 0.6;
/* Rays hit facets whose normal has at least this cosine to them. */
static const mjtNum STEEPEST = 0.2;
/* Largest radius of a sphere or a cylinder, m; flatter is a plane. Smallest radius. */
static const mjtNum FLAT = 0.5, LEAST_RADIUS = 1e-4;
/* Ratio of the principal curvatures up to which a shape is a cylinder, and from which on it is a sphere. */
static const mjtNum CYLINDER = 0.12, SPHERE = 0.5;
/* How far corners may lie off the sphere through them, m. Other spheres have the geometric mean of both radii of curvature. */
static const mjtNum THROUGH = 2e-5;
/* Distance from a facet's plane at which a point lies on it, m. */
static const mjtNum ON = 1e-6;
/* Rings of a disk and points on each; one point lies in the middle. */
enum { RINGS = 3, ROUND = 12, RAYS = 1 + RINGS * ROUND };

/* ---- reading ---- */

static void corner_of(mjtNum to[3], const mjModel* m, int mesh, int vertex) {
  const float* from = m->mesh_vert + 3 * (m->mesh_vertadr[mesh] + vertex);
  for (int i = 0; i < 3; i++) to[i] = from[i];
}

/* The cell of a normal. */
static int cell_of(const mjtNum normal[3]) {
  int axis = 0, at[2];
  for (int i = 1; i < 3; i++) axis = fabs(normal[i]) > fabs(normal[axis]) ? i : axis;
  for (int i = 0; i < 2; i++) {
    mjtNum place = (1 + normal[(axis + 1 + i) % 3] / fabs(normal[axis])) / 2;
    at[i] = (int)mju_clip(place * CELLS_OF_SIDE, 0, CELLS_OF_SIDE - 1);
  }
  return ((2 * axis + (normal[axis] > 0)) * CELLS_OF_SIDE + at[0]) * CELLS_OF_SIDE + at[1];
}

/* Sorts the facets into cells. `spare`: room for as many numbers as the facets have. */
static void sort_facets(facets* f, mjtNum* spare) {
  int start[CELLS + 1] = {0}, next[CELLS];
  mjtNum *normal = spare, *offset = spare + 3 * f->count, *corner = spare + 4 * f->count;
  for (int k = 0; k < f->count; k++) start[cell_of(f->normal + 3 * k) + 1]++;
  for (int c = 0; c < CELLS; c++) next[c] = start[c + 1] += start[c];
  for (int k = 0; k < f->count; k++) {
    int to = --next[cell_of(f->normal + 3 * k)];
    mju_copy3(normal + 3 * to, f->normal + 3 * k);
    offset[to] = f->offset[k];
    mju_copy(corner + 9 * to, f->corner + 9 * k, 9);
  }
  mju_copy(f->normal, normal, 3 * f->count);
  mju_copy(f->offset, offset, f->count);
  mju_copy(f->corner, corner, 9 * f->count);
  for (int c = 0; c < CELLS; c++) {
    if (start[c] == start[c + 1]) continue;
    facet_cell* cell = &f->cell[f->cell_count++];
    *cell = (facet_cell){.first = start[c], .end = start[c + 1], .offset = INFINITY};
    for (int k = cell->first; k < cell->end; k++) mju_addTo3(cell->normal, f->normal + 3 * k);
    mju_scl3(cell->normal, cell->normal, 1.0 / (cell->end - cell->first));
    for (int k = cell->first; k < cell->end; k++) {
      mjtNum apart[3];
      mju_sub3(apart, f->normal + 3 * k, cell->normal);
      cell->spread = mju_max(cell->spread, mju_norm3(apart));
      cell->offset = mju_min(cell->offset, f->offset[k]);
    }
  }
}

/* The facets of a mesh; those without area are left out. Returns the sum of the normals weighted by area, over the area. */
static mjtNum read_facets(facets* f, const mjModel* m, int mesh) {
  mjtNum sum[3] = {0, 0, 0}, area = 0;
  for (int k = 0; k < m->mesh_facenum[mesh]; k++) {
    const int* face = m->mesh_face + 3 * (m->mesh_faceadr[mesh] + k);
    mjtNum *corner = f->corner + 9 * f->count, *normal = f->normal + 3 * f->count, one[3], two[3];
    for (int i = 0; i < 3; i++) {
      corner_of(corner + 3 * i, m, mesh, face[i]);
      f->radius = mju_max(f->radius, mju_norm3(corner + 3 * i));
      for (int k = 0; k < 3; k++) {
        f->least[k] = mju_min(f->least[k], corner[3 * i + k]);
        f->most[k] = mju_max(f->most[k], corner[3 * i + k]);
      }
    }
    mju_sub3(one, corner + 3, corner);
    mju_sub3(two, corner + 6, corner);
    mju_cross(normal, one, two);
    mju_addTo3(sum, normal);
    mjtNum twice = mju_normalize3(normal);
    if (twice < 1e-14) continue;
    area += twice;
    f->offset[f->count++] = mju_dot3(normal, corner);
  }
  return area > 0 ? mju_norm3(sum) / area : INFINITY;
}

/* How far corners lie above the planes of other facets at most. */
static mjtNum concavity(const facets* f) {
  mjtNum most = 0;
  for (int k = 0; k < 3 * f->count; k++) most = mju_max(most, facets_gap(f, f->corner + 3 * k));
  return most;
}

int facets_read(facets* f, const mjModel* m, int mesh, char* why, size_t room) {
  int count = m->mesh_facenum[mesh];
  *f = (facets){0};
  if (count < 4 || count > FACETS_MAX) {
    snprintf(why, room, "is a mesh of %d facets; a pad touches meshes of 4 to %d", count, FACETS_MAX);
    return -1;
  }
  mjtNum* numbers = malloc((size_t)count * 2 * 13 * sizeof(*numbers));
  f->cell = malloc(CELLS * sizeof(*f->cell));
  if (!numbers || !f->cell) {
    free(numbers);
    facets_free(f);
    snprintf(why, room, "is a mesh for which there is no memory");
    return -1;
  }
  f->normal = numbers;
  f->offset = numbers + 3 * count;
  f->corner = numbers + 4 * count;
  mjtNum open = read_facets(f, m, mesh);
  sort_facets(f, numbers + 13 * count);
  mjtNum above = concavity(f);
  if (!(open < CLOSED)) {
    snprintf(why, room, "is a mesh that is not closed, or whose facets have no common orientation; a pad touches closed convex meshes");
  } else if (above > CONVEX * f->radius) {
    snprintf(why, room, "is a mesh that is not convex: a corner lies %.2g m above a facet; split it into convex meshes", above);
  } else {
    return 0;
  }
  facets_free(f);
  return -1;
}

void facets_free(facets* f) {
  free(f->normal);
  free(f->cell);
  *f = (facets){0};
}

/* ---- distances ---- */

mjtNum facets_gap(const facets* f, const mjtNum at[3]) {
  mjtNum most = -INFINITY, far = mju_norm3(at);
  /* The cell that points at the place first: most others then lie below. */
  for (int round = 0; round < 2; round++) {
    int best = -1;
    mjtNum highest = -INFINITY;
    for (int c = 0; c < f->cell_count; c++) {
      const facet_cell* cell = &f->cell[c];
      mjtNum bound = mju_dot3(cell->normal, at) + cell->spread * far - cell->offset;
      if (bound <= most) continue;
      if (round == 0) {
        if (bound > highest) best = c;
        highest = mju_max(highest, bound);
        continue;
      }
      for (int k = cell->first; k < cell->end; k++) most = mju_max(most, mju_dot3(f->normal + 3 * k, at) - f->offset[k]);
    }
    for (int k = best < 0 ? 0 : f->cell[best].first; best >= 0 && k < f->cell[best].end; k++) {
      most = mju_max(most, mju_dot3(f->normal + 3 * k, at) - f->offset[k]);
    }
  }
  return most;
}

/* The point of a triangle next to `from` (Ericson 2005, Real-Time Collision Detection, 5.1.5). */
static void nearest_of_triangle(mjtNum to[3], const mjtNum corner[9], const mjtNum from[3]) {
  const mjtNum *a = corner, *b = corner + 3, *c = corner + 6;
  mjtNum ab[3], ac[3], ap[3], bp[3], cp[3];
  mju_sub3(ab, b, a);
  mju_sub3(ac, c, a);
  mju_sub3(ap, from, a);
  mju_sub3(bp, from, b);
  mju_sub3(cp, from, c);
  mjtNum d1 = mju_dot3(ab, ap), d2 = mju_dot3(ac, ap), d3 = mju_dot3(ab, bp), d4 = mju_dot3(ac, bp), d5 = mju_dot3(ab, cp);
  mjtNum d6 = mju_dot3(ac, cp), va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2, v, w;
  if (d1 <= 0 && d2 <= 0) {
    v = w = 0;
  } else if (d3 >= 0 && d4 <= d3) {
    v = 1, w = 0;
  } else if (d6 >= 0 && d5 <= d6) {
    v = 0, w = 1;
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    v = d1 / (d1 - d3), w = 0;
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    v = 0, w = d2 / (d2 - d6);
  } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    w = (d4 - d3) / (d4 - d3 + d5 - d6), v = 1 - w;
  } else {
    v = vb / (va + vb + vc), w = vc / (va + vb + vc);
  }
  for (int i = 0; i < 3; i++) to[i] = a[i] + v * ab[i] + w * ac[i];
}

/* The point of the mesh next to `from`. */
static void nearest(mjtNum to[3], const facets* f, const mjtNum from[3]) {
  mjtNum least = INFINITY;
  for (int k = 0; k < f->count; k++) {
    mjtNum above = mju_dot3(f->normal + 3 * k, from) - f->offset[k], at[3], apart[3];
    if (above * above >= least) continue;
    nearest_of_triangle(at, f->corner + 9 * k, from);
    mju_sub3(apart, from, at);
    mjtNum square = mju_dot3(apart, apart);
    if (square < least) {
      least = square;
      mju_copy3(to, at);
    }
  }
}

/* ---- local shape ---- */

/* Points of the mesh over a disk, the normals and the facets there. */
typedef struct {
  mjtNum place[RAYS][2], at[RAYS][3], normal[RAYS][3];
  int facet[RAYS];
} patch;

/* Rays along -z onto a convex mesh: the lowest of the facets' planes. 0 if the surface drops too far. */
static int sample(patch* p, const facets* f, const mjtNum middle[3], const mjtNum axes[3][3], mjtNum radius) {
  mjtNum height[RAYS];
  int* hit = p->facet;
  for (int r = 0; r < RAYS; r++) {
    int ring = (r + ROUND - 1) / ROUND;
    mjtNum angle = 2 * mjPI * ((r + ROUND - 1) % ROUND + 0.5 * (ring % 2)) / ROUND;
    p->place[r][0] = radius * ring / RINGS * cos(angle);
    p->place[r][1] = radius * ring / RINGS * sin(angle);
    height[r] = INFINITY;
    hit[r] = -1;
  }
  for (int k = 0; k < f->count; k++) {
    const mjtNum* n = f->normal + 3 * k;
    mjtNum up = mju_dot3(n, axes[2]);
    if (up < STEEPEST) continue;
    mjtNum x = mju_dot3(n, axes[0]) / up, y = mju_dot3(n, axes[1]) / up, over = (f->offset[k] - mju_dot3(n, middle)) / up;
    for (int r = 0; r < RAYS; r++) {
      mjtNum here = over - x * p->place[r][0] - y * p->place[r][1];
      if (here < height[r]) {
        height[r] = here;
        hit[r] = k;
      }
    }
  }
  for (int r = 0; r < RAYS; r++) {
    if (hit[r] < 0 || height[r] < -DROP * radius) return 0;
    mju_copy3(p->normal[r], f->normal + 3 * hit[r]);
    for (int i = 0; i < 3; i++) {
      p->at[r][i] = middle[i] + p->place[r][0] * axes[0][i] + p->place[r][1] * axes[1][i] + height[r] * axes[2][i];
    }
  }
  return 1;
}

/* Principal curvatures by least squares: on a sphere and a cylinder the normal changes linearly over the disk. The larger first. */
static void curvatures(mjtNum to[2], const patch* p, const mjtNum axes[3][3]) {
  mjtNum square = 0, uu = 0, vv = 0, uv = 0;
  for (int r = 0; r < RAYS; r++) {
    mjtNum u = p->place[r][0], v = p->place[r][1], nu = mju_dot3(p->normal[r], axes[0]), nv = mju_dot3(p->normal[r], axes[1]);
    square += u * u;
    uu += nu * u;
    vv += nv * v;
    uv += (nu * v + nv * u) / 2;
  }
  mjtNum mean = (uu + vv) / 2 / square, apart = sqrt((uu - vv) * (uu - vv) / 4 + uv * uv) / square;
  to[0] = mean + apart;
  to[1] = mean - apart;
}

/* The direction along which the normals do not change. */
static void axis_of(mjtNum axis[3], const patch* p) {
  mjtNum sum[9] = {0}, values[3], vectors[9], quat[4];
  for (int r = 0; r < RAYS; r++) {
    for (int i = 0; i < 9; i++) sum[i] += p->normal[r][i / 3] * p->normal[r][i % 3];
  }
  mju_eig3(values, vectors, quat, sum);
  for (int i = 0; i < 3; i++) axis[i] = vectors[3 * i + 2];
}

/* Takes what lies along the axis of a shape out of a direction. */
static void across_axis(mjtNum direction[3], const local_shape* shape) {
  mju_addToScl3(direction, shape->axis, -mju_dot3(direction, shape->axis));
}

/* A sphere or a cylinder of a radius next to the points of a patch. */
static void put_round(local_shape* shape, const patch* p, mjtNum radius) {
  shape->radius = radius;
  mju_zero3(shape->middle);
  for (int r = 0; r < RAYS; r++) {
    mjtNum normal[3];
    mju_copy3(normal, p->normal[r]);
    across_axis(normal, shape);
    mju_normalize3(normal);
    for (int i = 0; i < 3; i++) shape->middle[i] += (p->at[r][i] - radius * normal[i]) / RAYS;
  }
}

/* Moves a sphere or a cylinder so that it passes through the corners of the facets of a patch, which lie on the body that the mesh was
 * made of, by least squares:  2 x.c + (R² - c²) = x²,  x from the present middle over its radius, across the axis. */
static void pass_through_corners(local_shape* shape, const patch* p, const facets* f) {
  enum { SIZE = 4 };
  mjtNum matrix[SIZE * SIZE] = {0}, right[SIZE] = {0}, solution[SIZE];
  for (int k = 0; k < 3 * RAYS; k++) {
    mjtNum row[SIZE] = {0, 0, 0, 1}, x[3];
    mju_sub3(x, f->corner + 9 * p->facet[k / 3] + 3 * (k % 3), shape->middle);
    across_axis(x, shape);
    mju_scl3(row, x, 1 / shape->radius);
    mjtNum square = mju_dot3(row, row);
    for (int i = 0; i < SIZE; i++) {
      for (int j = 0; j < SIZE; j++) matrix[SIZE * i + j] += row[i] * row[j];
      right[i] += row[i] * square;
    }
  }
  /* Nothing moves along the axis. */
  for (int i = 0; i < 9; i++) matrix[SIZE * (i / 3) + i % 3] += RAYS * shape->axis[i / 3] * shape->axis[i % 3];
  if (mju_cholFactor(matrix, SIZE, 1e-9) < SIZE) return;
  mju_cholSolve(solution, matrix, right, SIZE);
  mjtNum moved[3];
  mju_scl3(moved, solution, shape->radius / 2);
  mju_addTo3(shape->middle, moved);
  shape->radius *= sqrt(mju_max(0, solution[3] + mju_dot3(solution, solution) / 4));
}

/* Distance of a point from the surface of a shape, `normal` that of a plane. */
static mjtNum off_shape(const local_shape* shape, const mjtNum normal[3], const mjtNum at[3]) {
  mjtNum arm[3];
  mju_sub3(arm, at, shape->middle);
  if (shape->kind == FINGERPAD_SHAPE_PLANE) return mju_dot3(arm, normal);
  across_axis(arm, shape);
  return mju_norm3(arm) - shape->radius;
}

/* Whether the mesh over a disk lies on a shape. */
static int fits(const local_shape* shape, const mjtNum normal[3], const patch* p) {
  if (shape->kind != FINGERPAD_SHAPE_PLANE && !(shape->radius > LEAST_RADIUS)) return 0;
  for (int r = 0; r < RAYS; r++) {
    if (!(fabs(off_shape(shape, normal, p->at[r])) < FITS)) return 0;
  }
  return 1;
}

/* Whether the corners of the facets lie on a round shape. */
static int is_through_corners(const local_shape* shape, const patch* p, const facets* f) {
  for (int k = 0; k < 3 * RAYS; k++) {
    if (!(fabs(off_shape(shape, NULL, f->corner + 9 * p->facet[k / 3] + 3 * (k % 3))) < THROUGH)) return 0;
  }
  return 1;
}

/* The shape of a patch; 0 if it is none of those that a pad touches. `apex`: the normal of a plane. */
static int fit(local_shape* shape, mjtNum apex[3], const facets* f, const patch* p, const mjtNum axes[3][3]) {
  const local_shape unknown = {0};
  mjtNum bent[2];
  curvatures(bent, p, axes);
  *shape = unknown;
  mju_zero3(apex);
  for (int r = 0; r < RAYS; r++) {
    mju_addTo3(apex, p->normal[r]);
    mju_addToScl3(shape->middle, p->at[r], 1.0 / RAYS);
  }
  mju_normalize3(apex);
  shape->kind = FINGERPAD_SHAPE_PLANE;
  if (bent[0] * FLAT < 1) return fits(shape, apex, p);

  *shape = unknown;
  shape->kind = FINGERPAD_SHAPE_SPHERE;
  put_round(shape, p, 1 / bent[0]);
  pass_through_corners(shape, p, f);
  if (shape->radius < FLAT && is_through_corners(shape, p, f) && fits(shape, apex, p)) return 1;

  *shape = unknown;
  if (bent[1] < CYLINDER * bent[0]) {
    shape->kind = FINGERPAD_SHAPE_CYLINDER;
    axis_of(shape->axis, p);
    put_round(shape, p, 1 / bent[0]);
    pass_through_corners(shape, p, f);
  } else if (bent[1] > SPHERE * bent[0]) {
    shape->kind = FINGERPAD_SHAPE_SPHERE;
    put_round(shape, p, 1 / sqrt(bent[0] * bent[1]));
  } else {
    return 0;
  }
  return fits(shape, apex, p);
}

/* The plane of the facet at a point that faces a direction most. */
static void facet_at(local_shape* shape, mjtNum apex[3], const facets* f, const mjtNum at[3], const mjtNum facing[3]) {
  mjtNum most = -INFINITY;
  *shape = (local_shape){.kind = FINGERPAD_SHAPE_PLANE};
  mju_copy3(shape->middle, at);
  for (int k = 0; k < f->count; k++) {
    const mjtNum* n = f->normal + 3 * k;
    mjtNum faces = mju_dot3(n, facing);
    if (faces > most && fabs(mju_dot3(n, at) - f->offset[k]) < ON) {
      most = faces;
      mju_copy3(apex, n);
    }
  }
}

/* Half the width of the mesh along a direction. */
static mjtNum half_width(const facets* f, const mjtNum direction[3]) {
  mjtNum least = INFINITY, most = -INFINITY;
  for (int k = 0; k < 3 * f->count; k++) {
    mjtNum place = mju_dot3(f->corner + 3 * k, direction);
    least = mju_min(least, place);
    most = mju_max(most, place);
  }
  return (most - least) / 2;
}

int facets_local(local_shape* shape, mjtNum apex[3], const facets* f, const mjtNum from[3], const mjtNum facing[3], mjtNum reach) {
  mjtNum at[3], axes[3][3], other[3] = {0, 0, 0};
  if (mju_norm3(from) > f->radius + reach || facets_gap(f, from) <= ON) return 0;
  mju_zero3(at);
  nearest(at, f, from);
  mju_sub3(axes[2], from, at);
  if (mju_normalize3(axes[2]) > reach) return 0;
  other[fabs(axes[2][0]) < 0.6 ? 0 : 1] = 1;
  mju_cross(axes[0], other, axes[2]);
  mju_normalize3(axes[0]);
  mju_cross(axes[1], axes[2], axes[0]);

  patch p;
  int is_fitted = 0;
  for (int k = 0; k < DISK_COUNT && !is_fitted; k++) {
    is_fitted = sample(&p, f, at, (const mjtNum(*)[3])axes, DISKS[k]) && fit(shape, apex, f, &p, (const mjtNum(*)[3])axes);
  }
  if (!is_fitted) facet_at(shape, apex, f, at, facing);
  if (shape->kind == FINGERPAD_SHAPE_PLANE) mju_copy3(shape->axis, apex);
  shape->thickness = half_width(f, apex);
  return 1;
}
