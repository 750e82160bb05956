"""Energy: contacts yield none; the dampers take what is stated."""

import mujoco
import numpy as np
import pytest

import fingerpad_mujoco
import hold
import paths
import scenes
from paths import NO_DAMPING, PAD, STILL, first_of



def taken_by_contacts(seed, timestep=0.0002, duration=4.0, push=1.0, **attributes):
    """Energy, mJ, that went into the contacts up to each step, and what went in and out in all, of an object that is pushed
    and turned at random between two fingers, with slip, lift-off and tilt, from a start without contact."""
    model, data = hold.gripped(grip_n=0.0, load_n=0.0, timestep=timestep, strength_userdata=0, **attributes)
    random = np.random.default_rng(seed)
    body, joint = data.body("object"), data.joint("object")
    energy, gone, before, speed = [0.0], 0.0, None, None
    for i in range(round(duration / timestep)):
        if i % round(0.02 / timestep) == 0:
            pull, twist = random.normal(0, push, 3), random.normal(0, 0.006 * push, 3)
            data.userdata[0] = random.uniform(0.5, 1.5)
        data.ctrl[0] = 0.8 + 0.5 * np.sin(9 * data.time)
        # A soft spring to the middle keeps the object there.
        body.xfrc_applied[:3] = pull - 40 * joint.qpos[:3] - 1.0 * joint.qvel[:3]
        body.xfrc_applied[3:] = twist - 0.05 * np.sign(joint.qpos[3]) * joint.qpos[4:] - 1e-4 * joint.qvel[3:]
        mujoco.mj_step(model, data)
        # The step went with the speed after it; the contact's force is taken as the mean of both ends.
        force = data.qfrc_passive - data.qfrc_damper - data.qfrc_spring
        if before is not None:
            work = -0.5e3 * timestep * (before + force) @ speed
            energy.append(energy[-1] + work)
            gone += abs(work)
        before, speed = force.copy(), data.qvel.copy()
    return np.array(energy), gone


@pytest.mark.parametrize("seed", first_of(1, 2, 3))
@pytest.mark.parametrize(
    "attributes",
    [NO_DAMPING, {}, NO_DAMPING | PAD | dict(push=0.3), PAD | dict(push=0.3), NO_DAMPING | PAD | dict(push=0.1, held="ball")],
    ids=["undamped", "damped", "undamped pad", "damped pad", "undamped pad and ball"],
)
def test_contacts_yield_no_energy(seed, attributes):
    # A pad is pushed so that no depth is beyond the fit: pads are stiffer, and a harder push throws the object over its edges.
    energy, gone = taken_by_contacts(seed, **attributes)
    assert gone > 30.0
    assert energy.min() > -1e-4 * gone, (energy.min(), gone)
    assert 0.05 * gone < energy[-1] < gone


def energies_after_a_hit(held, grip_n, timestep, seed, duration=20.0):
    """Data of an object that rests in pads without dampers and is hit, and the kinetic energy of all bodies after each step, over
    that of the hit."""
    model, data = hold.gripped(grip_n=grip_n, load_n=0.0, timestep=timestep, held=held, **NO_DAMPING, **PAD)
    hold.seconds(model, data, 1.0)
    random, joint, mass, energies = np.random.default_rng(seed), data.joint("object"), np.zeros((model.nv, model.nv)), []
    data.qvel[:] = 0
    joint.qvel[:3], joint.qvel[3:] = random.normal(0, 0.01, 3), random.normal(0, 1.0, 3)
    for k in range(round(duration / timestep) + 1):
        if k > 0:
            mujoco.mj_step(model, data)
        mujoco.mj_fullM(model, data, mass)
        energies.append(0.5 * data.qvel @ mass @ data.qvel)
    return data, np.array(energies[1:]) / energies[0]


@pytest.mark.parametrize("seed", first_of(1, 2))
@pytest.mark.parametrize(
    "held, grip_n, timestep", first_of(("die", 3.0, 0.002), ("die", 0.5, 0.004), ("card", 3.0, 0.004), ("coin", 5.0, 0.004))
)
def test_semi_implicit_forces_yield_no_energy(held, grip_n, timestep, seed):
    # In 20 s the kinetic energy never exceeds that of the hit, and the object comes to rest.
    data, shares = energies_after_a_hit(held, grip_n, timestep, seed)
    assert fingerpad_mujoco.read(data, "left")[0]["semi_implicit"] == 1
    assert shares.max() < 1 and shares[-200:].max() < 1e-8, (shares.max(), shares[-200:].max())


