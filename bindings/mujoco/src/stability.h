/* The largest stable time step of a model with fingertips. */

#ifndef FINGERPAD_MUJOCO_STABILITY_H
#define FINGERPAD_MUJOCO_STABILITY_H

#include <mujoco/mujoco.h>

#include "contact.h"
#include "placement.h"
#include "settings.h"

/* Numbers of a square matrix over the three shifts and the three turns of the finger's site. */
#define SQUARE 36

/* A contact as a linear spring and damper: N/m, N, N m and the same times seconds, along and about the axes of `here`. The
 * matrices are symmetric. */
typedef struct {
  int site, geom;
  placement here;
  mjtNum stiffness[SQUARE];
  /* Of the damper on the rate of depth, and of the dampers on slide, spin and tilt. */
  mjtNum normal_damping[SQUARE], slide_damping[SQUARE];
} linear_contact;

/* The spring and damper of a contact that sticks as a whole at `here`, from small shifts and turns of the site. */
void linearise(linear_contact* linear, const settings* s, const mjModel* m, int geom, const placement* here);

/* Limits of a model with contacts for explicit forces. */
typedef struct {
  /* The largest stable time step, s, with the dampers at their least share; infinite without contacts. */
  mjtNum step_s;
  /* Shares of the dampers that are applied. */
  damping_shares shares;
} stability;

/* The limits for these contacts. Needs the mass matrix and positions of the last forward pass. */
stability stability_of(const mjModel* m, mjData* d, const linear_contact* contacts, int count);

#endif
