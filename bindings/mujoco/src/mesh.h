/* Convex meshes as planes of facets, and their shape near a point. Lengths in metres, in the geom's frame. */

#ifndef FINGERPAD_MUJOCO_MESH_H
#define FINGERPAD_MUJOCO_MESH_H

#include <mujoco/mujoco.h>

/* Most facets of a mesh. */
#define FACETS_MAX 20000

/* Normals on a cube map: cells of each of the six sides along one edge, and in all. */
#define CELLS_OF_SIDE 6
#define CELLS (6 * CELLS_OF_SIDE * CELLS_OF_SIDE)

/* Facets with similar normals: the first of them and the one after the last, the middle of their normals, how far a normal is from it, and
 * their least offset. */
typedef struct {
  int first, end;
  mjtNum normal[3], spread, offset;
} facet_cell;

/* Facets of a convex mesh: outward normals, offsets along them from the origin, and corners, three points a facet. They are sorted by
 * cells, those without facets left out. */
typedef struct {
  int count, cell_count;
  mjtNum *normal, *offset, *corner;
  facet_cell* cell;
  /* Distance of the farthest corner from the origin; the box around all corners and the origin, m. */
  mjtNum radius, least[3], most[3];
} facets;

/* The shape of a mesh near a contact: a plane, a sphere or a cylinder without ends. Numbers only: it is part of the contact's memory. */
typedef struct {
  /* FINGERPAD_SHAPE_...; radius, m, 0 for a plane. */
  mjtNum kind, radius;
  /* A point of the plane, the middle of the sphere, or a point of the cylinder's axis. */
  mjtNum middle[3];
  /* Normal of a plane, direction of a cylinder's axis; zeros for a sphere. */
  mjtNum axis[3];
  /* How deep below its apex the middle of the mesh lies. */
  mjtNum thickness;
} local_shape;

/* Reads mesh `mesh` of the model into facets that facets_free frees. Returns 0, or -1 with the reason in `why`, at most `room` bytes: too
 * many facets, an open or a concave mesh. */
int facets_read(facets* f, const mjModel* m, int mesh, char* why, size_t room);
void facets_free(facets* f);

/* How far a point lies outside the mesh: the largest distance above a facet's plane, negative inside. */
mjtNum facets_gap(const facets* f, const mjtNum at[3]);

/* The shape of the mesh where it is next to `from`, a point outside it, seen along `facing`, the direction of the finger. Writes the
 * outward normal there into `apex`. A mesh that is neither nearly spherical nor cylindrical there counts as the plane of the facet
 * that faces the finger most. Returns 0 if `from` is inside the mesh or farther away than `reach`. */
int facets_local(local_shape* shape, mjtNum apex[3], const facets* f, const mjtNum from[3], const mjtNum facing[3], mjtNum reach);

#endif
