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
  mjtNum stiffness[SQUARE], damping[SQUARE];
} linear_contact;

/* The damping of a contact in the state `now`, by small velocities; `rest` is the wrench without. */
void damping_of(mjtNum damping[SQUARE], const settings* s, outcome now, const placement* here, const mjtNum rest[AXES]);

/* Force and moment of a wrench as six numbers. */
void wrench_numbers(mjtNum numbers[AXES], const wrench* w);

/* The lower triangle of the nearest matrix to a symmetric one that is not negative in any direction. */
void positive_part(mjtNum triangle[TRIANGLE], const mjtNum matrix[SQUARE]);

/* The six velocities of the finger's site against the geom's body, along the axes of the contact, by joint velocities: 6 x nv. */
void relative_jacobian(mjtNum* jacobian, const mjModel* m, mjData* d, int site, int geom, const placement* here);

/* Adds J' W J to `sum`, nv x nv, of a contact with six rows of J. */
void add_in_joints(mjtNum* sum, const mjtNum* jacobian, const mjtNum weight[SQUARE], mjData* d, int nv);

/* The spring and damper of the contact in place `slot` of the settings, if it sticks as a whole at `here`, from small shifts and turns of the
 * site. */
void linearise(linear_contact* linear, const memory* past, const settings* s, int slot, const placement* here);

/* Limits of a model with contacts for explicit forces; infinite without contacts. */
typedef struct {
  /* The largest stable time step, s, and the largest at which the dampers in full calm every vibration. */
  mjtNum step_s, calm_s;
} stability;

/* The limits for these contacts. Needs the mass matrix and positions of the last forward pass. */
stability stability_of(const mjModel* m, mjData* d, const linear_contact* contacts, int count);

#endif
