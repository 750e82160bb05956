/* fingerpad: the friction of a fingertip in real time.
 *
 * Written by cbindgen from the library's source (bindings/c/src); change that.
 *
 * Rules for every function:
 * - It returns FINGERPAD_OK (0) or an error code below. After an error nothing has changed, unless the function's comment states
 *   otherwise. fingerpad_error_text returns the text of a code.
 * - Numbers are passed by value, states and results by pointer. The caller owns that memory. The library allocates no memory, has
 *   no global state, prints nothing and never waits.
 * - Null and misaligned pointers are refused, and so are models, pads, states, contacts and watches that were not set up, were
 *   zeroed or unloaded. Two conditions cannot be checked: that a pointer has as much memory as its type or length requires, and that
 *   no other thread changes it during the call.
 * - Several threads may step different states at once, also with one model.
 *
 * Two models of the finger stand behind the same response. A bed of springs (fingerpad_model_..., fingerpad_step) is of one pose of
 * the finger on a plane, and cheap. A pad (fingerpad_pad_...) follows every pose on planes, spheres, cylinders and edges, at ten to
 * a hundred times the cost. Each kind of model file has its own load function.
 *
 * Lengths in mm, forces in N, time in s, pitch and roll in degrees, spin in rad. Frame: z out of the plane (of the tangent plane at
 * the apex of a pad's body) into the finger, x along the finger from proximal to distal; spin is counter-clockwise seen from the
 * finger. Forces are those that the plane or body exerts on the finger.
 */

#ifndef FINGERPAD_H
#define FINGERPAD_H

#include <stddef.h>
#include <stdint.h>

// All is well.
#define FINGERPAD_OK 0

// The bytes do not start like a model file.
#define FINGERPAD_NOT_A_MODEL 1

// Another version of the file's or the saved state's layout than this library reads.
#define FINGERPAD_VERSION_UNKNOWN 2

// Shorter or longer than it says itself: cut off, or not all of it was handed over.
#define FINGERPAD_LENGTH 3

// The checksum does not agree: damaged.
#define FINGERPAD_CHECKSUM 4

// A pointer is not aligned as its type requires; a model file must lie at an address divisible by 4.
#define FINGERPAD_ALIGNMENT 5

// Another number of springs, table nodes or modes than this library was built for, or more than FINGERPAD_PATCHES_MAX patches.
#define FINGERPAD_SHAPE 6

// A section of the file is missing, or an effect in it is unknown. From `fingerpad_model_load`: the file is not that of a bed;
// a pad's file goes to `fingerpad_pad_load`. From `fingerpad_pad_load`: the file is not that of a pad; a bed's file goes to
// `fingerpad_model_load`, or of tissue that relaxes to `fingerpad_relaxing_model_load`. Also for branches beside the effect
// `normal_relaxation`.
#define FINGERPAD_SECTION 7

// A value is not a number or out of its range.
#define FINGERPAD_RANGE 8

// A table of the file falls where it must not.
#define FINGERPAD_NOT_MONOTONE 9

// The file's numbers would let a closed path create energy.
#define FINGERPAD_NOT_PASSIVE 10

// A buffer is too small, or arrays of a batch are of different length.
#define FINGERPAD_BUFFER 11

// The state was saved with another model.
#define FINGERPAD_OTHER_MODEL 12

// An error that this version has no code of its own for.
#define FINGERPAD_UNKNOWN 13

// A pointer is null.
#define FINGERPAD_NULL 14

// A model, pad, state, contact or watch that was not set up: never initialised, zeroed or unloaded.
#define FINGERPAD_NOT_SET_UP 15

// The plane z = 0, the body below it: the value of `kind` in a shape. It has no sizes.
#define FINGERPAD_SHAPE_PLANE 0

// A sphere about the origin; `size_mm[0]` is its radius.
#define FINGERPAD_SHAPE_SPHERE 1

// An ellipsoid about the origin; `size_mm` are its semi-axes along x, y and z.
#define FINGERPAD_SHAPE_ELLIPSOID 2

// A cylinder about z with round ends; `size_mm` are its radius and half its length without the ends.
#define FINGERPAD_SHAPE_CAPSULE 3

// A cylinder about z with flat ends; `size_mm` are its radius and half its length.
#define FINGERPAD_SHAPE_CYLINDER 4

// Two faces that meet in a rounded edge along x, on which the origin lies, z out between them; `size_mm[0]` is the radius of the rounding,
// `angle_deg` the angle inside the body.
#define FINGERPAD_SHAPE_EDGE 5

// A box about the origin; `size_mm` are half its extents, `edge_radius_mm` rounds its edges.
#define FINGERPAD_SHAPE_BOX 6

// The finger does not touch: the value of `known` in a margin.
#define FINGERPAD_KNOWN_NO_CONTACT 0

// Nothing but the prior is known of the surface.
#define FINGERPAD_KNOWN_PRIOR 1

// Some surfaces are excluded.
#define FINGERPAD_KNOWN_PART 2

// The strength of the surface is known within its band.
#define FINGERPAD_KNOWN_STRENGTH 3

// Patches of the usual pad.
#define FEW 37

// Most patches of a pad, two more than the program `fingerpad finger` makes at most.
#define FINGERPAD_PATCHES_MAX 64

// Most branches of tissue that relaxes.
#define FINGERPAD_BRANCHES_MAX 3

// A plane: the value of `kind` in a body.
#define FINGERPAD_BODY_PLANE 0

// A sphere; a bowl with a negative radius.
#define FINGERPAD_BODY_SPHERE 1

// A circular cylinder along the tangent plane; a trough with a negative radius.
#define FINGERPAD_BODY_CYLINDER 2

// Two planes that meet in a rounded edge, which points at the finger.
#define FINGERPAD_BODY_EDGE 3

// Most bytes of a saved state of a pad; `state_bytes` of `fingerpad_pad_info` is the number for one pad.
#define FINGERPAD_PAD_STATE_BYTES 1852

// The same of a pad that relaxes.
#define FINGERPAD_RELAXING_PAD_STATE_BYTES 4376

// Bytes of a saved state of a bed that relaxes.
#define FINGERPAD_RELAXING_STATE_BYTES 252

// The same of a contact that spins.
#define FINGERPAD_RELAXING_SPIN_STATE_BYTES 380

// Bytes of a saved state.
#define FINGERPAD_STATE_BYTES 120

// Bytes of a saved state of a contact that spins.
#define FINGERPAD_SPIN_STATE_BYTES 152

// No contact: the value of `regime` in a response.
#define FINGERPAD_NO_CONTACT 0

// The whole contact sticks: stick ratio at least 0.99.
#define FINGERPAD_STICK 1

// Part of the contact slips.
#define FINGERPAD_PARTIAL_SLIP 2

// The whole contact slips: stick ratio at most 0.01.
#define FINGERPAD_SLIP 3

// Flag of `status`: a number of the motion was NaN or infinite; the step was taken as if that axis stood still.
#define FINGERPAD_STATUS_BAD_INPUT 2

// Flag of `status`: the time step was not a positive number.
#define FINGERPAD_STATUS_BAD_TIME_STEP 4

// Flag of `status`: deeper than the model was fitted; the answer is that of the largest depth.
#define FINGERPAD_STATUS_DEPTH_ABOVE_RANGE 8

// Flag of `status`: the slide of one step exceeded 64 mm, or the spin 8 rad, and was cut to that.
#define FINGERPAD_STATUS_LARGE_INCREMENT 16

// Flag of `status`: a driven step or a grip could not reach the force asked for.
#define FINGERPAD_STATUS_LOAD_NOT_REACHED 32

// Flag of `status`: the motion spins and the state does not know spin; the step was taken without it.
#define FINGERPAD_STATUS_SPIN_IGNORED 64

// Flag of `status`: the state had a value that is not a number and was reset; the forces are those of a fresh contact.
#define FINGERPAD_STATUS_MEMORY_LOST 128

// Flag of `status`: an effect led beyond its range and was held there.
#define FINGERPAD_STATUS_EFFECT_HELD 256

// Flag of `status`: a pose beyond those that the model was fitted in; the answer is that of the nearest of them.
#define FINGERPAD_STATUS_POSE_OUT_OF_RANGE 512

