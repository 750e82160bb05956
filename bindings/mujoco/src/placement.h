/* Where a fingertip stands against a face of a geom. Lengths in metres, angles in radians, MuJoCo's axes are the columns of a
 * row-major matrix. */

#ifndef FINGERPAD_MUJOCO_PLACEMENT_H
#define FINGERPAD_MUJOCO_PLACEMENT_H

#include <fingerpad.h>
#include <mujoco/mujoco.h>

#include "settings.h"

/* No face: the fingertip is beside the geom, behind it, or turned away from it. */
#define NO_FACE 0

/* A site against a face: its foot is the point of the face, or of the tangent plane at a round face's apex, below it. */
typedef struct {
  /* NO_FACE; 1 for a plane and a sphere; 1 to 6 for the faces +x, +y, +z, -x, -y, -z of a box; of a capsule and a cylinder 1 for
   * the side, 2 and 3 for the ends at +z and -z. */
  int face;
  /* Outward normal at the apex of a round face, in the geom's frame; zeros for a flat one. */
  mjtNum apex[3];
  /* The body that the finger meets, with the face's axes. */
  fingerpad_body body;
  /* Foot in the face's own coordinates. */
  mjtNum foot[2];
  /* Direction of the finger's axis within the face. */
  mjtNum angle;
  /* Height of the site above the face. */
  mjtNum height;
  /* Turn of the site about the finger's y axis (tip down) and then x axis, against the pose in which it lies flat. */
  mjtNum pitch, roll;
  /* In the world, orthonormal: the finger's axis within the face, across it, and the face's normal into the finger. */
  mjtNum along[3], across[3], normal[3];
} placement;

/* The placement of the finger's site against `geom`, from d->site_xpos and its like. The face `face` with its apex is kept for as
 * long as the site stays over it. Returns 0, or -1 if a position is no number. */
int place(
    placement* here, const settings* s, const mjModel* m, const mjData* d, int geom, int face, const mjtNum apex[3]);

/* The point of the undeformed pad that a plane touches first at a pitch and a roll, mm in the site's frame. Of a pad alone. */
void first_touch(mjtNum place_mm[3], const settings* s, mjtNum pitch, mjtNum roll);

#endif
