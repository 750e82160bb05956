"""The largest time step at which the forces of contacts, which MuJoCo Warp takes from the start of a step, are stable.

Main function: `stable_step_s`. Stiffness and damping come from small motions of each degree of freedom with contacts that stick as a whole.
"""

from __future__ import annotations

from typing import Any

import mujoco
import mujoco_warp
import numpy as np

#: A shift, m, and a turn, rad, that are small against the slip length and large against rounding; rates, m/s and rad/s.
SMALL_SHIFT, SMALL_TURN = 5e-6, 5e-4
SMALL_SPEED, SMALL_RATE = 1e-3, 1e-2
#: A strength at which no part of a contact slips during the small motions.
STICKS = 5.0
#: Largest  h² K + 2 h C  over the mass in a stable step of h; the reported step over that of linear contacts, as in the plugin.
STABLE, MARGIN = 4.0, 0.9
#: Steps, s, between which the limit is looked for.
STEPS_S = 1e-6, 1.0


def stable_step_s(callback: Any, mj_model: Any, m: Any, d: Any) -> Any:
    """The largest stable step of each world, s; infinite where nothing touches. Leaves positions, velocities and memory as they are."""
    nv, places, speeds = mj_model.nv, d.qpos.numpy().copy(), d.qvel.numpy().copy()
    strength, before, m.callback.passive = callback.strength.numpy().copy(), callback._before, None
    callback._before = None
    callback.strength.fill_(STICKS)

    def forces(qpos: Any, qvel: Any) -> Any:
        d.qpos.assign(qpos.astype(np.float32))
        d.qvel.assign(qvel.astype(np.float32))
        for pass_ in (mujoco_warp.kinematics, mujoco_warp.com_pos, mujoco_warp.com_vel):
            pass_(m, d)
        d.qfrc_passive.zero_()
        callback(m, d)
        return d.qfrc_passive.numpy().astype(np.float64)

    try:
        still, base = np.zeros((d.nworld, nv)), places.astype(np.float64)
        rest = forces(base, still)
        masses, arms = _masses_and_arms(callback, mj_model, base)
        stiffness, damping = np.zeros((2, d.nworld, nv, nv))
        for k in range(nv):
            axis, turns = np.eye(nv)[k], _turns(mj_model, k)
            step = 1 / (1 / SMALL_TURN + arms[k] / SMALL_SHIFT) if turns else SMALL_SHIFT
            rate = 1 / (1 / SMALL_RATE + arms[k] / SMALL_SPEED) if turns else SMALL_SPEED
            moved = base.copy()
            for place in moved:
                mujoco.mj_integratePos(mj_model, place, axis, step)
            stiffness[:, :, k] = (rest - forces(moved, still)) / step
            damping[:, :, k] = (rest - forces(base, still + rate * axis)) / rate
    finally:
        callback._before, m.callback.passive = before, callback
        callback.strength.assign(strength)
        forces(places, speeds)
    inverse = np.linalg.inv(np.linalg.cholesky(masses))
    stiffness, damping = (inverse @ ((a + a.swapaxes(1, 2)) / 2) @ inverse.swapaxes(1, 2) for a in (stiffness, damping))
    low, high = (np.full(d.nworld, np.log(s)) for s in STEPS_S)
    for _ in range(40):
        h = np.exp((low + high) / 2)[:, None, None]
        is_stable = np.linalg.eigvalsh(h**2 * stiffness + 2 * h * damping)[:, -1] < STABLE
        low, high = np.where(is_stable, (low + high) / 2, low), np.where(is_stable, high, (low + high) / 2)
    return np.where(np.exp(low) > 0.99 * STEPS_S[1], np.inf, MARGIN * np.exp(low))


def _turns(mj_model: Any, dof: int) -> bool:
    """Whether a degree of freedom is a turn."""
    joint = mj_model.dof_jntid[dof]
    kind = mj_model.jnt_type[joint]
    return bool(kind in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_BALL) or (kind == 0 and dof - mj_model.jnt_dofadr[joint] >= 3))


def _masses_and_arms(callback: Any, mj_model: Any, places: Any) -> tuple[Any, Any]:
    """Mass matrices of the worlds, and the largest speed of a site against its geom's body at a unit speed of each degree of freedom."""
    nv, data = mj_model.nv, mujoco.MjData(mj_model)
    masses, arms, jacobian = np.zeros((len(places), nv, nv)), np.zeros(nv), np.zeros((2, 3, nv))
    for world, place in enumerate(places):
        data.qpos[:] = place
        mujoco.mj_forward(mj_model, data)
        for k in range(nv):
            mujoco.mj_mulM(mj_model, data, masses[world, k], np.eye(nv)[k])
        for site, geom in callback.contacts:
            mujoco.mj_jacSite(mj_model, data, jacobian[0], None, site)
            mujoco.mj_jac(mj_model, data, jacobian[1], None, data.site_xpos[site], mj_model.geom_bodyid[geom])
            arms = np.maximum(arms, np.linalg.norm(jacobian[0] - jacobian[1], axis=0))
    return masses, arms