// Flag of `status`: a pad did not come to equilibrium within the rounds of a step; the answer is that of the last round.
#define FINGERPAD_STATUS_NOT_CONVERGED 1024

// Flag of `status`: the body is too sharp for the patches of a pad; the answer is that of a body with the least radius that they see.
#define FINGERPAD_STATUS_BODY_TOO_SHARP 2048

// Flag of `status`: a contact in frames began inside the body; its depth counts from where it began.
#define FINGERPAD_STATUS_BEGAN_INSIDE 4096

// Flag of `status`: a contact in frames reaches beyond the edge of its face, where the model has a face as well.
#define FINGERPAD_STATUS_BEYOND_EDGE 8192

// The finger touches: the value of `change` in an event.
#define FINGERPAD_TOUCH 0

// The stick ratio falls below `first_slip`.
#define FINGERPAD_FIRST_SLIP 1

// The stick ratio falls to `full_slip`.
#define FINGERPAD_FULL_SLIP 2

// Part or all of a contact that slipped sticks again.
#define FINGERPAD_RESTICK 3

// The finger leaves the plane.
#define FINGERPAD_LIFT_OFF 4

// Most events that one look can report: a finger that lands slipping.
#define FINGERPAD_EVENTS_A_LOOK 3

// The model file of a bed of springs in use: one pose of the finger, on a plane. Set it up with `fingerpad_model_load`; the file
// must stay where it is. May be copied, and read by several threads as long as none changes it.
typedef struct {
  uint64_t opaque[18];
} fingerpad_model;

// All that a contact remembers. Set it up with `fingerpad_state_init`. Plain memory: copy it to go back to it in the same
// program (a step that is tried and rejected); `fingerpad_state_save` makes bytes that can be checked when they are read.
typedef struct {
  uint32_t opaque[27];
} fingerpad_state;

// Motions of many contacts, `count` numbers in each array; see `fingerpad_motion`.
typedef struct {
  // Number of contacts.
  size_t count;
  // Depths at the end of the step, mm.
  const float *depth_mm;
  // Slides along x during the step, mm.
  const float *slide_x_mm;
  // Slides along y during the step, mm.
  const float *slide_y_mm;
  // Turns about the normal, rad; null for none.
  const float *spin_rad;
  // Length of the step, s, the same for all.
  float dt_s;
} fingerpad_motions;

// Forces that the plane exerts on the finger, and how far the contact is from slipping.
typedef struct {
  // Force along the normal, N. Negative where stuck flanks of a curved body pull.
  float normal_force_n;
  // Force along x, N; friction points along the body's motion. On a curved body the pressure on its slopes is part of it.
  float friction_x_n;
  // Force along y, N.
  float friction_y_n;
  // Friction alone along x, N: the sum of the tangential tractions. On a plane the force along x.
  float tangential_friction_x_n;
  // Friction alone along y, N.
  float tangential_friction_y_n;
  // Stuck area over contact area: 1 in a fresh contact, 0 in full slip and without contact.
  float stick_ratio;
  // Largest friction in the direction of the present one, N.
  float friction_limit_n;
  // 1 less the share of its limit that friction uses; with spin the load is friction and its moment. 0 without contact.
  float slip_margin;
  // The margin that is left when the tissue has relaxed at the present depth, if the load stays: 0 where the load slips before.
  // The slip margin itself where nothing relaxes.
  float slip_margin_relaxed;
  // Moment about the plane's normal through the point under first touch, N mm; without spin that of friction along y alone.
  float spin_moment_n_mm;
  // Moment of all forces about x through the point under first touch, N mm.
  float tilt_moment_x_n_mm;
  // Moment of all forces about y through the point under first touch, N mm.
  float tilt_moment_y_n_mm;
  // Centre of pressure along x from the point under first touch, mm; 0 where the normal force is not positive.
  float pressure_centre_x_mm;
  // Centre of pressure along y from the point under first touch, mm.
  float pressure_centre_y_mm;
  // Contact area, mm².
  float contact_area_mm2;
  // Half-width of the 95 % band of the normal force, N.
  float band_normal_n;
  // Half-width of the 95 % band of each friction component, N.
  float band_friction_n;
  // FINGERPAD_NO_CONTACT, FINGERPAD_STICK, FINGERPAD_PARTIAL_SLIP or FINGERPAD_SLIP.
  uint32_t regime;
  // Flags FINGERPAD_STATUS_..., 0 for none.
  uint32_t status;
} fingerpad_response;

// The same of a contact that also spins. Set it up with `fingerpad_spin_state_init`.
typedef struct {
  uint32_t opaque[35];
} fingerpad_spin_state;

// Conditions that effects depend on and a motion does not contain. `fingerpad_surroundings_default` gives the reference state.
typedef struct {
  // Moisture of the skin, corneometer units.
  float hydration_au;
  // Temperature of the skin, degrees Celsius.
  float temperature_c;
  // Width of the finger, mm.
  float finger_width_mm;
  // Clock of the series in which the tissue drifts, s.
  float series_s;
  // Hold before sliding, s; NaN: counted from the motion.
  float dwell_s;
  // Contact time since the last rest, s; NaN: counted from the motion.
  float occlusion_s;
  // Nominal speed of the plane where it moves, mm/s; NaN: computed from the motion.
  float speed_mm_s;
  // Columns of the user's own that tables of the model file read, in the order of `fingerpad_model_own_column`;
  // `fingerpad_model_surroundings` gives the values of the calibration.
  float own[4];
} fingerpad_surroundings;

// All that a contact with effects remembers: a state, and the clocks and paths that effects read. Set it up with
// `fingerpad_contact_init`. Plain memory: copy it to go back to it.
typedef struct {
  uint32_t opaque[39];
} fingerpad_contact;

// What the plane does in one step.
typedef struct {
  // Depth at the end of the step, mm, positive into the finger; 0 or less is no contact.
  float depth_mm;
  // Slide of the plane along x during the step, mm.
  float slide_x_mm;
  // Slide of the plane along y during the step, mm.
  float slide_y_mm;
  // Turn of the plane about its normal through the point under first touch during the step, rad, counter-clockwise seen
  // from the finger. Only a contact with spin follows it; another flags it.
  float spin_rad;
  // Length of the step, s.
  float dt_s;
} fingerpad_motion;

// What is prescribed in one step: depth or normal force, slide or friction.
typedef struct {
  // 0: `depth_mm` is prescribed; else `normal_force_n`.
  uint16_t by_normal_force;
  // 0: `slide_x_mm` and `slide_y_mm` are prescribed; else `friction_x_n` and `friction_y_n`.
  uint16_t by_friction;
  // Depth at the end of the step, mm.
  float depth_mm;
  // Normal force at the end of the step, N.
  float normal_force_n;
  // Slide along x during the step, mm.
  float slide_x_mm;
  // Slide along y during the step, mm.
  float slide_y_mm;
  // Friction along x at the end of the step, N.
  float friction_x_n;
  // Friction along y at the end of the step, N.
  float friction_y_n;
  // Turn of the plane during the step, rad.
  float spin_rad;
  // Length of the step, s.
  float dt_s;
} fingerpad_drive;

// All that the forces of a contact depend on, without the history of its slip: 64 bytes in place of 108. Set it up with
// `fingerpad_force_state_init`. Plain memory: copy it to go back to it.
typedef struct {
  uint32_t opaque[16];
} fingerpad_force_state;

// The part of `fingerpad_response` that needs no history of slip: no stick ratio, regime and bands.
typedef struct {
  // Normal force, N, not negative.
  float normal_force_n;
  // Friction along x, N; it points along the plane's motion.
  float friction_x_n;
  // Friction along y, N.
  float friction_y_n;
  // Largest friction in the direction of the present one, N; 0 without contact.
  float friction_limit_n;
  // 1 less the share of its limit that friction uses; 0 without contact.
  float slip_margin;
  // Moment of the friction along y about the plane's normal through the point under first touch, N mm.
  float spin_moment_n_mm;
  // Centre of pressure along x from the point under first touch, mm.
  float pressure_centre_x_mm;
  // Centre of pressure along y from the point under first touch, mm.
  float pressure_centre_y_mm;
  // Contact area, mm².
  float contact_area_mm2;
  // Flags FINGERPAD_STATUS_..., 0 for none.
  uint32_t status;
} fingerpad_force_response;

