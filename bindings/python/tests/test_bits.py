"""The package gives the bits of the core, along clean and disturbed paths."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import ACCURATE, MODEL, STEP

import fingerpad
from fingerpad import Fingers, Model, Pose, Status

#: Seed of all random numbers here; printed with a failure.
SEED = 20


def words(responses: Any) -> Any:
    """The bits of responses, a row a contact."""
    return responses.view(np.uint32).reshape(len(responses), -1)


def test_documented_vectors(model: Model, vectors: list[tuple[list[float], list[int]]]) -> None:
    fingers = Fingers(model)
    names = ["normal_force_n", "friction_x_n", "friction_y_n", "stick_ratio", "friction_limit_n", "slip_margin"]
    names += ["contact_area_mm2", "band_normal_n", "band_friction_n", "regime", "status"]
    for (depth, x, y), expected in vectors:
        r = fingers.step(depth, x, y, dt_s=1e-3, outputs="all")
        assert [int(r[name].view(np.uint32)[0]) for name in names] == expected, (depth, x, y)
    assert len(vectors) >= 8 and any(np.isnan(motion).any() for motion, _ in vectors)


def clean_path() -> Any:
    """A press and a slide."""
    rows = np.zeros(1200, STEP)
    rows["depth_mm"] = np.minimum(np.arange(1200) / 400, 1.2)
    rows["x"] = np.where(np.arange(1200) > 400, 0.004, 0)
    rows["dt_s"], rows["strength"], rows["pitch_deg"] = 1e-3, 1, np.nan
    return rows


def disturbed_path(spin: bool) -> Any:
    """Reversals, noise and vibration on the depth, changing strength, spin, lift-offs, and numbers that are none."""
    random = np.random.default_rng(SEED)
    rows = clean_path()
    t = np.arange(len(rows))
    rows["depth_mm"] += 0.1 * np.sin(0.7 * t) + random.normal(0, 0.01, len(rows))
    rows["depth_mm"][700:720] = -0.1
    rows["x"] = np.where(t % 150 < 80, 0.03, -0.04) + random.normal(0, 0.002, len(rows))
    rows["y"] = random.normal(0, 0.02, len(rows))
    rows["spin_rad"] = random.normal(0, 0.02, len(rows)) if spin else 0
    rows["strength"] = random.uniform(0.05, 3, len(rows))
    rows["x"][::97] = np.nan
    rows["depth_mm"][::131] = np.inf
    rows["dt_s"][::211] = -1
    return rows


def posed_path(spin: bool) -> Any:
    """The disturbed path in poses that change in contact."""
    rows = disturbed_path(spin)
    t = np.arange(len(rows))
    rows["pitch_deg"] = 30 + 10 * np.sin(t // 40)
    rows["roll_deg"] = 8 * np.cos(t // 40)
    rows["pitch_deg"][:100] = np.nan
    return rows


def of_native(native: Path, rows: Any, spin: bool) -> Any:
    command = [native, "steps", MODEL, "spin" if spin else "plain"]
    done = subprocess.run(command, input=rows.tobytes(), capture_output=True, check=True)
    return np.frombuffer(done.stdout, "<u4").reshape(len(rows), 14)


def of_python(fingers: Fingers, rows: Any) -> Any:
    out = []
    for r in rows:
        pose = None if np.isnan(r["pitch_deg"]) else Pose(float(r["pitch_deg"]), float(r["roll_deg"]))
        response = fingers.step(
            r["depth_mm"], r["x"], r["y"], r["spin_rad"], dt_s=r["dt_s"], strength_factor=r["strength"], pose=pose, outputs="all"
        )
        out.append(words(response)[0])
    return np.array(out)


@pytest.mark.parametrize("spin", [False, True])
@pytest.mark.parametrize("path", [lambda _: clean_path(), disturbed_path, posed_path], ids=["clean", "disturbed", "posed"])
def test_bits_of_the_core(native: Path, model: Model, path: Any, spin: bool) -> None:
    rows = path(spin)
    expected = of_native(native, rows, spin)
    found = of_python(Fingers(model, spin=spin), rows)
    differ = np.flatnonzero((expected != found).any(axis=1))
    assert differ.size == 0, f"seed {SEED}: the first step that differs is {differ[0]}: {rows[differ[0]]}"
    if path is disturbed_path:
        flags = np.bitwise_or.reduce(found[:, 7])
        assert flags & Status.BAD_INPUT and flags & Status.BAD_TIME_STEP


@pytest.mark.parametrize("spin", [False, True])
def test_a_run_of_many_is_each_alone(native: Path, model: Model, spin: bool) -> None:
    """Fingers with paths of their own, shifted in time, in one run; more of them than pass through the batch at once."""
    rows, count = disturbed_path(spin), 300
    shifted = np.array([np.roll(rows, k) for k in range(count)]).T[:400]
    inputs = (shifted["depth_mm"], shifted["x"], shifted["y"], shifted["spin_rad"])
    options: Any = {"dt_s": 1e-3, "strength_factor": shifted["strength"]}
    whole = Fingers(model, count, spin=spin).run(*inputs, **options)
    everything = Fingers(model, count, spin=spin).run(*inputs, **options, outputs="all")
    for name in fingerpad.FORCES.names or ():
        np.testing.assert_array_equal(whole[name].view(np.uint32), everything[name].view(np.uint32), err_msg=name)
    for k in (0, 1, 255, 256, 299):
        alone = shifted[:, k].copy()
        alone["dt_s"] = 1e-3
        np.testing.assert_array_equal(words(everything[:, k].copy()), of_native(native, alone, spin), err_msg=f"finger {k}")


def test_poses_of_many(native: Path, model: Model) -> None:
    """Each finger in a pose of its own, neighbours in the same and in others."""
    rows = posed_path(False)[100:400]
    pitch = np.array([20, 20, 30, 45, 45, 20], np.float32)
    roll = np.array([0, 0, 0, 10, -10, 0], np.float32)
    fingers = Fingers(model, len(pitch))
    found = [
        words(fingers.step(r["depth_mm"], r["x"], r["y"], strength_factor=r["strength"], pose=Pose(pitch, roll), outputs="all"))
        for r in rows
    ]
    for k in range(len(pitch)):
        alone = rows.copy()
        alone["dt_s"], alone["pitch_deg"], alone["roll_deg"] = 1e-3, pitch[k], roll[k]
        np.testing.assert_array_equal(np.array(found)[:, k], of_native(native, alone, False), err_msg=f"finger {k}")


def test_strides_and_types_change_nothing(model: Model) -> None:
    random = np.random.default_rng(SEED)
    depth = random.uniform(0.2, 1.5, 64).astype(np.float32)
    slide = random.normal(0, 0.3, 64).astype(np.float32)
    plain = Fingers(model, 64).step(depth, slide)
    wide = np.empty((64, 3), np.float64)
    wide[:, 1] = depth
    backwards = np.ascontiguousarray(slide[::-1])[::-1]
    swapped = slide.astype(">f4")
    for x in (backwards, swapped, list(slide), slide.astype(np.float64)):
        np.testing.assert_array_equal(words(Fingers(model, 64).step(wide[:, 1], x)), words(plain))


def test_the_accurate_model_and_tuning() -> None:
    """Six springs carry as four do, roughly; a larger finger carries its size squared (exact by the core's rule)."""
    four, six = Model.from_file(MODEL), Model.from_file(ACCURATE)
    assert (four.springs, six.springs) == (4, 6)
    forces = [Fingers(m).step(1.0, 0.5)["normal_force_n"][0] for m in (four, six)]
    assert forces[1] == pytest.approx(forces[0], rel=0.1)
    large = four.tuned(size=1.25)
    assert large.depth_max_mm == pytest.approx(1.25 * four.depth_max_mm)
    pressed = [Fingers(m).step(d)["normal_force_n"][0] for m, d in ((four, 0.8), (large, 1.0))]
    assert pressed[1] / pressed[0] == pytest.approx(1.25**2, rel=1e-5)


def test_gradient_is_a_difference_of_steps(model: Model) -> None:
    for direction in ([1.0, 0, 0], [0, 1.0, 0], [0, 0, -1.0]):
        fingers = Fingers(model)
        fingers.run(np.full((50, 1), 0.9), 0.01)
        gradient = fingers.gradient(direction)[0]
        further = np.array(direction) * 2e-4
        now = fingers.copy().step(0.9)
        then = fingers.step(0.9 + further[0], further[1], further[2])
        changed = [float(then[n][0]) - float(now[n][0]) for n in ("normal_force_n", "friction_x_n", "friction_y_n")]
        np.testing.assert_allclose(gradient @ further, changed, atol=0.03 * np.abs(changed).max())


def test_a_driven_step_reaches_its_forces(model: Model) -> None:
    fingers = Fingers(model, 3)
    wanted = np.array([0.1, 0.2, 0.4])
    for k in range(40):
        load = 0.05 * np.sin(k / 4)
        r = fingers.step_driven(normal_force_n=wanted, friction_x_n=load)
        np.testing.assert_allclose(r["normal_force_n"], wanted, rtol=1e-3)
        np.testing.assert_allclose(r["friction_x_n"], load, atol=1e-3 * r["friction_limit_n"].max())
    held = fingers.step_driven(normal_force_n=wanted, friction_x_n=load)
    assert (held["slide_x_mm"] == 0).all(), "a load that is there already does not creep"
    out_of_reach = fingers.step_driven(normal_force_n=1e3)
    assert (out_of_reach["status"] & Status.LOAD_NOT_REACHED).all()
