#include "contact.h"

#include <math.h>
#include <string.h>

static const mjtNum DEGREES = 180 / mjPI;
static const mjtNum MM_PER_M = 1000;
/* The largest stable time step that is reported where contacts set no limit, s. */
static const mjtNum NO_LIMIT_S = 1;

/* A pad of up to so many patches has states of so many words; one of more fills the whole of a state. */
enum { FEW_PATCHES = 37, FEW_WORDS = 326 };

/* ---- memory ---- */

static int words_of(const settings* s) {
  if (!s->is_pad) return (int)(sizeof(fingerpad_spin_state) / sizeof(uint32_t));
  return s->pad_info.patches <= FEW_PATCHES ? FEW_WORDS : (int)(sizeof(fingerpad_pad_state) / sizeof(uint32_t));
}

int memory_numbers(const settings* s) { return NUMBERS_BESIDE + words_of(s); }

static int set_strength(memory* past, const settings* s, float strength_factor) {
  return s->is_pad ? fingerpad_pad_state_set_strength_factor(&past->model.pad, strength_factor)
                   : fingerpad_spin_state_set_strength_factor(&past->model.bed, strength_factor);
}

void memory_clear(memory* past, const settings* s, float strength_factor) {
  memset(past, 0, sizeof(*past));
  if (s->is_pad) {
    fingerpad_pad_state_init(&s->pad, &past->model.pad);
  } else {
    fingerpad_spin_state_init(&past->model.bed);
  }
  set_strength(past, s, strength_factor);
}

/* A word of the model's memory is a number of the plugin's state: whole numbers of 32 bits are exact in a double. */
static uint32_t word_of(mjtNum number) { return number >= 0 && number <= UINT32_MAX ? (uint32_t)number : 0; }

/* Whether the local shape of a face, if it has one, has numbers that a contact may leave there. */
static int is_shape(const last_face* last) {
  const local_shape* shape = &last->local;
  mjtNum kind = shape->kind, across = mju_dot3(shape->axis, last->apex), none = mju_norm3(shape->axis) == 0;
  const mjtNum near = 1e-6, largest = 1e4;
  if (mju_norm((const mjtNum*)shape, LOCAL_NUMBERS) == 0) return 1;
  int has_axis = kind == FINGERPAD_BODY_CYLINDER || kind == FINGERPAD_BODY_EDGE;
  int has_radius = kind == FINGERPAD_BODY_PLANE ? shape->radius == 0 : shape->radius >= 1e-4 && shape->radius < 1e3;
  return has_radius && (has_axis || kind == FINGERPAD_BODY_PLANE || kind == FINGERPAD_BODY_SPHERE) &&
         fabs(mju_norm3(last->apex) - 1) < near && (has_axis ? fabs(mju_norm3(shape->axis) - 1) < near && fabs(across) < near : none) &&
         mju_norm3(shape->middle) < largest && shape->half > 0 && shape->thickness > 0;
}

void memory_read(memory* past, const settings* s, const mjtNum* numbers) {
  uint32_t* words = (uint32_t*)&past->model;
  int count = words_of(s);
  memset(past, 0, sizeof(*past));
  for (int i = 0; i < NUMBERS_BESIDE + count; i++) {
    if (!isfinite(numbers[i])) return;
  }
  for (int i = 0; i < count; i++) words[i] = word_of(numbers[NUMBERS_BESIDE + i]);
  past->last.face = (int)mju_clip(numbers[0], 0, EDGE_FACE);
  past->status = (int)mju_clip(numbers[1], 0, 65535);
  mju_copy(past->place, numbers + 2, 2);
  past->angle = numbers[4];
  mju_copy3(past->rest, numbers + 5);
  mju_copy3(past->last.apex, numbers + 8);
  past->last.touches = numbers[11] != 0;
  const mjtNum* stable = numbers + 12;
  past->stable = (known_stability){.step_s = stable[0], .calm_s = stable[1], .depth_mm = stable[2], .touching = stable[3]};
  mju_copy(past->stable.stiffness, stable + 4, TRIANGLE);
  mju_copy(past->by_constraints, stable + 4 + TRIANGLE, AXES);
  past->start = stable[4 + TRIANGLE + AXES];
  mju_copy((mjtNum*)&past->last.local, numbers + NUMBERS_BESIDE - LOCAL_NUMBERS, LOCAL_NUMBERS);
  if (!is_shape(&past->last)) past->last = (last_face){.face = NO_FACE};
}

