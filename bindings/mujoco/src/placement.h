/* Where a fingertip stands against a face of a geom. Lengths in metres, angles in radians, MuJoCo's axes are the columns of a
 * row-major matrix. */

#ifndef FINGERPAD_MUJOCO_PLACEMENT_H
#define FINGERPAD_MUJOCO_PLACEMENT_H

#include <fingerpad.h>
#include <mujoco/mujoco.h>

#include "settings.h"

/* No face: the fingertip is beside the geom, behind it, or turned away from it. */
#define NO_FACE 0

/* A site in the geom's frame: its place, and its axes as columns. */
typedef struct {
  mjtNum at[3], axes[9];
} seen_site;

/* A site against a face: its foot is the point of the face, or of the tangent plane at a round face's apex, below it. */
typedef struct {
  /* NO_FACE; 1 for a plane, a sphere and an ellipsoid; 1 to 6 for the faces +x, +y, +z, -x, -y, -z of a box; of a capsule and a cylinder 1 for
   * the side, 2 and 3 for the ends at +z and -z. */
  int face;
  /* Outward normal at the apex of a round face, in the geom's frame; zeros for a flat one. */
  mjtNum apex[3];
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

/* The face of the last step taken, NO_FACE for none; the apex of a round one; whether the finger touched it. */
typedef struct {
  int face, touches;
  mjtNum apex[3];
} last_face;

/* The placement of the finger's site against `geom`, from d->site_xpos and its like. The old face is kept for as long as the site
 * stays over it. Returns 0, or -1 if a position is not finite. */
int place(placement* here, const settings* s, const mjModel* m, const mjData* d, int geom, const last_face* old);

/* The placement over the same face after a shift, m, and a turn, rad, of the site along and about the axes of `here`; the directions
 * of the result are in the geom's frame. */
void place_moved(placement* there, const placement* here, const mjModel* m, int geom, const mjtNum shift[3], const mjtNum turn[3]);

/* The point of the undeformed pad that a plane touches first at a pitch and a roll, mm in the site's frame. Of a pad alone. */
void first_touch(mjtNum place_mm[3], const settings* s, mjtNum pitch, mjtNum roll);

#endif