// The model file of a pad in use: every pose of the finger, on planes, spheres, cylinders and edges. Set it up with
// `fingerpad_pad_load`; the file must stay where it is. May be copied, and read by several threads as long as none changes it.
typedef struct {
  uint64_t opaque[14];
} fingerpad_pad;

// The shape of a rigid body in a frame of its own.
typedef struct {
  // FINGERPAD_SHAPE_PLANE and so on.
  uint32_t kind;
  // Sizes as the kind states, mm: 0.1 to 1e6.
  double size_mm[3];
  // Radius of the edges of a box, mm: 0.1 to 1e6.
  double edge_radius_mm;
  // Angle between the faces of an edge, degrees: 1 to 179.
  double angle_deg;
} fingerpad_shape;

// All that a finger remembers of its contact with one body: room for any bed, and for any pad that does not relax. Set it up with
// `fingerpad_frame_init_pad` or `fingerpad_frame_init_bed`. It belongs to one finger and one body. Plain memory: copy it, or its first
// `fingerpad_frame_bytes`, to go back to it in the same program.
typedef struct {
  uint64_t opaque[288];
} fingerpad_frame_contact;

// The same for pads that relax. Set it up with `fingerpad_relaxing_frame_init_pad`, for any pad, and hand `&contact` of it to every function.
typedef struct {
  // Its beginning, which stands for it.
  fingerpad_frame_contact contact;
  uint64_t more[316];
} fingerpad_relaxing_frame_contact;

// Pose of a body in the finger's frame. That frame is the bone's: x along the finger from proximal to distal, z out of the pad's surface
// into the finger, y to complete a right-handed frame; the origin is where a plane first touches in the neutral pose.
typedef struct {
  // Place of the body's origin, mm.
  double position_mm[3];
  // Its orientation, in the order w, x, y, z, of unit length: rotates vectors of the body's frame into the finger's.
  double quaternion[4];
} fingerpad_pose;

// Force and moment about the origin of a frame, along its axes.
typedef struct {
  // Force, N.
  float force_n[3];
  // Moment, N mm.
  float moment_n_mm[3];
} fingerpad_wrench;

// Forces and state of a contact after a step.
typedef struct {
  // What the body exerts on the finger, in the finger's frame.
  fingerpad_wrench on_finger;
  // What the finger exerts on the body, in the body's frame.
  fingerpad_wrench on_body;
  // Depth of the body in the finger as the model has it, mm; 0 where the finger stands over no face.
  float depth_mm;
  // Pitch of the finger against the face, degrees.
  float pitch_deg;
  // Its roll, degrees.
  float roll_deg;
  // The face: 0 for none; 1 for a plane, a sphere, an ellipsoid and an edge; of a box 1 to 6 for +x, +y, +z, -x, -y, -z and 7 to 18 for
  // its edges; of a capsule and a cylinder 1 for the side, 2 and 3 for the ends at +z and -z.
  uint32_t face;
  // The response of the model, along the axes of the face's plane.
  fingerpad_response response;
  // Room for later fields; 0.
  uint32_t reserved[8];
} fingerpad_frame_response;

// One patch of the skin as a taxel of a tactile sensor. Over all patches of a pad the forces add up to `on_finger` of the response, and
// `place_mm` x `force_n` plus `moment_n_mm` to its moment.
typedef struct {
  // Its middle in the finger's frame, mm: where the contact has moved it; of a finger in the air at rest.
  float place_mm[3];
  // Force of the body on it along the axes of the finger's frame, N.
  float force_n[3];
  // Moment of the body on it about its middle, N mm: pressure is not even over a patch.
  float moment_n_mm[3];
  // Mean pressure over its own area, MPa; positive into the finger.
  float pressure_mpa;
  // Mean friction over its own area along the finger and across it, MPa: along x and y of the face's plane, as `friction_x_n` and
  // `friction_y_n` of a response.
  float shear_mpa[2];
  // Its own area, mm².
  float area_mm2;
  // Area of it in contact, mm².
  float contact_area_mm2;
  // Stuck share of the area in contact: 1 stick, 0 slip and without contact.
  float stick_ratio;
  // Friction over the largest friction that it can carry.
  float used;
} fingerpad_frame_patch;

// Prior of surface and finger, errors of model and sensors, and what is asked. `fingerpad_margin_settings_default` gives the usual ones.
typedef struct {
  // Standard deviation of the logarithm of the strength factor, 0.05 to 1.
  float strength;
  // Standard deviation of the finger's tangential stiffness, share, 0.01 to 0.3.
  float stiffness;
  // Standard deviation of the model's friction, share of the limit, 0.001 to 0.5.
  float model_error;
  // Mean of that error at 0, 1/4, 1/2, 3/4 of the limit and all of it, share of the model's friction, -0.2 to 0.2.
  float curve[5];
  // Slide over which that error is correlated, over the slip length, 0.01 to 10.
  float correlation;
  // Standard deviation of the model's stick ratio at a share of the limit, 0.005 to 1, for readings with a stick ratio.
  float stick_error;
  // Error of friction that is gained while the normal force changes by a factor of e, share, 0 to 1.
  float press_error;
  // Time constant of the force sensor, s, 0 to 1.
  float force_lag_s;
  // Play of the measured slide, mm, 0 to 10.
  float play_mm;
  // Drift of the measured slide, share of the slide, 0 to 0.5.
  float drift;
  // Standard deviation of the zero of friction at first touch, N, 0 to 10.
  float tare_n;
  // Its drift in a second, N, 0 to 10.
  float tare_drift_n;
  // Probability of the band of strength and margin, 0.5 to 0.999.
  float confidence;
  // Time ahead for which the chance of full slip is given, s, 0 to 10.
  float ahead_s;
} fingerpad_margin_settings;

// Finds the margin to slip on an unknown surface. Set it up with `fingerpad_margin_init`. The model's file must stay where it is.
typedef struct {
  uint64_t opaque[440];
} fingerpad_margin_observer;

// Forces and motion as measured at the end of a step, with the covariance of their noise.
typedef struct {
  // Normal force of the surface on the finger, N.
  float normal_force_n;
  // Friction along x, N.
  float friction_x_n;
  // Friction along y, N.
  float friction_y_n;
  // Slide of the surface along x since the last reading, mm.
  float slide_x_mm;
  // Slide along y, mm.
  float slide_y_mm;
  // Variance of the normal force, N^2.
  float normal_variance_n2;
  // Covariance of friction, N^2: xx, yy, xy.
  float friction_covariance_n2[3];
  // Covariance of the measured position (not of the slide), mm^2: xx, yy, xy.
  float slide_covariance_mm2[3];
  // Share of the contact area that sticks, from the shear field of a tactile skin.
  float stick_ratio;
  // Variance of its noise; 0 where it is not measured.
  float stick_variance;
  // Time since the last reading, s.
  float dt_s;
} fingerpad_margin_reading;

// What is known of the surface after a reading.
typedef struct {
  // Strength factor of the surface.
  float strength_factor;
  // Lower end of its band.
  float strength_low;
  // Upper end of its band.
  float strength_high;
  // Slip margin of the present friction, 0 to 1; 0 without contact.
  float slip_margin;
  // Lower end of its band: 0 announces slip.
  float margin_low;
  // Upper end of its band.
  float margin_high;
  // Chance of full slip within the time ahead, at the present rates of the forces.
  float slip_chance;
  // Tangential stiffness of the finger over that of the model.
  float stiffness_factor;
  // 0 where nothing but the prior is known, 1 where all is.
  float information;
  // FINGERPAD_KNOWN_NO_CONTACT and so on.
  uint32_t known;
  // 1 if this reading made clear that the surface has changed: the strength starts again from its prior. Else 0.
  uint32_t surface_changed;
  // FINGERPAD_STATUS_BAD_INPUT for an unsound number or covariance, FINGERPAD_STATUS_BAD_TIME_STEP for a clock that stands still,
  // FINGERPAD_STATUS_DEPTH_ABOVE_RANGE for a normal force beyond the model; the bounds have then widened.
  uint32_t status;
} fingerpad_margin;

