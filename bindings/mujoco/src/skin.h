/* The plugin fingerpad.patches: a sensor with place, force, pressure, shear and slip of each patch of a pad. */

#ifndef FINGERPAD_MUJOCO_SKIN_H
#define FINGERPAD_MUJOCO_SKIN_H

#include "contact.h"

/* Numbers of a patch; fingerpad_mujoco names them. */
#define PATCH_NUMBERS 15

/* The settings of an instance of fingerpad.contact, and its contacts after the last trial. */
const settings* settings_of(const mjData* d, int instance);
/* The memory of the contact in place `slot`, or NULL where it does not touch. */
const memory* touching_memory(const mjData* d, int instance, int slot);
/* Whether passive forces are switched off as a whole: then MuJoCo calls for none. */
int is_switched_off(const mjModel* m);
/* The name of that plugin. */
extern const char CONTACT_PLUGIN[];

void register_skin(void);

#endif