void memory_write(const memory* past, const settings* s, mjtNum* numbers) {
  const uint32_t* words = (const uint32_t*)&past->model;
  int count = words_of(s);
  numbers[0] = past->last.face;
  numbers[1] = past->status;
  mju_copy(numbers + 2, past->place, 2);
  numbers[4] = past->angle;
  mju_copy3(numbers + 5, past->rest);
  mju_copy3(numbers + 8, past->last.apex);
  numbers[11] = past->last.touches;
  mjtNum* stable = numbers + 12;
  stable[0] = past->stable.step_s;
  stable[1] = past->stable.calm_s;
  stable[2] = past->stable.depth_mm;
  stable[3] = past->stable.touching;
  mju_copy(stable + 4, past->stable.stiffness, TRIANGLE);
  mju_copy(stable + 4 + TRIANGLE, past->by_constraints, AXES);
  stable[4 + TRIANGLE + AXES] = past->start;
  mju_copy(numbers + NUMBERS_BESIDE - LOCAL_NUMBERS, (const mjtNum*)&past->last.local, LOCAL_NUMBERS);
  for (int i = 0; i < count; i++) numbers[NUMBERS_BESIDE + i] = words[i];
}

/* ---- one step ---- */

/* Depth of the finger's lowest point below the face, mm. A pad has its lowest point in each pose from its fit; a bed's finger is round with
 * the radii of the settings and touches at the site when it lies flat. */
static mjtNum depth_mm(const settings* s, const placement* here) {
  if (s->is_pad) {
    mjtNum touch[3], normal[3] = {-sin(here->pitch), cos(here->pitch) * sin(here->roll), cos(here->pitch) * cos(here->roll)};
    first_touch(touch, s, here->pitch, here->roll);
    return -mju_dot3(normal, touch) - MM_PER_M * here->height;
  }
  mjtNum sinks = s->pad_radius_mm[0] * (1 - cos(here->pitch)) + s->pad_radius_mm[1] * (1 - cos(here->roll));
  return sinks - MM_PER_M * here->height;
}

/* Slide of the face seen from the finger, mm, and its spin, rad, from the last step to here, which becomes the last. A plane moves at
 * the foot; of a round face the apex moves. */
static void motion_of(memory* past, const placement* here, mjtNum motion[3]) {
  int is_plane = here->body.kind == FINGERPAD_BODY_PLANE;
  mjtNum turn = remainder(here->angle - past->angle, 2 * mjPI), along = is_plane ? past->angle + turn / 2 : here->angle;
  mjtNum u = here->foot[0] - (is_plane ? past->place[0] : past->start), v = here->foot[1] - (is_plane ? past->place[1] : 0);
  /* The face goes one way when the finger goes the other. */
  const mjtNum apex[2] = {-(u * cos(along) + v * sin(along)), -(v * cos(along) - u * sin(along))};
  for (int i = 0; i < 2; i++) motion[i] = MM_PER_M * (apex[i] - (is_plane ? 0 : past->place[i]));
  motion[2] = -turn;
  mju_copy(past->place, is_plane ? here->foot : apex, 2);
  past->angle = here->angle;
}

/* The motion in single precision. The rounding error is kept and added to the next step, so that errors do not accumulate. */
static void rounded(memory* past, const mjtNum motion[3], float single[3]) {
  for (int i = 0; i < 3; i++) {
    mjtNum whole = motion[i] + past->rest[i];
    single[i] = (float)whole;
    past->rest[i] = whole - single[i];
  }
}

/* Moves the model of the finger on; With a `depth` of NaN the model keeps its memory. */
static void model_step(
    memory* past, const settings* s, const placement* here, const float motion[3], float depth, mjtNum dt, fingerpad_response* r) {
  if (s->is_pad) {
    fingerpad_pad_motion all = {
        depth, motion[0], motion[1], motion[2], (float)(s->pad_info.neutral_pitch_deg + DEGREES * here->pitch),
        (float)(DEGREES * here->roll), (float)dt,
    };
    fingerpad_pad_step(&s->pad, &past->model.pad, here->body, all, r);
  } else {
    fingerpad_motion all = {depth, motion[0], motion[1], motion[2], (float)dt};
    fingerpad_spin_step(&s->bed, &past->model.bed, all, r);
  }
}

/* Begins a contact. The axes of a round body are those of its face, and it begins with its apex under the site; the first motion
 * brings it to where it is. On a flat face it does not matter where a contact begins. */
static void begin(memory* past, const settings* s, const placement* here, float strength_factor) {
  memory_clear(past, s, strength_factor);
  past->last.face = here->face;
  mju_copy3(past->last.apex, here->apex);
  past->last.local = here->local;
  if (here->body.kind == FINGERPAD_BODY_PLANE) {
    mju_copy(past->place, here->foot, 2);
    past->angle = here->angle;
  } else if (here->body.kind != FINGERPAD_BODY_SPHERE) {
    past->start = here->foot[0];
  }
}