// A branch of tissue that relaxes: a stiffness that forgets.
typedef struct {
  // Its stiffness over that of the relaxed tissue, 0 to 100.
  float share;
  // The time in which it forgets, s: 1e-5 to 1e5.
  float time_s;
} fingerpad_branch;

// What a model file says of itself.
typedef struct {
  // Largest depth for which the model was fitted, mm, for the finger in use.
  float depth_max_mm;
  // Pitch of the finger against the plane in the one pose that the model is of, degrees.
  float pitch_deg;
  // Its roll, degrees.
  float roll_deg;
  // Number of effects in the file.
  uint32_t effects;
  // Checksum of the numbers; a saved state contains it.
  uint32_t checksum;
  // The file's description, JSON in UTF-8 without an end mark, inside the file.
  const char *meta;
  // Its length in bytes.
  size_t meta_length;
  // Number of columns of the user's own that tables of the file read; `fingerpad_model_own_column` describes each.
  uint32_t own_columns;
  // Number of branches of tissue that relaxes; 0 for tissue that does not. Their states are `fingerpad_relaxing_state`.
  uint32_t branches;
} fingerpad_model_info;

// A column of the user's own (a voltage, a humidity) that tables of a model file read.
typedef struct {
  // Its name, UTF-8, ending with a zero.
  char name[32];
  // Its unit, UTF-8, ending with a zero; empty for a pure number.
  char unit[16];
  // Least value for which the tables hold.
  float low;
  // Largest value for which they hold.
  float high;
  // The value under which the model was calibrated.
  float reference;
} fingerpad_own_column;

// What a pad's file says of itself.
typedef struct {
  // Number of patches of skin.
  uint32_t patches;
  // Largest depth for which the pad was fitted, mm, for the finger in use.
  float depth_max_mm;
  // Pitch in which the finger's axes are those of the plane, degrees.
  float neutral_pitch_deg;
  // Least pitch of the fit, degrees.
  float pitch_min_deg;
  // Largest pitch of the fit, degrees.
  float pitch_max_deg;
  // Largest roll of the fit to either side, degrees.
  float roll_max_deg;
  // Checksum of the numbers; a saved state contains it.
  uint32_t checksum;
  // Bytes of a saved state: 1312 for a pad of up to 37 patches, else FINGERPAD_PAD_STATE_BYTES. Of tissue that relaxes 2864, else
  // FINGERPAD_RELAXING_PAD_STATE_BYTES.
  uint32_t state_bytes;
  // The file's description, JSON in UTF-8 without an end mark, inside the file.
  const char *meta;
  // Its length in bytes.
  size_t meta_length;
  // Number of branches of tissue that relaxes; 0 for tissue that does not. Their states are `fingerpad_relaxing_pad_state`.
  uint32_t branches;
} fingerpad_pad_info;

// All that a contact of a pad remembers: 1844 bytes, room for FINGERPAD_PATCHES_MAX patches, so that a program takes any pad
// without a rebuild. A pad of up to 37 patches, the usual number, uses the first 1304 bytes and a step made for so many,
// which needs less stack and time. Set it up with `fingerpad_pad_state_init` or `fingerpad_pad_state_init_over`. A state belongs to
// one pad, one tuning and one body. Plain memory: copy it to go back to it in the same program (a step that is tried and
// rejected); `fingerpad_pad_state_save` makes bytes that can be checked when they are read.
typedef struct {
  uint32_t opaque[461];
} fingerpad_pad_state;

// The same for tissue that relaxes: 4368 bytes. Set it up with `fingerpad_relaxing_pad_state_init` or
// `fingerpad_relaxing_pad_state_init_over`, for any pad, and hand `&state` of it to every function. For a pad that does not relax it is a
// `fingerpad_pad_state` with unused room.
typedef struct {
  // Its beginning, which stands for it.
  fingerpad_pad_state state;
  uint32_t more[631];
} fingerpad_relaxing_pad_state;

// The rigid body that a pad touches. Its apex is the point with the tangent plane that depth, slide and pose refer to. Numbers
// that a kind has no use for are not read.
typedef struct {
  // FINGERPAD_BODY_PLANE, FINGERPAD_BODY_SPHERE, FINGERPAD_BODY_CYLINDER or FINGERPAD_BODY_EDGE.
  uint32_t kind;
  // Radius of sphere, cylinder or the edge's rounding, mm: 0.1 to 1e6. Negative for a bowl or a trough.
  float radius_mm;
  // Direction of the axis of a cylinder or of an edge in the tangent plane, from x towards y, degrees: -180 to 180.
  float axis_deg;
  // Angle between the faces of an edge inside the body, degrees: 1 to 179.
  float angle_deg;
} fingerpad_body;

// What the body does in one step, and the finger's pose at its end.
typedef struct {
  // Depth at the end of the step, mm, positive into the finger, along the normal at the body's apex: from where a plane there
  // would first touch the finger in its pose. 0 or less is no contact.
  float depth_mm;
  // Slide of the body along x during the step, mm.
  float slide_x_mm;
  // Slide of the body along y during the step, mm.
  float slide_y_mm;
  // Turn of the body about the normal during the step, rad, counter-clockwise seen from the finger.
  float spin_rad;
  // Pitch of the finger against the tangent plane at the body's apex at the end of the step, degrees.
  float pitch_deg;
  // Its roll, degrees.
  float roll_deg;
  // Length of the step, s.
  float dt_s;
} fingerpad_pad_motion;

// Derivatives of the forces for a motion that goes on, N/mm; each with depth, slide x and slide y.
typedef struct {
  // Of the normal force.
  float normal_n_mm[3];
  // Of friction along x.
  float friction_x_n_mm[3];
  // Of friction along y.
  float friction_y_n_mm[3];
} fingerpad_gradient;

// The least grip that holds a load.
typedef struct {
  // Depth to press to, mm.
  float depth_mm;
  // Normal force there with the load applied, N.
  float normal_force_n;
  // FINGERPAD_STATUS_LOAD_NOT_REACHED if not even the largest depth holds the load, FINGERPAD_STATUS_BAD_INPUT if a number
  // was none; 0 otherwise.
  uint32_t status;
} fingerpad_grip;

// Load of one patch of skin.
typedef struct {
  // Its middle now along x, y and z of the tangent plane, from the point about which poses turn, mm.
  float place_mm[3];
  // Mean pressure over its own area, MPa.
  float pressure_mpa;
  // Mean traction along x and y over its own area, MPa.
  float traction_mpa[2];
  // Area in contact, mm².
  float contact_area_mm2;
  // Share of that area which sticks.
  float stick_ratio;
  // Share of its strength that friction uses.
  float used;
} fingerpad_patch;

// All that a contact of a bed remembers whose tissue relaxes: 240 bytes. Set it up with `fingerpad_relaxing_state_init`. With a bed that does
// not relax it is a `fingerpad_state` with unused room. Plain memory, as `fingerpad_state`.
typedef struct {
  uint32_t opaque[60];
} fingerpad_relaxing_state;

// The same of a contact that also spins: 368 bytes. Set it up with `fingerpad_relaxing_spin_state_init`.
typedef struct {
  uint32_t opaque[92];
} fingerpad_relaxing_spin_state;

// When a watch reports a change: thresholds that differ by direction (hysteresis), and the number of looks that must
// show it (debounce). `fingerpad_watch_settings_default` gives the usual ones.
typedef struct {
  // First slip: the stick ratio is below this for `looks` looks.
  float first_slip;
  // First slip at once: the stick ratio is below this.
  float sure_slip;
  // Full slip: the stick ratio is at most this for `looks` looks.
  float full_slip;
  // A contact in full slip sticks again in part: the stick ratio is above this for `looks` looks.
  float partial_restick;
  // A contact sticks again as a whole: the stick ratio is above this for `looks` looks.
  float restick;
  // Looks that show slip or stick, less those that do not, before it is reported; 0 counts as 1.
  uint8_t looks;
  // The same before touch or lift-off is reported; 0 counts as 1.
  uint8_t contact_looks;
} fingerpad_watch_settings;

