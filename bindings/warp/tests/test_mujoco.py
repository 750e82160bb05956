"""Fingertips in MuJoCo Warp: a held block, the forces on the bodies, geoms of all kinds, memory, energy, misuse."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import fingerpad
import mujoco
import numpy as np
import pytest
import warp as wp
from conftest import DEVICES, MODEL, SEED
from scipy.spatial.transform import Rotation
from test_frames import COUNT, SHAPES, poses

import fingerpad_warp as fw
from fingerpad_warp import _frames

# A package of the nightly tests.
mujoco_warp = pytest.importorskip("mujoco_warp")
pytestmark = pytest.mark.nightly
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
import scenes  # noqa: E402

from fingerpad_warp.mujoco import Callback  # noqa: E402


@pytest.fixture(params=DEVICES, autouse=True)
def on_device(request: pytest.FixtureRequest) -> Any:
    with wp.ScopedDevice(request.param):
        yield request.param


def test_4096_worlds_hold_or_let_slip(model: fw.Model) -> None:
    """Grip and strength at random: the core's least grip says which blocks are held. None of those drifts by 1e-3 um/s."""
    random, worlds = np.random.default_rng(SEED), 4096
    grip_n, strength = random.uniform(0.05, 1.2, worlds), random.uniform(0.5, 1.5, worlds)
    _, m, d, callback = scenes.grip(worlds, strength_factor=strength[:, None])
    d.ctrl.assign(grip_n[:, None].astype(np.float32))
    scenes.seconds(m, d, 0.3)
    scenes.set_gravity(m, scenes.GRAVITY)
    scenes.seconds(m, d, 2.4)
    before = scenes.mean_place_mm(m, d)
    scenes.seconds(m, d, 0.8)
    # From the middle of the first 0.2 s to that of the second it is a second.
    drift_um_s = 1e3 * np.abs(scenes.mean_place_mm(m, d) - before).max(axis=1)
    core = fingerpad.Model.from_bytes(model.to_bytes())
    load_n = scenes.MASS_KG * scenes.GRAVITY / 2
    # The weight pulls the block towards the root of the fingers. The core's least grip has the 95 % band of friction on the safe side.
    least_n = np.array([core.least_grip(-load_n, strength_factor=s)[1] for s in strength])
    holds, slips = grip_n > 1.02 * least_n, grip_n < 0.85 * least_n
    assert holds.sum() > 2000 and slips.sum() > 100
    answer = callback.read()
    for name, which in (("hold", holds), ("slip", slips)):
        print(f"{which.sum()} worlds should {name}: drift {drift_um_s[which].min():.1e} to {drift_um_s[which].max():.1e} um/s")
    assert (answer["status"][holds] == 0).all()
    worst, least = np.argmax(np.where(holds, drift_um_s, 0)), drift_um_s[slips].min()
    assert drift_um_s[worst] < 1e-3, f"seed {SEED}, world {worst}: {drift_um_s[worst]:.1e} um/s"
    assert least > 1e3, f"seed {SEED}: a block that its grip cannot hold drifts by {least:.1e} um/s"
    held_n = -answer["friction_x_n"][holds].sum(axis=1)
    np.testing.assert_allclose(held_n, 2 * load_n, rtol=1e-4)


def shaken(m: Any, d: Any, callback: Any, steps: int, between: Any = None) -> list[Any]:
    """Motions and responses of all contacts while the grip and a push on the block change at random."""
    random, out = np.random.default_rng(SEED), []
    for _ in range(steps):
        d.ctrl.assign((0.5 + 0.1 * random.standard_normal((d.nworld, 1))).astype(np.float32))
        push = np.zeros((d.nworld, 4, 6), np.float32)
        push[:, 3] = random.normal(0, [0.3, 0.3, 0.3, 1e-3, 1e-3, 1e-3], (d.nworld, 6))
        d.xfrc_applied.assign(push)
        mujoco_warp.step(m, d)
        motion = {name: array.numpy().copy() for name, array in callback._frames.motion.items()}
        out.append((motion, callback.response.numpy()))
        if between is not None:
            between()
    return out


