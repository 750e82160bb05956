#include "stability.h"

#include <math.h>
#include <string.h>

/* A shift, m, and a turn, rad, that are small against the slip length and large against rounding. */
static const mjtNum SMALL_SHIFT = 5e-6, SMALL_TURN = 5e-4;
/* A speed, m/s, and a rate, rad/s, at which no damper is cut off. */
static const mjtNum SMALL_RATE = 1e-6;
/* A strength at which no part of the contact slips during the small motions, and a time step for them, s. */
static const float STICKS = 5;
static const mjtNum ANY_STEP_S = 1e-3;
/* Rounds of the power iteration, of the iterations for the step and for the share of the dampers. */
/* No shift, turn or velocity. */
static const mjtNum STILL[3] = {0, 0, 0};
enum { POWER_ROUNDS = 60, STEP_ROUNDS = 5, SHARE_ROUNDS = 6, AXES = 6 };
/* Largest  h² K + 2 h C  over the mass at which dampers are applied in full: a quarter of the limit of stability. Dampers beyond it
 * make an explicit step alternate from side to side. The least share of the dampers. */
static const mjtNum CALM = 2, LEAST_SHARE = 0.1;
/* Reported step over that of the linear contact: a pad was lost from 0.95 of it on. */
static const mjtNum MARGIN = 0.9;

/* ---- one contact ---- */

/* A wrench at `at` about the site at `here`, along the axes of `here`: six numbers. */
static void wrench_seen_from(mjtNum seen[AXES], const wrench* w, const placement* at, const mjtNum shift[3], const placement* here) {
  mjtNum force[3], moment[3], arm[3], carried[3];
  for (int i = 0; i < 3; i++) {
    force[i] = w->force[0] * at->along[i] + w->force[1] * at->across[i] + w->force[2] * at->normal[i];
    moment[i] = w->moment[0] * at->along[i] + w->moment[1] * at->across[i] + w->moment[2] * at->normal[i];
    arm[i] = shift[0] * here->along[i] + shift[1] * here->across[i] + shift[2] * here->normal[i];
  }
  mju_cross(carried, arm, force);
  mju_addTo3(moment, carried);
  const mjtNum* axes[3] = {here->along, here->across, here->normal};
  for (int i = 0; i < 3; i++) {
    seen[i] = mju_dot3(axes[i], force);
    seen[3 + i] = mju_dot3(axes[i], moment);
  }
}

/* Replaces a matrix by its symmetric part. */
static void symmetrise(mjtNum matrix[SQUARE]) {
  for (int i = 0; i < AXES; i++) {
    for (int k = 0; k < i; k++) {
      matrix[AXES * i + k] = matrix[AXES * k + i] = (matrix[AXES * i + k] + matrix[AXES * k + i]) / 2;
    }
  }
}

/* The damping of a contact in the state `now`, with the dampers of `s`, by small velocities; `rest` is the wrench without. */
static void damping_of(mjtNum damping[SQUARE], const settings* s, outcome now, const placement* here, const mjtNum rest[AXES]) {
  for (int k = 0; k < AXES; k++) {
    mjtNum speed[3] = {0, 0, 0}, rate[3] = {0, 0, 0}, moved[AXES];
    (k < 3 ? speed : rate)[k % 3] = SMALL_RATE;
    wrench w;
    contact_wrench(&w, &now, s, here, rate, speed);
    wrench_seen_from(moved, &w, here, STILL, here);
    for (int i = 0; i < AXES; i++) damping[AXES * i + k] = (rest[i] - moved[i]) / SMALL_RATE;
  }
  symmetrise(damping);
}

