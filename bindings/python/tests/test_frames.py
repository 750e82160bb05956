"""Contacts from poses: the bits of the core, the forces of increments, balance, states, what is refused."""

from __future__ import annotations

import copy
import pickle
import runpy
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import MODEL, PAD

import fingerpad
from fingerpad import FRAMES, FrameContacts, Fingers, InputError, Model, Pad, Regime, Shape, Status, relative_pose

SEED = 23


def about(axis: Any, angle_deg: Any) -> Any:
    """The quaternions of turns about an axis."""
    half = np.deg2rad(np.asarray(angle_deg, float)) / 2
    return np.concatenate([np.cos(half)[..., None], np.sin(half)[..., None] * np.asarray(axis, float)], -1)


#: Turn of a plane, or of a face that looks along z, under the finger in the neutral pose.
LEVEL = about([0, 1, 0], -30.0)
ORIGIN, NO_TURN = np.zeros(3), np.array([1.0, 0, 0, 0])


def turned(quaternion: Any, vector: Any) -> Any:
    """Vectors turned by quaternions."""
    return relative_pose(ORIGIN, quaternion * [1, -1, -1, -1], vector, NO_TURN)[0]


def times(first: Any, second: Any) -> Any:
    """Products of quaternions."""
    return relative_pose(ORIGIN, first * [1, -1, -1, -1], ORIGIN, second)[1]