@pytest.mark.parametrize(("integrator", "late"), [("Euler", False), ("implicitfast", False), ("Euler", True)])
def test_contacts_follow_the_core(on_device: str, integrator: str, late: bool) -> None:
    """What the callback passes to the model, step by step, leads the core to the same responses; trials in between leave no trace.

    After 1e6 s the time in single precision stands still. Then there are no trials.
    """
    _, m, d, callback = scenes.grip(8, integrator=integrator)
    d.time.assign(np.full(8, 1e6 if late else 0, np.float32))

    def trials() -> None:
        kept = d.qpos.numpy().copy()
        d.qpos.assign(kept + np.float32(1e-4))
        mujoco_warp.forward(m, d)
        d.qpos.assign(kept)

    steps = shaken(m, d, callback, 150, None if late else trials)
    assert (d.time.numpy() == 1e6).all() == late
    core = fingerpad.Fingers(fingerpad.Model.from_file(MODEL), 16, spin=True)
    seen = set()
    for motion, found in steps:
        expected = core.step(**motion, outputs="all")
        seen |= set(expected["regime"])
        for name in ("normal_force_n", "friction_x_n", "friction_y_n", "spin_moment_n_mm"):
            np.testing.assert_allclose(found[name], expected[name], rtol=0, atol=0 if on_device == "cpu" else 1e-5, err_msg=name)
    assert seen >= {1, 2}
    spins = np.array([motion["spin_rad"] for motion, _ in steps])
    slides = np.array([motion["slide_y_mm"] for motion, _ in steps])
    assert np.abs(spins).max() > 1e-4 and np.abs(slides).max() > 1e-3, "the block turns and moves sideways"


def test_generalised_forces_are_those_of_mujoco() -> None:
    """Force and moment of each contact, applied to both bodies by MuJoCo itself, give the same generalised forces."""
    mj_model, m, d, callback = scenes.grip(6)
    shaken(m, d, callback, 60)
    mujoco_warp.forward(m, d)
    wrench, passive = callback._wrench.numpy().astype(np.float64), d.qfrc_passive.numpy()
    for world in range(6):
        mj_data = mujoco.MjData(mj_model)
        mj_data.qpos[:], mj_data.qvel[:] = d.qpos.numpy()[world], d.qvel.numpy()[world]
        mujoco.mj_forward(mj_model, mj_data)
        expected = mj_data.qfrc_passive.copy()
        for k, (site, geom) in enumerate(callback.contacts):
            at = mj_data.site_xpos[site]
            for sign, body in ((1, mj_model.site_bodyid[site]), (-1, mj_model.geom_bodyid[geom])):
                mujoco.mj_applyFT(mj_model, mj_data, sign * wrench[world, k, :3], sign * wrench[world, k, 3:], at, body, expected)
        assert np.abs(wrench[world]).max() > 0.05
        np.testing.assert_allclose(passive[world], expected, atol=2e-6)


GEOMS = {
    "plane": 'type="plane" size="1 1 1"',
    "cuboid": 'type="box" size="0.015 0.012 0.01"',
    "sphere": 'type="sphere" size="0.02"',
    "capsule": 'type="capsule" size="0.012 0.02"',
    "cylinder": 'type="cylinder" size="0.012 0.02"',
}
TOUCH = """<mujoco>
  <option timestep="0.00001" gravity="0 0 0"><flag contact="disable"/></option>
  <worldbody>
    <geom name="thing" {geom} pos="0.01 -0.02 0.03" euler="20 -40 70"/>
    <body name="finger"><freejoint/><geom size="0.008" mass="0.03"/><site name="tip"/></body>
  </worldbody>
</mujoco>"""


