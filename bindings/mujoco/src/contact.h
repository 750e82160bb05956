/* One fingertip against one geom: what it remembers, the motion that the model of the finger follows, the forces. */

#ifndef FINGERPAD_MUJOCO_CONTACT_H
#define FINGERPAD_MUJOCO_CONTACT_H

#include <fingerpad.h>
#include <mujoco/mujoco.h>
#include <stddef.h>

#include "placement.h"
#include "settings.h"

/* Numbers of a sensor for one contact; fingerpad_mujoco names them. */
#define OUTPUT_NUMBERS 20
/* Flag of `status`: the time step is longer than the largest stable one. Above the flags of the C library. */
#define STATUS_STEP_TOO_LONG 16384
/* How much closer a finger may come in the step in which a contact begins, mm. The library lets a contact begin 1 mm deep. */
#define TOO_FAST_MM 2

/* Shifts of the finger's site along x, y and z of the contact, and turns about them. */
#define AXES 6
/* Numbers of the lower triangle of a symmetric matrix over these axes. */
#define TRIANGLE 21

/* The limits of stability and the stiffness as they were last computed for a contact, and for which state: its depth, mm, and the
 * number of contacts that touched in the whole model. A contact that was never computed has zeros. */
typedef struct {
  /* The largest stable time step of explicit forces, and the largest at which they are calm, s. */
  mjtNum step_s, calm_s;
  mjtNum depth_mm, touching;
  /* Of a bed that sticks, N/m, N and N m; not negative in any direction. */
  mjtNum stiffness[TRIANGLE];
} known_stability;

/* All that a contact remembers from one step taken to the next. */
typedef struct {
  mjtNum status;
  /* Whether the finger touches, and whether it was placed before. */
  mjtNum touches, placed;
  /* The clearance at the last step, mm; see clearance.h. */
  mjtNum clearance_mm;
  known_stability stable;
  /* The last depth up to which the normal force rises, mm, and that force, N; 0 without. */
  mjtNum rises_mm, rises_n;
  /* Of a mesh: its shape near the finger. */
  local_shape local;
  /* Words; all before it are numbers. */
  fingerpad_relaxing_frame_contact framed;
} memory;

/* Numbers before the words, and most words. */
#define NUMBERS_BESIDE ((int)(offsetof(memory, framed) / sizeof(mjtNum)))
#define WORDS_MAX ((int)(sizeof(fingerpad_relaxing_frame_contact) / sizeof(uint32_t)))

/* The result of a contact at one moment. */
typedef struct {
  fingerpad_frame_response felt;
  int status;
  /* Of the dampers and of semi-implicit steps: friction along x and y, normal force, N; moment about the normal, N mm. */
  mjtNum damping[4];
  /* The largest stable time step of explicit forces, s, at most 1. */
  mjtNum stable_step_s;
  int is_semi_implicit;
  /* Whether the finger has its back to the geom. */
  int faces_away;
} outcome;

/* Force and moment about the site on the finger, N and N m along x, y and z of the contact. */
typedef struct {
  mjtNum force[3], moment[3];
} wrench;

/* Numbers of one contact in the plugin's state. */
int memory_numbers(const settings* s);
/* A contact of the geom in place `slot` of the settings that never was. */
void memory_clear(memory* past, const settings* s, int slot, float strength_factor);
/* From and to the numbers of the plugin's state. A memory with a number that is not finite is lost: the next step begins a fresh
 * contact and flags it. */
void memory_read(memory* past, const settings* s, const mjtNum* numbers);
void memory_write(const memory* past, const settings* s, mjtNum* numbers);

/* Whether the finger is far from the geom, by the numbers of the plugin's state: then `now` is all that a step has. */
int contact_is_far(outcome* now, const mjtNum* numbers, const settings* s, int slot, const placement* here);
/* Writes what a step of a finger that is far leaves into the numbers of the plugin's state. */
void contact_stay_far(const outcome* now, mjtNum* numbers);

/* Writes the limits of stability of a contact that touches into `now`, and whether its forces are semi-implicit: where explicit ones
 * would not be calm. */
void report_stability(outcome* now, const settings* s, const known_stability* stable, mjtNum dt);

/* Takes one step from `past` to `here` against the geom in place `slot` of the settings, and fills in how the finger stands there. Of
 * a placement that is not finite nothing is taken, and no force acts. */
outcome contact_step(memory* past, placement* here, const settings* s, int slot, float strength_factor, mjtNum dt);

/* The wrench of the model and of the dampers, which are written into `now`, for a velocity of the finger against the geom's body at
 * the site: turn, rad/s, and speed, m/s, along x, y and z of the contact. */
void contact_wrench(
    wrench* w, outcome* now, const settings* s, const placement* here, const mjtNum turn[3], const mjtNum speed[3]);

/* Applies a wrench to both bodies: d->qfrc_passive. */
void wrench_apply(const wrench* w, const settings* s, const placement* here, const mjModel* m, mjData* d, int geom);

/* Adds the dampers to `now` and applies force and moment to both bodies. */
void contact_apply(outcome* now, const settings* s, const placement* here, const mjModel* m, mjData* d, int geom);

/* The numbers of a sensor. */
void outcome_write(const outcome* now, mjtNum numbers[OUTPUT_NUMBERS]);

#endif