def taken_by_cycles(seed, cycles, sense=1, slide_mm=0.01, steps=800, part=1.0, tilt_rad=0.08, **attributes):
    """Energy, mJ, that each of `cycles` rounds of one closed path put into a contact, and what went in and out in one round.

    The finger is led in all six directions at once: depth 1.0 to 1.6 mm, tilts of some degrees, small slides and turns, or the
    ``part`` of all that."""
    model, data = paths.model_and_data(**NO_DAMPING, **attributes)
    random = np.random.default_rng(seed)
    size = part * np.array([0.3, slide_mm, slide_mm, 0.1 * slide_mm, tilt_rad, tilt_rad])
    phase, order = random.uniform(0, 2 * np.pi, 6), random.permutation([1, 1, 2, 2, 3, 3])
    rounds, before = np.zeros((cycles, 2)), None
    for i in range(cycles * steps + 1):
        angle = sense * 2 * np.pi * i / steps
        row = np.array([1.3, 0, 0, 0, 0, 0]) + size * np.sin(order * angle + phase)
        at, axes = paths.finger_at(row)
        paths.lead(model, data, (at, axes), STILL)
        now = (1e-3 * at, axes, data.qfrc_passive[:3].copy(), axes.apply(data.qfrc_passive[3:6]))
        if before is not None:
            force, moment = 0.5 * (before[2] + now[2]), 0.5 * (before[3] + now[3])
            work = -1e3 * (force @ (now[0] - before[0]) + moment @ (axes * before[1].inv()).as_rotvec())
            rounds[(i - 1) // steps] += [work, abs(work)]
        before = now
    return rounds


@pytest.mark.parametrize("seed", first_of(*range(4)))
@pytest.mark.parametrize("sense", [1, -1], ids=["there", "back"])
def test_a_closed_path_that_sticks_gives_back_what_it_took(seed, sense):
    # The first round may slip in part; after that every spring fits into its smallest limit.
    *_, (left, gone) = taken_by_cycles(seed, 3, sense)
    assert gone > 0.1
    assert abs(left) < 2e-4 * gone, (left, gone)


@pytest.mark.parametrize("seed", first_of(*range(4)))
def test_a_closed_path_that_slips_takes_energy(seed):
    *_, (left, gone) = taken_by_cycles(seed, 2, slide_mm=2.0)
    assert 0.1 * gone < left < gone


def test_a_free_vibration_decays_by_the_stated_damping():
    # Small against the slip length, so that all sticks: a mass on a spring with the dampers of one finger.
    damping, decay = 0.3, {}
    for value in (0.0, damping):
        attributes = dict(NO_DAMPING, damping_slide_n_s_per_m=value)
        scene = scenes.one_slide(timestep=1e-4, integrator="RK4", **attributes)
        model = mujoco.MjModel.from_xml_string(scene)
        data = mujoco.MjData(model)
        model.opt.gravity[:] = 0
        data.qvel[0] = 1e-4
        heights = np.array([mujoco.mj_step(model, data) or data.qpos[0] for _ in range(20000)])
        peaks = heights[1:-1][(heights[1:-1] > heights[:-2]) & (heights[1:-1] >= heights[2:])]
        times = 1e-4 * np.flatnonzero((heights[1:-1] > heights[:-2]) & (heights[1:-1] >= heights[2:]))
        decay[value] = -np.polyfit(times[:8], np.log(peaks[:8]), 1)[0]
    # Amplitude falls as exp(-c t/(2 m)).
    assert decay[damping] - decay[0.0] == pytest.approx(damping / (2 * scenes.MASS_KG), rel=0.05), decay


@pytest.mark.nightly
def test_a_bounce_is_damped_as_stated():
    # A finger in a deep press moves by little: mass, the model's own normal stiffness, and the dampers.
    decay = {}
    for value in (0.0, 1.0):
        attributes = dict(NO_DAMPING, damping_normal_n_s_per_m=value)
        scene = paths.scene(geom="plane", **attributes).replace("<freejoint/>", '<joint type="slide" axis="0 0 1"/>', 1)
        model = mujoco.MjModel.from_xml_string(scene.replace('mass="1"', 'mass="0.05"').replace("0.001", "0.0001"))
        data = mujoco.MjData(model)
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        data.qpos[0] = -1.2e-3
        mujoco.mj_forward(model, data)
        weight = fingerpad_mujoco.read(data, "finger")[0]["normal_force_n"]
        data.qfrc_applied[0] = -weight
        data.qvel[0] = 1e-4
        heights = 1.2e-3 + np.array([mujoco.mj_step(model, data) or data.qpos[0] for _ in range(20000)])
        top = (heights[1:-1] > heights[:-2]) & (heights[1:-1] >= heights[2:])
        times, peaks = 1e-4 * np.flatnonzero(top), heights[1:-1][top]
        decay[value] = -np.polyfit(times[:6], np.log(peaks[:6]), 1)[0]
    assert decay[1.0] - decay[0.0] == pytest.approx(1.0 / (2 * 0.05), rel=0.05), decay