@pytest.mark.parametrize(
    ("kind", "name"), [("bed", "plane"), ("bed", "cuboid"), *(("pad", name) for name in ("plane", "cuboid", "sphere", "capsule", "cylinder"))]
)
def test_geoms_are_the_shapes_of_contacts_in_frames(model: fw.Model, pad: fw.Pad, kind: str, name: str) -> None:
    """Depth, force and moment of a finger that moves about a geom are those of `FrameContacts`; trials in between leave no trace.

    The solver of a pad stops within a tolerance of the equilibrium; the depth shows the geometry itself.
    """
    finger = model if kind == "bed" else pad
    mj_model = mujoco.MjModel.from_xml_string(TOUCH.format(geom=GEOMS[name]))
    mj_data = mujoco.MjData(mj_model)
    mujoco.mj_forward(mj_model, mj_data)
    m, d = mujoco_warp.put_model(mj_model), mujoco_warp.put_data(mj_model, mj_data, nworld=COUNT)
    callback = Callback(finger, mj_model, m, d, [("tip", "thing")])
    contacts = fw.FrameContacts(finger, getattr(fw.Shape, name)(*SHAPES[name][0]), COUNT)
    geom = Rotation.from_matrix(mj_data.geom_xmat[0].reshape(3, 3))
    apart, sizes, regimes = [], [], set()
    for k, (position, quaternion) in enumerate(zip(*poses(name), strict=True)):
        quaternion = quaternion / np.linalg.norm(quaternion, axis=1)[:, None]
        turn = geom * Rotation.from_quat(np.roll(quaternion, -1, axis=1)).inv()
        qpos = np.concatenate([mj_data.geom_xpos[0] - turn.apply(position) / 1000, np.roll(turn.as_quat(), 1, axis=1)], axis=1)
        d.time.assign(np.full(COUNT, 0.001 * k, np.float32))
        for aside_m in (2e-4, 0.0):
            d.qpos.assign((qpos + aside_m * (np.arange(7) < 3)).astype(np.float32))
            mujoco_warp.forward(m, d)
        # Of a free joint: the force in the world, and the moment about the body's own axes.
        passive = d.qfrc_passive.numpy().astype(np.float64)
        found = np.stack([turn.inv().apply(passive[:, :3]), 1000 * passive[:, 3:]], axis=1)
        answer = contacts.step(position, quaternion, 1e-5).numpy()
        expected = contacts.on_finger.numpy().reshape(COUNT, 2, 3)
        expected[(answer["status"] & fw.Status.BAD_INPUT) != 0] = 0
        where = f"seed {SEED}, step {k}"
        np.testing.assert_array_equal(callback.read()["status"][:, 0], answer["status"], err_msg=where)
        np.testing.assert_allclose(callback.depth_mm()[:, 0], contacts.depth_mm.numpy(), rtol=0, atol=3e-5, err_msg=where)
        apart.append(np.abs(found - expected).max(axis=2))
        sizes.append(np.abs(expected).max(axis=2))
        regimes |= set(answer["regime"])
    share = np.array(apart) / np.array(sizes).max(axis=(0, 1))
    summary = f"seed {SEED}, {kind} on a {name}: within {share.max():.1e} of the largest"
    print(summary)
    assert share.max() <= (1e-5 if kind == "bed" else 1e-3), summary
    assert regimes >= {0, 1, 2}, regimes


@wp.kernel
def lowest_and_slopes(
    pad: wp.array(dtype=float), pose: wp.array(dtype=wp.vec2), lowest_mm: wp.array(dtype=float), slopes_mm: wp.array(dtype=wp.vec2)
):
    i = wp.tid()
    pitch, roll = pose[i][0], pose[i][1]
    held = _frames.held_pose(pad, pitch, roll)
    lowest_mm[i] = _frames.lowest_mm(pad, wp.vec2(), pitch, roll)
    slopes_mm[i] = _frames.lowest_slopes_mm(pad, wp.vec2(), pitch, roll, held, held[0] == pitch, held[1] == roll)