/* Whether the contact, as a disk of its area about the centre of pressure, reaches beyond the edge of the face. */
static int is_beyond_edge(const placement* here, const settings* s, const fingerpad_response* r) {
  mjtNum cosine = cos(here->angle), sine = sin(here->angle), radius = sqrt(r->contact_area_mm2 / mjPI) / MM_PER_M;
  mjtNum x = r->pressure_centre_x_mm / MM_PER_M, y = r->pressure_centre_y_mm / MM_PER_M;
  const mjtNum at[2] = {here->foot[0] + x * cosine - y * sine, here->foot[1] + x * sine + y * cosine};
  return reaches_beyond(here, s, at, radius);
}

void report_stability(outcome* now, const settings* s, const known_stability* stable, mjtNum dt) {
  if (!(stable->step_s > 0 && stable->step_s < NO_LIMIT_S)) return;
  now->stable_step_s = stable->step_s;
  now->is_semi_implicit = !s->is_explicit && dt > stable->calm_s;
  if (dt > stable->step_s && !now->is_semi_implicit) now->status |= STATUS_STEP_TOO_LONG;
}

outcome contact_step(memory* past, const settings* s, const placement* here, int finite, float strength_factor, mjtNum dt) {
  static const float NOWHERE[3] = {0, 0, 0};
  outcome now = {.face = here->face, .stable_step_s = NO_LIMIT_S};
  int lost = set_strength(past, s, strength_factor) == FINGERPAD_NOT_SET_UP;
  if (lost) {
    /* The plugin's state was overwritten with numbers that no step leaves there. */
    memory_clear(past, s, strength_factor);
    now.status = FINGERPAD_STATUS_MEMORY_LOST;
  }
  if (!finite) {
    /* The model keeps its memory and flags it; no force acts on bodies whose place is unknown. */
    model_step(past, s, here, NOWHERE, NAN, dt, &now.model);
    now = (outcome){.face = NO_FACE, .status = now.model.status, .stable_step_s = NO_LIMIT_S};
    past->status = now.status;
    return now;
  }
  if (here->face == NO_FACE) {
    memory_clear(past, s, strength_factor);
    past->status = now.status;
    return now;
  }
  int goes_on = past->last.face == here->face && memcmp(past->last.apex, here->apex, sizeof(here->apex)) == 0;
  if (!goes_on) begin(past, s, here, strength_factor);
  mjtNum motion[3];
  float single[3];
  motion_of(past, here, motion);
  rounded(past, motion, single);
  now.depth_mm = (float)depth_mm(s, here);
  model_step(past, s, here, single, now.depth_mm, dt, &now.model);
  now.status |= now.model.status;
  /* Beyond the middle of a round body the finger closes around it; the pad has no such contact. */
  int is_round = here->body.kind == FINGERPAD_BODY_SPHERE || here->body.kind == FINGERPAD_BODY_CYLINDER;
  if (is_round && now.depth_mm > here->body.radius_mm) now.status |= FINGERPAD_STATUS_DEPTH_ABOVE_RANGE;
  past->last.touches = now.model.regime != FINGERPAD_NO_CONTACT;
  if (past->last.touches && is_beyond_edge(here, s, &now.model)) now.status |= STATUS_BEYOND_EDGE;
  /* In the air the apex of a round body and the shape of a mesh go along with the finger. */
  int goes_along = here->body.kind != FINGERPAD_BODY_PLANE || has_local(here->face, s, here->slot);
  if (now.model.regime == FINGERPAD_NO_CONTACT && goes_along) {
    memory_clear(past, s, strength_factor);
  }
  past->status = now.status;
  return now;
}

void outcome_write(const outcome* now, mjtNum numbers[OUTPUT_NUMBERS]) {
  const fingerpad_response* r = &now->model;
  mjtNum all[OUTPUT_NUMBERS] = {
      r->normal_force_n, r->friction_x_n,      r->friction_y_n,          r->spin_moment_n_mm,
      now->depth_mm,     r->stick_ratio,       r->slip_margin,           r->friction_limit_n,
      r->contact_area_mm2, r->pressure_centre_x_mm, r->pressure_centre_y_mm, r->regime,
      now->status,       now->face,            now->damping[0],          now->damping[1],
      now->damping[2],   now->damping[3],      now->stable_step_s,    now->is_semi_implicit,
  };
  mju_copy(numbers, all, OUTPUT_NUMBERS);
}
