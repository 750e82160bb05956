"""What Fingers and Model refuse and remember, alone and in threads."""

from __future__ import annotations

import gc
import pickle
import struct
import subprocess
import sys
import threading
import time
import zlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import MODEL

import fingerpad
from fingerpad import EVENT, FORCES, Fingers, InputError, Model, ModelError, Pose, Regime, Status

SEED = 7


def test_spellings_are_those_of_the_core() -> None:
    assert fingerpad.status_words(0) == "ok"
    named = {bit: fingerpad.status_words(1 << bit) for bit in range(16)}
    assert {1 << bit: name.upper() for bit, name in named.items() if name} == {int(s): s.name for s in Status}


def test_properties(model: Model) -> None:
    assert Model.shipped().to_bytes() == MODEL.read_bytes()
    assert model.springs == 4 and 1 < model.depth_max_mm < 5 and 10 <= model.pitch_deg <= 70 and model.knows_poses
    assert "held_out" in str(model.meta) and model.effects == []
    depth, normal, status = model.least_grip(0.2, margin=0.2)
    assert status == 0
    assert Fingers(model).step(depth)["normal_force_n"][0] == pytest.approx(normal, rel=0.05)
    with pytest.raises(AttributeError):
        model.springs = 5  # type: ignore[misc]


def test_effects_are_not_left_out_in_silence(root: Path) -> None:
    corrected = Model.from_file(root / "firmware-example/corrected.fpm")
    assert corrected.effects
    with pytest.warns(UserWarning, match=corrected.effects[0][0]):
        Fingers(corrected)


def with_columns(data: bytes, columns: bytes) -> bytes:
    """A model file with a section of columns that tables read, put together after core/docs/fpm-format.md."""
    (count,) = struct.unpack_from("<I", data, 16)
    sections = [struct.unpack_from("<4sII", data, 20 + 12 * k) for k in range(count)]
    entries = b"".join(struct.pack("<4sII", name, at + 12, length) for name, at, length in sections)
    start = 20 + 12 * count
    padding = bytes(-len(data) % 4)
    length = len(data) + 12 + len(padding) + len(columns)
    entries += struct.pack("<4sII", b"COLS", length - len(columns), len(columns))
    rest = struct.pack("<I", count + 1) + entries + data[start:] + padding + columns
    return data[:8] + struct.pack("<II", length, zlib.crc32(rest)) + rest


def test_columns_of_the_users_own_are_told(model: Model) -> None:
    voltage = struct.pack("<32s16s3f", b"voltage_v", b"V", 0.0, 200.0, 20.0)
    frame = struct.pack("<32s16s3f", b"frame_temperature_c", "°C".encode(), 10.0, 40.0, 22.0)
    told = Model.from_bytes(with_columns(model.to_bytes(), voltage + frame))
    assert told.own_columns == [("voltage_v", "V", (0.0, 200.0), 20.0), ("frame_temperature_c", "°C", (10.0, 40.0), 22.0)]
    assert told.tuned(size=1.1).own_columns == told.own_columns and model.own_columns == []
    backwards = struct.pack("<32s16s3f", b"voltage_v", b"V", 200.0, 0.0, 20.0)
    for columns in (5 * voltage, voltage[:-4], backwards, struct.pack("<32s16s3f", b"", b"V", 0.0, 1.0, 0.0)):
        with pytest.raises(ModelError, match="COLS"):
            Model.from_bytes(with_columns(model.to_bytes(), columns))


