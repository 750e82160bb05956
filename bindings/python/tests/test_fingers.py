"""Errors, states, events and threads of Fingers, Model and Pad."""

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
from conftest import MODEL, PAD

import fingerpad
from fingerpad import (
    EVENT,
    FORCES,
    PATCH,
    Cylinder,
    Edge,
    Fingers,
    InputError,
    Model,
    ModelError,
    Pad,
    Plane,
    Regime,
    Sphere,
    Status,
)

SEED = 7


def test_spellings_are_those_of_the_core() -> None:
    assert fingerpad.status_words(0) == "ok"
    named = {bit: fingerpad.status_words(1 << bit) for bit in range(16)}
    assert {1 << bit: name.upper() for bit, name in named.items() if name} == {int(s): s.name for s in Status}


def test_properties(model: Model) -> None:
    assert Model.shipped().to_bytes() == MODEL.read_bytes()
    assert model.springs == 4 and 1 < model.depth_max_mm < 5 and model.pose_deg == (30.0, 0.0)
    assert f"4 springs, depth 0 to {model.depth_max_mm:.2f} mm" in repr(model) and " N, pitch 30 deg, roll 0 deg, 0 effects" in repr(model)
    assert "held_out" in str(model.meta) and model.effects == []
    depth, normal, status = model.least_grip(0.2, margin=0.2)
    assert status == 0
    assert Fingers(model).step(depth)["normal_force_n"][0] == pytest.approx(normal, rel=0.05)
    with pytest.raises(AttributeError):
        model.springs = 5  # type: ignore[misc]


def test_properties_of_a_pad(pad: Pad) -> None:
    assert Pad.shipped().to_bytes() == PAD.read_bytes()
    assert pad.patches == len(pad.patch_areas_mm2) == 37 and 4 < pad.depth_max_mm < 8 and pad.neutral_pitch_deg == 30
    assert pad.pitch_range_deg == (10, 70) and pad.roll_range_deg == (-30, 30) and pad.tuning == (1, 1, 1)
    assert "37 patches, depth 0 to " in repr(pad) and ", pitch 10 to 70 deg, roll -30 to 30 deg" in repr(pad)
    assert repr(pad.tuned(size=1.1)).endswith(", tuned>") and isinstance(pad.meta, dict) and pad.meta
    fingers = Fingers(pad, 3, body=Sphere(20))
    assert fingers.spin and fingers.body == Sphere(20) and repr(fingers).endswith(" on Sphere(radius_mm=20.0)>")
    assert Fingers(pad).body == Plane()


def test_a_file_tells_what_it_holds(tmp_path: Path, model: Model, pad: Pad) -> None:
    for path, expected in ((MODEL, model), (PAD, pad)):
        for found in (fingerpad.load(path), fingerpad.load(str(path)), fingerpad.load(path.read_bytes())):
            assert type(found) is type(expected) and found == expected
    with pytest.raises(ModelError, match="a pad, not a bed of springs: use fingerpad.load"):
        Model.from_bytes(pad.to_bytes())
    with pytest.raises(ModelError, match=r"fingertip\.fpm: a bed of springs, not a pad: use fingerpad.load"):
        Pad.from_file(MODEL)
    damaged = tmp_path / "damaged.fpm"
    for whole in (model.to_bytes(), pad.to_bytes()):
        for data, text in ((whole[:900], "900 bytes where"), (whole[:-9] + b"?" + whole[-8:], "checksum wrong"), (b"PNG!" + whole[4:], "not a model")):
            with pytest.raises(ModelError, match=f"^{text}"):
                fingerpad.load(data)
            damaged.write_bytes(data)
            with pytest.raises(ModelError, match=rf"damaged\.fpm: {text}"):
                fingerpad.load(damaged)
    with pytest.raises(InputError, match=r"none\.fpm: No such file"):
        fingerpad.load(tmp_path / "none.fpm")
    with pytest.raises(TypeError):
        fingerpad.load(3)  # type: ignore[arg-type]