// Sees changes from one response to the next, through noise. Set it up with `fingerpad_watch_init`.
typedef struct {
  uint32_t opaque[10];
} fingerpad_watch;

// A change and its time.
typedef struct {
  // The look at which it was seen, counted from 0.
  uint32_t tick;
  // Number of the finger.
  uint8_t finger;
  // FINGERPAD_TOUCH, FINGERPAD_FIRST_SLIP, FINGERPAD_FULL_SLIP, FINGERPAD_RESTICK or FINGERPAD_LIFT_OFF.
  uint8_t change;
} fingerpad_event;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Advances `count` contacts by one step each, with the same bits as steps one by one; `states` and `responses` are arrays of
// `count`. To use several cores, divide the arrays.
//
// Returns FINGERPAD_OK, or FINGERPAD_BUFFER if `count` is not that of the motions, FINGERPAD_NULL, FINGERPAD_ALIGNMENT, or
// FINGERPAD_NOT_SET_UP for the model or any of the states; then nothing changes.
int32_t fingerpad_step_batch(const fingerpad_model *model,
                             fingerpad_state *states,
                             const fingerpad_motions *motions,
                             fingerpad_response *responses,
                             size_t count);

// As `fingerpad_step_batch`, with spin.
int32_t fingerpad_spin_step_batch(const fingerpad_model *model,
                                  fingerpad_spin_state *states,
                                  const fingerpad_motions *motions,
                                  fingerpad_response *responses,
                                  size_t count);

// What a code means, in English; never null, never to be freed.
const char *fingerpad_error_text(int32_t code);

// The reference state of a library without a model: 35 corneometer units, 32 degrees Celsius, 16 mm, times and speed counted
// from the motion, 0 for columns of the user's own.
int32_t fingerpad_surroundings_default(fingerpad_surroundings *surroundings);

// The reference state of a model: the same, with the values of the calibration for columns of the user's own.
int32_t fingerpad_model_surroundings(const fingerpad_model *model,
                                     fingerpad_surroundings *surroundings);

// A finger in the air, all clocks at 0, with a strength factor of 1.
int32_t fingerpad_contact_init(fingerpad_contact *contact);

// The caller's factor on all strengths, 0.1 to 5; the effects' comes on top of it. Returns FINGERPAD_OK, or FINGERPAD_RANGE.
int32_t fingerpad_contact_set_strength_factor(fingerpad_contact *contact,
                                              float factor);

// Declares a rest of the finger in the air: the time of occlusion starts again from zero.
int32_t fingerpad_contact_record_rest(fingerpad_contact *contact);

// Advances a contact by one step with the effects of the model's file; bad surroundings (NaN) leave their effect out.
//
// Returns FINGERPAD_OK, or FINGERPAD_SECTION if the file has effects that this library does not know, FINGERPAD_NULL,
// FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP; then nothing changes.
int32_t fingerpad_contact_step(const fingerpad_model *model,
                               fingerpad_contact *contact,
                               fingerpad_surroundings surroundings,
                               fingerpad_motion motion,
                               fingerpad_response *response);

// What a sensor with the file's tare and cross-talk reads of a response: normal, x and y, N, into an array of three. Where
// tables say what the sensor makes of temperature, time or a column of the user's own, see `fingerpad_contact_reading_under`.
//
// Returns FINGERPAD_OK, FINGERPAD_SECTION as above, or FINGERPAD_RANGE for a response whose regime is none.
int32_t fingerpad_contact_reading(const fingerpad_model *model,
                                  const fingerpad_response *response,
                                  float *reading_n);

// The same under surroundings, after a step of the contact that gave the response.
//
// Returns FINGERPAD_OK, or what `fingerpad_contact_reading` returns.
int32_t fingerpad_contact_reading_under(const fingerpad_model *model,
                                        const fingerpad_contact *contact,
                                        fingerpad_surroundings surroundings,
                                        const fingerpad_response *response,
                                        float *reading_n);

// Advances a contact by one step driven by displacement or force in each direction; a held load does not creep. A force out
// of reach gives the nearest state and FINGERPAD_STATUS_LOAD_NOT_REACHED. `motion` becomes the motion that led there; it may
// be null. Takes 3 to 12 times as long as `fingerpad_step`.
//
// Returns FINGERPAD_OK, or FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP; then nothing changes.
int32_t fingerpad_step_driven(const fingerpad_model *model,
                              fingerpad_state *state,
                              fingerpad_drive drive,
                              fingerpad_response *response,
                              fingerpad_motion *motion);

// A finger in the air, with a strength factor of 1.
int32_t fingerpad_force_state_init(fingerpad_force_state *state);

// As `fingerpad_state_set_strength_factor`.
int32_t fingerpad_force_state_set_strength_factor(fingerpad_force_state *state, float factor);

// Advances a contact by one step; the forces are those of `fingerpad_step`, bit by bit, with about a third fewer instructions.
//
// Returns FINGERPAD_OK, or FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP; then nothing changes.
int32_t fingerpad_step_forces(const fingerpad_model *model,
                              fingerpad_force_state *state,
                              fingerpad_motion motion,
                              fingerpad_force_response *response);

// A finger in the air that is to touch a body of this shape, with the model of a pad and a strength factor of 1.
//
// Returns FINGERPAD_OK, or FINGERPAD_BUFFER for a pad whose tissue relaxes (use `fingerpad_relaxing_frame_init_pad`), FINGERPAD_RANGE for a
// kind that is none or a size out of its range, FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP for the pad; then nothing changes.
int32_t fingerpad_frame_init_pad(const fingerpad_pad *pad,
                                 fingerpad_shape shape,
                                 fingerpad_frame_contact *contact);

// The same for any pad. FINGERPAD_NOT_SET_UP also as `fingerpad_relaxing_pad_state_init`.
int32_t fingerpad_relaxing_frame_init_pad(const fingerpad_pad *pad,
                                          fingerpad_shape shape,
                                          fingerpad_relaxing_frame_contact *contact);

// The same with the model of a bed, which touches planes and the faces of boxes: FINGERPAD_RANGE for another shape. A bed is of one pose
// of the finger. In another one its depth alone changes, by that of a round finger, see `fingerpad_frame_set_bed_radius`. Its tissue may
// relax; initialise the contact again after `fingerpad_model_relax`.
int32_t fingerpad_frame_init_bed(const fingerpad_model *model,
                                 fingerpad_shape shape,
                                 fingerpad_frame_contact *contact);

// As `fingerpad_state_set_strength_factor`.
int32_t fingerpad_frame_set_strength_factor(fingerpad_frame_contact *contact, float factor);

// Sets the radius of a bed's finger along and across, mm: how depth changes when the finger tilts. A fresh contact has 21 mm.
//
// Returns FINGERPAD_OK, or FINGERPAD_RANGE for a radius that is not within 0 and 1000 mm, FINGERPAD_NOT_SET_UP for any contact but one of a
// bed, FINGERPAD_NULL or FINGERPAD_ALIGNMENT; then nothing changes.
int32_t fingerpad_frame_set_bed_radius(fingerpad_frame_contact *contact,
                                       float along_mm,
                                       float across_mm);

// Ends a contact, and has the body count as another shape from the next step on: for a body that is known by its shape near the finger
// alone, such as a mesh. `moved` is the pose of the new shape's frame in that of the old one. The place of the finger and the strength factor
// are kept.
//
// Returns FINGERPAD_OK, or FINGERPAD_RANGE for a shape that cannot be, or that a bed does not touch, FINGERPAD_NOT_SET_UP, FINGERPAD_NULL or
// FINGERPAD_ALIGNMENT; then nothing changes.
int32_t fingerpad_frame_reshape(fingerpad_frame_contact *contact,
                                fingerpad_shape shape,
                                const fingerpad_pose *moved);

// Bytes at the beginning of a contact that hold all that it remembers: copied into another one they are that contact. 0 for one that was not
// set up.
size_t fingerpad_frame_bytes(const fingerpad_frame_contact *contact);

