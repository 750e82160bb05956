"""The largest stable time step of contacts in MuJoCo Warp: that of masses on a spring; light blocks are held below it and lost above."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from conftest import MODEL

import fingerpad_warp as fw

# A package of the nightly tests.
mujoco_warp = pytest.importorskip("mujoco_warp")
pytestmark = pytest.mark.nightly
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
import scenes  # noqa: E402

from fingerpad_warp.mujoco import Callback  # noqa: E402

GRIP_N = np.array([0.3, 0.6, 1.0, 1.4])
MASSES = 0.03, 0.005
SLIDES = f"""<mujoco>
  <option timestep="0.0001" gravity="0 0 0"/>
  <worldbody>
    <body pos="0 0 {{z}}"><joint type="slide" axis="0 0 1"/><geom size="0.005" mass="{MASSES[0]}" contype="0" conaffinity="0"/><site name="tip" euler="0 30 0"/></body>
    <body><joint type="slide" axis="0 0 1"/><geom name="plate" type="box" size="0.05 0.05 0.01" pos="0 0 -0.01" mass="{MASSES[1]}" contype="0" conaffinity="0"/></body>
  </worldbody>
</mujoco>"""


@pytest.mark.parametrize(("depth_mm", "touches"), [(1.5, True), (-1.0, False)])
def test_the_step_is_that_of_two_masses_on_a_spring(depth_mm: float, touches: bool) -> None:
    """h² k + 2 h c = 4 m, less a margin of a tenth."""
    mj_model = mujoco.MjModel.from_xml_string(SLIDES.format(z=-0.001 * depth_mm))
    m, d = mujoco_warp.put_model(mj_model), mujoco_warp.put_data(mj_model, mujoco.MjData(mj_model), nworld=2)
    model = fw.Model.from_file(MODEL)
    callback = Callback(model, mj_model, m, d, [("tip", "plate")])
    mujoco_warp.step(m, d)
    fingers, by_mm, damping = fw.Fingers(model, 2), 2e-3, 2.0
    forces = fingers.step([depth_mm - by_mm / 2, depth_mm + by_mm / 2]).normal_force_n.numpy()
    stiffness, mass = 1e3 * (forces[1] - forces[0]) / by_mm, 1 / sum(1 / mass for mass in MASSES)
    expected = 0.9 * (-damping + np.sqrt(damping**2 + 4 * stiffness * mass)) / stiffness if touches else np.inf
    np.testing.assert_allclose(callback.stable_step(m, d), expected, rtol=0.03)


def held(model: Any, timestep: float, seconds: float, asks: bool) -> tuple[Any, Any, Any]:
    """Largest stable step and speed of a block of 5 g in the last two thirds, in worlds of other grips, and the responses at the end."""
    _, m, d, callback = scenes.grip(len(GRIP_N), timestep=timestep, mass_kg=0.005, model=model)
    d.ctrl.assign(GRIP_N[:, None].astype(np.float32))
    scenes.seconds(m, d, seconds / 3, timestep)
    stable = callback.stable_step(m, d) if asks else None
    speed = np.zeros(len(GRIP_N))
    for _ in range(round(2 * seconds / 3 / timestep)):
        mujoco_warp.step(m, d)
        speed = np.maximum(speed, np.abs(d.qvel.numpy()[:, 1:4]).max(axis=1))
    return stable, speed, callback.read()


@pytest.mark.parametrize("kind", ["bed", "pad"])
def test_light_blocks_are_held_at_the_stable_step(model: fw.Model, pad: fw.Pad, kind: str) -> None:
    finger = model if kind == "bed" else pad
    stable, speed, answer = held(finger, 2.5e-4, 0.3, asks=True)
    print(f"{kind}: stable step, ms: {1e3 * stable}, speed, m/s: {speed}")
    assert (speed < 1e-3).all() and (answer["status"] == 0).all()
    _, speed, _ = held(finger, stable.min(), 0.6, asks=False)
    assert (speed < 1e-3).all(), f"{kind} at the stable step: {speed} m/s"
    _, speed, _ = held(finger, 1.6 * stable.max(), 0.6, asks=False)
    assert (speed > 0.1).all(), f"{kind} at 1.6 times the stable step: {speed} m/s"


def test_a_step_that_is_too_long_is_flagged(model: fw.Model) -> None:
    _, m, d, callback = scenes.grip(2, timestep=0.004, mass_kg=0.005, model=model)
    d.ctrl.assign(np.array([[1.0], [-1.0]], np.float32))
    scenes.seconds(m, d, 0.02)
    stable = callback.stable_step(m, d)
    assert stable[0] < 0.004 and stable[1] == np.inf
    mujoco_warp.forward(m, d)
    answer = callback.read()
    touches = answer["regime"] != fw.Regime.NO_CONTACT
    assert touches[0].any() and not touches[1].any()
    np.testing.assert_array_equal(answer["status"] & fw.Status.STEP_TOO_LONG != 0, touches)


def test_asking_leaves_no_trace(model: fw.Model) -> None:
    first, second = (held(model, 0.0005, 0.15, asks=asks) for asks in (False, True))
    np.testing.assert_array_equal(first[1], second[1])
    np.testing.assert_array_equal(first[2], second[2])
