"""The package gives the bits of the core, along clean and disturbed paths."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import MODEL, PAD, STEP

import fingerpad
from fingerpad import Cylinder, Edge, Fingers, Model, Pad, Plane, Sphere, Status

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
    rows["dt_s"], rows["strength"] = 1e-3, 1
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


def of_native(native: Path, rows: Any, spin: bool, model: Path = MODEL) -> Any:
    command = [native, "bed", model, "spin" if spin else "plain"]
    done = subprocess.run(command, input=rows.tobytes(), capture_output=True, check=True)
    return np.frombuffer(done.stdout, "<u4").reshape(len(rows), 19)


def of_python(fingers: Fingers, rows: Any) -> Any:
    out = []
    for r in rows:
        response = fingers.step(
            r["depth_mm"], r["x"], r["y"], r["spin_rad"], dt_s=r["dt_s"], strength_factor=r["strength"], outputs="all"
        )
        out.append(words(response)[0])
    return np.array(out)


@pytest.mark.parametrize("spin", [False, True])
@pytest.mark.parametrize("path", [lambda _: clean_path(), disturbed_path], ids=["clean", "disturbed"])
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


#: Bodies and the poses over their apex.
BODIES = [
    (Plane(), (30.0, 0.0)),
    (Sphere(20.0), (25.0, 5.0)),
    (Sphere(-40.0), (30.0, 0.0)),
    (Cylinder(10.0, 90.0), (40.0, -10.0)),
    (Cylinder(12.5, 30.0), (30.0, 0.0)),
    (Edge(4.0, 20.0, 120.0), (30.0, 0.0)),
]


def pad_path(seed: int = SEED, count: int = 500) -> Any:
    """A press, slides, spins and lift-offs in poses that change, noise and changing strength, and numbers that are none."""
    random = np.random.default_rng(seed)
    rows = np.zeros(count, STEP)
    t = np.arange(count)
    rows["depth_mm"] = np.minimum(t / 60, 1.4) + 0.1 * np.sin(0.2 * t) + random.normal(0, 0.002, count)
    rows["depth_mm"][count // 2 : count // 2 + 10] = -0.1
    rows["x"] = np.where(t % 150 < 80, 0.03, -0.04)
    rows["y"] = random.normal(0, 0.01, count)
    rows["spin_rad"] = np.where(t % 90 < 30, 0.005, 0)
    rows["strength"] = np.where(t < 250, 1, random.uniform(0.5, 2, count))
    rows["pitch_deg"] = 35 + 12 * np.sin(t / 60)
    rows["roll_deg"] = 10 * np.cos(t / 45)
    rows["pitch_deg"][::149] = 85
    for name, every in {"x": 97, "depth_mm": 131, "pitch_deg": 163, "roll_deg": 167}.items():
        rows[name][every::every] = np.nan
    rows["dt_s"] = 1e-3
    rows["dt_s"][::211] = -1
    return rows


def on_native_pad(native: Path, rows: Any, body: Any, pose: tuple[float, float], pad: Path = PAD) -> tuple[Any, Any]:
    """Words of the responses and floats of the patches as bits."""
    numbers = [getattr(body, name, 0.0) for name in ("radius_mm", "axis_deg", "angle_deg")]
    command = [native, "pad", pad, type(body).__name__, *map(str, [*numbers, *pose])]
    done = subprocess.run(command, input=rows.tobytes(), capture_output=True, check=True)
    whole = np.frombuffer(done.stdout, "<u4").reshape(len(rows), -1)
    return whole[:, :19], whole[:, 19:]


@pytest.mark.parametrize(("body", "pose"), BODIES, ids=lambda case: str(case))
def test_bits_of_the_core_on_a_pad(native: Path, pad: Pad, body: Any, pose: tuple[float, float]) -> None:
    """Steps and patches, on all bodies and in poses that change."""
    rows = pad_path()
    expected, expected_patches = on_native_pad(native, rows, body, pose)
    fingers = Fingers(pad, body=body, pitch_deg=pose[0], roll_deg=pose[1])
    for i, r in enumerate(rows):
        response = fingers.step(
            r["depth_mm"], r["x"], r["y"], r["spin_rad"], dt_s=r["dt_s"], strength_factor=r["strength"],
            pitch_deg=r["pitch_deg"], roll_deg=r["roll_deg"], outputs="all",
        )  # fmt: skip
        assert (words(response)[0] == expected[i]).all(), f"seed {SEED}, step {i}: {r} gives {response}"
        assert (fingers.patches().view(np.uint32).reshape(-1) == expected_patches[i]).all(), f"seed {SEED}, step {i}: {r}"
    flags = np.bitwise_or.reduce(expected[:, 7])
    assert flags & Status.BAD_INPUT and flags & Status.BAD_TIME_STEP and flags & Status.POSE_OUT_OF_RANGE
    assert len(set(expected[:, 6])) == 4, "every regime"


@pytest.mark.parametrize("tuned", [False, True])
def test_many_fingers_of_a_pad_are_each_alone(pad: Pad, tuned: bool) -> None:
    """Fingers with paths and poses of their own; more of them than are stepped between two looks for Ctrl-C."""
    made = pad.tuned(size=1.1, stiffness=0.8, lambda_factor=1.2) if tuned else pad
    count, rows = 1100, pad_path()[:40]
    rows["depth_mm"] = np.minimum(0.1 + np.arange(40) / 40, 1.2)
    shifted = np.array([np.roll(rows, k) for k in range(count)]).T
    pitch, roll = np.linspace(12, 68, count), np.linspace(-28, 28, count)
    inputs = (shifted["depth_mm"], shifted["x"], shifted["y"], shifted["spin_rad"])
    many = Fingers(made, count, body=Sphere(18), pitch_deg=pitch, roll_deg=roll)
    forces = many.copy().run(*inputs, strength_factor=shifted["strength"])
    found = many.run(*inputs, strength_factor=shifted["strength"], outputs="all")
    patches = many.patches()
    for name in fingerpad.FORCES.names or ():
        np.testing.assert_array_equal(forces[name].view(np.uint32), found[name].view(np.uint32), err_msg=name)
    for k in (0, 1, 511, 1023, 1024, 1099):
        alone = Fingers(made, body=Sphere(18), pitch_deg=pitch[k], roll_deg=roll[k])
        expected = alone.run(*(x[:, k] for x in inputs), strength_factor=shifted["strength"][:, k], outputs="all")
        np.testing.assert_array_equal(words(found[:, k].copy()), words(expected[:, 0].copy()), err_msg=f"finger {k}")
        np.testing.assert_array_equal(patches[k], alone.patches()[0], err_msg=f"finger {k}")


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


def test_tuning_of_a_bed(model: Model) -> None:
    """A larger finger carries its size squared (exact by the core's rule)."""
    large = model.tuned(size=1.25)
    assert large.depth_max_mm == pytest.approx(1.25 * model.depth_max_mm)
    pressed = [Fingers(m).step(d)["normal_force_n"][0] for m, d in ((model, 0.8), (large, 1.0))]
    assert pressed[1] / pressed[0] == pytest.approx(1.25**2, rel=1e-5)


def test_tuning_of_a_pad(pad: Pad) -> None:
    """A geometrically similar finger on a similar ball: forces go with size squared and stiffness, exactly."""
    tuned = pad.tuned(size=1.25, stiffness=2, lambda_factor=1.5)
    assert tuned.depth_max_mm == pytest.approx(1.25 * pad.depth_max_mm)
    assert tuned.patch_areas_mm2 == pytest.approx([1.25**2 * area for area in pad.patch_areas_mm2])
    pair = [Fingers(pad, body=Sphere(20)), Fingers(tuned, body=Sphere(25))]
    path = np.minimum(np.arange(1, 41) / 40, 1.0)
    small, large = (f.run(k * path, outputs="all")[:, 0] for f, k in zip(pair, (1, 1.25)))
    np.testing.assert_allclose(large["normal_force_n"], 2 * 1.25**2 * small["normal_force_n"], rtol=2e-4)
    np.testing.assert_allclose(large["contact_area_mm2"], 1.25**2 * small["contact_area_mm2"], rtol=2e-4)
    np.testing.assert_allclose(pair[1].depth_mm, 1.25, rtol=1e-6)
    slid = [f.run(np.full(60, k), 0.1 * k, outputs="all")[-1, 0] for f, k in zip(pair, (1, 1.25))]
    beta = np.log(slid[1]["friction_limit_n"] / slid[0]["friction_limit_n"] / (1.5 * 1.25**2)) / np.log(2)
    assert 0.3 < beta < 1, "strength goes with stiffness to the power of the friction law"
    pressure = [f.patches()[0]["pressure_mpa"].max() for f in pair]
    assert pressure[1] / pressure[0] == pytest.approx(2, rel=0.02)


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