def test_bad_models(tmp_path: Path) -> None:
    whole = MODEL.read_bytes()
    cases: dict[str, bytes] = {
        "not a model file": b"PNG!" + whole[4:],
        "format version 10": whole[:4] + b"\x0a\0\0\0" + whole[8:],
        "bytes where": whole[: len(whole) // 2],
        "checksum wrong": whole[:5000] + bytes([whole[5000] ^ 1]) + whole[5001:],
    }
    for text, data in cases.items():
        with pytest.raises(ModelError, match=text):
            Model.from_bytes(data)
    for length in range(0, 200):
        with pytest.raises(ModelError):
            Model.from_bytes(whole[:length])
    short = tmp_path / "short.fpm"
    short.write_bytes(whole[:1000])
    with pytest.raises(ModelError, match=r"short\.fpm: 1000 bytes where"):
        Model.from_file(short)
    with pytest.raises(InputError, match=r"none\.fpm: No such file"):
        Model.from_file(tmp_path / "none.fpm")
    with pytest.raises(TypeError):
        Model.from_bytes("text")  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="Size.*3 is out of range"):
        Model.shipped().tuned(size=3)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"depth_mm": np.zeros(3)}, r"depth_mm: an array of shape \(3,\) where"),
        ({"depth_mm": 1, "slide_x_mm": np.zeros((4, 4))}, "slide_x_mm: an array of shape"),
        ({"depth_mm": "deep"}, "depth_mm: <U4 where real numbers"),
        ({"depth_mm": 1 + 2j}, "complex128 where real numbers"),
        ({"depth_mm": [[1], [2, 3]]}, "depth_mm: "),
        ({"depth_mm": None}, "depth_mm"),
        ({"depth_mm": 1, "dt_s": [1, 2]}, "dt_s: an array of shape"),
        ({"depth_mm": 1, "outputs": "some"}, "outputs: 'some'"),
        ({"depth_mm": 1, "out": np.zeros(4)}, "out: an array of shape"),
        ({"depth_mm": 1, "out": np.zeros(8, FORCES)[::2]}, "contiguous"),
        ({"depth_mm": 1, "pose": Pose(80)}, r"Pose\[0\] = 80 is out of range"),
        ({"depth_mm": 1, "pose": Pose(30, [0, 0, 0, 45])}, r"Pose\[1\] = 45 is out of range"),
        ({"depth_mm": 1, "pose": Pose(float("nan"))}, "out of range"),
    ],
)
def test_bad_arrays_move_nothing(model: Model, arguments: dict[str, Any], text: str) -> None:
    fingers = Fingers(model, 4)
    fingers.step(0.8, 0.3)
    before = fingers.save()
    with pytest.raises(InputError, match=text):
        fingers.step(**arguments)
    assert fingers.save() == before


def test_bad_runs(model: Model) -> None:
    fingers = Fingers(model, 4)
    with pytest.raises(InputError, match="a row a step"):
        fingers.run(1.0, 0.1)
    with pytest.raises(InputError, match=r"depth_mm: an array of shape \(5, 4\) where \(6, 4\)"):
        fingers.run(np.ones((5, 4)), np.ones((6, 4)))
    with pytest.raises(InputError, match="-1 fingers"):
        Fingers(model, -1)
    with pytest.raises(InputError, match="and not both"):
        fingers.step_driven(depth_mm=1, normal_force_n=1)
    assert fingers.run(np.ones((0, 4))).shape == (0, 4)
    assert Fingers(model, 0).step(1.0).shape == (0,)


@pytest.mark.parametrize("spin", [False, True])
def test_the_margin_is_zero_without_contact(model: Model, spin: bool) -> None:
    """In the air nothing is held: a controller that reads the margin must close. Depths with noise, slides that turn back."""
    random = np.random.default_rng(SEED)
    fingers = Fingers(model, 64, spin=spin)
    for _ in range(200):
        r = fingers.step(random.normal(0, 0.2, 64), random.normal(0, 0.02, 64))
        lifted = r["regime"] == Regime.NO_CONTACT
        assert lifted.any() and (r["slip_margin"][lifted] == 0).all()


def test_nonsense_is_flagged_and_forgotten(model: Model) -> None:
    """Bits at random in every input: nothing is no number, and nothing leaves its range."""
    random = np.random.default_rng(SEED)
    fingers = Fingers(model, 256, spin=True)
    for _ in range(200):
        depth, x, y, spin, strength = random.integers(0, 2**32, (5, 256), np.uint32).view(np.float32)
        r = fingers.step(depth, x, y, spin, dt_s=float(random.normal()), strength_factor=strength, outputs="all")
        floats = np.array([r[n] for n in r.dtype.names or () if r.dtype[n] == np.float32])
        assert np.isfinite(floats).all(), f"seed {SEED}"
        assert ((r["slip_margin"] >= 0) & (r["slip_margin"] <= 1)).all()
    with np.errstate(all="raise"):
        r = fingers.step([1e300] * 256)
    assert (r["status"] & Status.BAD_INPUT).all()


