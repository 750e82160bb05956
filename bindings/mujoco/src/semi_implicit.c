#include "semi_implicit.h"

#include <math.h>

#include "stability.h"

/* How far ahead the force along the stiffness is taken, over the time step. From 1/2 on no vibration of any frequency grows; at 1 this
 * holds also where a contact is up to twice as stiff as its stiffness says. */
static const mjtNum AHEAD = 1;
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

/* Row `i` of the Jacobian of MuJoCo's constraints: itself, or `room` filled with it. */
static const mjtNum* row_of(mjtNum* room, const mjModel* m, const mjData* d, int i) {
  if (!mj_isSparse(m)) return d->efc_J + (size_t)i * m->nv;
  mju_zero(room, m->nv);
  for (int k = d->efc_J_rowadr[i]; k < d->efc_J_rowadr[i] + d->efc_J_rownnz[i]; k++) room[d->efc_J_colind[k]] = d->efc_J[k];
  return room;
}

/* Adds the curvature of the cost of MuJoCo's constraints in the state of the last mj_constraintUpdate. */
static void add_constraints(mjtNum* system, const mjModel* m, mjData* d) {
  int nv = m->nv;
  mj_markStack(d);
  mjtNum *room = mj_stackAllocNum(d, (size_t)nv), *rows = mj_stackAllocNum(d, (size_t)(AXES * nv));
  for (int i = 0; i < d->nefc; i++) {
    if (d->efc_state[i] == mjCNSTRSTATE_QUADRATIC) {
      const mjtNum* row = row_of(room, m, d, i);
      for (int k = 0; k < nv; k++) {
        if (row[k] != 0) mju_addToScl(system + k * nv, row, d->efc_D[i] * row[k], nv);
      }
    } else if (d->efc_state[i] == mjCNSTRSTATE_CONE) {
      const mjContact* contact = d->contact + d->efc_id[i];
      mjtNum weight[SQUARE] = {0};
      mju_zero(rows, AXES * nv);
      for (int k = 0; k < contact->dim; k++) {
        mju_copy(rows + k * nv, row_of(room, m, d, i + k), nv);
        mju_copy(weight + AXES * k, contact->H + contact->dim * k, contact->dim);
      }
      add_in_joints(system, rows, weight, d, nv);
      i += contact->dim - 1;
    }
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

/* The cost that MuJoCo's solver minimises, with `system` in place of the mass matrix, and its gradient. */
static mjtNum cost_of(mjtNum* gradient, const mjtNum* system, const mjtNum* force, const mjtNum* a, const mjModel* m, mjData* d) {
  int nv = m->nv;
  mjtNum cost = 0;
  mj_markStack(d);
  mjtNum* off = mj_stackAllocNum(d, (size_t)d->nefc);
  mj_mulJacVec(m, d, off, a);
  mju_subFrom(off, d->efc_aref, d->nefc);
  mj_constraintUpdate(m, d, off, &cost, m->opt.cone == mjCONE_ELLIPTIC);
  mj_freeStack(d);
  mju_mulMatVec(gradient, system, a, nv, nv);
  cost += 0.5 * mju_dot(a, gradient, nv) - mju_dot(a, force, nv);
  mju_subFrom(gradient, force, nv);
  mju_subFrom(gradient, d->qfrc_constraint, nv);
  return cost;
}

/* The accelerations `a` that the forces and MuJoCo's own constraints will have together: the minimum of the cost, by Newton's method with steps
 * that are halved while they raise it. */
static void accelerate(mjtNum* a, const mjtNum* system, const mjtNum* force, const mjModel* m, mjData* d) {
  enum { ROUNDS = 20, HALVINGS = 12 };
  const mjtNum small = 1e-10;
  int nv = m->nv;
  mj_markStack(d);
  mjtNum *hessian = mj_stackAllocNum(d, (size_t)(nv * nv)), *gradient = mj_stackAllocNum(d, (size_t)(3 * nv));
  mjtNum *step = gradient + nv, *trial = step + nv;
  mju_copy(hessian, system, nv * nv);
  mju_cholFactor(hessian, nv, mjMINVAL);
  mju_cholSolve(a, hessian, force, nv);
  if (d->nefc) mj_referenceConstraint(m, d);
  for (int round = 0; d->nefc && round < ROUNDS; round++) {
    mjtNum cost = cost_of(gradient, system, force, a, m, d), share = -1;
    if (mju_norm(gradient, nv) <= small * mju_norm(force, nv)) break;
    mju_copy(hessian, system, nv * nv);
    add_constraints(hessian, m, d);
    mju_cholFactor(hessian, nv, mjMINVAL);
    mju_cholSolve(step, hessian, gradient, nv);
    for (int i = 0; i < HALVINGS; i++, share /= 2) {
      mju_addScl(trial, a, step, share, nv);
      if (cost_of(gradient, system, force, trial, m, d) <= cost) break;
    }
    mju_copy(a, trial, nv);
  }
  mj_freeStack(d);
}

/* The wrench at the velocity at the end of the step. A contact that would pull has none. Friction is at most what the normal force
 * at the end of the step allows; the excess is taken away at the centre of pressure. */
static void wrench_ahead(wrench* w, const coupled_contact* c, const mjtNum spring[SQUARE], const mjtNum after[AXES]) {
  const fingerpad_response* r = &c->now->felt.response;
  mjtNum more[AXES], before[AXES], all[AXES], moment[3];
  mjtNum *damping = c->now->damping;
  contact_wrench(w, c->now, c->s, &c->here, after + 3, after);
  wrench_numbers(before, w);
  mju_mulMatVec(more, spring, after, AXES, AXES);
  mju_sub(all, before, more, AXES);
  if (all[2] <= 0) {
    mju_zero(all, AXES);
  } else if (r->normal_force_n > 0) {
    /* On a round body the force across has pressure in it, and may be larger than the limit of friction. */
    mjtNum own = sqrt(r->friction_x_n * r->friction_x_n + r->friction_y_n * r->friction_y_n);
    mjtNum most = mju_max(own, r->friction_limit_n) * all[2] / r->normal_force_n, size = mju_norm(all, 2);
    const mjtNum z = c->here.touch[2] + c->now->felt.depth_mm / MM_PER_M;
    const mjtNum arm[3] = {r->pressure_centre_x_mm / MM_PER_M, r->pressure_centre_y_mm / MM_PER_M, z};
    mjtNum beyond[3] = {0, 0, 0};
    if (size > most) mju_scl(beyond, all, most / size - 1, 2);
    mju_cross(moment, arm, beyond);
    mju_addTo3(all, beyond);
    mju_addTo3(all + 3, moment);
  }
  mju_copy3(w->force, all);
  mju_copy3(w->moment, all + 3);
  mju_sub(more, all, before, AXES);
  mju_addTo3(damping, more);
  damping[3] += MM_PER_M * more[5];
}

/* With the forces  w(u') = w(0) − (C + AHEAD h K) u'  at the velocities  u' = u + h J a  of the contacts at the end of the step, the
 * accelerations a minimise MuJoCo's cost of
 *
 *   (M + sum J' (h C + AHEAD h² K) J) a = sum J' (w(0) − (C + AHEAD h K) u) + all other forces + forces of MuJoCo's constraints */
void apply_coupled(const mjModel* m, mjData* d, coupled_contact* contacts, int count) {
  int nv = m->nv;
  mjtNum h = m->opt.timestep;
  mj_markStack(d);
  mjtNum* system = mj_stackAllocNum(d, (size_t)(nv * nv));
  mjtNum* force = mj_stackAllocNum(d, (size_t)nv);
  mjtNum* ahead = mj_stackAllocNum(d, (size_t)nv);
  mjtNum* jacobians = mj_stackAllocNum(d, (size_t)(count * AXES * nv));
  mjtNum* springs = mj_stackAllocNum(d, (size_t)(count * SQUARE));
  mj_fullM(m, d, system);
  add_damping(system, m, d);
  other_forces(force, m, d);
  for (int i = 0; i < count; i++) {
    coupled_contact* c = contacts + i;
    mjtNum *jacobian = jacobians + i * AXES * nv, rest[AXES], both[SQUARE], before[AXES], lost[AXES];
    wrench w;
    relative_jacobian(jacobian, m, d, c->s->site, c->geom, &c->here);
    mju_mulMatVec(before, jacobian, d->qvel, AXES, nv);
    contact_wrench(&w, c->now, c->s, &c->here, STILL, STILL);
    wrench_numbers(rest, &w);
    weights_of(springs + i * SQUARE, both, c, rest, h);
    mju_mulMatVec(lost, both, before, AXES, AXES);
    mju_addToScl(rest, lost, -1 / h, AXES);
    for (int k = 0; k < AXES; k++) mju_addToScl(force, jacobian + k * nv, rest[k], nv);
    add_in_joints(system, jacobian, both, d, nv);
  }
  accelerate(ahead, system, force, m, d);
  mju_scl(ahead, ahead, h, nv);
  mju_addTo(ahead, d->qvel, nv);
  for (int i = 0; i < count; i++) {
    coupled_contact* c = contacts + i;
    mjtNum after[AXES];
    wrench w;
    mju_mulMatVec(after, jacobians + i * AXES * nv, ahead, AXES, nv);
    wrench_ahead(&w, c, springs + i * SQUARE, after);
    wrench_apply(&w, c->s, &c->here, m, d, c->geom);
  }
  mj_freeStack(d);
}
