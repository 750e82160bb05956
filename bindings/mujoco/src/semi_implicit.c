#include "semi_implicit.h"

#include <math.h>

#include "stability.h"

/* How far ahead the force along the stiffness is taken, over the time step. From 1/2 on no vibration of any frequency grows; at 1 this
 * holds also where a contact is up to twice as stiff as its stiffness says. */
static const mjtNum AHEAD = 1;
/* Speed at which a contact of MuJoCo's own slides, m/s. */
static const mjtNum SLIDES = 1e-3;
static const mjtNum STILL[3] = {0, 0, 0};
static const mjtNum MM_PER_M = 1000;

/* The stiffness of a bed. Friction that slips has none; of one that slips in part the share of the area that sticks counts. */
static void bed_stiffness(mjtNum stiffness[SQUARE], const coupled_contact* c) {
  mjtNum root = sqrt(mju_max(0, c->now->felt.response.stick_ratio));
  const mjtNum held[AXES] = {root, root, 1, 1, 1, root};
  for (int i = 0, at = 0; i < AXES; i++) {
    for (int k = 0; k <= i; k++, at++) {
      stiffness[AXES * i + k] = stiffness[AXES * k + i] = held[i] * held[k] * c->stiffness[at];
    }
  }
}

/* The stiffness of the patches of a pad that touch, with the bulk as it is, taken as a disk of springs about the centre of pressure. It
 * is larger than that of the pad, and it is the one that a small vibration meets: the bulk follows only beyond the tolerance of its
 * equilibrium. */
static void pad_stiffness(mjtNum stiffness[SQUARE], const coupled_contact* c) {
  const fingerpad_response* r = &c->now->felt.response;
  mjtNum normal = c->s->patch_stiffness * r->contact_area_mm2, across = normal * r->stick_ratio;
  /* Mean square of the places along one axis of a disk, m². */
  mjtNum square = r->contact_area_mm2 / (4 * mjPI * MM_PER_M * MM_PER_M);
  mjtNum x = r->pressure_centre_x_mm / MM_PER_M, y = r->pressure_centre_y_mm / MM_PER_M, z = c->here.touch[2] + c->now->felt.depth_mm / MM_PER_M;
  /* Rows: velocity of the centre by shifts and turns of the site. */
  const mjtNum rows[3][AXES] = {{1, 0, 0, 0, z, -y}, {0, 1, 0, -z, 0, x}, {0, 0, 1, y, -x, 0}};
  const mjtNum springs[3] = {across, across, normal};
  mju_zero(stiffness, SQUARE);
  for (int row = 0; row < 3; row++) {
    for (int i = 0; i < AXES; i++) mju_addToScl(stiffness + AXES * i, rows[row], springs[row] * rows[row][i], AXES);
  }
  stiffness[AXES * 3 + 3] += normal * square;
  stiffness[AXES * 4 + 4] += normal * square;
  stiffness[AXES * 5 + 5] += 2 * across * square;
}

/* What the velocity at the end of a step takes from the force, times the time step: h C + AHEAD h² K; and AHEAD h K. */
static void weights_of(mjtNum spring[SQUARE], mjtNum both[SQUARE], const coupled_contact* c, const mjtNum rest[AXES], mjtNum h) {
  (c->s->is_pad ? pad_stiffness : bed_stiffness)(spring, c);
  mju_scl(spring, spring, AHEAD * h, SQUARE);
  damping_of(both, c->s, *c->now, &c->here, rest);
  for (int i = 0; i < SQUARE; i++) both[i] = h * (both[i] + spring[i]);
}

/* Adds D times the square of a row of the constraints. */
static void add_row(mjtNum* mass, const mjtNum* row, mjtNum weight, int nv) {
  for (int k = 0; k < nv; k++) {
    if (row[k] != 0) mju_addToScl(mass + k * nv, row, weight * row[k], nv);
  }
}

/* Row `i` of the constraints. */
static void row_of(mjtNum* row, mjtNum* unit, const mjModel* m, const mjData* d, int i) {
  unit[i] = 1;
  mj_mulJacTVec(m, d, row, unit);
  unit[i] = 0;
}

