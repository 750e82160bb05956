/* Where a fingertip stands against a face of a geom. Lengths in metres, angles in radians, MuJoCo's axes are the columns of a
 * row-major matrix. */

#ifndef FINGERPAD_MUJOCO_PLACEMENT_H
#define FINGERPAD_MUJOCO_PLACEMENT_H

#include <mujoco/mujoco.h>

/* No face: the fingertip is beside the geom, behind it, or turned away from it. */
#define NO_FACE 0
/* Numbers of a placement that the plugin's state keeps. */
#define PLACEMENT_KEPT 4

/* A site against a face: its foot is the point of the face below it. */
typedef struct {
  /* NO_FACE, 1 for a plane, 1 to 6 for the faces +x, +y, +z, -x, -y, -z of a box. */
  int face;
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

/* The placement of `site` against `geom`, a plane or a box, from d->site_xpos and its like. A box keeps the face `face` for as
 * long as the site stays over it. Returns 0, or -1 if a position is no number. */
int place(placement* here, const mjModel* m, const mjData* d, int site, int geom, int face);

#endif