// Moves a contact on by one step of `dt_s` seconds: `body` is the pose of the body in the finger's frame at its end. The library finds the
// face that the finger meets, and turns the change of the pose into the motion of the model and its response into forces and moments.
//
// A pose that is not finite, or a quaternion that is not of unit length within 0.05 %, is flagged as FINGERPAD_STATUS_BAD_INPUT and not
// taken. A contact begins near the surface: no deeper than the finger came closer in the step, and 1 mm; else
// FINGERPAD_STATUS_BEGAN_INSIDE, until slip has raised it to the surface. The first step takes the pose as it is.
//
// Returns FINGERPAD_OK, or FINGERPAD_NOT_SET_UP, FINGERPAD_NULL or FINGERPAD_ALIGNMENT; then nothing changes.
int32_t fingerpad_frame_step_pad(const fingerpad_pad *pad,
                                 fingerpad_frame_contact *contact,
                                 const fingerpad_pose *body,
                                 float dt_s,
                                 fingerpad_frame_response *response);

// The same with the model of a bed.
int32_t fingerpad_frame_step_bed(const fingerpad_model *model,
                                 fingerpad_frame_contact *contact,
                                 const fingerpad_pose *body,
                                 float dt_s,
                                 fingerpad_frame_response *response);

// Writes the patches of a pad after the last step to an array of `count` patches: a tactile skin in the finger's frame. The first `patches`
// of `fingerpad_pad_info` are written. Without contact all is 0 but place and area. Costs as much as a round of a step, and 2 to 8 kB more
// stack than one.
//
// The sums hold to rounding. On a curved face a patch that slips ends beside where its load was found: the sums are off by up to 2 % in that
// step, and by rounding after a few steps at rest.
//
// Returns FINGERPAD_OK, or FINGERPAD_BUFFER if `count` is less than that number, FINGERPAD_NOT_SET_UP also for a contact of another pad or of a
// bed, which has no patches, FINGERPAD_NULL or FINGERPAD_ALIGNMENT; then nothing is written.
int32_t fingerpad_frame_patches(const fingerpad_pad *pad,
                                const fingerpad_frame_contact *contact,
                                fingerpad_frame_patch *patches,
                                size_t count);

// Surfaces within a factor of 2, stiffness within 15 %, the errors of the shipped model, sensors without lag, play and drift, a band of
// 95 %, 50 ms ahead.
int32_t fingerpad_margin_settings_default(fingerpad_margin_settings *settings);

// An observer for a finger in the air. Returns FINGERPAD_OK, or FINGERPAD_RANGE for a setting out of its range, FINGERPAD_NULL,
// FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP for the model; then nothing changes.
int32_t fingerpad_margin_init(const fingerpad_model *model,
                              fingerpad_margin_settings settings,
                              fingerpad_margin_observer *observer);

// Takes a reading and writes what is known after it. Any numbers may come in; see `status`.
//
// Returns FINGERPAD_OK, or FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP; then nothing changes.
int32_t fingerpad_margin_step(fingerpad_margin_observer *observer,
                              const fingerpad_margin_reading *reading,
                              fingerpad_margin *margin);

// Checks a model file and prepares a model that reads it in place: `length` bytes at an address divisible by 4, which live and
// stay unchanged as long as the model. Takes some 20 instructions a byte.
//
// Returns FINGERPAD_OK, or why the file is refused; then the model is as one that was unloaded. FINGERPAD_SECTION: the file has
// no bed in it; if it is the file of a pad, use `fingerpad_pad_load`, and if its tissue relaxes, `fingerpad_relaxing_model_load`.
int32_t fingerpad_model_load(fingerpad_model *model,
                             const uint8_t *file,
                             size_t length);

// The same, also for tissue that relaxes by the branches of its file. With such tissue the functions of `fingerpad_relaxing_state`,
// `fingerpad_relaxing_spin_state` and `fingerpad_frame_contact`, describe, tune and least grip work; all others return FINGERPAD_NOT_SET_UP.
int32_t fingerpad_relaxing_model_load(fingerpad_model *model,
                                      const uint8_t *file,
                                      size_t length);

// Marks a model as not set up, so that using it after its file is gone is refused.
int32_t fingerpad_model_unload(fingerpad_model *model);

// Changes the model to another finger, counted from the fitted one: factors on size (0.5 to 2), tissue stiffness (0.2 to 5)
// and lambda (0.1 to 10).
//
// Returns FINGERPAD_OK, or FINGERPAD_RANGE; then nothing changes.
int32_t fingerpad_model_tune(fingerpad_model *model,
                             float size,
                             float stiffness,
                             float lambda);

// Gives the tissue other branches than the file's, as `fingerpad_pad_relax`; none with a `count` of 0. A state belongs to one such choice:
// initialise it again afterwards. See `fingerpad_relaxing_model_load` for what works with such a model.
//
// Returns FINGERPAD_OK, or FINGERPAD_SHAPE for too many, FINGERPAD_RANGE, also for shares with which a fast press would exceed the range of
// the bed's springs, FINGERPAD_SECTION for a file with the effect `normal_relaxation`; then nothing changes.
int32_t fingerpad_model_relax(fingerpad_model *model,
                              const fingerpad_branch *branches,
                              size_t count);

// What a model file says of itself.
int32_t fingerpad_model_describe(const fingerpad_model *model, fingerpad_model_info *info);

// Column `index` of the user's own that tables of the file read. Its value goes to `own[index]` of the surroundings.
//
// Returns FINGERPAD_OK, or FINGERPAD_RANGE where the file has no column of that index; then nothing is written.
int32_t fingerpad_model_own_column(const fingerpad_model *model,
                                   uint32_t index,
                                   fingerpad_own_column *column);

// Checks a pad's model file and prepares a pad that reads it in place: `length` bytes at an address divisible by 4, which live
// and stay unchanged as long as the pad. Takes some 20 instructions a byte.
//
// Returns FINGERPAD_OK, or why the file is refused; then the pad is as one that was unloaded. FINGERPAD_SECTION: the file has no
// pad in it; if it is the file of a bed, use `fingerpad_model_load`. FINGERPAD_SHAPE: more than FINGERPAD_PATCHES_MAX patches.
// A pad whose file has branches can be described; for contacts of it use `fingerpad_relaxing_pad_load`.
int32_t fingerpad_pad_load(fingerpad_pad *pad,
                           const uint8_t *file,
                           size_t length);

// The same, also for contacts of tissue that relaxes by the branches of its file. Only a program with this function or `fingerpad_pad_relax`
// contains the steps of such tissue.
int32_t fingerpad_relaxing_pad_load(fingerpad_pad *pad,
                                    const uint8_t *file,
                                    size_t length);

// Marks a pad as not set up, so that using it after its file is gone is refused.
int32_t fingerpad_pad_unload(fingerpad_pad *pad);

// Changes the pad to another finger, counted from the fitted one: factors on size (0.5 to 2), tissue stiffness (0.2 to 5) and
// lambda (0.1 to 10). A state belongs to one tuning: initialise it again afterwards.
//
// Returns FINGERPAD_OK, or FINGERPAD_RANGE; then nothing changes.
int32_t fingerpad_pad_tune(fingerpad_pad *pad,
                           float size,
                           float stiffness,
                           float lambda);

// Gives the tissue other branches than the file's, at most FINGERPAD_BRANCHES_MAX; none with a `count` of 0. Held at a depth the force then
// falls as 1 plus the sum of share times exp(-t / time). A state belongs to one such choice: initialise it again afterwards.
//
// The times 0.004, 0.07 and 1.4 s are those of a human finger (Pawluk and Howe 1999). Shares of 1, 0.6 and 0.6 are assumed: measure them.
//
// Returns FINGERPAD_OK, or FINGERPAD_SHAPE for too many, FINGERPAD_RANGE; then nothing changes.
int32_t fingerpad_pad_relax(fingerpad_pad *pad,
                            const fingerpad_branch *branches,
                            size_t count);

// What a pad's file says of itself.
int32_t fingerpad_pad_describe(const fingerpad_pad *pad, fingerpad_pad_info *info);

// The point of the undeformed finger that a plane touches first in a pose, into an array of three numbers: mm along the finger's
// axes from the finger's origin, which touches first in the neutral pose (within 0.1 mm, the error of the fit). Depth 0 of a pose
// is where the plane passes through this point. A pose beyond those of the fit gives the point of the nearest of them.
//
// Returns FINGERPAD_OK, or FINGERPAD_RANGE if the pitch or the roll is NaN or infinite; then nothing is written.
int32_t fingerpad_pad_first_touch(const fingerpad_pad *pad,
                                  float pitch_deg,
                                  float roll_deg,
                                  float *place_mm);