/* What a contact of MuJoCo's own that slides at more than SLIDES adds: its normal direction alone. Returns 0 if it does not slide. */
static int add_sliding(mjtNum* mass, mjtNum* rows, mjtNum* unit, const mjModel* m, const mjData* d, const mjContact* contact) {
  int nv = m->nv, first = contact->efc_address, elliptic = m->opt.cone == mjCONE_ELLIPTIC;
  if (first < 0 || contact->dim < 3) return 0;
  mjtNum square = 0, weight = 0, *normal = rows + 2 * nv;
  mju_zero(normal, nv);
  for (int k = 0; k < 2; k++) {
    mjtNum* row = rows;
    if (elliptic) {
      row_of(row, unit, m, d, first + 1 + k);
    } else {
      mjtNum* opposite = rows + nv;
      row_of(row, unit, m, d, first + 2 * k);
      row_of(opposite, unit, m, d, first + 2 * k + 1);
      mju_addToScl(normal, row, 0.25, nv);
      mju_addToScl(normal, opposite, 0.25, nv);
      mju_subFrom(row, opposite, nv);
      mju_scl(row, row, 1 / (2 * mju_max(mjMINVAL, contact->friction[k])), nv);
    }
    mjtNum speed = mju_dot(row, d->qvel, nv);
    square += speed * speed;
  }
  if (square < SLIDES * SLIDES) return 0;
  if (elliptic) {
    row_of(normal, unit, m, d, first);
    weight = d->efc_D[first];
  } else {
    for (int i = 0; i < 2 * (contact->dim - 1); i++) weight += d->efc_D[first + i];
  }
  add_row(mass, normal, weight, nv);
  return 1;
}

/* The mass matrix with MuJoCo's own constraints, as if all of the present ones were active but for friction of contacts that slide: it
 * decides how far a force of a fingertip accelerates the bodies. */
static void add_constraints(mjtNum* mass, const mjModel* m, mjData* d) {
  int nv = m->nv;
  if (d->nefc == 0) return;
  mj_markStack(d);
  mjtNum *rows = mj_stackAllocNum(d, (size_t)(3 * nv)), *unit = mj_stackAllocNum(d, (size_t)d->nefc);
  mju_zero(unit, d->nefc);
  for (int i = 0; i < d->nefc; i++) {
    int is_contact = d->efc_type[i] >= mjCNSTR_CONTACT_FRICTIONLESS;
    const mjContact* contact = is_contact ? d->contact + d->efc_id[i] : NULL;
    if (contact && i == contact->efc_address && add_sliding(mass, rows, unit, m, d, contact)) {
      while (i + 1 < d->nefc && d->efc_type[i + 1] == d->efc_type[i] && d->efc_id[i + 1] == d->efc_id[i]) i++;
      continue;
    }
    row_of(rows, unit, m, d, i);
    add_row(mass, rows, d->efc_D[i], nv);
  }
  mj_freeStack(d);
}

/* The damping of joints and of actuators, where the integrator treats it implicitly. */
static void add_damping(mjtNum* mass, const mjModel* m, mjData* d) {
  int nv = m->nv, euler = m->opt.integrator == mjINT_EULER, implicit = m->opt.integrator == mjINT_IMPLICIT || m->opt.integrator == mjINT_IMPLICITFAST;
  mjtNum h = m->opt.timestep;
  int joints = !(m->opt.disableflags & mjDSBL_DAMPER) && (implicit || (euler && !(m->opt.disableflags & mjDSBL_EULERDAMP)));
  for (int i = 0; joints && i < nv; i++) mass[i * nv + i] += h * m->dof_damping[i];
  if (!implicit || (m->opt.disableflags & mjDSBL_ACTUATION)) return;
  for (int i = 0; i < m->nu; i++) {
    if (m->actuator_biastype[i] != mjBIAS_AFFINE) continue;
    mjtNum damping = mju_max(0, -m->actuator_biasprm[mjNBIAS * i + 2]);
    const int* columns = d->moment_colind + d->moment_rowadr[i];
    const mjtNum* moment = d->actuator_moment + d->moment_rowadr[i];
    for (int k = 0; k < d->moment_rownnz[i]; k++) {
      for (int j = 0; j < d->moment_rownnz[i]; j++) mass[columns[k] * nv + columns[j]] += h * damping * moment[k] * moment[j];
    }
  }
}

/* All forces but those of the constraints and of the contacts that are to be found, which MuJoCo itself computes after the passive ones. */
static void other_forces(mjtNum* force, const mjModel* m, mjData* d) {
  mj_markStack(d);
  mjtNum* bias = mj_stackAllocNum(d, (size_t)m->nv);
  mj_rne(m, d, 0, bias);
  mj_fwdActuation(m, d);
  for (int i = 0; i < m->nv; i++) force[i] = d->qfrc_passive[i] + d->qfrc_applied[i] + d->qfrc_actuator[i] - bias[i];
  for (int i = 1; i < m->nbody; i++) {
    const mjtNum* applied = d->xfrc_applied + 6 * i;
    if (mju_norm(applied, 6) > 0) mj_applyFT(m, d, applied, applied + 3, d->xipos + 3 * i, i, force);
  }
  mj_freeStack(d);
}

