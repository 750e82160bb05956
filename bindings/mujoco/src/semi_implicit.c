#include "semi_implicit.h"

#include <math.h>

#include "stability.h"

/* How far ahead the force along the stiffness is taken, over the time step. From 1/2 on no vibration of any frequency grows; at 1 this
 * holds also where a contact is up to twice as stiff as its stiffness says. */
static const mjtNum AHEAD = 1;
static const mjtNum STILL[3] = {0, 0, 0};
static const mjtNum MM_PER_M = 1000;

/* Where and how a contact carries force within a step. Friction and its moment about the centre of pressure are one force along three
 * directions: x, y, and a turn about the normal times the radius of gyration of the springs. It is in two parts, of the area that sticks and of
 * that which slips; each changes by its stiffness up to its limit. So friction that slips goes on as it is while the slip goes on, and takes
 * up the motion as one that sticks where the slip would turn round within the step. */
enum { ALONG = 3, NORMAL = 3, DIRECTIONS = 4, PARTS = 2 };

typedef struct {
  /* Its six velocities by the joints', and at the start of the step. */
  mjtNum *jacobian, before[AXES];
  /* Velocities along the directions by the six. */
  mjtNum rows[DIRECTIONS * AXES];
  /* Stiffness times the time step and damping, N s/m: of both parts, and along the normal. What else they are, of the six velocities. */
  mjtNum across[PARTS], normal, rest[SQUARE];
  /* Friction of both parts and its limits at the present normal force, N; that force; all six numbers of the wrench. */
  mjtNum friction[PARTS][ALONG], limit[PARTS], pressure, all[AXES];
  /* Normal force at the end of the step over the present one, by the last prediction. */
  mjtNum share;
} step_law;

/* The stiffness of a bed, all of which sticks. */
static void bed_stiffness(mjtNum stiffness[SQUARE], const coupled_contact* c) {
  for (int i = 0, at = 0; i < AXES; i++) {
    for (int k = 0; k <= i; k++, at++) stiffness[AXES * i + k] = stiffness[AXES * k + i] = c->stiffness[at];
  }
}

/* From the site to the centre of pressure, m along x, y and z of the contact. */
static void to_centre(mjtNum arm[3], const coupled_contact* c) {
  const fingerpad_response* r = &c->now->felt.response;
  arm[0] = r->pressure_centre_x_mm / MM_PER_M;
  arm[1] = r->pressure_centre_y_mm / MM_PER_M;
  arm[2] = c->here.touch[2] + c->now->felt.depth_mm / MM_PER_M;
}

/* The stiffness of the patches of a pad that touch, with the bulk as it is, taken as a disk of springs about the centre of pressure. It
 * is larger than that of the pad, and it is the one that a small vibration meets: the bulk follows only beyond the tolerance of its
 * equilibrium. */
static void pad_stiffness(mjtNum stiffness[SQUARE], const coupled_contact* c, const mjtNum arm[3]) {
  mjtNum area = c->now->felt.response.contact_area_mm2, spring = c->s->patch_stiffness * area;
  /* Mean square of the places along one axis of a disk, m². */
  mjtNum square = area / (4 * mjPI * MM_PER_M * MM_PER_M);
  mjtNum x = arm[0], y = arm[1], z = arm[2];
  /* Rows: velocity of the centre by shifts and turns of the site. */
  const mjtNum rows[3][AXES] = {{1, 0, 0, 0, z, -y}, {0, 1, 0, -z, 0, x}, {0, 0, 1, y, -x, 0}};
  mju_zero(stiffness, SQUARE);
  for (int row = 0; row < 3; row++) {
    for (int i = 0; i < AXES; i++) mju_addToScl(stiffness + AXES * i, rows[row], spring * rows[row][i], AXES);
  }
  stiffness[AXES * 3 + 3] += spring * square;
  stiffness[AXES * 4 + 4] += spring * square;
  stiffness[AXES * 5 + 5] += 2 * spring * square;
}

/* Splits stiffness and damping `whole` into the directions, along which motions of the centre of pressure meet them, and the rest. Returns
 * the radius of gyration, m. */
