/* Written by cbindgen from src/lib.rs; change that. */

#ifndef FINGERPAD_H
#define FINGERPAD_H

#include <stddef.h>
#include <stdint.h>

// Bytes of a saved state.
#define FINGERPAD_STATE_BYTES 120

// Bytes of a saved state of a contact that spins.
#define FINGERPAD_SPIN_STATE_BYTES 152

// A model ready to step. Load it with `fingerpad_model_load`; the file must stay where it is.
typedef struct {
  uint64_t opaque[10];
} fingerpad_model;

// A model in another pose. Write it with `fingerpad_model_pose`; the file must stay where it is.
typedef struct {
  uint64_t opaque[10];
} fingerpad_posed_model;

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
  // Largest friction in the direction of the present one, N
  float friction_limit_n;
  // 1 less the share of its limit that the load uses; with spin the load is friction and moment together.
  float slip_margin;
  // About the plane's normal through the point under first touch, N mm; without spin that of friction along y alone.
  float spin_moment_n_mm;
  // From the point under first touch, mm
  float pressure_centre_x_mm;
  // From the point under first touch, mm
  float pressure_centre_y_mm;
  // mm²
  float contact_area_mm2;
  // Half-width of the 95 % band, N
  float band_normal_n;
  // Half-width of the 95 % band, N
  float band_friction_n;
  // 0 no contact, 1 stick, 2 partial slip, 3 slip
  uint16_t regime;
  // Flags: 2 bad input, 4 bad time step, 8 depth above range, 16 large increment, 64 spin ignored, 128 memory lost and
  // begun anew
  uint16_t status;
} fingerpad_response;

// All that a contact remembers. Plain memory: copy it to go back to it in the same program; `fingerpad_state_save` makes
// bytes that can be checked when they are read.
typedef struct {
  uint32_t opaque[27];
} fingerpad_state;

// What the plane does in one step.
typedef struct {
  // Depth at the end of the step, mm.
  float depth_mm;
  // Slide of the plane during the step, mm.
  float slide_x_mm;
  // Slide of the plane during the step, mm.
  float slide_y_mm;
  // Turn of the plane about its normal through the point under first touch during the step, rad, counter-clockwise seen
  // from the finger. Only `fingerpad_spin_step` follows it; `fingerpad_step` flags it.
  float spin_rad;
  // Length of the step, s.
  float dt_s;
} fingerpad_motion;

// The same of a contact that also spins.
typedef struct {
  uint32_t opaque[35];
} fingerpad_spin_state;

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
// 3 length, 4 checksum, 5 not at an address divisible by 4, 6 other numbers of springs or nodes, 7 section missing,
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

// Writes into `posed` the model in another pose: pitch of the finger against the plane, 10 to 70 degrees, and roll, -30 to 30.
// `model` is that of the fitted pose. Returns 0, or 8 for a pose out of range or a model that knows one pose alone; then
// nothing is written. A state may be carried over.
//
// # Safety
// `model` was loaded, `posed` points to memory for a posed model.
int32_t fingerpad_model_pose(const fingerpad_model *model,
                             fingerpad_posed_model *posed,
                             float pitch_deg,
                             float roll_deg);

// Advances a contact by one step in another pose. Cannot fail, whatever the motion.
//
// # Safety
// `posed` was written by `fingerpad_model_pose`, `state` was initialised.
fingerpad_response fingerpad_posed_step(const fingerpad_posed_model *posed,
                                        fingerpad_state *state,
                                        fingerpad_motion motion);

// A finger in the air.
//
// # Safety
// `state` points to memory for a state.
void fingerpad_state_init(fingerpad_state *state);

// Sets the factor on all strengths, 0.1 to 5; returns the factor in use.
//
// # Safety
// `state` was initialised.
float fingerpad_state_set_strength_factor(fingerpad_state *state, float factor);

// Writes a state as FINGERPAD_STATE_BYTES bytes with version, checksum of the model and checksum of its own. The model's checksum is
// computed each time, some 20 instructions a byte of the file. Returns 0.
//
// # Safety
// `model` was loaded, `state` was initialised, `bytes` points to FINGERPAD_STATE_BYTES bytes.
int32_t fingerpad_state_save(const fingerpad_model *model,
                             const fingerpad_state *state,
                             uint8_t *bytes);

// Reads a state that `fingerpad_state_save` wrote with the same model file. Returns 0, or: 2 version, 3 length, 4 damaged, 8 a
// value that no step leaves behind, 12 saved with another model; then the state stays as it was.
//
// # Safety
// `model` was loaded, `state` was initialised, `bytes` points to `length` bytes.
int32_t fingerpad_state_restore(const fingerpad_model *model,
                                fingerpad_state *state,
                                const uint8_t *bytes,
                                size_t length);

// Advances a contact by one step. Cannot fail, whatever the motion.
//
// # Safety
// `model` was loaded, `state` was initialised.
fingerpad_response fingerpad_step(const fingerpad_model *model,
                                  fingerpad_state *state,
                                  fingerpad_motion motion);

// A finger in the air whose contact will also spin.
//
// # Safety
// `state` points to memory for a state.
void fingerpad_spin_state_init(fingerpad_spin_state *state);

// Sets the factor on all strengths, 0.1 to 5; returns the factor in use.
//
// # Safety
// `state` was initialised.
float fingerpad_spin_state_set_strength_factor(fingerpad_spin_state *state, float factor);

// Writes a state as FINGERPAD_SPIN_STATE_BYTES bytes with version, checksum of the model and checksum of its own. The model's checksum is
// computed each time, some 20 instructions a byte of the file. Returns 0.
//
// # Safety
// `model` was loaded, `state` was initialised, `bytes` points to FINGERPAD_SPIN_STATE_BYTES bytes.
int32_t fingerpad_spin_state_save(const fingerpad_model *model,
                                  const fingerpad_spin_state *state,
                                  uint8_t *bytes);

// Reads a state that `fingerpad_spin_state_save` wrote with the same model file. Returns 0, or: 2 version, 3 length, 4 damaged, 8 a
// value that no step leaves behind, 12 saved with another model; then the state stays as it was.
//
// # Safety
// `model` was loaded, `state` was initialised, `bytes` points to `length` bytes.
int32_t fingerpad_spin_state_restore(const fingerpad_model *model,
                                     fingerpad_spin_state *state,
                                     const uint8_t *bytes,
                                     size_t length);

// Advances a contact that also spins by one step; takes about twice as long as `fingerpad_step`. Cannot fail.
//
// # Safety
// `model` was loaded, `state` was initialised.
fingerpad_response fingerpad_spin_step(const fingerpad_model *model,
                                       fingerpad_spin_state *state,
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
