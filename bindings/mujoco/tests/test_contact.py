"""Geometry: what the plugin makes of positions, against the reduced model driven through its C library."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import paths
import scenes
from reference import RESPONSE, Finger

NAMES = [name for name in RESPONSE if not name.startswith("band")]


def assert_same(contacts, answers, tolerance=2e-4):
    """Forces, moments and areas alike up to what single precision of a motion of some mm makes of them."""
    for name in NAMES:
        seen = np.array([c[name] for c in contacts])
        own = np.array([getattr(r, name) for r in answers])
        scale = np.abs(own).max()
        assert np.abs(seen - own).max() <= tolerance * scale, (name, np.abs(seen - own).max() / scale)


@pytest.mark.parametrize("seed", paths.first_of(1, 2, 3))
def test_a_path_gives_what_the_reduced_model_gives(seed):
    path = paths.wandering(seed)
    contacts = paths.lead_along(path)
    assert sum(c["normal_force_n"] > 0 for c in contacts) > 300
    assert max(abs(c["spin_moment_n_mm"]) for c in contacts) > 1.0
    assert_same(contacts, paths.reference_along(Finger(scenes.MODEL_FILE), path))


def test_a_straight_path_gives_the_same_bits():
    # Depths and slides that are whole in single precision, so that nothing is rounded on the way.
    model, data = paths.model_and_data(geom="plane")
    finger = Finger(scenes.MODEL_FILE)
    x, depths = 0.0, [0.5, 1.0, 1.0, 1.5, 1.5, 1.25, 1.0]
    for i in range(140):
        depth, slide = depths[i // 20], 0.0 if i == 0 else (0.125 if i % 40 < 25 else -0.125)
        x -= slide
        contact = paths.lead(model, data, ([x, 0.0, -depth], Rotation.identity()))
        slid = 1e3 * (1e-3 * x) - 1e3 * (1e-3 * (x + slide))
        own = finger.step(contact["depth_mm"], -slid)
        for name in NAMES:
            assert contact[name] == getattr(own, name), (i, name)


@pytest.mark.parametrize("face", range(6))
def test_all_faces_of_a_box_and_all_motions_of_the_two_are_alike(face):
    path = paths.wandering(4, steps=300)

    def on_face(row):
        at, axes = paths.finger_at(row)
        return paths.FACES[face].apply(at), paths.FACES[face] * axes

    contacts = paths.lead_along(path, on_face, paths.tumbling(11, 300))
    assert {c["face"] for c in contacts} == {face + 1.0}
    assert_same(contacts, paths.reference_along(Finger(scenes.MODEL_FILE), path))


def test_contact_is_only_on_the_face_below():
    model, data = paths.model_and_data()
    edge = 1e3 * paths.HALF
    object_at = paths.STILL
    upright = Rotation.identity()

    def normal(at, axes=upright):
        return paths.lead(model, data, (at, axes), object_at)["normal_force_n"]

    assert normal([edge - 0.01, 0, edge - 1]) > 0.1
    assert normal([edge + 0.01, 0, edge - 1]) == 0
    assert normal([0, 0, edge + 0.01]) == 0
    # Behind the object, and from below with the finger's back to it.
    assert normal([0, 0, -edge - 1]) == 0
    assert normal([0, 0, -1]) == 0
    # Turned away by more than 60 degrees.
    assert normal([0, 0, edge - 1], Rotation.from_euler("y", 65, degrees=True)) == 0


def test_a_plane_has_no_edge():
    model, data = paths.model_and_data(geom="plane")
    assert paths.lead(model, data, ([5000, -7000, -1], Rotation.identity()))["normal_force_n"] > 0.1


def test_force_and_moment_reach_both_bodies():
    model, data = paths.model_and_data(damping_slide_n_s_per_m=0, damping_spin_n_m_s_per_rad=0, damping_normal_n_s_per_m=0)
    turn, moved = Rotation.from_rotvec([0.3, -0.8, 0.5]), np.array([30.0, -20.0, 15.0])
    for row in paths.wandering(6, steps=200)[:60]:
        at, axes = paths.finger_at(row)
        contact = paths.lead(model, data, (moved + turn.apply(at), turn * axes), (moved, turn))
    assert contact["normal_force_n"] > 0.1
    # The step has moved nothing yet: qfrc_passive belongs to where the bodies were led. A free joint has its force in the
    # world and its moment in the body's frame.
    force, moment = data.qfrc_passive[:3], (turn * axes).apply(data.qfrc_passive[3:6])
    reaction, counter = data.qfrc_passive[6:9], turn.apply(data.qfrc_passive[9:12])
    arm = 1e-3 * turn.apply(at)
    np.testing.assert_allclose(force, -reaction, atol=1e-15)
    np.testing.assert_allclose(counter, -moment - np.cross(arm, force), atol=1e-15)
    # In the finger's axes within the plane.
    flat = turn * Rotation.from_euler("z", row[3])
    own = flat.inv().apply(force)
    names = ("friction_x_n", "friction_y_n", "normal_force_n")
    np.testing.assert_allclose(own, [contact[name] for name in names], rtol=1e-6)
    assert flat.inv().apply(moment)[2] == pytest.approx(1e-3 * contact["spin_moment_n_mm"], rel=1e-6)


def test_strength_comes_from_attribute_and_userdata():
    model, data = paths.model_and_data(strength_factor=0.5, strength_userdata=2)
    finger = Finger(scenes.MODEL_FILE)
    x = 0.0
    for i in range(60):
        data.userdata[2] = [0, 1.4, 0.6][i // 20]
        finger.set_strength_factor(0.5 * [1, 1.4, 0.6][i // 20])
        x += 0.2
        contact = paths.lead(model, data, (paths.TOP + [-x, 0, -1], Rotation.identity()), paths.STILL)
        own = finger.step(1.0, 0.0 if i == 0 else 0.2)
        assert contact["friction_x_n"] == pytest.approx(own.friction_x_n, rel=1e-4)
        assert contact["friction_limit_n"] == pytest.approx(own.friction_limit_n, rel=1e-4)


def test_the_sensor_reads_nothing_with_passive_forces_off():
    model, data = paths.model_and_data()
    at = (paths.finger_at([1.0, 0, 0, 0, 0, 0]), paths.STILL)
    assert paths.lead(model, data, *at)["normal_force_n"] > 0.1
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SPRING | mujoco.mjtDisableBit.mjDSBL_DAMPER
    assert paths.lead(model, data, *at)["normal_force_n"] == 0
