/* The attributes of an instance of the plugin. */

#ifndef FINGERPAD_MUJOCO_SETTINGS_H
#define FINGERPAD_MUJOCO_SETTINGS_H

#include <fingerpad.h>
#include <mujoco/mujoco.h>

#include "mesh.h"

/* Most geoms of one instance. */
#define GEOMS_MAX 32

/* Names of the attributes, in the order in which the documentation has them. */
extern const char* const ATTRIBUTES[];
extern const int ATTRIBUTE_COUNT;

typedef struct {
  /* The bytes of the model file, which `bed` or `pad` reads in place; freed by settings_free. */
  void* file;
  /* Whether the file is that of a pad, which follows the finger's pose; else that of a bed, which is of one pose. */
  int is_pad;
  fingerpad_model bed;
  fingerpad_pad pad;
  /* Whether its tissue relaxes. */
  int relaxes;
  /* Pitch and roll of the neutral pose, degrees. */
  mjtNum neutral_deg[2];
  /* Words of a contact in frames, and patches of a pad. */
  int words, patches;
  /* The finger's level axes in the site's frame, as columns: those of a plane in the neutral pose. */
  mjtNum level[9];
  /* Radius of a ball in which the finger lies, see clearance.h, mm. */
  mjtNum enclosing_mm;
  /* Of a pad: stiffness of the patches over the area in contact, N/m per mm², while its bulk stays as it is. */
  mjtNum patch_stiffness;
  int site, geom_count, geoms[GEOMS_MAX];
  /* The shape of each geom; of a mesh that with which a contact begins. */
  fingerpad_shape shape[GEOMS_MAX];
  /* Of each geom that is a mesh; freed by settings_free. */
  facets mesh[GEOMS_MAX];
  /* Radius of the rounding of a box's edges, mm. */
  mjtNum edge_radius_mm;
  float strength_factor[GEOMS_MAX];
  /* First of d->userdata that multiply the strength factors, or -1. */
  int strength_userdata;
  /* N s/m, N s/m, N m s/rad. */
  mjtNum damping_normal, damping_slide, damping_spin;
  /* Whether forces are explicit at any time step; else they are semi-implicit where that is needed. */
  int is_explicit;
  /* Radius of a bed's finger along and across, mm: how depth counts when the finger tilts. */
  mjtNum pad_radius_mm[2];
} settings;

/* Several objects go by a name. */
#define AMBIGUOUS (-2)

/* The object of a name, -1 if there is none, AMBIGUOUS if there are several. `MjSpec.attach` puts a prefix and a suffix around the
 * names of a part, that of the instance or sensor, `who`, included, but leaves attributes as they are. A name therefore also stands for
 * one between a beginning and an end of that name: "tip" for "L_tip" in the instance "L_index". */
int find_object(const mjModel* m, const char* who, mjtObj type, const char* name);
/* Number of geoms that the attribute names, for the size of the state; 0 if there is none. */
int settings_geom_count(const mjModel* m, int instance);
/* The folder in which a model file is looked for that is named without a folder and does not lie in the working directory. */
void settings_set_models(const char* folder);
/* Reads the model file alone, for the size of the state; a file that cannot be read leaves the settings empty. */
void settings_preview(settings* s, const mjModel* m, int instance);
/* Reads all attributes and the model file. Returns 0, or -1 after a warning that names the attribute and its value. */
int settings_read(settings* s, const mjModel* m, int instance);
void settings_free(settings* s);
/* Sets up a contact in frames with a shape; returns the code of the library. */
int settings_begin(fingerpad_relaxing_frame_contact* framed, const settings* s, fingerpad_shape shape);
/* The strength factor of contact `i` at this moment. */
float settings_strength(const settings* s, const mjData* d, int i);

#endif