def test_state_is_saved_restored_copied_and_pickled(model: Model) -> None:
    fingers = Fingers(model, 5, spin=True)
    path = np.random.default_rng(SEED).normal(0, 0.05, (200, 5))
    fingers.run(0.9 + path, path, 0.01, 0.01, strength_factor=0.7)
    saved, copied, pickled = fingers.save(), fingers.copy(), pickle.loads(pickle.dumps(fingers))
    expected = fingers.run(0.9 + path, -path)
    fingers.restore(saved)
    for again in (fingers, copied, pickled):
        np.testing.assert_array_equal(again.run(0.9 + path, -path), expected)
    np.testing.assert_allclose(fingers.strength_factor, 0.7)
    with pytest.raises(ModelError, match="checksum"):
        fingers.restore(saved[:50] + bytes([saved[50] ^ 4]) + saved[51:])
    with pytest.raises(ModelError, match="bytes where"):
        fingers.restore(saved[:-1])
    np.testing.assert_array_equal(fingers.save(), copied.save())
    tuned = pickle.loads(pickle.dumps(model.tuned(stiffness=2)))
    assert tuned.tuning == model.tuned(stiffness=2).tuning


def test_reset(model: Model) -> None:
    fingers = Fingers(model, 3)
    fingers.step(0.9, 0.5, strength_factor=2)
    fingers.reset([True, False, True])
    np.testing.assert_array_equal(fingers.depth_mm, np.array([0, 0.9, 0], np.float32))
    fingers.reset()
    assert fingers.save() == Fingers(model, 3).save()
    with pytest.raises(InputError, match="which: int64"):
        fingers.reset([0, 1, 2])


def test_events_through_noise(model: Model) -> None:
    """Two fingers land; the second one slides, stops and turns back, the first one only trembles."""
    fingers = Fingers(model, 2)
    fingers.watch()
    steps = 1200
    slide = np.zeros((steps, 2))
    slide[200:700, 1], slide[800:1100, 1] = 0.01, -0.01
    depth = np.full((steps, 2), 0.8) + np.random.default_rng(SEED).normal(0, 1e-3, (steps, 2))
    depth[1150:] = -1
    r = fingers.run(depth, slide)
    events = fingers.events()
    assert events.dtype == EVENT and len(fingers.events()) == 0
    told = [list(events["change"][events["finger"] == k]) for k in (0, 1)]
    assert told[0] == ["touch", "lift_off"]
    assert told[1][:3] == ["touch", "first_slip", "full_slip"] and told[1][-1] == "lift_off" and "restick" in told[1]
    slips = events[(events["change"] == "full_slip") & (events["finger"] == 1)]["tick"][0]
    assert r["regime"][slips, 1] == Regime.SLIP and 200 < slips < 700


def test_what_was_freed_is_not_used() -> None:
    """Fingers outlive their model, arrays outlive their fingers."""
    model = Model.shipped()
    fingers = Fingers(model, 1000)
    del model
    gc.collect()
    r = fingers.step(0.9, 0.2)
    expected = r.copy()
    del fingers
    gc.collect()
    [np.empty(8000, np.float32).fill(7) for _ in range(100)]
    np.testing.assert_array_equal(r, expected)


def test_threads(model: Model) -> None:
    """Fingers of their own in each thread give the same bits; the same fingers in all threads wait for each other."""
    path = np.random.default_rng(SEED).normal(0, 0.05, (400, 64))
    expected = Fingers(model, 64).run(0.9 + path, path)
    with ThreadPoolExecutor(4) as pool:
        for found in pool.map(lambda _: Fingers(model, 64).run(0.9 + path, path), range(16)):
            np.testing.assert_array_equal(found, expected)
    shared, one = Fingers(model, 64), Fingers(model, 64)
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: shared.run(np.full((200, 1), 0.9), 0.001), range(8)))
    one.run(np.full((1600, 1), 0.9), 0.001)
    assert shared.save() == one.save()


def test_the_interpreter_is_free_during_a_run(model: Model) -> None:
    fingers, count = Fingers(model, 4096), 0
    path = np.full((2000, 1), 0.9)
    thread = threading.Thread(target=lambda: fingers.run(path, 0.001))
    thread.start()
    while thread.is_alive():
        count += 1
        time.sleep(1e-3)
    assert count > 20


def test_ctrl_c_leaves_the_fingers_as_they_were() -> None:
    script = """
import numpy as np, fingerpad, signal, threading, os
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
fingers = fingerpad.Fingers(fingerpad.Model.shipped(), 4096)
fingers.step(0.5, 0.1)
before = fingers.save()
try:
    threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
    fingers.run(np.full((4000, 1), 0.9), 0.001)
except KeyboardInterrupt:
    print("stopped" if fingers.save() == before else "moved")
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert done.stdout.strip() == "stopped", done.stderr
