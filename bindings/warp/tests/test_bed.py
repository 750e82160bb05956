"""A bed on Warp gives the numbers of the core along disturbed paths."""

from __future__ import annotations

import re
from typing import Any

import fingerpad
import numpy as np
import pytest
from conftest import ROOT, SEED, differences, disturbed_bed_path, follow

import fingerpad_warp as fw

FORCES = ("normal_force_n", "friction_x_n", "friction_y_n")
STEPS, MORE_STEPS, COUNT = 1000, 10_000, 4


def both(model: fw.Model, device: str, spin: bool, steps: int, changed: fw.Model | None = None) -> tuple[Any, Any]:
    """The responses of Warp and of the core to disturbed steps of several fingers."""
    path = disturbed_bed_path(steps, COUNT)
    if not spin:
        del path["spin_rad"]
    reference = fingerpad.Fingers(fingerpad.Model.from_bytes(model.to_bytes()), COUNT, spin=spin)
    found = follow(fw.Fingers(changed or model, COUNT, spin=spin, device=device), path)
    return found, follow(reference, path, outputs="all")


@pytest.mark.parametrize("steps", [STEPS, pytest.param(MORE_STEPS, marks=pytest.mark.nightly)])
@pytest.mark.parametrize("spin", [False, True], ids=["plain", "spin"])
def test_numbers_of_the_core(model: fw.Model, device: str, spin: bool, steps: int) -> None:
    found, expected = both(model, device, spin, steps)
    largest = expected["friction_limit_n"].max()
    assert set(np.unique(expected["regime"])) == {0, 1, 2, 3}, "the path shows every regime"
    flags = np.bitwise_or.reduce(expected["status"], axis=None)
    assert flags & fw.Status.BAD_INPUT and flags & fw.Status.DEPTH_ABOVE_RANGE and flags & fw.Status.LARGE_INCREMENT
    worst = differences(found, expected, FORCES).max() / largest
    assert worst <= 1e-6, f"seed {SEED}: forces differ by {worst:.1e} of the limit"
    np.testing.assert_array_equal(found["status"], expected["status"])
    np.testing.assert_array_equal(found["regime"], expected["regime"])
    # Nothing relaxes in this package, so the margin that is left is the margin.
    for name in set(expected.dtype.names) - {"slip_margin_relaxed"}:
        if device == "cpu":
            # Without fused multiplications the order of operations is that of the core, and so are the bits.
            np.testing.assert_array_equal(found[name], expected[name], err_msg=f"seed {SEED}: {name}")


@pytest.mark.nightly
def test_a_changed_model_is_noticed(model: fw.Model, device: str) -> None:
    """The comparison fails where a table is wrong by 3e-5."""
    changed = fw.Model.from_bytes(model.to_bytes())
    changed.rows = changed.rows.copy()
    changed.rows[:, 31:39] *= np.float32(1 + 3e-5)
    found, expected = both(model, device, False, MORE_STEPS, changed)
    assert differences(found, expected, FORCES).max() > 3e-6 * expected["friction_limit_n"].max()


def test_documented_vectors(model: fw.Model, device: str) -> None:
    """The steps that the description of the model file lists, with their bits on the CPU."""
    text = (ROOT / "core/docs/fpm-format.md").read_text()
    block = re.search(r"```vectors\n(.*?)\n```", text, re.DOTALL)
    assert block
    fingers = fw.Fingers(model, device=device)
    names = ["normal_force_n", "friction_x_n", "friction_y_n", "stick_ratio", "friction_limit_n", "slip_margin"]
    names += ["contact_area_mm2", "band_normal_n", "band_friction_n"]
    rows = block[1].splitlines()
    assert len(rows) >= 8
    for row in rows:
        motion, answer = row.split("|")
        *words, regime, status = answer.split()
        response = fingers.step(*(float(x) for x in motion.split())).numpy()[0]
        expected = np.array([int(word, 16) for word in words], np.uint32).view(np.float32)
        np.testing.assert_allclose([response[name] for name in names], expected, rtol=0 if device == "cpu" else 1e-6, atol=1e-9)
        assert (response["regime"], response["status"]) == (int(regime), int(status)), row


def test_at_rest_the_memory_keeps_its_bits(model: fw.Model, device: str) -> None:
    fingers = fw.Fingers(model, 64, spin=True, device=device)
    depth = np.linspace(0.3, 2.5, 64)
    fingers.step(depth)
    fingers.step(depth, 0.2, -0.1, 0.05)
    fingers.step(depth)
    before = fingers.save()
    for _ in range(100):
        fingers.step(depth)
    np.testing.assert_array_equal(fingers.save().view(np.uint32), before.view(np.uint32))


def test_no_friction_above_the_limit_for_any_bits(model: fw.Model, device: str) -> None:
    """Motions of random bits: nothing is NaN, and every number is within its range."""
    random = np.random.default_rng(SEED)
    for spin in (False, True):
        fingers = fw.Fingers(model, 512, spin=spin, device=device)
        for _ in range(200):
            words = random.integers(0, 1 << 32, (5, 512), dtype=np.uint32).view(np.float32)
            half = random.random(512) < 0.5
            depth = np.where(half, random.uniform(0, 3, 512), words[0]).astype(np.float32)
            r = fingers.step(depth, words[1], words[2], words[3], strength_factor=words[4]).numpy()
            for name in ("stick_ratio", "slip_margin"):
                assert ((r[name] >= 0) & (r[name] <= 1)).all(), (name, r[name])
            friction = np.hypot(r["friction_x_n"], r["friction_y_n"])
            assert (friction <= r["friction_limit_n"] * (1 + 1e-5)).all()
            assert (r["normal_force_n"] >= 0).all() and np.isfinite(r["contact_area_mm2"]).all()


def test_a_damaged_memory_is_flagged(model: fw.Model, device: str) -> None:
    """A memory that was overwritten with values that no step writes is reset and flagged."""
    for row, value in ((-1, 17.0), (-1, np.nan), (0, np.inf), (9, np.nan)):
        fingers = fw.Fingers(model, 2, device=device)
        fingers.step(1.0, 0.1)
        memory = fingers.save()
        memory[row, 1] = value
        fingers.restore(memory)
        r = fingers.step(1.0).numpy()
        assert list(r["status"]) == [0, fw.Status.MEMORY_LOST], (row, value, r)
        assert r["normal_force_n"][1] == 0 and fingers.step(1.0).numpy()["status"][1] == 0


def test_save_and_reset(model: fw.Model, device: str) -> None:
    fingers = fw.Fingers(model, 3, device=device)
    fingers.step(1.0, 0.1)
    saved = fingers.save()
    after = fingers.step(1.0, 0.05).numpy()
    fingers.restore(saved)
    np.testing.assert_array_equal(fingers.step(1.0, 0.05).numpy(), after)
    for _ in range(10):
        fingers.step(1.0, 0.1)
    fingers.reset([True, False, False])
    friction = fingers.step(1.0).numpy()["friction_x_n"]
    assert abs(friction[0]) < 0.02 and friction[1] == friction[2] > 0.2
