"""What a contact remembers: steps that are tried and rejected, Runge-Kutta, copies, resets, keyframes, several instances."""

import copy

import hold
import mujoco
import numpy as np
import pytest
from mujoco import rollout

import fingerpad_mujoco
import scenes
from paths import PAD, first_of
from reference import Finger


def whole(model, data):
    """All of MuJoCo's state as bits."""
    which = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, which))
    mujoco.mj_getState(model, data, state, which)
    return state.view(np.uint64)


#: Both models of the finger, and what they may hold.
SCENES = [dict(), PAD, PAD | dict(held="ball")]
of_every_kind = pytest.mark.parametrize("scene", SCENES, ids=["bed", "pad", "pad and ball"])


def shaken(**scene):
    model, data = hold.gripped(**scene)
    hold.shake(model, data, 0.2, seed=3)
    return model, data


@of_every_kind
@pytest.mark.parametrize("integrator", first_of("RK4", "Euler", "implicit", "implicitfast", "discrete"))
def test_steps_that_were_tried_leave_nothing(integrator, scene):
    model, plain = shaken(integrator=integrator, **scene)
    tried = copy.copy(plain)
    random = np.random.default_rng(17)
    for _ in range(200):
        mujoco.mj_step(model, plain)
        # Positions and velocities are put back, the plugin's state is not: a trial must not have touched it.
        qpos, qvel = tried.qpos.copy(), tried.qvel.copy()
        for _ in range(3):
            tried.qpos[:3] += random.normal(0, 1e-3, 3)
            tried.qvel[:] += random.normal(0, 1e-2, model.nv)
            mujoco.mj_forward(model, tried)
        tried.qpos[:], tried.qvel[:] = qpos, qvel
        mujoco.mj_step(model, tried)
    assert (whole(model, plain) == whole(model, tried)).all()
    assert fingerpad_mujoco.read(plain, "left")[0]["normal_force_n"] > 0.1


@of_every_kind
def test_finite_differences_leave_nothing(scene):
    model, plain = shaken(**scene)
    other = copy.copy(plain)
    for _ in range(20):
        mujoco.mj_step(model, plain)
        n = 2 * model.nv + model.na
        mujoco.mjd_transitionFD(model, other, 1e-6, True, np.empty((n, n)), None, None, None)
        mujoco.mj_step(model, other)
    assert (whole(model, plain) == whole(model, other)).all()


def falling_by_hand(steps, timestep, depth_mm, integrator, pulls):
    """The object of scenes.one_slide by the textbook: heights, m. A stage of Runge-Kutta tries on a copy of the memory after
    the step's first stage; the step that is taken moves the memory to where the step began."""
    finger = Finger(scenes.MODEL_FILE, timestep)
    height, speed, last, heights = 0.0, 0.0, 0.0, []

    def acceleration(at, since, pull):
        # The object's rise is the plane's slide along the finger's axis, which points up; friction on the finger.
        friction = finger.step(depth_mm, 1e3 * (at - since)).friction_x_n
        return pull / scenes.MASS_KG - scenes.GRAVITY - friction / scenes.MASS_KG

    for pull in pulls[:steps]:
        first = acceleration(height, last, pull)
        last, kept = height, finger.save()
        if integrator == "Euler":
            speed += timestep * first
            height += timestep * speed
        else:
            speeds, gains = [speed], [first]
            for share in (0.5, 0.5, 1.0):
                stage = height + share * timestep * speeds[-1]
                speeds.append(speed + share * timestep * gains[-1])
                gains.append(acceleration(stage, last, pull))
                finger.restore(kept)
            weights = np.array([1, 2, 2, 1]) / 6
            height += timestep * weights @ speeds
            speed += timestep * weights @ gains
        heights.append(height)
    return np.array(heights)


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_an_object_falls_as_calculated_by_hand(integrator):
    random = np.random.default_rng(5)
    pulls = np.repeat(random.normal(0.44, 0.8, 40), 20)
    scene = scenes.one_slide(integrator=integrator, depth_mm=1.5, damping_slide_n_s_per_m=0)
    model = mujoco.MjModel.from_xml_string(scene)
    data, heights = mujoco.MjData(model), []
    for pull in pulls:
        data.body("object").xfrc_applied[2] = pull
        mujoco.mj_step(model, data)
        heights.append(data.qpos[0])
    by_hand = falling_by_hand(len(pulls), 0.001, 1.5, integrator, pulls)
    # It slips, and stays on the face of the object.
    assert 2e-3 < np.abs(by_hand).max() < 0.028
    np.testing.assert_allclose(heights, by_hand, atol=1e-6 * np.ptp(by_hand))