def with_patches(data: bytes, count: int) -> bytes:
    """A pad's file with as many patches, the first ones and then copies of the last one, after core/docs/fpm-format.md."""
    (number,) = struct.unpack_from("<I", data, 16)
    sections = {name: data[at : at + length] for name, at, length in (struct.unpack_from("<4sII", data, 20 + 12 * k) for k in range(number))}
    size = 4 * (12 + 3 * 16)
    patches = [sections[b"PADP"][k : k + size] for k in range(0, len(sections[b"PADP"]), size)]
    sections[b"PADP"] = b"".join((patches + [patches[-1]] * count)[:count])
    at, entries = 20 + 12 * number, b""
    for name, section in sections.items():
        entries += struct.pack("<4sII", name, at, len(section))
        at += len(section)
    rest = struct.pack("<I", number) + entries + b"".join(sections.values())
    return data[:8] + struct.pack("<II", at, zlib.crc32(rest)) + rest


def test_pads_of_other_sizes(pad: Pad) -> None:
    assert with_patches(pad.to_bytes(), 37) == pad.to_bytes()
    depth = np.linspace(0.05, 1, 20)
    usual = Fingers(pad, body=Sphere(20)).run(depth)
    for count in (12, 36, 38, 128):
        made = Pad.from_bytes(with_patches(pad.to_bytes(), count))
        fingers = Fingers(made, 2, body=Sphere(20))
        r = fingers.run(depth[:, None])
        assert made.patches == count and fingers.patches().shape == (2, count)
        assert (r["status"] == 0).all() and r["normal_force_n"][-1, 0] > 0.05
        saved = fingers.save()
        expected = fingers.step(0.9, 0.1)
        fingers.restore(saved)
        np.testing.assert_array_equal(fingers.step(0.9, 0.1), expected)
        if count == 38:
            # The last patch is apart here, and so is its copy.
            np.testing.assert_array_equal(r[:, :1], usual)
    with pytest.raises(ModelError, match="129 patches; at most 128 are used here"):
        Pad.from_bytes(with_patches(pad.to_bytes(), 129))


def test_equal_models_are_of_equal_numbers(model: Model, pad: Pad) -> None:
    assert model == Model.shipped() and pad == Pad.shipped() and model != pad and model != 3
    assert pad.tuned(size=1.1) == pad.tuned(size=1.1) != pad and pad.tuned() == pad
    assert model.tuned(lambda_factor=2) == model.tuned(lambda_factor=2) != model and model.tuned() == model
    assert len({model, Model.shipped(), pad, Pad.shipped(), pad.tuned(), pad.tuned(size=2)}) == 3


def test_the_version_is_that_of_the_package() -> None:
    from importlib.metadata import version

    assert fingerpad.__version__ == version("fingerpad")


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
    reported = Model.from_bytes(with_columns(model.to_bytes(), voltage + frame))
    assert reported.own_columns == [("voltage_v", "V", (0.0, 200.0), 20.0), ("frame_temperature_c", "°C", (10.0, 40.0), 22.0)]
    assert reported.tuned(size=1.1).own_columns == reported.own_columns and model.own_columns == []
    backwards = struct.pack("<32s16s3f", b"voltage_v", b"V", 200.0, 0.0, 20.0)
    for columns in (5 * voltage, voltage[:-4], backwards, struct.pack("<32s16s3f", b"", b"V", 0.0, 1.0, 0.0)):
        with pytest.raises(ModelError, match="COLS"):
            Model.from_bytes(with_columns(model.to_bytes(), columns))


