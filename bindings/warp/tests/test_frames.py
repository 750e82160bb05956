"""Contacts from poses on Warp follow the core, on every shape, with both models of the finger."""

from __future__ import annotations

from typing import Any

import fingerpad
import numpy as np
import pytest
from conftest import SEED
from scipy.spatial.transform import Rotation

import fingerpad_warp as fw

STEPS, COUNT = 180, 6
#: Arguments of a shape, and how far its surface is from its origin: along z, and with the body turned about x by 45 and 90 degrees.
SHAPES: dict[str, tuple[tuple[Any, ...], tuple[float, ...]]] = {
    "plane": ((), (0.0,)),
    "cuboid": (([15, 12, 10], 2), (10.0, 22 / np.sqrt(2) - 0.6, 12.0)),
    "sphere": ((20,), (20.0,)),
    "ellipsoid": (([25, 20, 15],), (15.0,)),
    "capsule": ((12, 20), (32.0, 18.5 * np.sqrt(2), 12.0)),
    "cylinder": ((12, 20), (20.0, 60.0, 12.0)),
    "edge": ((3, 100), (0.0,)),
}


#: Flat, round and long faces and edges in each run of the tests, the others at night.
CASES: list[Any] = [("bed", "plane"), ("bed", "cuboid"), ("pad", "cuboid"), ("pad", "capsule")]
CASES += [pytest.param("pad", name, marks=pytest.mark.nightly) for name in ("plane", "sphere", "ellipsoid", "cylinder", "edge")]


def poses(name: str) -> tuple[Any, Any]:
    """Bodies that come up, slide, turn, tilt, leave and come back, some turned on end: shapes (steps, fingers, 3) and (…, 4)."""
    random, away = np.random.default_rng(SEED), SHAPES[name][1]
    position, quaternion = np.empty((STEPS, COUNT, 3)), np.empty((STEPS, COUNT, 4))
    t = 0.02 * np.arange(STEPS)
    for i in range(COUNT):
        k = i % len(away)
        lies = Rotation.from_euler("x", 45 * k if len(away) > 1 else 0, degrees=True)
        phase = random.uniform(0, 6, 6)
        neutral = Rotation.from_euler("y", -30 + random.uniform(-8, 8), degrees=True)
        yaw = random.uniform(-20, 20) if k == 1 else random.uniform(-180, 180)
        way = np.stack([yaw + 10 * np.sin(t + phase[1]), 4 * np.sin(1.3 * t + phase[2]), 4 * np.sin(0.7 * t + phase[3])], axis=1)
        depth = -0.3 + np.minimum(np.arange(STEPS) / 40, 1) * random.uniform(1.2, 2) + 0.2 * np.sin(2 * t + phase[0])
        depth[120:130] -= 3
        slide = np.stack([0.5 * np.sin(t + phase[4]), 0.5 * np.sin(0.8 * t + phase[5]), depth - away[k]], axis=1)
        position[:, i] = neutral.apply(slide)
        quaternion[:, i] = np.roll((neutral * Rotation.from_euler("zyx", way, degrees=True) * lies).as_quat(), 1, axis=1)
    position[77, 0, 1], quaternion[99, 1] = np.nan, 2 * quaternion[99, 1]
    return position, quaternion


@pytest.mark.parametrize(("kind", "name"), CASES)
def test_numbers_of_the_core(model: fw.Model, pad: fw.Pad, device: str, kind: str, name: str) -> None:
    """Forces and moments on both bodies in 1080 steps, over the largest of each: the geometry agrees to single precision.

    The solvers of a pad stop within a tolerance of the equilibrium, which with a bed does not hide the geometry.
    """
    finger = model if kind == "bed" else pad
    contacts = fw.FrameContacts(finger, getattr(fw.Shape, name)(*SHAPES[name][0]), COUNT, device=device)
    reference = (fingerpad.Model if kind == "bed" else fingerpad.Pad).from_bytes(finger.to_bytes())
    core = fingerpad.FrameContacts(reference, getattr(fingerpad.Shape, name)(*SHAPES[name][0]), COUNT)
    apart, sizes, faces, flags, regimes = [], [], set(), 0, set()
    for k, (position, quaternion) in enumerate(zip(*poses(name), strict=True)):
        strength = 1.0 if k < 140 else 0.6
        found = contacts.step(position, quaternion, strength_factor=strength).numpy()
        expected = core.step(position, quaternion, strength_factor=strength)
        wrenches = np.concatenate([contacts.on_finger.numpy(), contacts.on_body.numpy()], axis=1).reshape(COUNT, 4, 3)
        names = ("force_on_finger_n", "moment_on_finger_n_mm", "force_on_body_n", "moment_on_body_n_mm")
        wanted = np.stack([expected[each] for each in names], axis=1)
        apart.append(np.abs(wrenches - wanted).max(axis=2))
        sizes.append(np.abs(wanted).max(axis=2))
        np.testing.assert_array_equal(found["status"], expected["status"], err_msg=f"seed {SEED}, step {k}")
        np.testing.assert_array_equal(contacts.face.numpy(), expected["face"], err_msg=f"seed {SEED}, step {k}")
        faces |= set(expected["face"])
        regimes |= set(expected["regime"])
        flags |= int(np.bitwise_or.reduce(expected["status"]))
    share = np.array(apart) / np.array(sizes).max(axis=(0, 1))
    summary = f"seed {SEED}: 99.9 % within {np.quantile(share, 0.999):.1e} of the largest, all within {share.max():.1e}, faces {sorted(faces)}"
    print(summary)
    mostly, always = (1e-5, 1e-5) if kind == "bed" else (3e-4, 1e-3)
    assert np.quantile(share, 0.999) <= mostly and share.max() <= always, summary
    assert flags & fw.Status.BAD_INPUT and regimes >= {0, 1, 2}, (flags, regimes)
    if name == "cuboid" and kind == "pad":
        assert max(faces) >= 7, "an edge of the box is touched"


def test_what_cannot_be_is_named(model: fw.Model, pad: fw.Pad) -> None:
    for make, text in (
        (lambda: fw.FrameContacts(model, fw.Shape.sphere(20)), "a bed of springs touches planes and cuboids alone"),
        (lambda: fw.FrameContacts(pad, fw.Sphere(20)), r"shape: Sphere\(radius_mm=20.0\) where a Shape is needed"),  # type: ignore[arg-type]
        (lambda: fw.FrameContacts(pad, fw.Shape.plane(), 0), "count: 0 is not between 1 and"),
        (lambda: fw.Shape.sphere(0), "size_mm: 0 is not between 0.1 and 1000000"),
        (lambda: fw.Shape.edge(3, 180), "angle_deg: 180 is not between 1 and 179"),
        (lambda: fw.Shape.cuboid(3, 1), "half_mm: 3 where three numbers are needed"),  # type: ignore[arg-type]
    ):
        with pytest.raises(fw.InputError, match=text):
            make()
