/* Semi-implicit forces of all contacts that need them, for time steps at which explicit forces would vibrate or be unstable. */

#ifndef FINGERPAD_MUJOCO_SEMI_IMPLICIT_H
#define FINGERPAD_MUJOCO_SEMI_IMPLICIT_H

#include <mujoco/mujoco.h>

#include "contact.h"
#include "placement.h"
#include "settings.h"

/* A contact whose forces are to be found together with those of others. */
typedef struct {
  const settings* s;
  int geom;
  placement here;
  /* From its memory: lower triangle of the stiffness of a bed, acceleration by MuJoCo's constraints. */
  const mjtNum *stiffness, *by_constraints;
  outcome* now;
  /* Filled in: the velocity of the site against the geom, and that at the end of the step without the forces of constraints. */
  mjtNum before[AXES], ahead[AXES];
} coupled_contact;

/* Finds and applies the forces, and adds what differs from those of bed or pad to the dampers of each outcome. Needs the mass matrix,
 * positions, velocities and constraints of the present forward pass. */
void apply_coupled(const mjModel* m, mjData* d, coupled_contact* contacts, int count);

/* The velocity of the site against the geom, for the velocities of d and the positions of its last forward pass. */
void velocity_against(mjtNum velocity[AXES], const mjModel* m, mjData* d, int site, int geom, const placement* here);

#endif