def test_bad_models(tmp_path: Path) -> None:
    whole = MODEL.read_bytes()
    cases: dict[str, bytes] = {
        "not a model file": b"PNG!" + whole[4:],
        "format version 9": whole[:4] + b"\x09\0\0\0" + whole[8:],
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


@pytest.mark.parametrize("kind", [Model, Pad])
def test_tunings_out_of_range(kind: Any) -> None:
    for name, value, text in (
        ("size", 3, "size: 3 is not between 0.5 and 2"),
        ("stiffness", 0.1, "stiffness: 0.1 is not between 0.2 and 5"),
        ("lambda_factor", float("nan"), "lambda_factor: NaN is not between 0.1 and 10"),
    ):
        with pytest.raises(ModelError, match=text):
            kind.shipped().tuned(**{name: value})


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
        ({"depth_mm": np.ma.masked_array([1, 2, 3, 4], [0, 1, 0, 1])}, "depth_mm: 2 of 4 numbers are masked"),
        ({"depth_mm": np.ma.masked}, "depth_mm: 1 of 1 numbers are masked"),
        ({"depth_mm": 1, "slide_y_mm": np.ma.masked_invalid([0, 0, 0, np.inf])}, "slide_y_mm: 1 of 4 numbers are masked"),
        ({"depth_mm": 1, "strength_factor": [True] * 4}, "strength_factor: bool where real numbers"),
        ({"depth_mm": [1, None, 1, 1]}, "depth_mm: object where real numbers"),
        ({"depth_mm": 1, "pitch_deg": 40}, r"pitch_deg: 40, but a bed of springs is of one pose \(pitch 30 deg, roll 0 deg\)"),
        ({"depth_mm": 1, "roll_deg": [0, 0, 0, 45]}, r"roll_deg: an array of shape \(4,\), but a bed of springs is of one pose"),
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
    for pitch in (1.0, np.ones((6, 4))):
        with pytest.raises(InputError, match="pitch_deg: .* a bed of springs is of one pose"):
            fingers.run(np.ones((6, 4)), pitch_deg=pitch)
    with pytest.raises(InputError, match="and not both"):
        fingers.step_driven(depth_mm=1, normal_force_n=1)
    assert fingers.run(np.ones((0, 4))).shape == (0, 4)
    assert Fingers(model, 0).step(1.0).shape == (0,)


@pytest.mark.parametrize(("kind", "most"), [(Model, 1 << 24), (Pad, 1 << 20)])
def test_hostile_counts(kind: Any, most: int) -> None:
    for count in (-1, most + 1, 10**12, 2**63, 2**64, 10**30):
        with pytest.raises(InputError, match=f"count: {count} is not between 0 and {most}"):
            Fingers(kind.shipped(), count)
    for count in (2.5, "3", None, True, False):
        with pytest.raises(InputError, match=f"count: {count!r} where a whole number is needed"):
            Fingers(kind.shipped(), count)
    with pytest.raises(InputError, match="model: str where a Model or a Pad"):
        Fingers("fingertip.fpm")  # type: ignore[arg-type]
    assert len(Fingers(kind.shipped(), np.int64(3))) == 3


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"pitch_deg": 80}, "pitch_deg: 80 is not between 10 and 70"),
        ({"roll_deg": [0, 31, 0, 0]}, "roll_deg: 31 is not between -30 and 30"),
        ({"pitch_deg": float("nan")}, "pitch_deg: nan is not between 10 and 70"),
        ({"pitch_deg": [30, 40]}, r"pitch_deg: an array of shape \(2,\) where \(4,\)"),
        ({"body": "plane"}, "body: 'plane' where a Plane, Sphere, Cylinder or Edge"),
        ({"body": Sphere}, "body: .* where a Plane, Sphere"),
    ],
)
def test_bad_fingers_of_a_pad(model: Model, pad: Pad, options: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        Fingers(pad, 4, **options)
    with pytest.raises(InputError, match=f"{next(iter(options))}: .*a bed of springs is of one pose"):
        Fingers(model, 4, **options)


def test_a_spin_is_true_or_false(model: Model) -> None:
    for spin in ("no", 1, None):
        with pytest.raises(InputError, match=f"spin: {spin!r} where True or False is needed"):
            Fingers(model, spin=spin)  # type: ignore[arg-type]


def test_masks_without_masked_numbers_pass(model: Model) -> None:
    depth = np.array([0.3, 0.6, 0.9])
    plain = Fingers(model, 3).step(depth)
    np.testing.assert_array_equal(Fingers(model, 3).step(np.ma.masked_array(depth, False)), plain)
    np.testing.assert_array_equal(Fingers(model, 3).step(np.ma.masked_array(depth, [0, 1, 0]).filled(0.6)), plain)
    pd = pytest.importorskip("pandas")
    np.testing.assert_array_equal(Fingers(model, 3).step(pd.Series(depth)), plain)
    assert list(Fingers(model, 3).step(pd.Series([0.3, None, 0.9]))["status"]) == [0, Status.BAD_INPUT, 0]


@pytest.mark.parametrize(
    ("body", "numbers", "text"),
    [
        (Sphere, (0,), "radius_mm: 0 is not between 0.1 and 1000000, or the negative of that"),
        (Sphere, (float("nan"),), "radius_mm: nan is not"),
        (Sphere, (1e300,), "radius_mm: 1e[+]300 is not"),
        (Cylinder, (float("inf"), 0), "radius_mm: inf is not"),
        (Cylinder, (10, 270), "axis_deg: 270 is not between -180 and 180"),
        (Cylinder, ("wide",), "radius_mm: 'wide' where a number"),
        (Edge, (-2,), "radius_mm: -2 is not between 0.1 and 1000000$"),
        (Edge, (2, 0, 180), "angle_deg: 180 is not between 1 and 179"),
        (Edge, (2, None), "axis_deg: None where a number"),
    ],
)
def test_bad_bodies(body: Any, numbers: tuple[Any, ...], text: str) -> None:
    with pytest.raises(InputError, match=text):
        body(*numbers)


def test_a_pad_is_driven_by_forces(pad: Pad) -> None:
    fingers = Fingers(pad, 3, body=Sphere(20), pitch_deg=[30, 40, 50])
    for _ in range(5):
        r = fingers.step_driven(normal_force_n=[0.3, 0.5, 0.7], friction_x_n=[0.0, 0.05, -0.1])
    np.testing.assert_allclose(r["normal_force_n"], [0.3, 0.5, 0.7], rtol=1e-3)
    np.testing.assert_allclose(r["friction_x_n"], [0.0, 0.05, -0.1], atol=1e-3)
    assert not r["status"].any() and not r["slide_x_mm"].any(), "a load that is there already does not creep"
    stiffness = fingers.gradient()
    assert (stiffness[:, 0, 0] > 0.1).all() and (stiffness[:, 1, 1] > 0.05).all() and (stiffness[:, 2, 2] > 0.05).all()
    assert (fingers.step_driven(normal_force_n=50)["status"] & Status.LOAD_NOT_REACHED).all()


def test_what_a_bed_cannot(model: Model) -> None:
    with pytest.raises(InputError, match="patches: a bed of springs has none"):
        Fingers(model).patches()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"depth_mm": np.zeros(3)}, r"depth_mm: an array of shape \(3,\) where"),
        ({"depth_mm": 1, "pitch_deg": [[1, 2]]}, "pitch_deg: an array of shape"),
        ({"depth_mm": 1, "roll_deg": "left"}, "roll_deg: <U4 where real numbers"),
        ({"depth_mm": 1, "outputs": "some"}, "outputs: 'some'"),
    ],
)
def test_bad_arrays_move_no_finger_of_a_pad(pad: Pad, arguments: dict[str, Any], text: str) -> None:
    fingers = Fingers(pad, 4)
    fingers.step(0.8, 0.3)
    before = fingers.save()
    with pytest.raises(InputError, match=text):
        fingers.step(**arguments)
    assert fingers.save() == before


