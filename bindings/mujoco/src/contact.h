/* One fingertip against one geom: what it remembers, the motion that the model of the finger follows, the forces. */

#ifndef FINGERPAD_MUJOCO_CONTACT_H
#define FINGERPAD_MUJOCO_CONTACT_H

#include <fingerpad.h>
#include <mujoco/mujoco.h>

#include "placement.h"
#include "settings.h"

/* Numbers that the plugin's state holds for one contact beside the words of the model's memory: those of `memory` other than
 * `model`. */
#define NUMBERS_BESIDE 54
/* Numbers of a sensor for one contact; fingerpad_mujoco.py names them. */
#define OUTPUT_NUMBERS 20
/* Flag of `status`: the time step is longer than the largest stable one. Above the flags of the C library. */
#define STATUS_STEP_TOO_LONG 16384
/* Flag of `status`: part of the contact lies beyond the edge of the face, where the model has a face as well. */
#define STATUS_BEYOND_EDGE 32768

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
  last_face last;
  /* Place of a plane's foot in its own coordinates; of a round face the place of its apex along x and y from the foot; m. */
  mjtNum place[2], angle;
  /* Place along a round face's axis at which the contact began: there it is the same everywhere. */
  mjtNum start;
  /* Slide along x and y, mm, and spin, rad, that single precision left out so far. */
  mjtNum rest[3];
  int status;
  known_stability stable;
  /* Acceleration of the finger's site against the geom by MuJoCo's own constraints in the last step, m/s² and rad/s²; zeros unless the
   * step was semi-implicit. */
  mjtNum by_constraints[AXES];
  union {
    fingerpad_spin_state bed;
    fingerpad_pad_state pad;
  } model;
} memory;

/* The result of a contact at one moment. */
typedef struct {
  fingerpad_response model;
  float depth_mm;
  int face, status;
  /* Of the dampers and of semi-implicit steps: friction along x and y, normal force, N; moment about the normal, N mm. */
  mjtNum damping[4];
  /* The largest stable time step of explicit forces, s, at most 1. */
  mjtNum stable_step_s;
  int is_semi_implicit;
} outcome;

/* Force and moment about the site on the finger, N and N m along x, y and z of the contact. */
typedef struct {
  mjtNum force[3], moment[3];
} wrench;

/* Numbers of one contact in the plugin's state. */
int memory_numbers(const settings* s);
/* A contact that never was. */
void memory_clear(memory* past, const settings* s, float strength_factor);
/* From and to the numbers of the plugin's state. A memory with a number that is not finite is lost: the next step begins a fresh
 * contact and flags it. */
void memory_read(memory* past, const settings* s, const mjtNum* numbers);
void memory_write(const memory* past, const settings* s, mjtNum* numbers);

/* Writes the limits of stability of a contact that touches into `now`, and whether its forces are semi-implicit: where explicit ones
 * would not be calm. */
void report_stability(outcome* now, const settings* s, const known_stability* stable, mjtNum dt);

/* Takes one step from `past` to `here`; `finite` is 0 if a position is not finite, and then the memory is held. */
outcome contact_step(memory* past, const settings* s, const placement* here, int finite, float strength_factor, mjtNum dt);

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
