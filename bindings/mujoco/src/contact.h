/* One fingertip against one geom: what it remembers, the motion that the model of the finger follows, the forces. */

#ifndef FINGERPAD_MUJOCO_CONTACT_H
#define FINGERPAD_MUJOCO_CONTACT_H

#include <fingerpad.h>
#include <mujoco/mujoco.h>

#include "placement.h"
#include "settings.h"

/* Numbers that the plugin's state holds for one contact beside the words of the model's memory: the face, foot, angle and apex of
 * the last step taken, what rounding left of its slide and spin, and its status. */
#define NUMBERS_BESIDE 11
/* Numbers that a sensor tells of one contact; fingerpad_mujoco.py names them. */
#define OUTPUT_NUMBERS 18

/* All that a contact remembers from one step taken to the next. */
typedef struct {
  int face;
  mjtNum foot[2], angle, apex[3];
  /* Slide along x and y, mm, and spin, rad, that single precision left out so far. */
  mjtNum rest[3];
  int status;
  union {
    fingerpad_spin_state bed;
    fingerpad_pad_state pad;
  } model;
} memory;

/* What a contact does at one moment. */
typedef struct {
  fingerpad_response model;
  float depth_mm;
  int face, status;
  /* Of the dampers: friction along x and y, normal force, N; moment about the normal, N mm. */
  mjtNum damping[4];
} outcome;

/* Numbers of one contact in the plugin's state. */
int memory_numbers(int is_pad);
/* A contact that never was. */
void memory_clear(memory* past, const settings* s, float strength_factor);
/* From and to the numbers of the plugin's state. One that holds what is no number is lost: the next step begins anew and
 * flags it. */
void memory_read(memory* past, const settings* s, const mjtNum* numbers);
void memory_write(const memory* past, const settings* s, mjtNum* numbers);

/* Takes one step from `past` to `here`; `finite` is 0 if a position is no number, and then the memory is held. */
outcome contact_step(memory* past, const settings* s, const placement* here, int finite, float strength_factor, mjtNum dt);

/* Adds the dampers to `now` and applies force and moment to both bodies: d->qfrc_passive. */
void contact_apply(outcome* now, const settings* s, const placement* here, const mjModel* m, mjData* d, int geom);

/* The numbers of a sensor. */
void outcome_write(const outcome* now, mjtNum numbers[OUTPUT_NUMBERS]);

#endif
