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
/* No shift, turn or velocity. */
static const mjtNum STILL[3] = {0, 0, 0};
/* Rounds of the power iteration, of the iterations for the step, and most sweeps of the rotations of a small matrix. */
enum { POWER_ROUNDS = 60, STEP_ROUNDS = 5, SWEEPS = 12 };
/* Largest  h² K + 2 h C  over the mass in a stable step, and in one in which the dampers calm every vibration: dampers beyond 2 make an
 * explicit step alternate from side to side, and within the tolerance of its equilibrium a pad is stiffer than K. */
static const mjtNum STABLE = 4, CALM = 1.5;
/* Length at which a turn counts as much as a shift, m. */
static const mjtNum ARM = 0.005;
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

void wrench_numbers(mjtNum numbers[AXES], const wrench* w) {
  mju_copy3(numbers, w->force);
  mju_copy3(numbers + 3, w->moment);
}

void damping_of(mjtNum damping[SQUARE], const settings* s, outcome now, const placement* here, const mjtNum rest[AXES]) {
  for (int k = 0; k < AXES; k++) {
    mjtNum speed[3] = {0, 0, 0}, rate[3] = {0, 0, 0}, moved[AXES];
    (k < 3 ? speed : rate)[k % 3] = SMALL_RATE;
    wrench w;
    contact_wrench(&w, &now, s, here, rate, speed);
    wrench_numbers(moved, &w);
    for (int i = 0; i < AXES; i++) damping[AXES * i + k] = (rest[i] - moved[i]) / SMALL_RATE;
  }
  symmetrise(damping);
}

void linearise(linear_contact* linear, const memory* past, const settings* s, int slot, const placement* here) {
  memory start, moved;
  placement there = *here;
  wrench w;
  mjtNum rest[AXES], then[AXES];
  memcpy(&start, past, sizeof(start));
  outcome now = contact_step(&start, &there, s, slot, STICKS, ANY_STEP_S), other;
  *linear = (linear_contact){.site = s->site, .geom = s->geoms[slot], .here = there};
  if (s->relaxes) {
    /* Forces of equal age are compared. */
    memcpy(&moved, &start, sizeof(start));
    now = contact_step(&moved, &there, s, slot, STICKS, ANY_STEP_S);
  }
  contact_wrench(&w, &now, s, &linear->here, STILL, STILL);
  wrench_numbers(rest, &w);
  for (int k = 0; k < AXES; k++) {
    mjtNum shift[3] = {0, 0, 0}, turn[3] = {0, 0, 0}, step = k < 3 ? SMALL_SHIFT : SMALL_TURN;
    (k < 3 ? shift : turn)[k % 3] = step;
    place_moved(&there, &linear->here, shift, turn);
    memcpy(&moved, &start, sizeof(start));
    other = contact_step(&moved, &there, s, slot, STICKS, ANY_STEP_S);
    contact_wrench(&w, &other, s, &there, STILL, STILL);
    wrench_seen_from(then, &w, &there, shift, &linear->here);
    for (int i = 0; i < AXES; i++) linear->stiffness[AXES * i + k] = (rest[i] - then[i]) / step;
  }
  symmetrise(linear->stiffness);
  damping_of(linear->damping, s, now, &linear->here, rest);
}

/* One rotation of the method of Jacobi: brings the entry p, q of a symmetric matrix to 0, and turns the columns of `axes`. */
static void rotate(mjtNum matrix[SQUARE], mjtNum axes[SQUARE], int p, int q) {
  mjtNum off = matrix[AXES * p + q];
  if (off == 0) return;
  mjtNum half = (matrix[AXES * q + q] - matrix[AXES * p + p]) / (2 * off);
  mjtNum tangent = (half < 0 ? -1 : 1) / (fabs(half) + sqrt(half * half + 1)), cosine = 1 / sqrt(tangent * tangent + 1);
  mjtNum sine = tangent * cosine;
  for (int k = 0; k < AXES; k++) {
    mjtNum a = matrix[AXES * k + p], b = matrix[AXES * k + q];
    matrix[AXES * k + p] = cosine * a - sine * b;
    matrix[AXES * k + q] = sine * a + cosine * b;
  }
  for (int k = 0; k < AXES; k++) {
    mjtNum a = matrix[AXES * p + k], b = matrix[AXES * q + k];
    matrix[AXES * p + k] = cosine * a - sine * b;
    matrix[AXES * q + k] = sine * a + cosine * b;
    a = axes[AXES * k + p];
    b = axes[AXES * k + q];
    axes[AXES * k + p] = cosine * a - sine * b;
    axes[AXES * k + q] = sine * a + cosine * b;
  }
}

/* Length of an axis: turns are multiplied by the arm. */
static mjtNum length_of(int axis) { return axis < 3 ? 1 : ARM; }

void positive_part(mjtNum triangle[TRIANGLE], const mjtNum matrix[SQUARE]) {
  mjtNum scaled[SQUARE], axes[SQUARE] = {0};
  for (int i = 0; i < AXES; i++) {
    axes[AXES * i + i] = 1;
    for (int k = 0; k < AXES; k++) scaled[AXES * i + k] = matrix[AXES * i + k] / (length_of(i) * length_of(k));
  }
  for (int sweep = 0; sweep < SWEEPS; sweep++) {
    for (int p = 0; p < AXES; p++) {
      for (int q = p + 1; q < AXES; q++) rotate(scaled, axes, p, q);
    }
  }
  for (int i = 0, at = 0; i < AXES; i++) {
    for (int k = 0; k <= i; k++, at++) {
      triangle[at] = 0;
      for (int e = 0; e < AXES; e++) {
        triangle[at] += mju_max(0, scaled[AXES * e + e]) * axes[AXES * i + e] * axes[AXES * k + e];
      }
      triangle[at] *= length_of(i) * length_of(k);
    }
  }
}

