"""Light objects in MuJoCo Warp at long time steps: nothing is thrown, no energy is made, the motion is that of the plugin for MuJoCo."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from conftest import MODEL, PAD, SEED
from scipy.spatial.transform import Rotation

import fingerpad_warp as fw

# A package of the nightly tests.
mujoco_warp = pytest.importorskip("mujoco_warp")
pytestmark = pytest.mark.nightly
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
import scenes  # noqa: E402

from fingerpad_warp.mujoco import Callback  # noqa: E402

#: Masses, kg, and grips, N, of the worlds.
MASSES, GRIPS = (0.001, 0.002, 0.003, 0.005, 0.01, 0.045), np.arange(0.8, 2.5, 0.3)
FLAT = """<mujoco>
  <option timestep="0.001" gravity="0 0 0"/>
  <worldbody>
    <geom name="plate" type="plane" size="1 1 0.1" contype="0" conaffinity="0"/>
    <body name="finger"><freejoint/><geom size="0.008" mass="0.03" contype="0" conaffinity="0"/><site name="tip"/></body>
  </worldbody>
</mujoco>"""


@pytest.mark.parametrize("timestep", [0.001, 0.002, 0.003, 0.004])
@pytest.mark.parametrize(
    ("cone", "integrator", "jacobian"), [("pyramidal", "Euler", "dense"), ("elliptic", "implicitfast", "sparse"), ("elliptic", "Euler", "dense")]
)
def test_none_of_six_grips_throws_a_block_of_1_to_45_g(pad: fw.Pad, timestep: float, cone: str, integrator: str, jacobian: str) -> None:
    """A hand lifts a block off a table by 60 mm/s. Friction is within the limit of the normal force in every step."""
    masses, grips = (column.ravel() for column in np.meshgrid(MASSES, GRIPS))
    m, d, callback = scenes.lift(masses, pad, timestep, cone=cone, integrator=integrator, jacobian=jacobian)
    speed, ctrl = np.zeros(len(masses)), np.column_stack([0 * grips, grips, grips]).astype(np.float32)
    for k in range(round(2.0 / timestep)):
        ctrl[:, 0] = 0.06 * np.clip(k * timestep - 0.8, 0, 1)
        d.ctrl.assign(ctrl)
        mujoco_warp.step(m, d)
        speed = np.maximum(speed, np.linalg.norm(d.qvel.numpy()[:, -6:-3], axis=1))
        answer, law = callback.read(), callback._coupling.law.numpy()
        axes = d.geom_xmat.numpy()[:, callback.contacts[0][1], None] @ callback._frames.stands.numpy()["axes"].reshape(-1, 2, 3, 3)
        friction = np.linalg.norm(np.einsum("wkij,wki->wkj", axes, callback._wrench.numpy()[:, :, :3])[:, :, :2], axis=2)
        limit = answer["friction_limit_n"] * law["share"].reshape(answer.shape)
        inside = (friction <= 1.001 * limit + 1e-5) | (callback.semi_implicit.numpy() == 0)[:, None]
        assert inside.all(), (k, friction[~inside], limit[~inside])
        assert not (answer["status"] & fw.Status.NOT_CONVERGED).any(), k
    below_mm = 1e3 * (d.xpos.numpy()[:, 4, 2] - d.xpos.numpy()[:, 1, 2])
    print(f"fastest {speed.max():.3f} m/s, furthest {np.abs(below_mm).max():.2f} mm")
    # It falls by 0.5 mm onto the table at first.
    assert (speed < 0.3).all() and (np.abs(below_mm) < 5).all(), (masses, grips, speed, below_mm)


@pytest.mark.parametrize("kind", ["bed", "pad"])
def test_an_object_that_is_hit_comes_to_rest(model: fw.Model, pad: fw.Pad, kind: str) -> None:
    """5 g between two fingers at 4 ms, without dampers: kinetic energy is never above that after the hit."""
    dampers = dict.fromkeys(("damping_normal_n_s_per_m", "damping_slide_n_s_per_m", "damping_spin_n_m_s_per_rad"), 0.0)
    _, m, d, callback = scenes.grip(64, mass_kg=0.005, model=model if kind == "bed" else pad, **dampers)
    random = np.random.default_rng(SEED)
    d.ctrl.assign(np.linspace(0.6, 1.4, 64)[:, None].astype(np.float32))
    d.qpos.assign(d.qpos.numpy() + np.array([0.8e-3, -0.4e-3, *[0] * 6], np.float32))
    scenes.seconds(m, d, 1.5)
    inertia = np.array([0.02, *[0.005] * 3, *m.body_inertia.numpy()[0, -1]])
    hit = d.qvel.numpy() + random.normal(0, [0, 0.05, 0.05, 0.05, 1, 1, 1], (64, 7)).astype(np.float32)
    d.qvel.assign(hit)
    start, most = 0.5 * hit**2 @ inertia, np.zeros(64)
    for _ in range(500):
        mujoco_warp.step(m, d)
        energy = 0.5 * d.qvel.numpy() ** 2 @ inertia
        most = np.maximum(most, energy)
    print(f"{kind}: most over start {np.max(most / start):.3f}, end over start {np.max(energy / start):.1e}")
    assert callback.semi_implicit.numpy().all() and (callback.read()["regime"] != 0).all()
    assert (most < start).all() and (energy < 1e-3 * start).all(), (most / start, energy / start)


@pytest.mark.parametrize(("tilt_deg", "within"), [((0, 0), 1e-3), ((6, -4), 0.1)])
def test_the_stiffness_of_a_bed_is_that_of_small_motions(model: fw.Model, tilt_deg: tuple[float, float], within: float) -> None:
    """All six motions of a finger that sticks, against the differences of its forces. Left out: moments of a tilt turn with the finger."""
    mj_model = mujoco.MjModel.from_xml_string(FLAT)
    m, d = mujoco_warp.put_model(mj_model), mujoco_warp.put_data(mj_model, mujoco.MjData(mj_model), nworld=13)
    dampers = dict.fromkeys(("damping_normal_n_s_per_m", "damping_slide_n_s_per_m", "damping_spin_n_m_s_per_rad"), 0.0)
    callback = Callback(model, mj_model, m, d, [("tip", "plate")], strength_factor=5.0, **dampers)
    level = Rotation.from_euler("yx", (model.pose_deg[0] + tilt_deg[0], tilt_deg[1]), degrees=True)
    small = np.array([2e-6] * 3 + [2e-4] * 3)
    moves = np.concatenate([np.zeros((1, 6)), np.diag(small), -np.diag(small)])

    def forward(time_s: float, moves: Any) -> Any:
        turn = Rotation.from_rotvec(moves[:, 3:]) * level
        quat = np.roll(turn.as_quat(), 1, axis=1)
        d.qpos.assign(np.concatenate([moves[:, :3] + [0, 0, -1e-3 * depth_mm], quat], axis=1).astype(np.float32))
        d.time.assign(np.full(13, time_s, np.float32))
        mujoco_warp.forward(m, d)
        return callback._coupling.law.numpy()

    depth_mm = 1.2
    forward(0.0, 0 * moves)
    law = forward(0.001, moves)
    stiffness = law["vibrates"][0] / 0.001**2
    differences = (law["all"][7:] - law["all"][1:7]).T / (2 * small)
    # Friction turns with the finger, which is no stiffness: the symmetric part.
    expected, size = (differences + differences.T) / 2, np.sqrt(np.diag(stiffness))
    apart = np.abs(stiffness - expected) / np.outer(size, size)
    print(f"tilt {tilt_deg}: within {apart.max():.3f}")
    assert apart.max() < within, np.round(apart, 3)


INSTANCE = """<instance name="{0}"><config key="model_file" value="{1}"/><config key="site" value="{0}"/><config key="geoms" value="object"/></instance>"""
SENSOR = """<plugin name="{0}" plugin="fingerpad.contact" instance="{0}"/>"""


@pytest.mark.parametrize(("file", "within_mm"), [(MODEL, 0.2), (PAD, 0.001)], ids=["bed", "pad"])
@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_the_motion_is_that_of_the_plugin(file: Path, within_mm: float, cone: str) -> None:
    """A block of 5 g is lifted off a table at 4 ms. Its place is compared in every step, and what the fingers feel at the end.

    Beds differ by more, because the plugin computes their stiffness again only after their depth has changed by 15 %. This package does so in
    every step."""
    fingerpad_mujoco = pytest.importorskip("fingerpad_mujoco")
    sides, timestep = ("left", "right"), 0.004
    instances, sensors = ("".join(text.format(side, file) for side in sides) for text in (INSTANCE, SENSOR))
    plugin = f'<extension><plugin plugin="fingerpad.contact">{instances}</plugin></extension>'
    mj_model = scenes.lift_model(0.005, timestep, cone=cone, plugin=plugin, sensors=f"<sensor>{sensors}</sensor>")
    mj_data = mujoco.MjData(mj_model)
    m, d, callback = scenes.lift([0.005], fw.load(file), timestep, cone=cone)
    apart_mm, semi, moved_mm = 0.0, [], 0.0
    for k in range(round(2.0 / timestep)):
        ctrl = [0.06 * np.clip(k * timestep - 0.8, 0, 1), 1.4, 1.4]
        mj_data.ctrl[:] = ctrl
        d.ctrl.assign(np.array([ctrl], np.float32))
        mujoco.mj_step(mj_model, mj_data)
        mujoco_warp.step(m, d)
        apart_mm = max(apart_mm, 1e3 * np.abs(d.qpos.numpy()[0, :6] - mj_data.qpos[:6]).max())
        moved_mm = max(moved_mm, 1e3 * (mj_data.qpos[5] - 0.03))
        felt = [fingerpad_mujoco.read(mj_data, side)[0] for side in sides]
        semi.append((felt[0]["semi_implicit"], callback.semi_implicit.numpy()[0]))
    answer, share = callback.read()[0], np.mean(semi, axis=0)
    print(f"{file.name}, {cone}: within {apart_mm:.4f} mm of {moved_mm:.1f} mm; semi-implicit in {share} of the steps")
    assert apart_mm < within_mm and moved_mm > 50 and (share > 0.9).all()
    for name in ("normal_force_n", "slip_margin"):
        np.testing.assert_allclose(answer[name], [each[name] for each in felt], rtol=0.01, err_msg=name)


@pytest.mark.parametrize(("speed_m_s", "is_flagged"), [(0.4, False), (1.0, True)])
def test_a_finger_that_comes_too_fast_is_flagged(pad: fw.Pad, speed_m_s: float, is_flagged: bool) -> None:
    """More than 2 mm in a step of 4 ms: in the step before the contact."""
    mj_model = mujoco.MjModel.from_xml_string(FLAT.replace('timestep="0.001"', 'timestep="0.004"'))
    m, d = mujoco_warp.put_model(mj_model), mujoco_warp.put_data(mj_model, mujoco.MjData(mj_model))
    callback, seen = Callback(pad, mj_model, m, d, [("tip", "plate")]), []
    quat = np.roll(Rotation.from_euler("y", 30, degrees=True).as_quat(), 1)
    for height_mm in (9.0, 3.0):
        d.qpos.assign(np.array([[0, 0, 1e-3 * height_mm, *quat]], np.float32))
        d.qvel.assign(np.array([[0, 0, -speed_m_s, 0, 0, 0]], np.float32))
        mujoco_warp.forward(m, d)
        seen.append(bool(callback.read()["status"][0, 0] & fw.Status.STEP_TOO_LONG))
    assert seen == [False, is_flagged]
