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
  /* From its memory: lower triangle of the stiffness of a bed. */
  const mjtNum* stiffness;
  outcome* now;
} coupled_contact;

/* Finds and applies the forces, and adds what differs from those of bed or pad to the dampers of each outcome. Needs the mass matrix,
 * positions, velocities and constraints of the present forward pass. */
void apply_coupled(const mjModel* m, mjData* d, coupled_contact* contacts, int count);

#endif
