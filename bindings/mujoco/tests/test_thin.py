"""Thin and light objects: held, and the largest stable time step."""

import hold
import mujoco
import numpy as np
import paths
import pytest
import scenes
from paths import PAD, STILL
from reference import Finger

import fingerpad_mujoco



@pytest.mark.nightly
@pytest.mark.parametrize("timestep", [0.001, 0.002, 0.004])
@pytest.mark.parametrize("grip_n", hold.THIN_GRIPS_N)
@pytest.mark.parametrize("name", hold.THIN)
def test_pads_hold_a_thin_or_light_object(name, grip_n, timestep):
    # A key of 2 mm, a coin, a card of 0.8 mm and a die of 5 g; the pads are compressed by up to 4.6 mm.
    held = hold.held_by_pads(name, grip_n, timestep, duration=12.0)
    assert held["drift_um_s"] < 1e-3 and held["turn_rad_s"] < 1e-6 and held["hum_um"] < 0.1, held
    assert held["normal_force_n"] == pytest.approx(grip_n, rel=0.01) and abs(held["sag_mm"]) < 0.5, held
    # The face of the die is smaller than the contact.
    assert held["flags"] == (["beyond_edge"] if name == "die" and grip_n >= 3.0 else []) and not held["too_long"]


@pytest.mark.nightly
@pytest.mark.parametrize("timestep", [0.001, 0.002, 0.004])
@pytest.mark.parametrize("grip_n", [0.3, 0.5, 1.0, 1.5])
def test_pads_hold_a_pen_of_8_mm(grip_n, timestep):
    held = hold.held_by_pads("pen", grip_n, timestep, duration=12.0)
    assert held["drift_um_s"] < 1e-3 and held["turn_rad_s"] < 1e-6 and held["hum_um"] < 0.1, held


@pytest.mark.nightly
@pytest.mark.parametrize("integrator", ["RK4", "implicit", "implicitfast"])
@pytest.mark.parametrize("name", ["die", "card"])
def test_pads_hold_a_light_object_with_other_integrators(name, integrator):
    held = hold.held_by_pads(name, 3.0, 0.004, duration=12.0, integrator=integrator)
    assert held["drift_um_s"] < 1e-3 and held["hum_um"] < 0.1, held


@pytest.mark.nightly
@pytest.mark.parametrize("timestep", [0.001, 0.002, 0.004])
@pytest.mark.parametrize("name", ["die", "card"])
def test_beds_hold_a_light_object(name, timestep):
    held = hold.held("fingerpad", timestep, 12.0, held=name, grip_n=1.0)
    assert held["drift_um_s"] < 1e-3 and held["hum_um"] < 0.1, held


@pytest.mark.nightly
@pytest.mark.parametrize("grip_n, is_held", [(0.3, True), (1.0, True), (5.0, False)])
def test_beside_mujocos_own_contact_at_its_best(grip_n, is_held):
    # With 5 N its spheres go through the key.
    drift = hold.held("best", 0.001, 10.0, grip_n=grip_n, held="key")["drift_um_s"]
    assert (drift is not None and drift < 1e-3) if is_held else drift is None


def on_plate(half_mm):
    """A finger over a free box of so many mm half its thickness."""
    scene = paths.scene(**PAD).replace(f'{paths.HALF} {paths.HALF} {paths.HALF}"', f'{paths.HALF} {paths.HALF} {half_mm / 1e3}"')
    model = mujoco.MjModel.from_xml_string(scene)
    return model, mujoco.MjData(model)


def at_depth(model, data, half_mm, depth_mm, x_mm=0.0):
    return paths.lead(model, data, paths.pad_at([depth_mm, x_mm, 0, 0, 0, 0], np.array([0, 0, half_mm])), STILL)


