/* One fingertip against one geom: the motion that the reduced model follows, and the forces that come of it. */

#ifndef FINGERPAD_MUJOCO_CONTACT_H
#define FINGERPAD_MUJOCO_CONTACT_H

#include <fingerpad.h>
#include <mujoco/mujoco.h>

#include "placement.h"
#include "settings.h"

/* Words of the reduced model's memory. */
#define MODEL_WORDS ((int)(sizeof(fingerpad_spin_state) / sizeof(uint32_t)))
/* Numbers that the plugin's state holds for one contact: the face, foot and angle of the last step taken, what rounding left
 * of its slide and spin, its status, and the words of the reduced model's memory. */
#define MEMORY_NUMBERS (PLACEMENT_KEPT + 3 + 1 + MODEL_WORDS)
/* Numbers that a sensor tells of one contact; fingerpad_mujoco.py names them. */
#define OUTPUT_NUMBERS 18

/* Flag of `status` beside those of the reduced model: the pose is beyond what the model knows and was held at its end. */
#define STATUS_POSE_HELD 4096

/* All that a contact remembers from one step taken to the next. */
typedef struct {
  int face;
  mjtNum foot[2], angle;
  /* Slide along x and y, mm, and spin, rad, that single precision left out so far. */
  mjtNum rest[3];
  int status;
  fingerpad_spin_state model;
} memory;

/* What a contact does at one moment. */
typedef struct {
  fingerpad_response model;
  float depth_mm;
  int face, status;
  /* Of the dampers: friction along x and y, normal force, N; moment about the normal, N mm. */
  mjtNum damping[4];
} outcome;

/* A contact that never was. */
void memory_clear(memory* past, float strength_factor);
/* From and to the numbers of the plugin's state. One that holds what is no number is lost: the next step begins anew and
 * flags it. */
void memory_read(memory* past, const mjtNum numbers[MEMORY_NUMBERS]);
void memory_write(const memory* past, mjtNum numbers[MEMORY_NUMBERS]);

/* Takes one step from `past` to `here`; `finite` is 0 if a position is no number, and then the memory is held. */
outcome contact_step(memory* past, const settings* s, const placement* here, int finite, float strength_factor, mjtNum dt);

/* Adds the dampers to `now` and applies force and moment to both bodies: d->qfrc_passive. */
void contact_apply(outcome* now, const settings* s, const placement* here, const mjModel* m, mjData* d, int geom);

/* The numbers of a sensor. */
void outcome_write(const outcome* now, mjtNum numbers[OUTPUT_NUMBERS]);

#endif