def test_patches_add_up(pad: Pad) -> None:
    """Pressure over the patches is the normal force, traction the friction; patches without contact have neither."""
    area = np.array(pad.patch_areas_mm2)
    fingers = Fingers(pad, 3, pitch_deg=[30, 45, 20], roll_deg=[0, 10, -10])
    air = fingers.patches()
    assert air.shape == (3, 37) and air.dtype == PATCH and not air.view(np.float32).any()
    depth = np.linspace(0.05, 1.0, 20)[:, None]
    fingers.run(depth)
    r = fingers.run(np.full((20, 1), 1.0), 0.04, 0.02, outputs="all")[-1]
    patches = fingers.patches()
    np.testing.assert_allclose((patches["pressure_mpa"] * area).sum(1), r["normal_force_n"], rtol=1e-4)
    for axis in "xy":
        traction = (patches[f"traction_{axis}_mpa"] * area).sum(1)
        np.testing.assert_allclose(traction, r[f"friction_{axis}_n"], rtol=2e-3, atol=1e-4)
    np.testing.assert_allclose(patches["contact_area_mm2"].sum(1), r["contact_area_mm2"], rtol=1e-4)
    mean = (patches["stick_ratio"] * patches["contact_area_mm2"]).sum(1) / patches["contact_area_mm2"].sum(1)
    assert (r["regime"] == Regime.PARTIAL_SLIP).all() and (np.abs(mean - r["stick_ratio"]) < 0.2).all()
    apart = patches["contact_area_mm2"] == 0
    assert apart.any() and not apart.all() and (patches["used_share"] <= 1).all()
    for name in ("pressure_mpa", "traction_x_mpa", "traction_y_mpa", "stick_ratio", "used_share"):
        assert (patches[name][apart] == 0).all()
    assert (patches["pressure_mpa"][~apart] > 0).all()