def test_depth_is_compression_of_the_pad_not_of_the_object():
    thin, thick = on_plate(0.4), on_plate(20.0)
    for depth in [*np.arange(-0.2, 4.0, 0.1), *np.arange(4.0, -0.2, -0.1)]:
        contact, own = at_depth(*thin, 0.4, depth), at_depth(*thick, 20.0, depth)
        assert contact["normal_force_n"] == pytest.approx(own["normal_force_n"], rel=1e-3, abs=1e-5), depth
        assert (contact["normal_force_n"] > 0) == (depth > 0.05) or abs(depth) <= 0.05
    # And from above through the middle of the card in one step.
    at_depth(*thin, 0.4, -0.1)
    at_depth(*thin, 0.4, 0.85)
    assert at_depth(*thin, 0.4, 2.0)["normal_force_n"] > 0.3


def test_contact_ends_where_the_finger_leaves_the_face():
    thin = on_plate(0.4)
    edge = 1e3 * paths.HALF
    at_depth(*thin, 0.4, -0.1)
    at_depth(*thin, 0.4, 0.85)
    for x in np.linspace(0, edge - 0.05, 50):
        assert at_depth(*thin, 0.4, 2.0, x)["normal_force_n"] > 0.3
    assert at_depth(*thin, 0.4, 2.0, edge + 0.05)["normal_force_n"] == 0
    # It does not begin from the side or from behind, deeper than the middle of the card.
    assert at_depth(*thin, 0.4, 2.0, edge - 0.05)["normal_force_n"] == 0


# ---- the largest stable step ----


def closed(name, grip_n, model_file, timestep=0.0005, torque_n_mm=0.0, mass=None, **attributes):
    model, data = hold.gripped(grip_n=grip_n, timestep=timestep, held=name, model_file=model_file, mass=mass, **attributes)
    data.body("object").xfrc_applied[3] = 1e-3 * torque_n_mm
    return model, data


def largest_vibration_mm(model, data):
    """Range of the object's position and of its turn at 20 mm in the last half of a second of two."""
    hold.seconds(model, data, 1.5)
    places = []
    for _ in range(round(0.5 / model.opt.timestep)):
        mujoco.mj_step(model, data)
        places.append(data.joint("object").qpos * [1e3, 1e3, 1e3, 40, 40, 40, 40])
    return np.ptp(places, axis=0).max()


@pytest.mark.nightly
@pytest.mark.parametrize(
    "scene",
    [
        dict(name="die", grip_n=1.0, model_file=scenes.PAD_FILE),
        dict(name="die", grip_n=3.0, model_file=scenes.PAD_FILE),
        dict(name="card", grip_n=1.0, model_file=scenes.PAD_FILE),
        dict(name="key", grip_n=1.0, model_file=scenes.PAD_FILE),
        dict(name="plate", grip_n=0.8, model_file=scenes.PAD_FILE, torque_n_mm=2.0, mass=0.003),
        dict(name="plate", grip_n=0.8, model_file=scenes.MODEL_FILE, torque_n_mm=2.0, mass=0.003),
        dict(name="die", grip_n=0.6, model_file=scenes.MODEL_FILE),
    ],
    ids=lambda s: f'{s["name"]} {s["grip_n"]} N {s["model_file"].stem}',
)
def test_the_reported_step_is_the_largest_at_which_explicit_forces_hold_a_light_object(scene):
    # With weak dampers: strong ones set a limit of their own, beyond which an object vibrates by less.
    explicit = dict(
        integration="explicit", damping_normal_n_s_per_m=0.5, damping_slide_n_s_per_m=0.5, damping_spin_n_m_s_per_rad=5e-6
    )
    model, data = closed(**scene, **explicit)
    hold.seconds(model, data, 1.0)
    step_s = fingerpad_mujoco.stable_step(model, data)
    sensed = fingerpad_mujoco.read(data, "left")[0]
    assert sensed["stable_step_s"] == pytest.approx(step_s, rel=0.15)
    assert not {"step_too_long", "not_converged"} & set(fingerpad_mujoco.flags(sensed["status"]))
    assert 0.001 < step_s < 0.0045, "else the servo of the hand sets the limit"
    assert largest_vibration_mm(*closed(**scene, **explicit, timestep=0.9 * step_s)) < 0.2
    assert not largest_vibration_mm(*closed(**scene, **explicit, timestep=1.3 * step_s)) < 5.0
    # Semi-implicit forces have no such limit; the servo of the hand has one.
    assert largest_vibration_mm(*closed(**scene, timestep=min(1.3 * step_s, 0.004))) < 1e-3


