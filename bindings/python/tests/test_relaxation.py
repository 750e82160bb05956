"""Tissue that relaxes: the bits of the core, a hold whose force falls, the margin that is left, and what is refused."""

from __future__ import annotations

import pickle
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_bits import BODIES, disturbed_path, of_native, of_python, on_native_pad, pad_path, words

from fingerpad import Finger, Fingers, FrameContacts, InputError, MarginObserver, Model, ModelError, Pad, Shape, Status, load

BRANCHES = [(1.0, 0.004), (0.6, 0.07), (0.6, 1.4)]
NO_TIMES = (0.0, -1.0, np.nan, np.inf)


@pytest.fixture(scope="module")
def soft(pad: Pad) -> Pad:
    return pad.relaxing("human-assumed")


@pytest.fixture(scope="module")
def file(soft: Pad, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("soft") / "soft.fpm"
    path.write_bytes(soft.to_bytes())
    return path


def at_many_paces(seed: int) -> Any:
    """The path of a pad in time steps over four decades, and with steps of no time."""
    rows = pad_path(seed, 400)
    rows["dt_s"] = 10 ** np.random.default_rng(seed).uniform(-4, 0, len(rows))
    for k, dt_s in enumerate(NO_TIMES):
        rows["dt_s"][50 + k :: 101] = dt_s
    return rows


@pytest.mark.parametrize(("body", "pose"), BODIES, ids=lambda case: str(case))
def test_bits_of_the_core(native: Path, file: Path, soft: Pad, body: Any, pose: tuple[float, float]) -> None:
    rows = at_many_paces(31)
    expected, patches = on_native_pad(native, rows, body, pose, file)
    fingers = Fingers(soft, body=body, pitch_deg=pose[0], roll_deg=pose[1])
    saved = b""
    for i, r in enumerate(rows):
        response = fingers.step(
            r["depth_mm"], r["x"], r["y"], r["spin_rad"], dt_s=r["dt_s"], strength_factor=r["strength"],
            pitch_deg=r["pitch_deg"], roll_deg=r["roll_deg"], outputs="all",
        )  # fmt: skip
        assert (words(response)[0] == expected[i]).all(), f"step {i}: {r} gives {response}"
        assert (fingers.patches().view(np.uint32).reshape(-1) == patches[i]).all(), f"step {i}: {r}"
        if i % 60 == 30:
            saved = fingers.save()
            fingers.restore(saved)
    forces, margin = expected.view(np.float32), expected.view(np.float32)[:, 18]
    assert (margin >= 0).all() and (margin <= 1).all() and (np.abs(forces[:, 4] - margin) > 0.05).sum() > 50
    assert len(saved) > 2864


def test_bits_in_frames(native: Path, file: Path, soft: Pad) -> None:
    """A plane that comes up, slides and stays, in steps of any pace."""
    random = np.random.default_rng(5)
    count = 200
    up = np.minimum(np.arange(count) / 60, 1.2)
    rows = np.zeros((count, 9))
    normal = np.array([-0.5, 0, np.sqrt(0.75)])
    rows[:, :3] = up[:, None] * normal + np.where(np.arange(count) > 80, 0.3, 0)[:, None] * [0, 1, 0]
    rows[:, 3:7] = [np.cos(np.pi / 12), 0, -np.sin(np.pi / 12), 0]
    rows[:, 7] = 10 ** random.uniform(-4, -0.5, count)
    rows[:, 8] = 1
    done = subprocess.run([native, "frames", "pad", file, "plane"], input=rows.tobytes(), capture_output=True, check=True)
    expected = np.frombuffer(done.stdout, "<u4").reshape(count, 35)
    contacts = FrameContacts(soft, Shape.plane())
    for i, row in enumerate(rows):
        response = contacts.step(row[:3], row[3:7], row[7])
        assert (response.view(np.uint32).reshape(-1) == expected[i]).all(), f"step {i}"
    at_first = contacts.step(rows[-1, :3] + 0.2 * normal, rows[-1, 3:7], 1e-5)["normal_force_n"][0]
    assert contacts.step(rows[-1, :3] + 0.2 * normal, rows[-1, 3:7], 100.0)["normal_force_n"][0] < 0.8 * at_first


@pytest.mark.parametrize("spin", [False, True])
def test_bits_of_the_core_on_a_bed(native: Path, model: Model, tmp_path: Path, spin: bool) -> None:
    """Of single fingers, of steps in a batch, of forces alone and after a copy of the bytes."""
    soft = model.relaxing("human-assumed")
    file = tmp_path / "soft.fpm"
    file.write_bytes(soft.to_bytes())
    rows = disturbed_path(spin)
    rows["dt_s"] = 10 ** np.random.default_rng(3).uniform(-4, 0, len(rows))
    for k, dt_s in enumerate(NO_TIMES):
        rows["dt_s"][50 + k :: 101] = dt_s
    expected = of_native(native, rows, spin, file)
    fingers = Fingers(load(file), spin=spin)
    half = len(rows) // 2
    found = of_python(fingers, rows[:half])
    saved = fingers.save()
    fingers.restore(saved)
    found = np.concatenate([found, of_python(fingers, rows[half:])])
    assert (found == expected).all()
    margins = expected.view(np.float32)[:, [4, 18]]
    assert (np.abs(margins[:, 0] - margins[:, 1]) > 0.05).sum() > 50
    plain = Fingers(soft, 2, spin=spin)
    for r, words_of in zip(rows[:200], expected, strict=False):
        forces = plain.step(r["depth_mm"], r["x"], r["y"], r["spin_rad"], dt_s=r["dt_s"], strength_factor=r["strength"])
        assert (words(forces)[:, :8] == words_of[:8]).all()
    for other in (model, model.relaxing([(0.5, 1.0)])):
        with pytest.raises(ModelError):
            Fingers(other, spin=spin).restore(saved)


def test_a_bed_relaxes_by_its_branches_and_says_so(model: Model) -> None:
    soft = model.relaxing("human-assumed")
    finger, t = Finger(soft), 0.0
    first = finger.step(1.0, dt_s=1e-7)
    for dt_s in NO_TIMES:
        assert finger.step(1.0, dt_s=dt_s).status == Status.BAD_TIME_STEP
    for k in range(1200):
        dt_s = 1e-4 if k < 400 else 1e-3 * 1.012 ** (k - 400)
        t += dt_s
        r = finger.step(1.0, dt_s=dt_s)
        over = 1 + sum(share * np.exp(-t / time) for share, time in BRANCHES)
        assert r.normal_force_n / first.normal_force_n * 3.2 == pytest.approx(over, rel=1e-4), t
    assert Model.from_bytes(soft.to_bytes()) == soft == pickle.loads(pickle.dumps(soft)) != model
    assert "assumed" in repr(soft) and "relaxes" not in repr(model) and model.relaxation == []
    assert soft.tuned(size=1.2).relaxing([]).relaxation == [] and soft.relaxing([]) == model
    with pytest.raises(InputError, match="branches"):
        model.relaxing([(-0.1, 1.0)])
    with pytest.raises(ModelError, match="OddStiffness"):
        model.relaxing([(50.0, 1.0)])
    held = FrameContacts(soft, Shape.plane())
    pose = [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]
    assert len(held.step(*pose, 1e-3)) == 1
    with pytest.raises(InputError, match="RELX"):
        MarginObserver(soft)


def test_a_hold_falls_as_its_branches_do_and_steps_of_no_time_freeze_it(soft: Pad) -> None:
    finger = Finger(soft)
    first = finger.step(1.0, dt_s=1e-7)
    for dt_s in NO_TIMES:
        r = finger.step(1.0, dt_s=dt_s)
        assert r.status == Status.BAD_TIME_STEP
        assert r.normal_force_n == pytest.approx(first.normal_force_n, rel=1e-3)
    again, t = pickle.loads(pickle.dumps(finger)), 0.0
    for k in range(1200):
        dt_s = 1e-4 if k < 400 else 1e-3 * 1.012 ** (k - 400)
        t += dt_s
        r = finger.step(1.0, dt_s=dt_s)
        over = 1 + sum(share * np.exp(-t / time) for share, time in BRANCHES)
        assert r.normal_force_n / first.normal_force_n * 3.2 == pytest.approx(over, rel=5e-3), t
    assert t > 140 and r.slip_margin_relaxed == pytest.approx(r.slip_margin, abs=1e-5)
    left = 1 - (1 - first.slip_margin) * first.friction_limit_n / r.friction_limit_n
    assert first.slip_margin_relaxed == pytest.approx(left, abs=3e-3) and first.slip_margin_relaxed < first.slip_margin
    assert again.step(1.0, dt_s=1e-7).normal_force_n == pytest.approx(first.normal_force_n, rel=1e-3), "a pickle remembers"


def test_many_are_each_alone(soft: Pad) -> None:
    depth = np.linspace(0.4, 1.4, 5)
    many = Fingers(soft, 5)
    found = many.run(np.broadcast_to(depth, (60, 5)), dt_s=np.geomspace(1e-4, 1, 60), outputs="all")
    for k, d in enumerate(depth):
        alone = Fingers(soft).run(np.full(60, d), dt_s=np.geomspace(1e-4, 1, 60), outputs="all")
        np.testing.assert_array_equal(words(found[:, k].copy()), words(alone[:, 0].copy()))
    copy = many.copy()
    assert (copy.step(depth, dt_s=0.1) == many.step(depth, dt_s=0.1)).all()
    many.reset()
    assert (many.step(depth, dt_s=1e-7)["normal_force_n"] > 1.9 * found["normal_force_n"][-1]).all()


def test_branches_are_checked_kept_and_printed(pad: Pad, soft: Pad) -> None:
    assert pad.relaxation == [] and "relaxes" not in repr(pad)
    assert soft.relaxation == pytest.approx(np.array(BRANCHES), rel=1e-6) and "assumed" in repr(soft)
    assert Pad.from_bytes(soft.to_bytes()) == soft == pickle.loads(pickle.dumps(soft)) != pad
    assert soft.tuned(size=1.2).relaxing([]).relaxation == [] and soft.relaxing([]) == pad
    assert pad.relaxing([(0.5, 1.0)]).tuned(stiffness=2).relaxation == [(0.5, 1.0)]
    for wrong in ([(-0.1, 1)], [(np.nan, 1)], [(1, 0)], [(1, np.inf)], [(1, 1)] * 4, "human"):
        with pytest.raises(InputError, match="branches"):
            pad.relaxing(wrong)  # type: ignore[arg-type]
    saved = Fingers(soft).save()
    for other in (pad, pad.relaxing([(0.5, 1.0)])):
        with pytest.raises(ModelError):
            Fingers(other).restore(saved)
    assert soft.least_grip(0.2) == pad.least_grip(0.2), "the grip that holds for good"
    plain = Fingers(pad).run(np.linspace(0, 1, 30), 0.01, outputs="all")
    np.testing.assert_array_equal(plain["slip_margin"], plain["slip_margin_relaxed"])


def test_a_grip_by_the_margin_that_is_left_holds_and_one_by_the_present_margin_slips(soft: Pad) -> None:
    load_n, margin = 0.25, 0.1

    def holds(name: str) -> bool:
        """Squeezes faster than the tissue relaxes until the margin of a name is there, and holds the depth for a minute."""
        finger = Fingers(soft)
        finger.step(0.4, dt_s=1e-3)
        depth = 0.4
        for _ in range(400):
            r = finger.step_driven(depth_mm=depth, friction_x_n=load_n, dt_s=1e-3)[0]
            if r["slip_margin" if name == "now" else "slip_margin_relaxed"] >= margin:
                break
            depth += 0.01
        for dt_s in np.geomspace(1e-3, 5, 60):
            r = finger.step_driven(depth_mm=depth, friction_x_n=load_n, dt_s=dt_s)[0]
            if r["friction_x_n"] < 0.97 * load_n:
                return False
        return bool(r["slip_margin"] > 0.7 * margin)

    assert holds("later") and not holds("now")