// A finger in the air over a plane, with a strength factor of 1. Poses turn about the point of first touch in the neutral pose.
//
// Returns FINGERPAD_OK, FINGERPAD_BUFFER for a pad whose tissue relaxes (use `fingerpad_relaxing_pad_state_init`), or FINGERPAD_NULL,
// FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP for the pad; then nothing changes.
int32_t fingerpad_pad_state_init(const fingerpad_pad *pad,
                                 fingerpad_pad_state *state);

// A finger in the air over a body whose apex lies under first touch in a pose, and about which the finger turns: for spheres,
// cylinders and edges. A pose beyond those of the fit counts as the nearest of them; the first step flags it.
//
// Returns as `fingerpad_pad_state_init`, or FINGERPAD_RANGE for a pitch or roll of NaN.
int32_t fingerpad_pad_state_init_over(const fingerpad_pad *pad,
                                      fingerpad_pad_state *state,
                                      float pitch_deg,
                                      float roll_deg);

// As `fingerpad_pad_state_init`, of any pad. FINGERPAD_NOT_SET_UP also for a pad with the branches of its file that was loaded with
// `fingerpad_pad_load`: use `fingerpad_relaxing_pad_load`.
int32_t fingerpad_relaxing_pad_state_init(const fingerpad_pad *pad,
                                          fingerpad_relaxing_pad_state *state);

// As `fingerpad_pad_state_init_over`, of any pad; see `fingerpad_relaxing_pad_state_init`.
int32_t fingerpad_relaxing_pad_state_init_over(const fingerpad_pad *pad,
                                               fingerpad_relaxing_pad_state *state,
                                               float pitch_deg,
                                               float roll_deg);

// Sets the factor on all strengths, 0.1 to 5, from the next step on: what moisture, speed or dwell make of the friction. Returns
// FINGERPAD_OK, or FINGERPAD_RANGE; then the factor stays.
int32_t fingerpad_pad_state_set_strength_factor(fingerpad_pad_state *state,
                                                float factor);

// Advances a contact of a pad on a body by one step. Accepts a motion of any bits and reports errors in it in `status` of
// the response: also a pose beyond the fit (FINGERPAD_STATUS_POSE_OUT_OF_RANGE) and a step without equilibrium
// (FINGERPAD_STATUS_NOT_CONVERGED). Needs 13 kB of stack (21 kB for more than 37 patches; 1 kB more for tissue that relaxes) and ten to a hundred times the
// time of `fingerpad_step`.
//
// Returns FINGERPAD_OK, or FINGERPAD_RANGE for a body that cannot be, FINGERPAD_NULL, FINGERPAD_ALIGNMENT or
// FINGERPAD_NOT_SET_UP, also for the state of a pad of another size; then nothing changes.
int32_t fingerpad_pad_step(const fingerpad_pad *pad,
                           fingerpad_pad_state *state,
                           fingerpad_body body,
                           fingerpad_pad_motion motion,
                           fingerpad_response *response);

// Advances a contact of a pad by one step driven by displacement or force in each direction, as `fingerpad_spin_step_driven`: a held load does
// not creep, a force out of reach gives the nearest state and FINGERPAD_STATUS_LOAD_NOT_REACHED. A finger that touches in this step is pressed
// first, then loaded. Takes many steps, and the stack of one and several states more.
//
// Returns as `fingerpad_pad_step`.
int32_t fingerpad_pad_step_driven(const fingerpad_pad *pad,
                                  fingerpad_pad_state *state,
                                  fingerpad_body body,
                                  float pitch_deg,
                                  float roll_deg,
                                  fingerpad_drive drive,
                                  fingerpad_response *response,
                                  fingerpad_motion *motion);

// Writes how the forces of a pad change with a further motion from the last step, as `fingerpad_spin_state_gradient`, in the pose of that step.
// By differences of seven steps.
//
// Returns as `fingerpad_pad_patches`.
int32_t fingerpad_pad_gradient(const fingerpad_pad *pad,
                               const fingerpad_pad_state *state,
                               fingerpad_body body,
                               float depth_mm,
                               float slide_x_mm,
                               float slide_y_mm,
                               fingerpad_gradient *gradient);

// The least depth and normal force at which a pad on a body in a pose holds a load, as `fingerpad_least_grip`; after a press and a slide to the
// load. Tissue that relaxes has relaxed then: the grip holds the load for good. Takes many steps at each of 13 depths.
//
// Returns FINGERPAD_OK, or FINGERPAD_RANGE for a body that cannot be, FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP.
int32_t fingerpad_pad_least_grip(const fingerpad_pad *pad,
                                 fingerpad_body body,
                                 float pitch_deg,
                                 float roll_deg,
                                 float load_x_n,
                                 float load_y_n,
                                 float margin,
                                 float strength_factor,
                                 fingerpad_grip *grip);

// Writes the load of each patch after the last step, on the body of that step, to an array of `count` patches. The first
// `patches` of `fingerpad_pad_info` are written. Costs as much as a round of a step, and
// 2 to 4 kB more stack than one.
//
// Returns FINGERPAD_OK, or FINGERPAD_BUFFER if `count` is less than that number, FINGERPAD_RANGE for a body that cannot be,
// FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP; then nothing is written.
int32_t fingerpad_pad_patches(const fingerpad_pad *pad,
                              const fingerpad_pad_state *state,
                              fingerpad_body body,
                              fingerpad_patch *patches,
                              size_t count);

// Writes a state as `state_bytes` (`fingerpad_pad_info`) bytes with version, checksum of the pad and checksum of its own into a buffer of
// `length` bytes. The pad's checksum is computed each time, some 20 instructions a byte of the file.
//
// Returns FINGERPAD_OK, or FINGERPAD_BUFFER if `length` is too small; then nothing is written.
int32_t fingerpad_pad_state_save(const fingerpad_pad *pad,
                                 const fingerpad_pad_state *state,
                                 uint8_t *bytes,
                                 size_t length);

// Reads a state that `fingerpad_pad_state_save` wrote with the same pad's file and branches; `state` need not be set up, but of a pad
// that relaxes it must have been.
//
// Returns FINGERPAD_OK, or: FINGERPAD_NOT_SET_UP for the pad or such a state, FINGERPAD_LENGTH if `length` is not `state_bytes`, FINGERPAD_CHECKSUM if damaged,
// FINGERPAD_VERSION_UNKNOWN, FINGERPAD_OTHER_MODEL, FINGERPAD_RANGE for a value that no step leaves behind; then the state
// stays as it was.
int32_t fingerpad_pad_state_restore(const fingerpad_pad *pad,
                                    fingerpad_pad_state *state,
                                    const uint8_t *bytes,
                                    size_t length);

// A finger in the air, with a strength factor of 1.
int32_t fingerpad_relaxing_state_init(fingerpad_relaxing_state *state);

// As `fingerpad_state_set_strength_factor`.
int32_t fingerpad_relaxing_state_set_strength_factor(fingerpad_relaxing_state *state, float factor);

// As `fingerpad_state_save`, FINGERPAD_RELAXING_STATE_BYTES bytes.
int32_t fingerpad_relaxing_state_save(const fingerpad_model *model,
                                      const fingerpad_relaxing_state *state,
                                      uint8_t *bytes,
                                      size_t length);

// As `fingerpad_state_restore`, FINGERPAD_RELAXING_STATE_BYTES bytes of the same model file and branches.
int32_t fingerpad_relaxing_state_restore(const fingerpad_model *model,
                                         fingerpad_relaxing_state *state,
                                         const uint8_t *bytes,
                                         size_t length);

// As `fingerpad_step`. A step of no valid length is flagged and freezes the memory.
int32_t fingerpad_relaxing_step(const fingerpad_model *model,
                                fingerpad_relaxing_state *state,
                                fingerpad_motion motion,
                                fingerpad_response *response);