def test_slopes_are_those_of_the_depth(pad: fw.Pad) -> None:
    """Where the pad follows an angle of the pose or holds it at the end of its range; from neutral on, -20 to 40 and -30 to 30 degrees."""
    places = np.radians([(pitch, roll) for pitch in (-33, -15, 10, 50) for roll in (-40, -20, 0, 20, 40)])

    def at(pose: Any) -> tuple[Any, Any]:
        lowest_mm, slopes_mm = wp.zeros(len(pose), dtype=float), wp.zeros(len(pose), dtype=wp.vec2)
        inputs = [wp.array(pad.numbers, dtype=float), wp.array(pose, dtype=wp.vec2)]
        wp.launch(lowest_and_slopes, dim=len(pose), inputs=inputs, outputs=[lowest_mm, slopes_mm])
        return lowest_mm.numpy().astype(np.float64), slopes_mm.numpy()

    step = 0.01
    for axis in (0, 1):
        way = step * np.eye(2)[axis]
        expected = (at(places + way)[0] - at(places - way)[0]) / (2 * step)
        np.testing.assert_allclose(at(places)[1][:, axis], expected, atol=4e-3)


@pytest.mark.parametrize("integrator", ["Euler"])
def test_pads_follow_the_core(pad: fw.Pad, integrator: str) -> None:
    """The same for pads, whose pose changes as the block turns."""
    _, m, d, callback = scenes.grip(8, timestep=0.002, integrator=integrator, model=pad)
    steps = shaken(m, d, callback, 150)
    core = fingerpad.Fingers(fingerpad.Pad.from_bytes(pad.to_bytes()), 16)
    poses, apart, limits = [], [], []
    for motion, found in steps:
        expected = core.step(**motion, outputs="all")
        poses.append([motion["pitch_deg"], motion["roll_deg"]])
        names = ("normal_force_n", "friction_x_n", "friction_y_n")
        apart.append(np.max([np.abs(found[name] - expected[name]) for name in names], axis=0))
        limits.append(expected["friction_limit_n"])
        np.testing.assert_array_equal(found["status"], expected["status"])
    assert np.quantile(np.array(apart) / np.max(limits, axis=0), 0.999) < 1e-4
    assert np.ptp(poses, axis=0).max() > 0.05, "the pose changes"


def test_pads_hold(pad: fw.Pad) -> None:
    """A block in two pads, 0.3 to 2 N: no drift, and the sag of the core, pressed to 0.6 N and slid slowly (0.807 mm)."""
    grip_n = np.array([0.3, 0.6, 1.0, 2.0])
    _, m, d, callback = scenes.grip(4, timestep=0.003, model=pad)
    d.ctrl.assign(grip_n[:, None].astype(np.float32))
    scenes.seconds(m, d, 0.5, 0.003)
    scenes.set_gravity(m, scenes.GRAVITY)
    scenes.seconds(m, d, 1.7, 0.003)
    before = scenes.mean_place_mm(m, d, 66)
    scenes.seconds(m, d, 0.8, 0.003)
    after = scenes.mean_place_mm(m, d, 66)
    print(f"drift, um/s: {1e3 * np.abs(after - before).max(axis=1)}, sag, mm: {after[:, 2]}")
    assert 1e3 * np.abs(after - before).max() < 1e-3, f"drift, um/s: {1e3 * np.abs(after - before).max(axis=1)}"
    assert (callback.read()["status"] == 0).all()
    assert abs(after[1, 2] + 0.807) < 0.03, after[:, 2]


