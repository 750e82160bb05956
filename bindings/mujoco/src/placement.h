/* Where a fingertip stands against a face of a geom. Lengths in metres, angles in radians, MuJoCo's axes are the columns of a
 * row-major matrix. */

#ifndef FINGERPAD_MUJOCO_PLACEMENT_H
#define FINGERPAD_MUJOCO_PLACEMENT_H

#include <fingerpad.h>
#include <mujoco/mujoco.h>

#include "mesh.h"
#include "settings.h"

/* No face: the fingertip is beside the geom, behind it, or turned away from it. */
#define NO_FACE 0
/* The face of a mesh, and an edge of a box: both have a local shape. */
#define MESH_FACE 1
#define EDGE_FACE 7

/* A site in the geom's frame: its place, and its level axes as columns, which are those of a plane in the neutral pose. */
typedef struct {
  mjtNum at[3], axes[9];
} seen_site;

/* A site against a face: its foot is the point of the face, or of the tangent plane at a round face's apex, below it. */
typedef struct {
  /* NO_FACE; 1 for a plane, a sphere, an ellipsoid and a mesh; 1 to 6 for the faces +x, +y, +z, -x, -y, -z of a box, 7 for an edge; of a
   * capsule and a cylinder 1 for the side, 2 and 3 for the ends at +z and -z. */
  int face;
  /* Outward normal at the apex of a round face or of a local shape, in the geom's frame; zeros for a flat face. */
  mjtNum apex[3];
  /* Of a mesh and of an edge; zeros for other faces. `slot` is the place of the geom in the settings. */
  local_shape local;
  int slot;
  seen_site site;
  /* The body that the finger meets, with the face's axes. */
  fingerpad_body body;
  /* Foot in the face's own coordinates; half the extents of the face in them, and the radius of its rim, m; infinite for none. */
  mjtNum foot[2], half[2], rim;
  /* Direction of the finger's axis within the face. */
  mjtNum angle;
  /* Height of the site above the face. */
  mjtNum height;
  /* Turn of the site about the finger's y axis (tip down) and then x axis, against the pose in which it lies flat. */
  mjtNum pitch, roll;
  /* In the world, orthonormal: the finger's axis within the face, across it, and the face's normal into the finger. */
  mjtNum along[3], across[3], normal[3];
} placement;

/* The face of the last step taken, NO_FACE for none; the apex of a round one; the local shape of a mesh or an edge; whether the finger
 * touched it. */
typedef struct {
  int face, touches;
  mjtNum apex[3];
  local_shape local;
} last_face;

/* The placement of the finger's site against the geom in place `slot` of the settings, from d->site_xpos and its like. The old face is kept for as long as the site
 * stays over it. Returns 0, or -1 if a position is not finite. */
int place(placement* here, const settings* s, const mjModel* m, const mjData* d, int slot, const last_face* old);

/* Whether a face has a local shape: that of a mesh, and an edge. */
int has_local(int face, const settings* s, int slot);

/* Whether a contact of a radius, m, about a point of the face's own coordinates reaches beyond the face, or to where a mesh is not
 * the local shape any more. */
int reaches_beyond(const placement* here, const settings* s, const mjtNum at[2], mjtNum radius);

/* The placement over the same face after a shift, m, and a turn, rad, of the site along and about the axes of `here`; the directions
 * of the result are in the geom's frame. */
void place_moved(
    placement* there, const placement* here, const settings* s, const mjModel* m, const mjtNum shift[3], const mjtNum turn[3]);

/* The point of the undeformed pad that a plane touches first at a pitch and a roll, mm in the site's frame. Of a pad alone. */
void first_touch(mjtNum place_mm[3], const settings* s, mjtNum pitch, mjtNum roll);

#endif
