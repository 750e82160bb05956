/* How far a finger is from a geom, at little cost: while it is far, the model of the finger is not asked. */

#ifndef FINGERPAD_MUJOCO_CLEARANCE_H
#define FINGERPAD_MUJOCO_CLEARANCE_H

#include "placement.h"
#include "settings.h"

/* From this clearance on the model of the finger is not asked, mm. */
#define FAR_MM 2

/* How far the geom in place `slot` of the settings is from the finger, mm: at most the true distance; negative where it may reach into the
 * finger. */
mjtNum clearance_mm(const settings* s, int slot, const placement* here);

/* Whether the finger stands at the geom with its back to it: its site is at the surface or up to 5 mm below, and the pad points out of the
 * geom. */
int faces_away(const settings* s, int slot, const placement* here);

/* Radius of a ball that touches the site from inside the finger and encloses the points of a pad or bed that touch first in any pose, mm. */
mjtNum enclosing_radius_mm(const settings* s);

#endif