void linearise(linear_contact* linear, const settings* s, const mjModel* m, int geom, const placement* here) {
  *linear = (linear_contact){.site = s->site, .geom = geom, .here = *here};
  memory past = {.status = 0}, fresh;
  placement start, there;
  wrench w;
  mjtNum rest[AXES], moved[AXES];
  place_moved(&start, here, m, geom, STILL, STILL);
  memory_clear(&past, s, STICKS);
  outcome now = contact_step(&past, s, &start, 1, STICKS, ANY_STEP_S);
  contact_wrench(&w, &now, s, &start, STILL, STILL);
  wrench_seen_from(rest, &w, &start, STILL, &start);
  for (int k = 0; k < AXES; k++) {
    mjtNum shift[3] = {0, 0, 0}, turn[3] = {0, 0, 0}, step = k < 3 ? SMALL_SHIFT : SMALL_TURN;
    (k < 3 ? shift : turn)[k % 3] = step;
    place_moved(&there, here, m, geom, shift, turn);
    memcpy(&fresh, &past, sizeof(past));
    outcome then = contact_step(&fresh, s, &there, 1, STICKS, ANY_STEP_S);
    contact_wrench(&w, &then, s, &there, STILL, STILL);
    wrench_seen_from(moved, &w, &there, shift, &start);
    for (int i = 0; i < AXES; i++) linear->stiffness[AXES * i + k] = (rest[i] - moved[i]) / step;
  }
  symmetrise(linear->stiffness);
  settings normal = *s, slide = *s;
  normal.damping_slide = normal.damping_spin = slide.damping_normal = 0;
  damping_of(linear->normal_damping, &normal, now, &start, rest);
  damping_of(linear->slide_damping, &slide, now, &start, rest);
}

/* ---- all contacts ---- */

/* Adds J' W J to `sum`, of a contact: J its six relative velocities of the site against the geom's body. */
static void add_in_joints(mjtNum* sum, const mjtNum* jacobian, const mjtNum weight[SQUARE], mjtNum* product, int nv) {
  mju_mulMatMat(product, weight, jacobian, AXES, AXES, nv);
  for (int k = 0; k < AXES; k++) {
    for (int i = 0; i < nv; i++) {
      for (int j = 0; j < nv; j++) sum[i * nv + j] += jacobian[k * nv + i] * product[k * nv + j];
    }
  }
}

/* The six velocities of the finger's site against the geom's body, along the axes of the contact, by joint velocities. */
static void relative_jacobian(mjtNum* jacobian, mjtNum* work, const mjModel* m, const mjData* d, const linear_contact* c) {
  int nv = m->nv;
  mjtNum *finger = work, *body = work + AXES * nv;
  mj_jacSite(m, d, finger, finger + 3 * nv, c->site);
  mj_jac(m, d, body, body + 3 * nv, d->site_xpos + 3 * c->site, m->geom_bodyid[c->geom]);
  mju_subFrom(finger, body, AXES * nv);
  const mjtNum* axes[3] = {c->here.along, c->here.across, c->here.normal};
  for (int half = 0; half < 2; half++) {
    for (int k = 0; k < 3; k++) {
      mju_mulMatTVec(jacobian + (3 * half + k) * nv, finger + 3 * half * nv, axes[k], 3, nv);
    }
  }
}

/* Replaces S by L^-1 S L^-T, L the Cholesky factor of the mass matrix. */
static void over_mass(mjtNum* matrix, const mjtNum* factor, int nv) {
  for (int pass = 0; pass < 2; pass++) {
    /* Each column by forward substitution, then the same of the transpose. */
    for (int column = 0; column < nv; column++) {
      for (int i = 0; i < nv; i++) {
        mjtNum left = matrix[i * nv + column];
        for (int k = 0; k < i; k++) left -= factor[i * nv + k] * matrix[k * nv + column];
        matrix[i * nv + column] = left / factor[i * nv + i];
      }
    }
    mju_transpose(matrix, matrix, nv, nv);
  }
}

/* Stiffness and both dampings over the mass, and room for three vectors. */
typedef struct {
  const mjtNum *stiffness, *normal, *slide;
  mjtNum *x, *kx, *cx;
  int nv;
} oscillator;

/* kx and cx: K x and C x, with C = share C_normal + share C_slide. */
static void multiply(const oscillator* o, damping_shares shares) {
  int nv = o->nv;
  mjtNum* slide = o->kx;
  mju_mulMatVec(o->cx, o->normal, o->x, nv, nv);
  mju_mulMatVec(slide, o->slide, o->x, nv, nv);
  mju_scl(o->cx, o->cx, shares.normal, nv);
  mju_addToScl(o->cx, slide, shares.slide, nv);
  mju_mulMatVec(o->kx, o->stiffness, o->x, nv, nv);
}