@of_every_kind
def test_a_copy_goes_its_own_way(scene):
    model, data = shaken(**scene)
    twin = copy.copy(data)
    mujoco.mj_step(model, data, 100)
    mujoco.mj_step(model, twin, 100)
    assert (whole(model, data) == whole(model, twin)).all()
    twin.ctrl[0] = 0.0
    mujoco.mj_step(model, twin, 500)
    mujoco.mj_step(model, data, 500)
    assert fingerpad_mujoco.read(twin, "right")[0]["normal_force_n"] == 0
    assert fingerpad_mujoco.read(data, "right")[0]["normal_force_n"] > 0.1


@of_every_kind
def test_saved_and_restored_it_goes_on_with_the_same_bits(scene):
    same, _ = hold.restored(**scene)
    assert same


@of_every_kind
def test_a_rollout_in_threads_does_what_single_steps_do(scene):
    model, start = shaken(**scene)
    size, which = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS), mujoco.mjtState.mjSTATE_FULLPHYSICS
    first = np.empty(size)
    mujoco.mj_getState(model, start, first, which)
    random = np.random.default_rng(29)
    controls = np.zeros((6, 100, model.nu))
    controls[:, :, 0] = hold.GRIP_N * random.uniform(0.5, 1.5, (6, 100))
    threads = [mujoco.MjData(model) for _ in range(3)]
    states, _ = rollout.rollout(model, threads, np.tile(first, (6, 1)), controls)
    for control, seen in zip(controls, states):
        single = mujoco.MjData(model)
        mujoco.mj_setState(model, single, first, which)
        for row, state in zip(control, seen):
            single.ctrl[:] = row
            mujoco.mj_step(model, single)
            own = np.empty(size)
            mujoco.mj_getState(model, single, own, which)
            assert (own.view(np.uint64) == state.view(np.uint64)).all()


@of_every_kind
def test_a_reset_forgets(scene):
    model, data = shaken(**scene)
    fresh = mujoco.MjData(model)
    for d in (data, fresh):
        mujoco.mj_resetData(model, d)
        d.ctrl[0] = hold.GRIP_N
        mujoco.mj_step(model, d, 300)
    assert (whole(model, data) == whole(model, fresh)).all()


def test_a_keyframe_begins_with_fresh_contacts():
    scene = scenes.grip().replace("</mujoco>", '<keyframe><key name="pressed" qpos="0 0.0015 0 0 0.001 1 0 0 0"/></keyframe></mujoco>')
    model = mujoco.MjModel.from_xml_string(scene)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 100)
    ends = []
    for _ in range(2):
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_forward(model, data)
        right = fingerpad_mujoco.read(data, "right")[0]
        assert right["depth_mm"] == pytest.approx(1.5) and right["friction_x_n"] == 0 and right["stick_ratio"] == 1
        mujoco.mj_step(model, data, 50)
        ends.append(whole(model, data).copy())
    assert (ends[0] == ends[1]).all()


def test_instances_and_geoms_do_not_disturb_each_other():
    def row(fingers):
        names = [f"f{i}" for i in range(fingers)]
        instances = [scenes.instance(name, name, "a floor b") for name in names]
        bodies = "".join(
            f'<body name="{name}" pos="0 {0.1 * i} 0.0"><joint name="{name}" type="slide" axis="0 0 1"/>'
            f'<joint name="{name}x" type="slide" axis="1 0 0"/>'
            f'<geom size="0.005" mass="0.05" contype="0" conaffinity="0"/><site name="{name}" pos="0 0 -0.001" euler="0 30 0"/></body>'
            for i, name in enumerate(names)
        )
        return f"""<mujoco>{scenes.extension(*instances)}<worldbody><geom name="floor" type="plane" size="1 1 1"/>
          <body pos="5 0 0"><geom name="a" type="box" size="1 1 1"/></body>
          <body pos="0 0 -0.0505"><geom name="b" type="box" size="1 1 0.05"/></body>{bodies}</worldbody>
          <sensor>{"".join(scenes.sensor(name) for name in names)}</sensor></mujoco>"""

    def run(fingers):
        model = mujoco.MjModel.from_xml_string(row(fingers))
        data = mujoco.MjData(model)
        for i in range(400):
            data.qfrc_applied[1::2] = 0.3 * np.sin(0.05 * i)
            mujoco.mj_step(model, data)
        return [fingerpad_mujoco.read(data, f"f{i}") for i in range(fingers)]

    # The largest stable step is one number of the whole model.
    own = lambda contacts: [contact | {"stable_step_s": None} for contact in contacts]
    alone, many = run(1)[0], run(5)
    assert all(own(each) == own(alone) for each in many)
    far, floor, box = alone
    assert far["normal_force_n"] == 0 and floor["normal_force_n"] > 0.1
    # The box lies 0.5 mm lower than the floor.
    assert floor["depth_mm"] - box["depth_mm"] == pytest.approx(0.5, abs=1e-5)
