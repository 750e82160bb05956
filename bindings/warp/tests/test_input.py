"""Bad input raises an exception that names argument, value and range."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import warp as wp
from conftest import MODEL, PAD

import fingerpad_warp as fw
from fingerpad_warp import _model as place
from fingerpad_warp import _pad_model as pad_place


def sealed(data: bytes) -> bytes:
    """The same file with its length and checksum brought in order."""
    data = data[:8] + struct.pack("<I", len(data)) + data[12:]
    return data[:12] + struct.pack("<I", zlib.crc32(data[16:])) + data[16:]


def with_float(path: Path, section: bytes, place_of: int, value: float) -> bytes:
    """A file in which one float of a section is another, sealed."""
    data = bytearray(path.read_bytes())
    count = struct.unpack_from("<I", data, 16)[0]
    for i in range(count):
        name, offset, _ = struct.unpack_from("<4s2I", data, 20 + 12 * i)
        if name == section:
            struct.pack_into("<f", data, offset + place_of, value)
            return sealed(bytes(data))
    raise AssertionError(section)


def test_whole_files_are_read() -> None:
    for path, kind in ((MODEL, fw.Model), (PAD, fw.Pad)):
        assert isinstance(fw.load(path), kind) and fw.load(path.read_bytes()) == fw.load(str(path))


@pytest.mark.parametrize("path", [MODEL, PAD], ids=["bed", "pad"])
def test_damaged_files_are_refused(path: Path) -> None:
    data = path.read_bytes()
    for length in range(0, len(data), 97):
        with pytest.raises(fw.ModelError):
            fw.load(data[:length])
    for at in range(0, len(data), 61):
        with pytest.raises(fw.ModelError):
            fw.load(data[:at] + bytes([data[at] ^ 0x41]) + data[at + 1 :])


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda d: b"XXXX" + d[4:], "does not start with FPM1"),
        (lambda d: d[:4] + struct.pack("<I", 9) + d[8:], "format version 9; this package reads version 10"),
        (lambda d: d + b"1234", r"\d+ bytes where \d+ are expected"),
        (lambda d: d[:-1] + b"?", "checksum wrong"),
    ],
)
def test_the_reason_is_named(change: Any, text: str) -> None:
    with pytest.raises(fw.ModelError, match=text):
        fw.load(change(MODEL.read_bytes()))


ROWS = 8 + 4 * (place.HEAD + place.SPRING * place.SPRINGS)


@pytest.mark.parametrize(
    ("section", "at", "value", "text"),
    [
        (b"DATA", 0, 0.0, "made for 0 springs"),
        (b"DATA", 8, 30.0, r"depth_max_mm\[0\] = 30 is not between 0.1 and 20"),
        (b"DATA", 8 + 4 * place.ODD, float("nan"), r"odd_per_mm\[0\] = nan"),
        (b"DATA", 8 + 4 * place.POSE, 80.0, r"pitch_deg\[0\] = 80 is not between 10 and 70"),
        (b"DATA", 8 + 4 * place.HEAD, 0.9, "sum of the stiffness shares"),
        (b"DATA", ROWS + 4 * (place.ROW * 3 + place.LIMIT), -1.0, r"friction_limit_n\[3\] = -1 is not between"),
        (b"DATA", ROWS + 4 * (place.ROW * 3 + place.NORMAL + 1), -0.1, "normal_force_n falls at node 3"),
        (b"DATA", ROWS + 4 * (place.ROW * 5 + place.AREA), 60.0, "contact_area_mm2 jumps at node 5"),
        (b"DATA", ROWS + 4 * (place.ROW * 36 + place.LIMIT + 1), 0.1, "friction_limit_n changes behind the last node"),
        (b"PADN", 4 + 4 * (pad_place.FRICTION + 1), 1.5, r"beta\[0\] = 1.5 is not between 0.001 and 1"),
        (b"PADN", 4 + 4 * pad_place.REACH, 0.1, "reach of a patch"),
        (b"PADP", 4 * 3, -1.0, r"area of a patch, mm2\[0\] = -1"),
    ],
)
def test_numbers_out_of_range_are_refused_by_name(section: bytes, at: int, value: float, text: str) -> None:
    path = MODEL if section == b"DATA" else PAD
    with pytest.raises(fw.ModelError, match=text):
        fw.load(with_float(path, section, at, value))


def test_a_model_that_could_create_energy_is_refused() -> None:
    """A coupling of the normal force to friction that is far too strong, continuous in value."""
    model = fw.Model.from_file(MODEL)
    data = bytearray(MODEL.read_bytes())
    offset = next(o for n, o, _ in (struct.unpack_from("<4s2I", data, 20 + 12 * i) for i in range(3)) if n == b"DATA")
    for i in range(place.NODES):
        at = offset + ROWS + 4 * (place.ROW * i + place.PRESS_SLIDE)
        value, slope, bend = 40 * model.rows[i, place.PRESS_SLIDE : place.PRESS_SLIDE + 3].astype(np.float64)
        struct.pack_into("<3f", data, at, value, slope, bend)
    with pytest.raises(fw.ModelError, match="press coupling in cell .* could create energy"):
        fw.load(sealed(bytes(data)))


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"count": 0}, "count: 0 is not between 1 and"),
        ({"count": 10**9}, "count: 1000000000 is not between 1 and"),
        ({"count": 3.7}, "count: 3.7 where a whole number is needed"),
        ({"device": "cuda:99"}, "device: 'cuda:99' is none of"),
        ({"pitch_deg": 40}, "pitch_deg: 40, but a bed of springs is of one pose"),
        ({"body": fw.Plane()}, r"body: Plane\(\), but a bed"),
    ],
)
def test_fingers_of_a_bed(model: fw.Model, arguments: dict[str, Any], text: str) -> None:
    with pytest.raises(fw.InputError, match=text):
        fw.Fingers(model, **({"count": 2, "device": "cpu"} | arguments))


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"pitch_deg": 80}, "pitch_deg: 80 is not between 10 and 70"),
        ({"roll_deg": [0, float("nan")]}, "roll_deg: nan is not between -30 and 30"),
        ({"body": "ball"}, "body: 'ball' where a Plane, Sphere, Cylinder or Edge is needed"),
        ({"body": fw.Sphere(2)}, "body: Sphere.* is too sharp for the patches of the pad, which see 3.89 mm and more"),
    ],
)
def test_fingers_of_a_pad(pad: fw.Pad, arguments: dict[str, Any], text: str) -> None:
    with pytest.raises(fw.InputError, match=text):
        fw.Fingers(pad, 2, device="cpu", **arguments)


def test_models_of_others_are_refused() -> None:
    with pytest.raises(fw.InputError, match="model: builtins.str where"):
        fw.Fingers("fingertip.fpm")


def test_bodies() -> None:
    for make, text in (
        (lambda: fw.Sphere(0.0), "radius_mm: 0.0 is not between 0.1 and 1000000"),
        (lambda: fw.Cylinder(5, 200), "axis_deg: 200 is not between -180 and 180"),
        (lambda: fw.Edge(-1), "radius_mm: -1 is not between 0.1 and 1000000"),
        (lambda: fw.Sphere("5 mm"), "radius_mm: '5 mm' where a number is needed"),
    ):
        with pytest.raises(fw.InputError, match=text):
            make()


@pytest.mark.parametrize(
    ("motion", "text"),
    [
        ({"depth_mm": "deep"}, r"depth_mm: 'deep' \(<U4\) where real numbers are needed"),
        ({"depth_mm": [1, 2, 3]}, r"depth_mm: an array of shape \(3,\) where \(2,\) is needed"),
        ({"depth_mm": True}, "depth_mm: True"),
        ({"depth_mm": 1, "slide_x_mm": 1j}, "slide_x_mm: 1j"),
        ({"depth_mm": 1, "dt_s": [1e-3]}, r"dt_s: \[0.001\] where one number is needed"),
        ({"depth_mm": 1, "roll_deg": 3}, "roll_deg: 3, but a bed"),
    ],
)
def test_motions(model: fw.Model, motion: dict[str, Any], text: str) -> None:
    fingers = fw.Fingers(model, 2, device="cpu")
    with pytest.raises(fw.InputError, match=text):
        fingers.step(**motion)


def test_warp_arrays_that_do_not_fit(model: fw.Model) -> None:
    fingers = fw.Fingers(model, 2, device="cpu")
    for array, text in (
        (wp.zeros(3, dtype=float, device="cpu"), r"depth_mm: a Warp array of shape \(3,\) where \(2,\) is needed"),
        (wp.zeros(2, dtype=wp.float64, device="cpu"), "depth_mm: a Warp array of float64 where float32 is needed"),
    ):
        with pytest.raises(fw.InputError, match=text):
            fingers.step(array)


def test_saved_states_that_do_not_fit(model: fw.Model) -> None:
    fingers = fw.Fingers(model, 2, device="cpu")
    with pytest.raises(fw.InputError, match=r"saved: float32 of shape \(27, 1\) where float32 of shape \(27, 2\) is needed"):
        fingers.restore(fw.Fingers(model, 1, device="cpu").save())
    with pytest.raises(fw.InputError, match="which: int64 where booleans are needed"):
        fingers.reset([1, 0])


def test_bad_numbers_are_flagged_and_leave_their_axis(model: fw.Model, device: str) -> None:
    """NaN does not raise: the status of that contact says so, and nothing else moves."""
    fingers = fw.Fingers(model, 4, spin=True, device=device)
    fingers.step(1.0)
    at_rest = fingers.step(1.0).numpy()
    nan = np.float32("nan")
    r = fingers.step([1, nan, 1, 1], [0, 0, nan, 0], 0.0, [0, 0, 0, np.inf]).numpy()
    assert list(r["status"]) == [0, fw.Status.BAD_INPUT, fw.Status.BAD_INPUT, fw.Status.BAD_INPUT]
    np.testing.assert_array_equal(r["normal_force_n"], at_rest["normal_force_n"])
    late = fingers.step(1.0, dt_s=float("nan")).numpy()
    assert (late["status"] == fw.Status.BAD_TIME_STEP).all()


def test_a_spin_that_is_not_followed_is_flagged(model: fw.Model, device: str) -> None:
    fingers = fw.Fingers(model, 3, device=device)
    fingers.step(1.0)
    plain = fingers.step(1.0).numpy()
    r = fingers.step(1.0, spin_rad=[0.0, 0.1, np.float32("nan")]).numpy()
    assert list(r["status"]) == [0, fw.Status.SPIN_IGNORED, fw.Status.SPIN_IGNORED]
    np.testing.assert_array_equal(r["normal_force_n"], plain["normal_force_n"])


def test_arrays_of_torch(model: fw.Model) -> None:
    """A torch tensor is read without a copy, and a response is one through `wp.to_torch`. Skipped where there is no torch."""
    torch = pytest.importorskip("torch")
    fingers = fw.Fingers(model, 3, device="cpu")
    response = fingers.step(torch.tensor([0.5, 1.0, 1.5]))
    force = wp.to_torch(response.normal_force_n)
    np.testing.assert_array_equal(force.numpy(), response.numpy()["normal_force_n"])
