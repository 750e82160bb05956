/* What an instance of the plugin was told by its attributes. */

#ifndef FINGERPAD_MUJOCO_SETTINGS_H
#define FINGERPAD_MUJOCO_SETTINGS_H

#include <fingerpad.h>
#include <mujoco/mujoco.h>

/* Most geoms of one instance. */
#define GEOMS_MAX 32

/* Names of the attributes, in the order in which the documentation has them. */
extern const char* const ATTRIBUTES[];
extern const int ATTRIBUTE_COUNT;

typedef struct {
  /* The bytes of the model file, which `model` reads in place; freed by settings_free. */
  void* file;
  fingerpad_model model;
  float fitted_pitch_deg;
  int site, geom_count, geoms[GEOMS_MAX];
  float strength_factor[GEOMS_MAX];
  /* First of d->userdata that multiply the strength factors, or -1. */
  int strength_userdata;
  /* N s/m, N s/m, N m s/rad. */
  mjtNum damping_normal, damping_slide, damping_spin;
  /* Radius of the pad along and across the finger, mm: how depth counts when the finger tilts. */
  mjtNum pad_radius_mm[2];
  /* Whether the model follows the finger's pitch and roll. */
  int follows_pose;
} settings;

/* Number of geoms that the attribute names, for the size of the state; 0 if there is none. */
int settings_geom_count(const mjModel* m, int instance);
/* Reads all attributes and the model file. Returns 0, or -1 after a warning that names the attribute and its value. */
int settings_read(settings* s, const mjModel* m, int instance);
void settings_free(settings* s);
/* The strength factor of contact `i` at this moment. */
float settings_strength(const settings* s, const mjData* d, int i);

#endif