def test_the_reported_step_is_that_of_a_mass_on_a_spring():
    # One direction, one finger: h² k + 2 h c = 4 m, less a margin of a tenth.
    finger, slide = Finger(scenes.MODEL_FILE), 1e-3
    finger.step(1.5)
    stiffness = 1e3 * abs(finger.step(1.5, slide).friction_x_n) / slide
    model = mujoco.MjModel.from_xml_string(scenes.one_slide())
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 3)
    damping, mass = 2.0, scenes.MASS_KG
    expected = (-damping + np.sqrt(damping**2 + 4 * stiffness * mass)) / stiffness
    assert fingerpad_mujoco.stable_step(model, data) == pytest.approx(0.9 * expected, rel=0.02)


def test_the_reported_step_is_that_of_two_masses_on_a_spring():
    # A finger of 30 g pressed onto a plate of 5 g, both on slides along the normal.
    finger = Finger(scenes.MODEL_FILE)
    stiffness = 1e3 * (finger.step(1.5005).normal_force_n - Finger(scenes.MODEL_FILE).step(1.4995).normal_force_n) / 1e-3
    masses = 0.03, 0.005
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <option timestep="0.0001" gravity="0 0 0"/>
      {scenes.extension(scenes.instance("finger", "finger", "plate"))}
      <worldbody>
        <body pos="0 0 -0.0015"><joint type="slide" axis="0 0 1"/><geom size="0.005" mass="{masses[0]}" contype="0"/><site name="finger" euler="0 30 0"/></body>
        <body><joint type="slide" axis="0 0 1"/><geom name="plate" type="box" size="0.05 0.05 0.01" pos="0 0 -0.01" mass="{masses[1]}" contype="0"/></body>
      </worldbody></mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    damping, mass = 2.0, 1 / sum(1 / m for m in masses)
    expected = (-damping + np.sqrt(damping**2 + 4 * stiffness * mass)) / stiffness
    assert fingerpad_mujoco.stable_step(model, data) == pytest.approx(0.9 * expected, rel=0.03)


def test_without_contact_there_is_no_limit():
    model, data = paths.model_and_data()
    mujoco.mj_forward(model, data)
    assert fingerpad_mujoco.stable_step(model, data) == np.inf
    assert fingerpad_mujoco.read(data, "finger")[0]["stable_step_s"] == 1.0


def test_a_step_that_is_too_long_is_flagged_and_warned_of_once(own_folder):
    model = mujoco.MjModel.from_xml_string(scenes.grip(held="die", timestep=0.0026, integration="explicit", **PAD))
    data, flags = mujoco.MjData(model), set()
    data.ctrl[0] = 3.0
    for _ in range(300):
        mujoco.mj_step(model, data)
        flags |= set(fingerpad_mujoco.flags(fingerpad_mujoco.read(data, "left")[0]["status"]))
    assert "step_too_long" in flags
    log = (own_folder / "MUJOCO_LOG.TXT").read_text()
    assert log.count("instance 'left': timestep = 0.0026 s is longer than") == 1
    model, data = closed("die", 1.0, scenes.PAD_FILE, timestep=0.0026)
    contact = fingerpad_mujoco.read(data, "left")[0]
    assert contact["status"] == 0 and contact["semi_implicit"] == 1


def test_forces_are_semi_implicit_only_where_that_is_needed():
    for timestep, needed in ((0.00025, 0), (0.002, 1)):
        model, data = closed("die", 1.0, scenes.PAD_FILE, timestep=timestep)
        assert fingerpad_mujoco.read(data, "left")[0]["semi_implicit"] == needed
    model, data = closed("die", 1.0, scenes.PAD_FILE, timestep=0.001, integration="explicit")
    assert fingerpad_mujoco.read(data, "left")[0]["semi_implicit"] == 0


def test_a_semi_implicit_step_goes_on_with_the_same_bits_from_a_saved_state():
    same, _ = hold.restored(0.004, held="die", **PAD)
    assert same
