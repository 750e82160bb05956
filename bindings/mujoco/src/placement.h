/* Where a finger's site and a geom stand against each other. Lengths in metres, angles in radians; MuJoCo's axes are the columns of a
 * row-major matrix. */

#ifndef FINGERPAD_MUJOCO_PLACEMENT_H
#define FINGERPAD_MUJOCO_PLACEMENT_H

#include <fingerpad.h>
#include <mujoco/mujoco.h>

#include "settings.h"

/* The body that a finger meets, and how the finger stands against its face once a step has found it. */
typedef struct {
  /* Whether all positions are finite. */
  int finite;
  /* The axes of the site in the world. */
  mjtNum site[9];
  /* The geom in the site's frame. */
  fingerpad_pose geom;
  /* In the world, orthonormal: the finger's axis within the face, across it, and the face's normal into the finger. */
  mjtNum along[3], across[3], normal[3];
  /* From the site to the point of the finger that touches first, along these axes. */
  mjtNum touch[3];
} placement;

/* The placement of the finger's site against a geom, from d->site_xpos and its like. */
void place(placement* here, const settings* s, const mjData* d, int geom);

/* The same after a shift, m, and a turn, rad, of the site along and about the axes of `here`. */
void place_moved(placement* there, const placement* here, const mjtNum shift[3], const mjtNum turn[3]);

/* Fills in how the finger stands against the face of a response. */
void stand(placement* here, const settings* s, const fingerpad_frame_response* felt);

/* A pose, seen from a frame that is itself at `frame`. */
fingerpad_pose seen_from(const fingerpad_pose* frame, const fingerpad_pose* pose);
/* The pose of a frame at `pose` in a frame at `frame`. */
fingerpad_pose carried_by(const fingerpad_pose* frame, const fingerpad_pose* pose);

#endif