def test_a_ball_presses_less_than_a_plane_and_in_the_middle(pad: Pad) -> None:
    depth = np.linspace(0.05, 1.0, 20)[:, None]
    pressed = {}
    for body in (Plane(), Sphere(1e6), Sphere(20), Cylinder(20, 0), Sphere(-60)):
        fingers = Fingers(pad, body=body)
        r = fingers.run(depth, outputs="all")[-1, 0]
        assert r["status"] == 0 and r["normal_force_n"] > 0.1, body
        pressed[body] = r
    assert pressed[Sphere(1e6)]["normal_force_n"] == pytest.approx(pressed[Plane()]["normal_force_n"], rel=0.03)
    names = ("normal_force_n", "contact_area_mm2")
    for name in names:
        ball, rod, plane, bowl = (float(pressed[b][name]) for b in (Sphere(20), Cylinder(20, 0), Plane(), Sphere(-60)))
        assert ball < rod < plane < bowl, name


def test_a_pose_that_changes_in_contact(pad: Pad) -> None:
    """Rolling and pitching back and forth under load: the finger comes to every pose, and poses of a step are those of no other."""
    fingers = Fingers(pad, 2)
    fingers.run(np.linspace(0.05, 1.0, 20)[:, None])
    t = np.linspace(0, 2 * np.pi, 201)[1:, None]
    r = fingers.run(1.0 + 0 * t, pitch_deg=30 + np.array([15, 0]) * np.sin(t), roll_deg=np.array([0, 20]) * np.sin(t), outputs="all")
    assert (r["status"] == 0).all()
    assert np.ptp(r["pressure_centre_x_mm"][:, 0]) > 0.5 and np.ptp(r["pressure_centre_y_mm"][:, 1]) > 0.5
    assert np.ptp(r["normal_force_n"][:, 0]) > 0.01
    # Without a pose a step is in that in which the fingers were made, which is where they are now.
    np.testing.assert_allclose(fingers.step(1.0)["normal_force_n"], r["normal_force_n"][-1], rtol=1e-3)
    held = fingers.save()
    beyond = fingers.step(1.0, pitch_deg=[90, 30], roll_deg=[0, -45])
    assert (beyond["status"] == Status.POSE_OUT_OF_RANGE).all()
    fingers.restore(held)
    nearest = fingers.step(1.0, pitch_deg=[70, 30], roll_deg=[0, -30])
    np.testing.assert_array_equal(beyond["normal_force_n"], nearest["normal_force_n"])
    lost = fingers.step(1.0, pitch_deg=[float("nan"), 30], roll_deg=[0, float("nan")])
    assert (lost["status"] == Status.BAD_INPUT).all() and (lost["normal_force_n"] > 0).all()