def work_of_a_closed_path(
    slide_m: float, turn_rad: float, damping: float = 0.0, tilt_rad: float = 0.0, way: int = 1, axis: int | None = None, **options: Any
) -> tuple[float, float]:
    """Work, and work exchanged back and forth, of the contacts of the block on a closed path in all six directions, mJ.

    The path is gone twice, and the second time counts: what slips in the first cycle does so once. Forces are explicit. `way` is 1 or -1; `axis`: one
    of the six alone.
    """
    dampers = {"damping_normal_n_s_per_m": damping, "damping_slide_n_s_per_m": damping, "damping_spin_n_m_s_per_rad": 1e-5 * damping}
    mj_model, m, d, callback = scenes.grip(1, timestep=1e-4, **dampers, **options)
    random = np.random.default_rng(SEED)
    start = np.zeros(mj_model.nq)
    start[0] = 2.4e-3
    # Turned about the world's y axis: one finger is pitched up, the other down.
    start[4], start[6] = np.cos(tilt_rad / 2), np.sin(tilt_rad / 2)
    phases, count = random.uniform(0, 6, 6), 150
    sizes = np.array([slide_m] * 3 + [turn_rad] * 3)
    if axis is not None:
        sizes[np.arange(6) != axis] = 0
    places, forces = [], []
    for k in range(2 * count + 1):
        angle = way * 2 * np.pi * k / count
        to = np.zeros(mj_model.nv)
        to[1:] = sizes * (np.sin(angle * (1 + np.arange(6) % 2) + phases) - np.sin(phases))
        qpos = start.copy()
        qpos[1] = -1.2e-3
        mujoco.mj_integratePos(mj_model, qpos, to, 1.0)
        if places:
            speed = np.zeros(mj_model.nv)
            mujoco.mj_differentiatePos(mj_model, speed, 0.004, places[-1], qpos)
            d.qvel.assign(speed[None].astype(np.float32))
        d.qpos.assign(qpos[None].astype(np.float32))
        d.time.assign(np.array([0.004 * k], np.float32))
        mujoco_warp.forward(m, d)
        places.append(qpos)
        forces.append(d.qfrc_passive.numpy()[0].astype(np.float64))
    answer = callback.read()[0]
    assert (answer["stick_ratio"] > 0.3).all() and (answer["normal_force_n"] > 0.1).all()
    work = swept = 0.0
    for k in range(count, 2 * count):
        gone = np.zeros(mj_model.nv)
        mujoco.mj_differentiatePos(mj_model, gone, 1.0, places[k], places[k + 1])
        part = (forces[k] + forces[k + 1]) / 2 * gone
        work, swept = work + 1e3 * part[1:].sum(), swept + 1e3 * np.abs(part[1:]).sum()
    return work, swept


def test_no_closed_path_yields_energy() -> None:
    """Without dampers a path that sticks gives back what it took; a wider one slips and takes, and so do dampers."""
    for slide_m, turn_rad in ((1e-5, 0.0), (0.0, 5e-4), (5e-6, 2e-4)):
        work, swept = work_of_a_closed_path(slide_m, turn_rad)
        print(f"{work / swept:.1e} of the work exchanged")
        assert abs(work) < 2e-4 * swept, f"{slide_m} m, {turn_rad} rad: {work:.2e} of {swept:.2e} mJ"
    work, swept = work_of_a_closed_path(4e-5, 2e-2)
    assert -0.5 * swept < work < -0.01 * swept
    # Along the grip, across and along the fingers, about the grip.
    for axis in range(4):
        work, swept = work_of_a_closed_path(5e-6, 2e-4, 0.5, axis=axis)
        assert work < -1e-3 * swept, f"dampers along axis {axis}: {work:.2e} of {swept:.2e} mJ"


@pytest.mark.parametrize("tilt_rad", [0.0, 0.1, 0.45])
def test_no_closed_path_of_pads_yields_energy(pad: fw.Pad, tilt_rad: float) -> None:
    """A pad gives back what it took on small paths, also where it holds the pose at the end of its range (26 degrees off)."""
    work, swept = work_of_a_closed_path(1e-5, 5e-4, model=pad, tilt_rad=tilt_rad)
    print(f"{work / swept:.1e} of the work exchanged")
    assert abs(work) < 2e-3 * swept, f"{work:.2e} of {swept:.2e} mJ"