static mjtNum split(step_law* law, const mjtNum whole[SQUARE], const mjtNum arm[3]) {
  mjtNum by[DIRECTIONS * AXES], along[DIRECTIONS * DIRECTIONS], factor[DIRECTIONS * DIRECTIONS];
  /* Motions of the site that move the centre of pressure along x, along y, that turn about it, that move it along the normal. */
  const mjtNum motions[DIRECTIONS * AXES] = {1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, arm[1], -arm[0], 0, 0, 0, 1, 0, 0, 1, 0, 0, 0};
  mju_mulMatMat(by, motions, whole, DIRECTIONS, AXES, AXES);
  mju_mulMatMatT(along, by, motions, DIRECTIONS, AXES, DIRECTIONS);
  mju_copy(factor, along, DIRECTIONS * DIRECTIONS);
  mju_cholFactor(factor, DIRECTIONS, mjMINVAL);
  mju_copy(law->rest, whole, SQUARE);
  for (int k = 0; k < AXES; k++) {
    mjtNum column[DIRECTIONS];
    for (int i = 0; i < DIRECTIONS; i++) column[i] = by[AXES * i + k];
    mju_cholSolve(column, factor, column, DIRECTIONS);
    for (int i = 0; i < DIRECTIONS; i++) {
      law->rows[AXES * i + k] = column[i];
      mju_addToScl(law->rest + AXES * k, by + AXES * i, -column[i], AXES);
    }
  }
  law->normal = along[DIRECTIONS * NORMAL + NORMAL];
  mjtNum across = mju_max(along[0], along[DIRECTIONS + 1]), radius = sqrt(along[2 * DIRECTIONS + 2] / mju_max(across, mjMINVAL));
  for (int k = 0; k < AXES; k++) law->rows[AXES * 2 + k] *= radius;
  law->across[0] = across;
  return radius;
}

static void read_law(step_law* law, const coupled_contact* c, mjtNum h) {
  const fingerpad_response* r = &c->now->felt.response;
  mjtNum whole[SQUARE], damping[SQUARE], arm[3], moment[3], friction[ALONG];
  wrench w;
  contact_wrench(&w, c->now, c->s, &c->here, STILL, STILL);
  wrench_numbers(law->all, &w);
  to_centre(arm, c);
  if (c->s->is_pad) {
    pad_stiffness(whole, c, arm);
  } else {
    bed_stiffness(whole, c);
  }
  damping_of(damping, c->s, *c->now, &c->here, law->all);
  mju_scl(whole, whole, AHEAD * h, SQUARE);
  mju_addTo(whole, damping, SQUARE);
  mjtNum radius = split(law, whole, arm), stuck = mju_clip(r->stick_ratio, 0, 1);
  mju_cross(moment, arm, law->all);
  friction[0] = r->tangential_friction_x_n;
  friction[1] = r->tangential_friction_y_n;
  /* With the moment friction is no larger than the limit that it has alone. */
  mjtNum along = mju_norm(friction, 2), alone = mju_max(along, r->friction_limit_n), room = sqrt(alone * alone - along * along);
  friction[2] = mju_clip((law->all[5] - moment[2]) / mju_max(radius, mjMINVAL), -room, room);
  /* Where all slips, friction is its limit: on round bodies that is less than the limit of the response. */
  mjtNum size = mju_norm3(friction), limit = size + stuck * (alone - size);
  const mjtNum parts[PARTS] = {stuck, 1 - stuck};
  mjtNum slips = mju_min(size, parts[1] * limit) / mju_max(size, mjMINVAL);
  for (int i = 0; i < PARTS; i++) {
    mju_scl3(law->friction[i], friction, i ? slips : 1 - slips);
    law->limit[i] = parts[i] * limit;
  }
  law->across[1] = parts[1] * law->across[0];
  law->across[0] *= parts[0];
  law->pressure = r->normal_force_n;
  law->share = 1;
}

/* The wrench at the velocities `after`; if asked for, its fall with them, a symmetric matrix; and the normal force before it is held at 0: a
 * contact does not pull. */