def test_a_state_belongs_to_one_pad_body_and_tuning(pad: Pad) -> None:
    fingers = Fingers(pad, 2, body=Sphere(20), pitch_deg=[30, 50])
    fingers.run(np.linspace(0.05, 1, 20)[:, None], 0.01, strength_factor=1.4)
    saved, copied, pickled = fingers.save(), fingers.copy(), pickle.loads(pickle.dumps(fingers))
    assert pickled.body == Sphere(20) and pickled.model == pad
    expected = fingers.run(np.full((20, 1), 0.9), 0.02)
    fingers.restore(saved)
    for again in (fingers, copied, pickled):
        np.testing.assert_array_equal(again.run(np.full((20, 1), 0.9), 0.02), expected)
    np.testing.assert_allclose(fingers.strength_factor, 1.4)
    for other, text in (
        (Fingers(pad, 2), r"saved with Sphere\(radius_mm=20.0\), .* here it is Plane\(\), size 1"),
        (Fingers(pad, 2, body=Sphere(21)), r"here it is Sphere\(radius_mm=21.0\)"),
        (Fingers(pad.tuned(size=1.2), 2, body=Sphere(20)), "here it is .*, size 1.2"),
    ):
        before = other.save()
        with pytest.raises(ModelError, match=text):
            other.restore(saved)
        assert other.save() == before
    with pytest.raises(ModelError, match="bytes where"):
        Fingers(pad, 3, body=Sphere(20)).restore(saved)
    Fingers(pad, 2, body=Sphere(np.float32(20)), pitch_deg=[30, 50]).restore(saved)
    before = fingers.save()
    for k in range(0, len(saved), 7):
        with pytest.raises(ModelError):
            fingers.restore(saved[:k])
        with pytest.raises(ModelError):
            fingers.restore(saved[:k] + bytes([saved[k] ^ 8]) + saved[k + 1 :])
    assert fingers.save() == before
    with pytest.raises(ModelError, match="bytes where"):
        fingers.restore(Fingers(Model.shipped(), 2).save())


def test_a_body_sharper_than_the_patches_is_flagged(pad: Pad) -> None:
    """It would dig in between the patches, which would not answer; the force is that of the least radius."""
    for sharp, least in ((Sphere(1), Sphere(3.95)), (Edge(0.2, 30), Edge(1.6, 30))):
        r = Fingers(pad, body=sharp).run(np.linspace(0, 3, 60))[-1, 0]
        assert r["status"] == Status.BODY_TOO_SHARP
        expected = Fingers(pad, body=least).run(np.linspace(0, 3, 60))[-1, 0]["normal_force_n"]
        assert r["normal_force_n"] == pytest.approx(expected, rel=0.03) and expected > 0.2