@pytest.mark.parametrize(("kind", "tilt_rad"), [("bed", 0.1), ("pad", 0.45)])
def test_a_path_takes_the_same_both_ways_round(pad: fw.Pad, kind: str, tilt_rad: float) -> None:
    """Tilted fingers on a wide path: a moment that does not belong to the depth would take on one way and give on the other."""
    options = {"model": pad} if kind == "pad" else {}
    shares = []
    for way in (1, -1):
        work, swept = work_of_a_closed_path(2e-4, 2e-2, tilt_rad=tilt_rad, way=way, **options)
        shares.append(work / swept)
    assert max(shares) < 0 and abs(shares[0] - shares[1]) < 0.01, shares


def test_a_place_that_is_no_number_is_flagged() -> None:
    _, m, d, callback = scenes.grip(3)
    d.ctrl.assign(np.full((3, 1), 0.5, np.float32))
    scenes.seconds(m, d, 0.3)
    kept = d.qpos.numpy().copy()
    qpos = kept.copy()
    qpos[1, 2] = np.nan
    d.qpos.assign(qpos)
    mujoco_warp.forward(m, d)
    answer = callback.read()
    assert (answer["status"] == [[0, 0], [fw.Status.BAD_INPUT] * 2, [0, 0]]).all()
    assert not callback._wrench.numpy()[1].any() and callback._wrench.numpy()[0].any()
    d.qpos.assign(kept)
    mujoco_warp.forward(m, d)
    answer = callback.read()
    np.testing.assert_array_equal(answer["normal_force_n"][1], answer["normal_force_n"][0])
    assert (answer["status"] == 0).all() and (answer["normal_force_n"] > 0.1).all()


def test_a_reset_begins_anew() -> None:
    _, m, d, callback = scenes.grip(2)
    first = shaken(m, d, callback, 30)
    mujoco_warp.reset_data(m, d)
    second = shaken(m, d, callback, 30)
    for (_, a), (_, b) in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


def test_misuse_is_named(model: fw.Model, pad: fw.Pad) -> None:
    for options, text in (
        ({"contacts": [("thumb", "object")]}, "contacts: the model has no site 'thumb'"),
        ({"contacts": [("left", "ball")]}, "contacts: the model has no geom 'ball'"),
        ({"contacts": ["left"]}, r"contacts: \['left'\] where pairs"),
        ({"contacts": []}, "contacts: at least one pair is needed"),
        ({"geom": "sphere"}, "contacts: geom 'object' is of type sphere; a bed touches plane, box"),
        ({"geom": "ellipsoid", "model": pad}, r"contacts: geom 'object' has the semi-axes \[20. 20. 30.\] mm; a pad takes a ratio of up to 1.4"),
        ({"edge_radius_mm": 2}, "edge_radius_mm: 2, but a bed touches no edges"),
        ({"edge_radius_mm": 11, "model": pad}, "edge_radius_mm: 11 is not between 0.1 and 10"),
        ({"integrator": "RK4"}, "integrator: RK4 is none of EULER, IMPLICIT, IMPLICITFAST"),
        ({"strength_factor": 9}, "strength_factor: 9 is not between 0.1 and 5"),
        ({"damping_slide_n_s_per_m": -1}, "damping_slide_n_s_per_m: -1 is not between 0 and"),
        ({"pad_radius_mm": 21}, "pad_radius_mm: 21 where two numbers are needed"),
        ({"model": "bed"}, "model: str where a Model or a Pad is needed"),
        ({"model": pad, "pad_radius_mm": (21, 21)}, r"pad_radius_mm: \(21, 21\), but a pad has a shape of its own"),
    ):
        with pytest.raises(fw.InputError, match=text):
            scenes.grip(2, **options)
    _, m, _, _ = scenes.grip(2)
    _, _, other, _ = scenes.grip(3)
    with pytest.raises(fw.InputError, match="d: 3 worlds where 2 are needed"):
        mujoco_warp.step(m, other)