// As `fingerpad_step_driven`.
int32_t fingerpad_relaxing_step_driven(const fingerpad_model *model,
                                       fingerpad_relaxing_state *state,
                                       fingerpad_drive drive,
                                       fingerpad_response *response,
                                       fingerpad_motion *motion);

// As `fingerpad_state_gradient`: for another motion in the last step.
int32_t fingerpad_relaxing_state_gradient(const fingerpad_model *model,
                                          const fingerpad_relaxing_state *state,
                                          float depth_mm,
                                          float slide_x_mm,
                                          float slide_y_mm,
                                          fingerpad_gradient *gradient);

// The same whose contact will also spin.
int32_t fingerpad_relaxing_spin_state_init(fingerpad_relaxing_spin_state *state);

// As `fingerpad_state_set_strength_factor`.
int32_t fingerpad_relaxing_spin_state_set_strength_factor(fingerpad_relaxing_spin_state *state,
                                                          float factor);

// As `fingerpad_state_save`, FINGERPAD_RELAXING_SPIN_STATE_BYTES bytes.
int32_t fingerpad_relaxing_spin_state_save(const fingerpad_model *model,
                                           const fingerpad_relaxing_spin_state *state,
                                           uint8_t *bytes,
                                           size_t length);

// As `fingerpad_state_restore`, FINGERPAD_RELAXING_SPIN_STATE_BYTES bytes of the same model file and branches.
int32_t fingerpad_relaxing_spin_state_restore(const fingerpad_model *model,
                                              fingerpad_relaxing_spin_state *state,
                                              const uint8_t *bytes,
                                              size_t length);

// As `fingerpad_spin_step`. A step of no valid length is flagged and freezes the memory.
int32_t fingerpad_relaxing_spin_step(const fingerpad_model *model,
                                     fingerpad_relaxing_spin_state *state,
                                     fingerpad_motion motion,
                                     fingerpad_response *response);

// As `fingerpad_spin_step_driven`.
int32_t fingerpad_relaxing_spin_step_driven(const fingerpad_model *model,
                                            fingerpad_relaxing_spin_state *state,
                                            fingerpad_drive drive,
                                            fingerpad_response *response,
                                            fingerpad_motion *motion);

// As `fingerpad_spin_state_gradient`: for another motion in the last step.
int32_t fingerpad_relaxing_spin_state_gradient(const fingerpad_model *model,
                                               const fingerpad_relaxing_spin_state *state,
                                               float depth_mm,
                                               float slide_x_mm,
                                               float slide_y_mm,
                                               fingerpad_gradient *gradient);

// The gradient at a state for a motion that goes on in the direction (depth, slide x, slide y; any length). One-sided where
// the law has kinks: springs on their limit slip if the direction loads them further; with zeros all springs stick. 0 without
// contact, and 0 along depth beyond the tables. NaN in the direction counts as 0.
int32_t fingerpad_state_gradient(const fingerpad_model *model,
                                 const fingerpad_state *state,
                                 float depth_mm,
                                 float slide_x_mm,
                                 float slide_y_mm,
                                 fingerpad_gradient *gradient);

// As `fingerpad_state_gradient`, at a fixed angle.
int32_t fingerpad_spin_state_gradient(const fingerpad_model *model,
                                      const fingerpad_spin_state *state,
                                      float depth_mm,
                                      float slide_x_mm,
                                      float slide_y_mm,
                                      fingerpad_gradient *gradient);

// The least depth and normal force at which friction of the load, N, leaves the slip margin `margin` (0 to 0.95), even if the
// finger holds less than the model says by the half-width of its 95 % band; `strength_factor` as in
// `fingerpad_state_set_strength_factor`. Tissue that relaxes has relaxed then: the grip holds the load for good.
int32_t fingerpad_least_grip(const fingerpad_model *model,
                             float load_x_n,
                             float load_y_n,
                             float margin,
                             float strength_factor,
                             fingerpad_grip *grip);

// A finger in the air whose contact will also spin.
int32_t fingerpad_spin_state_init(fingerpad_spin_state *state);

// As `fingerpad_state_set_strength_factor`.
int32_t fingerpad_spin_state_set_strength_factor(fingerpad_spin_state *state, float factor);

// As `fingerpad_state_save`, FINGERPAD_SPIN_STATE_BYTES bytes.
int32_t fingerpad_spin_state_save(const fingerpad_model *model,
                                  const fingerpad_spin_state *state,
                                  uint8_t *bytes,
                                  size_t length);

// As `fingerpad_state_restore`, FINGERPAD_SPIN_STATE_BYTES bytes.
int32_t fingerpad_spin_state_restore(const fingerpad_model *model,
                                     fingerpad_spin_state *state,
                                     const uint8_t *bytes,
                                     size_t length);

// As `fingerpad_step`, with spin; takes about twice as long.
int32_t fingerpad_spin_step(const fingerpad_model *model,
                            fingerpad_spin_state *state,
                            fingerpad_motion motion,
                            fingerpad_response *response);

// As `fingerpad_step_driven`, with spin, which is prescribed as an angle.
int32_t fingerpad_spin_step_driven(const fingerpad_model *model,
                                   fingerpad_spin_state *state,
                                   fingerpad_drive drive,
                                   fingerpad_response *response,
                                   fingerpad_motion *motion);

// A finger in the air, with a strength factor of 1.
int32_t fingerpad_state_init(fingerpad_state *state);

// Sets the factor on all strengths, 0.1 to 5, from the next step on: what moisture, speed, dwell or another finger make of
// the friction. Returns FINGERPAD_OK, or FINGERPAD_RANGE; then the factor stays.
int32_t fingerpad_state_set_strength_factor(fingerpad_state *state,
                                            float factor);

// Writes a state as FINGERPAD_STATE_BYTES bytes with version, checksum of the model and checksum of its own into a buffer of
// `length` bytes. The model's checksum is computed each time, some 20 instructions a byte of the file.
//
// Returns FINGERPAD_OK, or FINGERPAD_BUFFER if `length` is too small; then nothing is written.
int32_t fingerpad_state_save(const fingerpad_model *model,
                             const fingerpad_state *state,
                             uint8_t *bytes,
                             size_t length);

// Reads a state that `fingerpad_state_save` wrote with the same model file; `state` need not be set up.
//
// Returns FINGERPAD_OK, or: FINGERPAD_LENGTH if `length` is not FINGERPAD_STATE_BYTES, FINGERPAD_CHECKSUM if damaged,
// FINGERPAD_VERSION_UNKNOWN, FINGERPAD_OTHER_MODEL, FINGERPAD_RANGE for a value that no step leaves behind; then the state
// stays as it was.
int32_t fingerpad_state_restore(const fingerpad_model *model,
                                fingerpad_state *state,
                                const uint8_t *bytes,
                                size_t length);

// Advances a contact by one step. A motion of any bits is accepted; `status` of the response reports its errors.
//
// Returns FINGERPAD_OK, or FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP; then nothing changes.
int32_t fingerpad_step(const fingerpad_model *model,
                       fingerpad_state *state,
                       fingerpad_motion motion,
                       fingerpad_response *response);

// First slip below 0.99 for eight looks or below 0.95 at once, full slip at 0.03, restick above 0.3 and above 0.995, each for
// eight looks; touch and lift-off after two looks.
int32_t fingerpad_watch_settings_default(fingerpad_watch_settings *settings);

// A watch for one finger, which starts in the air. Returns FINGERPAD_OK, or FINGERPAD_RANGE for a threshold that is not a
// number from 0 to 1.
int32_t fingerpad_watch_init(fingerpad_watch *watch,
                             uint8_t finger,
                             fingerpad_watch_settings settings);

// Looks at one step's response and writes what changed into `events`, room for FINGERPAD_EVENTS_A_LOOK of them, and their
// number into `count`: mostly 0.
//
// Returns FINGERPAD_OK, or FINGERPAD_RANGE for a response whose regime is none, FINGERPAD_NULL, FINGERPAD_ALIGNMENT or
// FINGERPAD_NOT_SET_UP; then nothing changes.
int32_t fingerpad_watch_look(fingerpad_watch *watch,
                             const fingerpad_response *response,
                             fingerpad_event *events,
                             uint32_t *count);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* FINGERPAD_H */