def path(under_mm: float, count: int = 300, seed: int = SEED) -> tuple[Any, Any]:
    """Poses of a body whose middle is so far below its surface: a press, slides, spins, tilts, noise, and a lift-off."""
    random, t = np.random.default_rng(seed), np.arange(count)
    depth = np.minimum(t / 60 - 0.1, 1) + 0.1 * np.sin(t / 9)
    depth[count // 2 : count // 2 + 20] = -0.5
    place = np.stack([0.8 * np.sin(t / 40), 0.5 * np.cos(t / 50), depth - under_mm], -1) + random.normal(0, 1e-3, (count, 3))
    tilt = times(about([1, 0, 0], 8 * np.sin(t / 30)), about([0, 1, 0], 6 * np.sin(t / 37)))
    pose = times(LEVEL, times(tilt, about([0, 0, 1], 9 * np.sin(t / 25))))
    return turned(times(LEVEL, tilt), place), pose


@pytest.mark.parametrize(
    ("kind", "shape", "under_mm"),
    [
        (Model, Shape.plane(), 0.0),
        (Model, Shape.cuboid([25, 30, 10], 2), 10.0),
        (Pad, Shape.plane(), 0.0),
        (Pad, Shape.sphere(15), 15.0),
        (Pad, Shape.cylinder(20, 12), 12.0),
        (Pad, Shape.cuboid([6, 30, 10], 2), 10.0),
    ],
    ids=lambda case: repr(case),
)
def test_bits_of_the_core(native: Path, kind: Any, shape: Shape, under_mm: float) -> None:
    """Also the bits of each contact alone, with what is no pose, and opposite forces."""
    position, quaternion = path(under_mm)
    position[90::97], quaternion[130::83], quaternion[170] = np.nan, 1.1 * quaternion[130::83], 0
    factor = np.where(np.arange(300) < 220, 1.0, 0.6)
    rows = np.column_stack([position, quaternion, np.full(300, 1e-3), factor]).astype("<f8")
    sizes = [x for size in shape.sizes for x in np.atleast_1d(size)]
    command = [native, "frames", kind.__name__.lower().replace("model", "bed"), MODEL if kind is Model else PAD, shape.kind, *map(str, sizes)]
    done = subprocess.run(command, input=rows.tobytes(), capture_output=True, check=True)
    expected = np.frombuffer(done.stdout, "<u4").reshape(300, 35)
    one, many = FrameContacts(kind.shipped(), shape), FrameContacts(kind.shipped(), shape, 3)
    seen = set()
    for k in range(300):
        r = one.step(position[k], quaternion[k], strength_factor=factor[k])
        assert (r.view(np.uint32) == expected[k]).all(), f"seed {SEED}, step {k}: {r}"
        late = [k, max(k - 70, 0), k]
        rs = many.step(position[late], quaternion[late], strength_factor=factor[late])
        assert (rs.view(np.uint32).reshape(3, 35)[[0, 2]] == expected[k]).all()
        seen.add(int(r["regime"][0]))
        apart = turned(quaternion[k], r["force_on_body_n"].astype(float)) + r["force_on_finger_n"]
        if not r["status"][0] & Status.BAD_INPUT:
            assert np.abs(apart).max() <= 1e-6 * (1 + np.abs(r["force_on_finger_n"]).max()), f"seed {SEED}, step {k}: {r}"
            # Both wrenches are one about the finger's origin.
            arm = np.cross(position[k], turned(quaternion[k], r["force_on_body_n"].astype(float)))
            moment = turned(quaternion[k], r["moment_on_body_n_mm"].astype(float)) + arm + r["moment_on_finger_n_mm"]
            assert np.abs(moment).max() < 1e-4, f"seed {SEED}, step {k}: {r}"
    flags = np.bitwise_or.reduce(expected[:, 7])
    assert flags & Status.BAD_INPUT and {Regime.NO_CONTACT, Regime.STICK, Regime.PARTIAL_SLIP} <= seen


@pytest.mark.parametrize(("kind", "tolerance"), [(Model, 1e-6), (Pad, 5e-4)])
def test_poses_of_a_plane_are_increments(kind: Any, tolerance: float) -> None:
    """The same response as from depth and slides, and its force in the frame of the finger. A pad is in equilibrium within 2e-4, so that
    slides that differ in their last bit alone give forces that differ by 3e-4."""
    framed, fingers = FrameContacts(kind.shipped(), Shape.plane()), Fingers(kind.shipped(), spin=True)
    at = np.zeros(2)
    for k in range(400):
        slide = np.array([np.sin(k / 40), 0.6 * np.cos(k / 60)]) / 64 if k > 150 else np.zeros(2)
        at += slide
        r = framed.step(turned(LEVEL, [*at, min(k / 128, 1.2)]), LEVEL)
        e = fingers.step(r["depth_mm"], *slide, outputs="all")
        within = tolerance * max(e["normal_force_n"][0], 1e-3)
        for name in ("normal_force_n", "friction_x_n", "friction_y_n"):
            assert abs(r[name][0] - e[name][0]) <= within, (k, r, e)
        force = turned(LEVEL * [1, -1, -1, -1], r["force_on_finger_n"].astype(float))[0]
        assert np.abs(force - [e["friction_x_n"][0], e["friction_y_n"][0], e["normal_force_n"][0]]).max() <= within + 1e-6, (k, r, e)
    assert r["face"] == 1 and r["pitch_deg"] == pytest.approx(30) and framed.depth_mm == r["depth_mm"]


@pytest.mark.parametrize(("shape", "under_mm"), [(Shape.plane(), 0.0), (Shape.sphere(15), 15.0), (Shape.edge(4, 100), 0.0)], ids=repr)
def test_the_patches_are_a_skin_that_carries_the_wrench(shape: Shape, under_mm: float) -> None:
    """Two fingers of a human pad and of another tip: sums, a lift-off, a pose that is none; a bed is refused."""
    for pad in (Pad.shipped(), Pad.from_file(PAD.parent / "silicone-dome-pad.fpm")):
        position, quaternion = path(under_mm)
        contacts, touched = FrameContacts(pad, shape, 2), 0
        for k in range(0, 300, 3):
            for _ in range(4):
                r = contacts.step([position[k], [0, 0, -90]], quaternion[k])
            skin = contacts.patches()
            assert skin.shape == (2, pad.patches) and (skin["area_mm2"] > 0).all() and skin["area_mm2"][0] == pytest.approx(pad.patch_areas_mm2)
            loads = [skin[name] for name in ("force_n", "moment_n_mm", "pressure_mpa", "shear_mpa", "contact_area_mm2", "stick_ratio")]
            assert not any(load[1].any() for load in loads), "the second finger stays in the air"
            if r["regime"][0] == Regime.NO_CONTACT:
                assert not any(load[0].any() for load in loads)
                continue
            touched += 1
            force = skin["force_n"][0].astype(float)
            moment = np.cross(skin["place_mm"][0], force) + skin["moment_n_mm"][0]
            size = 1e-5 * (0.1 + r["normal_force_n"][0])
            assert np.abs(force.sum(0) - r["force_on_finger_n"][0]).max() < size, (k, r)
            assert np.abs(moment.sum(0) - r["moment_on_finger_n_mm"][0]).max() < 10 * size, (k, r)
        assert touched > 60
        before = contacts.patches()
        assert contacts.step([np.nan, 0, 0], NO_TURN)["status"].all() and (contacts.patches() == before).all()
    with pytest.raises(InputError, match="a bed of springs has none"):
        FrameContacts(Model.shipped(), Shape.plane()).patches()


def test_every_shape_is_met(pad: Pad) -> None:
    """From its own side, at about the same depth; faces by number."""
    quarter = about([1, 0, 0], 90.0)
    for shape, turn, under_mm, face in (
        (Shape.ellipsoid([12, 10, 6]), NO_TURN, 6, 1),
        (Shape.capsule(8, 20), quarter, 8, 1),
        (Shape.capsule(8, 20), NO_TURN, 28, 2),
        (Shape.cylinder(9, 15), NO_TURN, 15, 2),
        (Shape.edge(4, 110), NO_TURN, 0, 1),
        (Shape.cuboid((12, 14, 10), 3), quarter, 14, 2),
    ):
        contacts = FrameContacts(pad, shape, 2)
        for depth in np.linspace(-0.2, 1, 60):
            r = contacts.step(turned(LEVEL, [0, 0, depth - under_mm]), times(LEVEL, turn))
        assert (r["face"] == face).all() and (r["normal_force_n"] > 0.03).all() and (np.abs(r["depth_mm"] - 1) < 0.05).all(), (shape, r)
        assert eval(repr(shape)) == shape == pickle.loads(pickle.dumps(shape)) and contacts.shape == shape


def test_a_contact_that_begins_inside_is_flagged(pad: Pad) -> None:
    contacts = FrameContacts(pad, Shape.cuboid([30, 30, 10], 2))
    contacts.step([200, 0, -5], LEVEL)
    r = contacts.step(turned(LEVEL, [0, 0, 3 - 10]), LEVEL)
    assert r["status"] & Status.BEGAN_INSIDE and r["depth_mm"] <= 1
    slid = contacts.step(turned(LEVEL, [29, 0, 3 - 10]), LEVEL)
    assert slid["status"] & Status.BEYOND_EDGE


def test_states_are_kept_in_copies(pad: Pad) -> None:
    position, quaternion = path(15.0)
    contacts = FrameContacts(pad, Shape.sphere(15), 2)
    contacts.watch()
    for k in range(110):
        contacts.step(position[k], quaternion[k], strength_factor=[1, 1.4])
    events = contacts.events()
    assert events["finger"][events["change"] == "touch"].tolist() == [0, 1]
    kept = contacts.copy()
    expected = [contacts.step(position[k], quaternion[k]) for k in range(110, 130)]
    for _ in range(2):
        contacts.restore(kept)
        np.testing.assert_array_equal(contacts.strength_factor, np.float32([1, 1.4]))
        np.testing.assert_array_equal([contacts.step(position[k], quaternion[k]) for k in range(110, 130)], expected)
    contacts.restore(contacts)
    contacts.reset([True, False])
    assert contacts.depth_mm[0] == 0 < contacts.depth_mm[1] and contacts.strength_factor[0] == 1
    r = contacts.step(position[0], quaternion[0], out=contacts.step(position[0], quaternion[0]))
    assert r.dtype == FRAMES and (r["regime"] == Regime.NO_CONTACT).all() and len(contacts) == 2
    for other in ((pad, Shape.sphere(15)), (pad, Shape.sphere(16), 2), (pad.tuned(size=1.1), Shape.sphere(15), 2)):
        with pytest.raises(InputError, match=r"saved: .* but here it is .*Shape.sphere\(15.0\)>"):
            contacts.restore(FrameContacts(*other))
    with pytest.raises(TypeError):
        copy.deepcopy(contacts)


def test_relative_poses(pad: Pad) -> None:
    """The same finger and body, seen from everywhere."""
    random = np.random.default_rng(SEED)
    quaternions = random.normal(size=(50, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    world = random.normal(0, 100, (50, 3))
    place, turn = np.array([3.0, -1, 2]), about([0.6, 0, 0.8], 40.0)
    position, quaternion = relative_pose(world, quaternions, world + turned(quaternions, place), times(quaternions, turn))
    np.testing.assert_allclose(position, np.broadcast_to(place, (50, 3)), atol=1e-12)
    np.testing.assert_allclose(quaternion * np.sign(quaternion[:, :1]), np.broadcast_to(turn, (50, 4)), atol=1e-14)
    r = FrameContacts(pad, Shape.sphere(15)).step(*relative_pose([0, 0, 0], [1, 0, 0, 0], [0, 0, 0], [np.nan, 0, 0, 0]))
    assert r["status"] == Status.BAD_INPUT and r["face"] == 0


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda m, p: FrameContacts(m, Shape.sphere(20)), r"shape: Shape.sphere\(20.0\), but a bed of springs touches planes and cuboids alone"),
        (lambda m, p: FrameContacts(p, fingerpad.Sphere(20)), r"shape: Sphere\(radius_mm=20.0\) where a Shape is needed"),
        (lambda m, p: FrameContacts(p, Shape("ball")), r"shape: a ball of \[\] is none"),
        (lambda m, p: FrameContacts(p, Shape.plane(), -1), "count: -1 is not between 0 and"),
        (lambda m, p: FrameContacts(3, Shape.plane()), "model: int where a Model or a Pad"),
        (lambda m, p: Shape.sphere(0), "radius_mm: 0 is not between 0.1 and 1000000"),
        (lambda m, p: Shape.capsule(5, float("nan")), "half_length_mm: nan is not between 0.1"),
        (lambda m, p: Shape.edge(5, 180), "angle_deg: 180 is not between 1 and 179"),
        (lambda m, p: Shape.ellipsoid([1, 2, -3]), "semi_axes_mm: -3 is not between"),
        (lambda m, p: Shape.cuboid([1, 2], 1), r"half_mm: \[1, 2\] where three numbers are needed"),
        (lambda m, p: Shape.cuboid([1, 2, 3], "sharp"), "edge_radius_mm: 'sharp' where a number"),
        (lambda m, p: FrameContacts(p, Shape.plane(), 2).step(0.0, NO_TURN), r"position_mm: an array of shape \(\) where rows of 3 numbers"),
        (lambda m, p: FrameContacts(p, Shape.plane(), 2).step(np.zeros((3, 3)), NO_TURN), r"position_mm: an array of shape \(3, 3\) where \(2, 3\)"),
        (lambda m, p: FrameContacts(p, Shape.plane()).step(ORIGIN, [1, 0, 0]), r"quaternion_wxyz: an array of shape \(3,\)"),
        (lambda m, p: FrameContacts(p, Shape.plane()).restore(3), "saved: int where FrameContacts are needed"),
        (lambda m, p: relative_pose(ORIGIN, [1, 0, 0], ORIGIN, NO_TURN), r"finger_quaternion_wxyz: an array of shape \(3,\)"),
        (lambda m, p: relative_pose(np.zeros((2, 3)), NO_TURN, np.zeros((3, 3)), NO_TURN), r"finger_position_mm \(2,\), body_position_mm \(3,\)"),
    ],
)
def test_what_is_refused(model: Model, pad: Pad, make: Any, text: str) -> None:
    with pytest.raises(InputError, match=text):
        make(model, pad)