static void follow(mjtNum all[AXES], mjtNum fall[SQUARE], mjtNum* pressure, const step_law* law, const mjtNum after[AXES]) {
  mjtNum along[DIRECTIONS], more[DIRECTIONS] = {0}, own[DIRECTIONS * DIRECTIONS] = {0}, room[DIRECTIONS * AXES];
  mju_mulMatVec(along, law->rows, after, DIRECTIONS, AXES);
  mju_mulMatVec(all, law->rest, after, AXES, AXES);
  mju_sub(all, law->all, all, AXES);
  for (int i = 0; i < PARTS; i++) {
    mjtNum trial[ALONG], limit = law->share * law->limit[i], stiffness = law->across[i];
    if (!(stiffness > 0)) continue;
    mju_addScl3(trial, law->friction[i], along, -stiffness);
    mjtNum size = mju_norm3(trial), kept = size > limit ? limit / size : 1;
    for (int k = 0; k < ALONG; k++) {
      more[k] += kept * trial[k] - law->friction[i][k];
      own[DIRECTIONS * k + k] += kept * stiffness;
      for (int j = 0; kept < 1 && j < ALONG; j++) own[DIRECTIONS * k + j] -= kept * stiffness * trial[k] * trial[j] / (size * size);
    }
  }
  *pressure = law->pressure - law->normal * along[NORMAL];
  more[NORMAL] = mju_max(0, *pressure) - law->pressure;
  own[DIRECTIONS * NORMAL + NORMAL] = *pressure > 0 ? law->normal : 0;
  for (int i = 0; i < DIRECTIONS; i++) mju_addToScl(all, law->rows + AXES * i, more[i], AXES);
  if (!fall) return;
  mju_mulMatMat(room, own, law->rows, DIRECTIONS, DIRECTIONS, AXES);
  mju_mulMatTMat(fall, law->rows, room, DIRECTIONS, AXES, AXES);
  mju_addTo(fall, law->rest, SQUARE);
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

/* Adds h c J' J of a force along one sparse row J with the damping h c. */
static void add_row(mjtNum* mass, mjtNum damping, const mjtNum* row, const int* columns, int count, int nv) {
  for (int k = 0; k < count; k++) {
    for (int j = 0; j < count; j++) mass[columns[k] * nv + columns[j]] += damping * row[k] * row[j];
  }
}

/* The damping of joints, tendons and actuators, where the integrator treats it implicitly. */
static void add_damping(mjtNum* mass, const mjModel* m, mjData* d) {
  int nv = m->nv, euler = m->opt.integrator == mjINT_EULER, implicit = m->opt.integrator == mjINT_IMPLICIT || m->opt.integrator == mjINT_IMPLICITFAST;
  mjtNum h = m->opt.timestep;
  int joints = !(m->opt.disableflags & mjDSBL_DAMPER) && (implicit || (euler && !(m->opt.disableflags & mjDSBL_EULERDAMP)));
  for (int i = 0; joints && i < nv; i++) mass[i * nv + i] += h * m->dof_damping[i];
  for (int i = 0; joints && implicit && i < m->ntendon; i++) {
    int at = m->ten_J_rowadr[i];
    add_row(mass, h * m->tendon_damping[i], d->ten_J + at, m->ten_J_colind + at, m->ten_J_rownnz[i], nv);
  }
  for (int i = 0; implicit && !(m->opt.disableflags & mjDSBL_ACTUATION) && i < m->nu; i++) {
    if (m->actuator_biastype[i] != mjBIAS_AFFINE) continue;
    int at = d->moment_rowadr[i];
    add_row(mass, h * mju_max(0, -m->actuator_biasprm[mjNBIAS * i + 2]), d->actuator_moment + at, d->moment_colind + at, d->moment_rownnz[i], nv);
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

/* All that the prediction is of. */
typedef struct {
  const mjModel* m;
  mjData* d;
  step_law* law;
  int count;
  /* Mass and what the integrator adds to it, and the forces of all but contacts and constraints. */
  const mjtNum *mass, *force;
} coupling;

/* The velocities of a contact at the end of a step with the accelerations `a`. */
static void velocity_after(mjtNum after[AXES], const coupling* all, const step_law* law, const mjtNum* a) {
  mju_mulMatVec(after, law->jacobian, a, AXES, all->m->nv);
  mju_addScl(after, law->before, after, all->m->opt.timestep, AXES);
}

/* The gradient of the cost that the accelerations minimise: that of MuJoCo's solver with the contacts. */
static void gradient_of(mjtNum* gradient, const coupling* all, const mjtNum* a) {
  const mjModel* m = all->m;
  mjData* d = all->d;
  int nv = m->nv;
  mju_mulMatVec(gradient, all->mass, a, nv, nv);
  mju_subFrom(gradient, all->force, nv);
  if (d->nefc) {
    mj_markStack(d);
    mjtNum* off = mj_stackAllocNum(d, (size_t)d->nefc);
    mj_mulJacVec(m, d, off, a);
    mju_subFrom(off, d->efc_aref, d->nefc);
    mj_constraintUpdate(m, d, off, NULL, m->opt.cone == mjCONE_ELLIPTIC);
    mj_freeStack(d);
    mju_subFrom(gradient, d->qfrc_constraint, nv);
  }
  for (int i = 0; i < all->count; i++) {
    const step_law* law = all->law + i;
    mjtNum after[AXES], w[AXES], pressure;
    velocity_after(after, all, law, a);
    follow(w, NULL, &pressure, law, after);
    for (int k = 0; k < AXES; k++) mju_addToScl(gradient, law->jacobian + k * nv, -w[k], nv);
  }
}

/* The curvature of the cost where its gradient was taken last. */
static void curvature_of(mjtNum* hessian, const coupling* all, const mjtNum* a) {
  int nv = all->m->nv;
  mju_copy(hessian, all->mass, nv * nv);
  add_constraints(hessian, all->m, all->d);
  for (int i = 0; i < all->count; i++) {
    const step_law* law = all->law + i;
    mjtNum after[AXES], w[AXES], fall[SQUARE], pressure;
    velocity_after(after, all, law, a);
    follow(w, fall, &pressure, law, after);
    mju_scl(fall, fall, all->m->opt.timestep, SQUARE);
    add_in_joints(hessian, law->jacobian, fall, all->d, nv);
  }
}

/* How much of a step from `a` to take: where the cost falls no more along it, or the whole where it still falls there. `trial` is where that
 * leads, with its gradient. */
static void search(mjtNum* trial, mjtNum* gradient, const coupling* all, const mjtNum* a, const mjtNum* step, mjtNum slope) {
  enum { TRIALS = 40 };
  int nv = all->m->nv;
  mjtNum from = 0, to = 1, share = 1, left = slope, right = 0;
  for (int i = 0; i < TRIALS; i++) {
    mju_addScl(trial, a, step, -share, nv);
    gradient_of(gradient, all, trial);
    mjtNum here = -mju_dot(gradient, step, nv);
    if (mju_abs(here) <= -0.1 * slope || (here < 0 && share == 1)) return;
    if (here < 0) {
      from = share;
      left = here;
    } else {
      to = share;
      right = here;
    }
    share = from + (to - from) * mju_clip(left / (left - right), 0.1, 0.9);
  }
}

/* Brings the accelerations `a` to the minimum of the cost, by Newton's method. Returns the gradient that is left over the forces. */
static mjtNum minimise(mjtNum* a, const coupling* all) {
  enum { ROUNDS = 60 };
  const mjtNum small = 1e-10;
  int nv = all->m->nv;
  mjData* d = all->d;
  mj_markStack(d);
  mjtNum *hessian = mj_stackAllocNum(d, (size_t)(nv * nv)), *gradient = mj_stackAllocNum(d, (size_t)(3 * nv));
  mjtNum *step = gradient + nv, *trial = step + nv;
  gradient_of(gradient, all, a);
  mjtNum size = mju_norm(all->force, nv), left = mju_norm(gradient, nv);
  for (int i = 0; i < all->count; i++) size += mju_norm(all->law[i].all, AXES);
  for (int round = 0; round < ROUNDS && left > small * size; round++) {
    curvature_of(hessian, all, a);
    mju_cholFactor(hessian, nv, mjMINVAL);
    mju_cholSolve(step, hessian, gradient, nv);
    search(trial, gradient, all, a, step, -mju_dot(gradient, step, nv));
    mju_copy(a, trial, nv);
    left = mju_norm(gradient, nv);
  }
  mj_freeStack(d);
  return left / mju_max(size, mjMINVAL);
}

/* Takes the normal forces at the end of the step into the limits of friction. Returns the largest change of a share. */
static mjtNum update_shares(const coupling* all, const mjtNum* a) {
  mjtNum most = 0;
  for (int i = 0; i < all->count; i++) {
    step_law* law = all->law + i;
    mjtNum after[AXES], w[AXES], pressure;
    velocity_after(after, all, law, a);
    follow(w, NULL, &pressure, law, after);
    mjtNum share = law->pressure > 0 ? mju_max(0, pressure) / law->pressure : 1;
    most = mju_max(most, mju_abs(share - law->share));
    law->share = share;
  }
  return most;
}

/* The wrench at the velocity at the end of the step, none of a contact that would pull; what differs from that at rest counts to the dampers. */
static void wrench_ahead(wrench* w, const coupled_contact* c, const step_law* law, const mjtNum after[AXES]) {
  mjtNum all[AXES], more[AXES], moment[3], pressure, *damping = c->now->damping;
  follow(all, NULL, &pressure, law, after);
  if (pressure <= 0) mju_zero(all, AXES);
  mju_copy3(w->force, all);
  mju_copy3(w->moment, all + 3);
  mju_sub(more, all, law->all, AXES);
  mju_copy3(damping, more);
  mju_cross(moment, c->here.touch, more);
  damping[3] = MM_PER_M * (more[5] - moment[2]);
}

/* The accelerations a of the end of the step minimise the cost of
 *
 *   M a = sum J' w(u + h J a) + all other forces + forces of MuJoCo's constraints
 *
 * with the wrenches w of the contacts at their velocities at the end of the step; their limits of friction follow their normal forces. */
void apply_coupled(const mjModel* m, mjData* d, coupled_contact* contacts, int count) {
  enum { ROUNDS = 6 };
  /* Changes of a share of the normal force: so small that the next round changes nothing, and so large that friction is off by as much. */
  const mjtNum close = 1e-3, off = 0.05;
  /* What may be left of the gradient. */
  const mjtNum found = 1e-6;
  int nv = m->nv;
  mj_markStack(d);
  mjtNum* mass = mj_stackAllocNum(d, (size_t)(nv * nv));
  mjtNum *force = mj_stackAllocNum(d, (size_t)(2 * nv)), *a = force + nv;
  mjtNum* jacobians = mj_stackAllocNum(d, (size_t)(count * AXES * nv));
  step_law* law = mj_stackAllocByte(d, (size_t)count * sizeof(step_law), _Alignof(step_law));
  const coupling all = {m, d, law, count, mass, force};
  mj_fullM(m, d, mass);
  add_damping(mass, m, d);
  other_forces(force, m, d);
  for (int i = 0; i < count; i++) {
    law[i].jacobian = jacobians + i * AXES * nv;
    relative_jacobian(law[i].jacobian, m, d, contacts[i].s->site, contacts[i].geom, &contacts[i].here);
    mju_mulMatVec(law[i].before, law[i].jacobian, d->qvel, AXES, nv);
    read_law(law + i, contacts + i, m->opt.timestep);
  }
  if (d->nefc) mj_referenceConstraint(m, d);
  mju_zero(a, nv);
  mjtNum left = 0, changed = 1;
  for (int round = 0; round < ROUNDS && changed > close; round++) {
    left = minimise(a, &all);
    changed = update_shares(&all, a);
  }
  int is_found = left < found && changed < off;
  for (int i = 0; i < count; i++) {
    mjtNum after[AXES];
    wrench w;
    velocity_after(after, &all, law + i, a);
    wrench_ahead(&w, contacts + i, law + i, after);
    if (!is_found) contacts[i].now->status |= FINGERPAD_STATUS_NOT_CONVERGED;
    wrench_apply(&w, contacts[i].s, &contacts[i].here, m, d, contacts[i].geom);
  }
  mj_freeStack(d);
}
