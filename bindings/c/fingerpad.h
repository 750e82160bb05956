/* Written by cbindgen from src/lib.rs; change that. */

#ifndef FINGERPAD_H
#define FINGERPAD_H

#include <stddef.h>
#include <stdint.h>

// A model ready to step. Load it with `fingerpad_model_load`; the file must stay where it is.
typedef struct {
  uint64_t opaque[5];
} fingerpad_model;

// All that a contact remembers. Plain memory: copy it to save it.
typedef struct {
  uint32_t opaque[17];
} fingerpad_state;

// Forces that the plane exerts on the finger.
typedef struct {
  // N
  float normal_force_n;
  // N
  float friction_x_n;
  // N
  float friction_y_n;
  // Stuck area over contact area.
  float stick_ratio;
  // N
  float friction_limit_n;
  // 1 - |friction| / friction_limit
  float slip_margin;
  // mm²
  float contact_area_mm2;
  // Half-width of the 95 % band, N
  float band_normal_n;
  // Half-width of the 95 % band, N
  float band_friction_n;
  // 0 no contact, 1 stick, 2 partial slip, 3 slip
  uint16_t regime;
  // Flags: 2 bad input, 4 bad time step, 8 depth above range, 16 large increment
  uint16_t status;
} fingerpad_response;

// What the plane does in one step.
typedef struct {
  // Depth at the end of the step, mm.
  float depth_mm;
  // Slide of the plane during the step, mm.
  float slide_x_mm;
  // Slide of the plane during the step, mm.
  float slide_y_mm;
  // Length of the step, s.
  float dt_s;
} fingerpad_motion;

// The least grip that holds a load.
typedef struct {
  // mm
  float depth_mm;
  // N
  float normal_force_n;
  // 0, 2 bad input, 32 not even the largest depth holds the load
  uint16_t status;
} fingerpad_grip;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Checks a model file and prepares a model that reads it in place. Returns 0, or: 1 not a model file, 2 version,
// 3 length, 4 checksum, 5 not at an address divisible by 4, 6 other numbers of elements or nodes, 7 section missing,
// 8 value out of range, 9 table not monotone, 10 not passive.
//
// # Safety
// `model` points to memory for a model, `file` to `length` bytes that live and stay unchanged as long as the model.
int32_t fingerpad_model_load(fingerpad_model *model,
                             const uint8_t *file,
                             size_t length);

// Changes the model to another finger: factors on size, stiffness and lambda, and tau_0 in MPa. Returns 0, or 8 if a
// value is out of range; then nothing changes.
//
// # Safety
// `model` was loaded.
int32_t fingerpad_model_tune(fingerpad_model *model,
                             float size,
                             float stiffness,
                             float lambda,
                             float tau0_mpa);

// A finger in the air.
//
// # Safety
// `state` points to memory for a state.
void fingerpad_state_init(fingerpad_state *state);

// Sets the factor on all strengths, 0.2 to 5; returns the factor in use.
//
// # Safety
// `state` was initialised.
float fingerpad_state_set_strength_factor(fingerpad_state *state, float factor);

// Advances a contact by one step. Cannot fail, whatever the motion.
//
// # Safety
// `model` was loaded, `state` was initialised.
fingerpad_response fingerpad_step(const fingerpad_model *model,
                                  fingerpad_state *state,
                                  fingerpad_motion motion);

// The least depth and normal force at which friction of `load` leaves the slip margin `margin`.
//
// # Safety
// `model` was loaded.
fingerpad_grip fingerpad_least_grip(const fingerpad_model *model,
                                    float load_x_n,
                                    float load_y_n,
                                    float margin,
                                    float strength_factor);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* FINGERPAD_H */