/* ---- all contacts ---- */

void add_in_joints(mjtNum* sum, const mjtNum* jacobian, const mjtNum weight[SQUARE], mjData* d, int nv) {
  mj_markStack(d);
  mjtNum* product = mj_stackAllocNum(d, (size_t)(AXES * nv));
  mju_mulMatMat(product, weight, jacobian, AXES, AXES, nv);
  for (int k = 0; k < AXES; k++) {
    for (int i = 0; i < nv; i++) {
      mjtNum by = jacobian[k * nv + i];
      if (by != 0) mju_addToScl(sum + i * nv, product + k * nv, by, nv);
    }
  }
  mj_freeStack(d);
}

void relative_jacobian(mjtNum* jacobian, const mjModel* m, mjData* d, int site, int geom, const placement* here) {
  int nv = m->nv;
  mj_markStack(d);
  mjtNum *finger = mj_stackAllocNum(d, (size_t)(2 * AXES * nv)), *body = finger + AXES * nv;
  mj_jacSite(m, d, finger, finger + 3 * nv, site);
  mj_jac(m, d, body, body + 3 * nv, d->site_xpos + 3 * site, m->geom_bodyid[geom]);
  mju_subFrom(finger, body, AXES * nv);
  const mjtNum* axes[3] = {here->along, here->across, here->normal};
  for (int half = 0; half < 2; half++) {
    for (int k = 0; k < 3; k++) {
      mju_mulMatTVec(jacobian + (3 * half + k) * nv, finger + 3 * half * nv, axes[k], 3, nv);
    }
  }
  mj_freeStack(d);
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
    for (int i = 0; i < nv; i++) {
      for (int k = 0; k < i; k++) {
        mjtNum other = matrix[i * nv + k];
        matrix[i * nv + k] = matrix[k * nv + i];
        matrix[k * nv + i] = other;
      }
    }
  }
}

/* Stiffness and damping over the mass, and room for three vectors. */
typedef struct {
  const mjtNum *stiffness, *damping;
  mjtNum *x, *kx, *cx;
  int nv;
} oscillator;

static void multiply(const oscillator* o) {
  mju_mulMatVec(o->cx, o->damping, o->x, o->nv, o->nv);
  mju_mulMatVec(o->kx, o->stiffness, o->x, o->nv, o->nv);
}

/* Stiffness and damping, 1/s² and 1/s, in the direction of the largest eigenvalue of  h² K + 2 h C. */
static void stiffest(mjtNum* k, mjtNum* c, const oscillator* o, mjtNum step) {
  for (int i = 0; i < POWER_ROUNDS; i++) {
    multiply(o);
    mju_scl(o->x, o->kx, step * step, o->nv);
    mju_addToScl(o->x, o->cx, 2 * step, o->nv);
    mju_normalize(o->x, o->nv);
  }
  multiply(o);
  *k = mju_max(0, mju_dot(o->x, o->kx, o->nv));
  *c = mju_max(0, mju_dot(o->x, o->cx, o->nv));
}

/* The step at which that eigenvalue meets a limit. At STABLE an oscillation of two steps neither grows nor decays. */
static mjtNum step_of(const oscillator* o, mjtNum limit) {
  mjtNum step = 1, k, c;
  for (int round = 0; round < STEP_ROUNDS; round++) {
    stiffest(&k, &c, o, step);
    mjtNum root = c + sqrt(c * c + limit * k);
    if (!(root > 0)) return INFINITY;
    step = limit / root;
  }
  return step;
}

stability stability_of(const mjModel* m, mjData* d, const linear_contact* contacts, int count) {
  int nv = m->nv;
  if (count == 0 || nv == 0) return (stability){INFINITY, INFINITY};
  mj_markStack(d);
  mjtNum* mass = mj_stackAllocNum(d, (size_t)(nv * nv));
  mjtNum* sums[2];
  for (int i = 0; i < 2; i++) {
    sums[i] = mj_stackAllocNum(d, (size_t)(nv * nv));
    mju_zero(sums[i], nv * nv);
  }
  mjtNum* jacobian = mj_stackAllocNum(d, (size_t)(AXES * nv));
  mjtNum* work = mj_stackAllocNum(d, (size_t)(3 * nv));
  for (int i = 0; i < count; i++) {
    relative_jacobian(jacobian, m, d, contacts[i].site, contacts[i].geom, &contacts[i].here);
    add_in_joints(sums[0], jacobian, contacts[i].stiffness, d, nv);
    add_in_joints(sums[1], jacobian, contacts[i].damping, d, nv);
  }
  mj_fullM(m, d, mass);
  mju_cholFactor(mass, nv, mjMINVAL);
  for (int i = 0; i < 2; i++) over_mass(sums[i], mass, nv);
  oscillator o = {sums[0], sums[1], work, work + nv, work + 2 * nv, nv};
  for (int i = 0; i < nv; i++) o.x[i] = 1 + 0.1 * ((7 * i) % 11);
  stability limits = {MARGIN * step_of(&o, STABLE), step_of(&o, CALM)};
  mj_freeStack(d);
  return limits;
}