def test_a_cube_hangs_between_two_pads(pad: Pad) -> None:
    """Free in all directions, for a second: friction carries its weight, and it neither sinks nor turns on."""
    grip, mass_kg, dt_s = FrameContacts(pad, Shape.cuboid([15, 15, 15], 2), 2), 0.02, 1e-3
    inertia_kg_mm2 = mass_kg * 30**2 / 6
    turns = times(np.stack([NO_TURN, about([1, 0, 0], 180.0)]), about([0, 1, 0], 30.0))
    place, speed, turn, spin = np.zeros(3), np.zeros(3), NO_TURN, np.zeros(3)
    places = []
    for k in range(1400):
        depth = min(0.01 * k, 1.5)
        r = grip.step(*relative_pose([[0, 0, 15 - depth], [0, 0, depth - 15]], turns, place, turn), dt_s)
        force = turned(turn, r["force_on_body_n"].sum(0).astype(float)) - [mass_kg * 9.81 * min(k / 200, 1), 0, 0]
        speed = 0.95 * (speed + 1e3 * dt_s * force / mass_kg)
        spin = 0.95 * (spin + 1e3 * dt_s * r["moment_on_body_n_mm"].sum(0).astype(float) / inertia_kg_mm2)
        place = place + dt_s * speed
        turn = times(turn, np.array([1, *(0.5 * dt_s * spin)]))
        turn = turn / np.linalg.norm(turn)
        places.append(place)
    assert (r["status"] == 0).all() and (r["face"] == [3, 6]).all() and (r["slip_margin"] > 0.5).all(), r
    assert np.abs(force).max() < 1e-3 * mass_kg * 9.81 and np.linalg.norm(turn[1:]) < 0.1, (force, turn)
    assert np.linalg.norm(places[-1] - places[400]) < 1e-2 and 0.05 < np.linalg.norm(place) < 1, (place, places[400])


@pytest.mark.nightly
def test_the_example_with_pybullet() -> None:
    """An engine without an adapter: the pads carry the block's weight, and it does not creep."""
    found = runpy.run_path(str(Path(__file__).resolve().parents[1] / "examples/pybullet_block.py"))["hold"]()
    assert abs(found["carried_share"] - 1) < 1e-3 and found["creep_um_s"] < 1e-3, found
    assert found["flags"] == 0 and 0.2 < found["sag_mm"] < 0.5 and found["slip_margin"] > 0.5, found
