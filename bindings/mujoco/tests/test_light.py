"""Light objects that also touch a table, a wall or each other by MuJoCo's own contact: nothing is thrown, no energy is made."""

import mujoco
import numpy as np
import pytest
import scenes
from paths import within_limit
from reference import PadFinger

import fingerpad_mujoco

#: Steps, s; masses, kg; grips, N.
STEPS = (0.001, 0.002, 0.003, 0.004)
MASSES = (0.001, 0.002, 0.003, 0.005, 0.01, 0.045)
GRIPS = np.arange(0.8, 2.5, 0.3)


def fastest(mass, timestep, grip_n, **option):
    """The largest speed, m/s, of a block on a table that two pads grip and lift by 60 mm/s, and where it is in the hand at the end, mm. Checks that
    semi-implicit friction is within the limit of the normal force."""
    model = mujoco.MjModel.from_xml_string(scenes.lifted(mass=mass, timestep=timestep, **option))
    data, speed = mujoco.MjData(model), 0.0
    data.ctrl[1:] = grip_n
    for _ in range(round(2.0 / timestep)):
        data.ctrl[0] = 0.06 * np.clip(data.time - 0.8, 0, 1)
        mujoco.mj_step(model, data)
        speed = max(speed, np.abs(data.body("object").cvel[3:]).max())
        within_limit(data, ("left", "right"))
    return speed, 1e3 * (data.body("object").xpos[2] - data.body("hand").xpos[2])


def lifts(mass, timestep, grips, **option):
    for grip_n in grips:
        speed, below_mm = fastest(mass, timestep, grip_n, **option)
        # It falls by 0.5 mm onto the table at first.
        assert speed < 0.3 and abs(below_mm) < 5, (mass, timestep, grip_n, option, speed, below_mm)


@pytest.mark.parametrize(
    "option",
    [dict(cone="pyramidal", integrator="Euler"), dict(cone="elliptic", integrator="implicitfast", jacobian="sparse")],
    ids=["pyramidal", "elliptic"],
)
def test_a_light_block_is_lifted_off_a_table(option):
    for mass, timestep in ((0.001, 0.002), (0.001, 0.004), (0.005, 0.004)):
        lifts(mass, timestep, (0.8, 1.9), **option)


def test_dense_and_sparse_constraints_give_the_same():
    speeds = [fastest(0.001, 0.004, 1.3, cone="elliptic", jacobian=jacobian) for jacobian in ("dense", "sparse")]
    assert speeds[0] == pytest.approx(speeds[1], rel=1e-6)


@pytest.mark.nightly
@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
@pytest.mark.parametrize("timestep", STEPS)
def test_none_of_six_grips_throws_a_block_of_1_to_45_g(timestep, cone, integrator):
    for mass in MASSES:
        lifts(mass, timestep, GRIPS, cone=cone, integrator=integrator)


# ---- energy ----


def stored_over_force():
    """Depths, mm, and energy that a pad has stored at them over its normal force, mm, on a plane."""
    finger, depths = PadFinger(scenes.PAD_FILE), np.arange(0, 8.01, 0.05)
    force = np.array([finger.step(depth).normal_force_n for depth in depths])
    energy = np.concatenate([[0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(depths))])
    return depths, energy / np.maximum(force, 1e-9)


def largest_gain(seed, timestep, duration=1.5, **option):
    """How much the energy of a random scene rises above an earlier value, mJ, and the largest speed of its objects, m/s.

    A block is gripped by two pads with constant forces while it touches a table, a wall and a second block, and all of that is shaken by a
    hand on a spring. Energy: kinetic, of gravity, springs and constant forces, and what normal forces have stored in the pads."""
    random = np.random.default_rng(seed)
    model = mujoco.MjModel.from_xml_string(scenes.crowded(random, timestep, **option))
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data, least, gain, speed = mujoco.MjData(model), np.inf, 0.0, 0.0
    depths, over = stored_over_force()
    data.ctrl[:] = random.uniform(0.3, 2.5)
    data.qvel[-12:] = random.normal(0, 0.1, 12) * ([1, 1, 1, 10, 10, 10] * 2)
    for _ in range(round(duration / timestep)):
        # Energies and sensors of one position.
        mujoco.mj_forward(model, data)
        pads = [fingerpad_mujoco.read(data, side)[0] for side in ("left", "right")]
        stored = sum(pad["normal_force_n"] * np.interp(pad["depth_mm"], depths, over) for pad in pads)
        energy = 1e3 * data.energy.sum() - 1e3 * data.ctrl @ data.qpos[1:3] + stored
        least = min(least, energy)
        gain = max(gain, energy - least)
        mujoco.mj_step2(model, data)
        speed = max(speed, np.abs([data.body(name).cvel[3:] for name in ("object", "other")]).max())
    return gain, speed


def gains_little(seeds, timestep):
    for seed in seeds:
        # Integrators and cones take turns.
        option = dict(integrator=("Euler", "implicitfast")[seed % 2], cone=("pyramidal", "elliptic")[seed // 2 % 2])
        gain, speed = largest_gain(seed, timestep, **option)
        # Friction and tilt store energy as well: up to 1.5 mJ at any time step.
        assert gain < 2.0 and speed < 1.5, (seed, timestep, option, gain, speed)


def test_random_scenes_make_no_energy():
    gains_little((0, 3, 4, 6, 8, 28, 66), 0.004)


@pytest.mark.nightly
@pytest.mark.parametrize("timestep", [0.002, 0.004])
def test_200_random_scenes_make_no_energy(timestep):
    gains_little(range(200), timestep)