def test_nonsense_is_flagged_by_a_pad(pad: Pad) -> None:
    """Bits at random in every input, on every body: all that is answered is a number within its range."""
    random = np.random.default_rng(SEED)
    for body in (Plane(), Sphere(10), Sphere(-12), Cylinder(8, 40), Edge(3, 90, 60)):
        fingers = Fingers(pad, 64, body=body)
        for _ in range(15):
            depth, x, y, spin, strength, pitch, roll = random.integers(0, 2**32, (7, 64), np.uint32).view(np.float32)
            depth = np.where(random.random(64) < 0.7, random.normal(0.7, 1, 64), depth)
            r = fingers.step(
                depth, x, y, spin, dt_s=float(random.normal()), strength_factor=strength, pitch_deg=pitch, roll_deg=roll, outputs="all"
            )
            floats = np.array([r[n] for n in r.dtype.names or () if r.dtype[n] == np.float32])
            assert np.isfinite(floats).all() and np.isfinite(fingers.patches().view(np.float32)).all(), f"seed {SEED}, {body}"
            assert ((r["slip_margin"] >= 0) & (r["slip_margin"] <= 1)).all()
        assert (fingers.step([1e300] * 64)["status"] & Status.BAD_INPUT).all()


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
    """Bits at random in every input: all results are finite and within their range."""
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
    on_ball = Fingers(Pad.shipped(), 2, body=Sphere(15), pitch_deg=50)
    on_ball.step(0.9, 0.5, strength_factor=2)
    on_ball.reset([True, False])
    np.testing.assert_array_equal(on_ball.depth_mm, np.array([0, 0.9], np.float32))
    on_ball.reset()
    assert on_ball.save() == Fingers(Pad.shipped(), 2, body=Sphere(15), pitch_deg=50).save()


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
    reported = [list(events["change"][events["finger"] == k]) for k in (0, 1)]
    assert reported[0] == ["touch", "lift_off"]
    assert reported[1][:3] == ["touch", "first_slip", "full_slip"] and reported[1][-1] == "lift_off" and "restick" in reported[1]
    slips = events[(events["change"] == "full_slip") & (events["finger"] == 1)]["tick"][0]
    assert 200 < slips < 700 and (r["stick_ratio"][slips - 7 : slips + 1, 1] <= 0.1).all(), "eight looks"
    assert (r["regime"][slips + 10 : 700, 1] == Regime.SLIP).all()


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


@pytest.mark.parametrize(("kind", "count"), [(Model, 64), (Pad, 4)])
def test_threads(kind: Any, count: int) -> None:
    """Fingers of their own in each thread give the same bits; the same fingers in all threads wait for each other."""
    model = kind.shipped()
    path = np.random.default_rng(SEED).normal(0, 0.05, (400, count))
    expected = Fingers(model, count).run(0.9 + path, path)
    with ThreadPoolExecutor(4) as pool:
        for found in pool.map(lambda _: Fingers(model, count).run(0.9 + path, path), range(16)):
            np.testing.assert_array_equal(found, expected)
    shared, one = Fingers(model, count), Fingers(model, count)
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: shared.run(np.full((200, 1), 0.9), 0.001), range(8)))
    one.run(np.full((1600, 1), 0.9), 0.001)
    assert shared.save() == one.save()


@pytest.mark.parametrize(("kind", "steps"), [(Model, 2000), (Pad, 20)])
def test_the_interpreter_is_free_during_a_run(kind: Any, steps: int) -> None:
    fingers, count = Fingers(kind.shipped(), 4096), 0
    path = np.full((steps, 1), 0.9)
    thread = threading.Thread(target=lambda: fingers.run(path, 0.001))
    thread.start()
    while thread.is_alive():
        count += 1
        time.sleep(1e-3)
    assert count > 20


@pytest.mark.parametrize(("kind", "count", "steps"), [("Model", 4096, 4000), ("Pad", 4096, 100), ("Pad", 20_000, 1)])
def test_ctrl_c_leaves_the_fingers_as_they_were(kind: str, count: int, steps: int) -> None:
    """Also in the midst of a long single step."""
    script = f"""
import numpy as np, fingerpad, signal, threading, os
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
fingers = fingerpad.Fingers(fingerpad.{kind}.shipped(), {count})
fingers.step(0.5, 0.1)
before = fingers.save()
try:
    threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
    fingers.run(np.full(({steps}, 1), 0.9), 0.001)
except KeyboardInterrupt:
    print("stopped" if fingers.save() == before else "moved")
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert done.stdout.strip() == "stopped", done.stderr