/* The wrench at the velocity at the end of the step, which never pulls. */
static void wrench_ahead(wrench* w, const coupled_contact* c, const mjtNum spring[SQUARE], const mjtNum after[AXES]) {
  mjtNum more[AXES];
  contact_wrench(w, c->now, c->s, &c->here, after + 3, after);
  mju_mulMatVec(more, spring, after, AXES, AXES);
  mju_scl(more, more, -1, AXES);
  more[2] = mju_max(more[2], -w->force[2]);
  mju_addTo3(w->force, more);
  mju_addTo3(w->moment, more + 3);
  mju_addTo3(c->now->damping, more);
  c->now->damping[3] += MM_PER_M * more[5];
}

void velocity_against(mjtNum velocity[AXES], const mjModel* m, mjData* d, int site, int geom, const placement* here) {
  mj_markStack(d);
  mjtNum* jacobian = mj_stackAllocNum(d, (size_t)(AXES * m->nv));
  relative_jacobian(jacobian, m, d, site, geom, here);
  mju_mulMatVec(velocity, jacobian, d->qvel, AXES, m->nv);
  mj_freeStack(d);
}

/* With the accelerations b of the contacts without these forces, the velocities u and the forces  w(u') = w(0) − (C + AHEAD h K) u'  at
 * the velocities  u' = u + h (b + J y):
 *
 *   (M + sum J' (h C + AHEAD h² K) J) y = sum J' (w(0) − (h C + AHEAD h² K) (u / h + b)),     y = M^-1 sum J' w(u') */
void apply_coupled(const mjModel* m, mjData* d, coupled_contact* contacts, int count) {
  int nv = m->nv;
  mjtNum h = m->opt.timestep;
  mj_markStack(d);
  mjtNum* mass = mj_stackAllocNum(d, (size_t)(nv * nv));
  mjtNum* system = mj_stackAllocNum(d, (size_t)(nv * nv));
  mjtNum* others = mj_stackAllocNum(d, (size_t)nv);
  mjtNum* force = mj_stackAllocNum(d, (size_t)nv);
  mjtNum* gain = mj_stackAllocNum(d, (size_t)nv);
  mjtNum* jacobians = mj_stackAllocNum(d, (size_t)(count * AXES * nv));
  mjtNum* springs = mj_stackAllocNum(d, (size_t)(count * SQUARE));
  mj_fullM(m, d, mass);
  add_damping(mass, m, d);
  add_constraints(mass, m, d);
  mju_copy(system, mass, nv * nv);
  mju_cholFactor(mass, nv, mjMINVAL);
  other_forces(others, m, d);
  mju_cholSolve(gain, mass, others, nv);
  mju_zero(force, nv);
  for (int i = 0; i < count; i++) {
    coupled_contact* c = contacts + i;
    mjtNum *jacobian = jacobians + i * AXES * nv, rest[AXES], both[SQUARE], lost[AXES];
    wrench w;
    relative_jacobian(jacobian, m, d, c->s->site, c->geom, &c->here);
    mju_mulMatVec(c->before, jacobian, d->qvel, AXES, nv);
    mju_mulMatVec(c->ahead, jacobian, gain, AXES, nv);
    contact_wrench(&w, c->now, c->s, &c->here, STILL, STILL);
    wrench_numbers(rest, &w);
    weights_of(springs + i * SQUARE, both, c, rest, h);
    for (int k = 0; k < AXES; k++) c->ahead[k] = c->before[k] + h * (c->ahead[k] + c->by_constraints[k]);
    mju_mulMatVec(lost, both, c->ahead, AXES, AXES);
    mju_addToScl(rest, lost, -1 / h, AXES);
    for (int k = 0; k < AXES; k++) mju_addToScl(force, jacobian + k * nv, rest[k], nv);
    add_in_joints(system, jacobian, both, d, nv);
  }
  mju_cholFactor(system, nv, mjMINVAL);
  mju_cholSolve(gain, system, force, nv);
  for (int i = 0; i < count; i++) {
    coupled_contact* c = contacts + i;
    mjtNum *jacobian = jacobians + i * AXES * nv, after[AXES], numbers[AXES];
    wrench w;
    mju_mulMatVec(after, jacobian, gain, AXES, nv);
    for (int k = 0; k < AXES; k++) after[k] = c->ahead[k] + h * after[k];
    wrench_ahead(&w, c, springs + i * SQUARE, after);
    wrench_apply(&w, c->s, &c->here, m, d, c->geom);
    wrench_numbers(numbers, &w);
    for (int k = 0; k < AXES; k++) mju_addToScl(others, jacobian + k * nv, numbers[k], nv);
  }
  mju_cholSolve(gain, mass, others, nv);
  for (int i = 0; i < count; i++) {
    coupled_contact* c = contacts + i;
    mju_mulMatVec(c->ahead, jacobians + i * AXES * nv, gain, AXES, nv);
    for (int k = 0; k < AXES; k++) c->ahead[k] = c->before[k] + h * c->ahead[k];
  }
  mj_freeStack(d);
}