/* Stiffness and damping, 1/s² and 1/s, in the direction of the largest eigenvalue of  h² K + 2 h C;  returns the eigenvalue. */
static mjtNum stiffest(mjtNum* k, mjtNum* c, const oscillator* o, mjtNum step, damping_shares shares) {
  for (int i = 0; i < POWER_ROUNDS; i++) {
    multiply(o, shares);
    mju_scl(o->x, o->kx, step * step, o->nv);
    mju_addToScl(o->x, o->cx, 2 * step, o->nv);
    mju_normalize(o->x, o->nv);
  }
  multiply(o, shares);
  *k = mju_max(0, mju_dot(o->x, o->kx, o->nv));
  *c = mju_max(0, mju_dot(o->x, o->cx, o->nv));
  return step * step * *k + 2 * step * *c;
}

/* The step at which that eigenvalue is 4: there an oscillation of two steps neither grows nor decays. */
static mjtNum step_of(const oscillator* o, damping_shares shares) {
  mjtNum step = 1, k, c;
  for (int round = 0; round < STEP_ROUNDS; round++) {
    stiffest(&k, &c, o, step, shares);
    mjtNum root = c + sqrt(c * c + 4 * k);
    if (!(root > 0)) return INFINITY;
    step = 4 / root;
  }
  return step;
}

/* Raises one of the shares from its least to the largest, up to 1, for which the eigenvalue is at most CALM. */
static void raise(mjtNum* share, const oscillator* o, mjtNum step, const damping_shares* shares) {
  mjtNum k, c, low = LEAST_SHARE, high = 1;
  *share = 1;
  if (stiffest(&k, &c, o, step, *shares) <= CALM) return;
  for (int round = 0; round < SHARE_ROUNDS; round++) {
    *share = (low + high) / 2;
    *(stiffest(&k, &c, o, step, *shares) <= CALM ? &low : &high) = *share;
  }
  *share = low;
}

/* The largest shares; the damper on the rate of depth comes first, since it keeps a finger from sinking in on impact. */
static damping_shares shares_of(const oscillator* o, mjtNum step) {
  damping_shares shares = {LEAST_SHARE, LEAST_SHARE};
  raise(&shares.normal, o, step, &shares);
  raise(&shares.slide, o, step, &shares);
  return shares;
}

stability stability_of(const mjModel* m, mjData* d, const linear_contact* contacts, int count) {
  static const damping_shares LEAST = {LEAST_SHARE, LEAST_SHARE};
  int nv = m->nv;
  if (count == 0 || nv == 0) return (stability){INFINITY, {1, 1}};
  mj_markStack(d);
  mjtNum* mass = mj_stackAllocNum(d, (size_t)(nv * nv));
  mjtNum* sums[3];
  for (int i = 0; i < 3; i++) {
    sums[i] = mj_stackAllocNum(d, (size_t)(nv * nv));
    mju_zero(sums[i], nv * nv);
  }
  mjtNum* jacobian = mj_stackAllocNum(d, (size_t)(AXES * nv));
  mjtNum* work = mj_stackAllocNum(d, (size_t)(2 * AXES * nv));
  for (int i = 0; i < count; i++) {
    relative_jacobian(jacobian, work, m, d, contacts + i);
    add_in_joints(sums[0], jacobian, contacts[i].stiffness, work, nv);
    add_in_joints(sums[1], jacobian, contacts[i].normal_damping, work, nv);
    add_in_joints(sums[2], jacobian, contacts[i].slide_damping, work, nv);
  }
  mj_fullM(m, d, mass);
  mju_cholFactor(mass, nv, mjMINVAL);
  for (int i = 0; i < 3; i++) over_mass(sums[i], mass, nv);
  oscillator o = {sums[0], sums[1], sums[2], work, work + nv, work + 2 * nv, nv};
  for (int i = 0; i < nv; i++) o.x[i] = 1 + 0.1 * ((7 * i) % 11);
  stability limits = {MARGIN * step_of(&o, LEAST), shares_of(&o, m->opt.timestep)};
  mj_freeStack(d);
  return limits;
}
