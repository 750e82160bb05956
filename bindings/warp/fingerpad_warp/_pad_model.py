"""The numbers of a pad, read from a model file and checked; the bodies that a pad touches.

Main classes: `Pad`, `Plane`, `Sphere`, `Cylinder`, `Edge`. The checks are those of the core's `Pad::check`.
"""

from __future__ import annotations

import json
import math
import os
import struct
from dataclasses import dataclass
from typing import Any, Union

import numpy as np

from fingerpad_warp._errors import InputError, ModelError
from fingerpad_warp._file import Envelope, Floats, check_range, read_bytes

MODES = 16
#: Floats of a patch, and places in it.
PATCH = 12 + 3 * MODES
MIDDLE, PATCH_AREA, SPREAD, PATCH_MODES, COMPLIANCE = 0, 3, 4, 10, 10 + 3 * MODES
#: Floats of the numbers, and places in them.
NUMBERS = 318
RIGID, SQUASH, REACH, CENTRE, FIRST_TOUCH = 0, 96, 232, 233, 236
NEUTRAL_PITCH, PITCH_RANGE, ROLL_MAX, DEPTH_MAX, BAND_NORMAL, BAND_FRICTION = 256, 257, 259, 260, 261, 267
BAND_BODY, BAND_DEEP, BAND_LIGHT = 273, 275, 277
SOFTNESS, STIFFENING, FLATTENING, AREA, FRICTION, ONSET, LIFT, TURN = 281, 283, 285, 287, 290, 292, 293, 317
#: Most patches, more than any pad has.
MOST_PATCHES = 512
#: No number of a pad is near it.
LARGEST = 1e6


class Pad:
    """A fitted pad, of every pose and of rigid bodies: the numbers of its model file, checked."""

    def __init__(self, data: bytes) -> None:
        """From a file's bytes; `ModelError` names what is wrong."""
        envelope = Envelope(data)
        if b"RELX" in envelope:
            raise ModelError("section RELX is not understood: this package follows no tissue that relaxes")
        if b"ORTH" in envelope:
            raise ModelError("section ORTH is not understood: this package has no friction that depends on the direction")
        if b"PADN" not in envelope and b"DATA" in envelope:
            raise ModelError("the file holds a bed of springs, not a pad: read it with Model, or with load")
        head = envelope.section(b"PADN")[:4]
        modes = struct.unpack("<I", head)[0] if len(head) == 4 else 0
        if modes != MODES:
            raise ModelError(f"made for {modes} modes; this package steps {MODES}")
        self.numbers = envelope.floats(b"PADN", 4, NUMBERS)
        length = len(envelope.section(b"PADP"))
        if length == 0 or length % (4 * PATCH):
            raise ModelError(f"section PADP: {length} bytes where a multiple of {4 * PATCH} is expected")
        if length > 4 * PATCH * MOST_PATCHES:
            raise ModelError(f"{length // (4 * PATCH)} patches; this package steps at most {MOST_PATCHES}")
        self.patches = envelope.floats(b"PADP", 0, length // 4).reshape(-1, PATCH)
        try:
            self.meta: dict[str, Any] = json.loads(envelope.section(b"META").decode())
        except ValueError as error:
            raise ModelError(f"section META: {error}") from None
        self._data = bytes(data)
        self._check()

    @classmethod
    def from_bytes(cls, data: bytes) -> Pad:
        """A pad from a file's bytes."""
        return cls(data)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Pad:
        """A pad from a file."""
        return cls(read_bytes(path))

    def to_bytes(self) -> bytes:
        """The bytes of the file."""
        return self._data

    @property
    def depth_max_mm(self) -> float:
        """Largest depth for which the pad was fitted, mm. Steps go on to twice that, flagged."""
        return float(self.numbers[DEPTH_MAX])

    @property
    def neutral_pitch_deg(self) -> float:
        """The pitch in which fingers are without another one, degrees."""
        return float(self.numbers[NEUTRAL_PITCH])

    @property
    def pitch_range_deg(self) -> tuple[float, float]:
        """Least and largest pitch, degrees: the angle of the finger's long axis with the plane."""
        return float(self.numbers[PITCH_RANGE]), float(self.numbers[PITCH_RANGE + 1])

    @property
    def roll_range_deg(self) -> tuple[float, float]:
        """Least and largest roll, degrees."""
        return -float(self.numbers[ROLL_MAX]), float(self.numbers[ROLL_MAX])

    @property
    def least_radii_mm(self) -> dict[type, float]:
        """The least radius of each kind of body that the patches can see, mm, by their mean area."""
        size = float(np.sqrt(self.patches[:, PATCH_AREA].mean()))
        return {Sphere: 0.92 * size, Cylinder: 0.45 * size, Edge: 0.37 * size}

    def first_touch_point_mm(self, pitch_deg: Any, roll_deg: Any) -> Floats:
        """The point of the undeformed finger that a plane touches first in poses, along the axes of the finger, mm: shape (3, poses).

        The slope of the height over the plane's turn is the place along the plane. In single precision and in the core's order: fingers
        here are to turn about the core's point.
        """
        rad = np.float32(np.pi / 180)
        ps, pc = _sin_cos((np.asarray(pitch_deg, np.float32) - self.numbers[NEUTRAL_PITCH]) * rad)
        rs, rc = _sin_cos(np.asarray(roll_deg, np.float32) * rad)
        axes = [[pc, ps * rs, ps * rc], [np.zeros_like(ps), rc, -rs], [-ps, pc * rs, pc * rc]]
        x, root = axes[2][0], axes[2][1]
        y = root * root
        x2, y2 = x * x, y * y
        x3, x4, y3 = x2 * x, x2 * x2, y2 * y
        zero, one = np.zeros_like(x), np.ones_like(x)
        by_x = [
            zero, one, 2 * x, 3 * x2, 4 * x3, 5 * x4, 6 * x4 * x, zero, y, 2 * x * y, 3 * x2 * y, 4 * x3 * y, zero, y2, 2 * x * y2, zero,
            y3, 7 * x4 * x2, 3 * x2 * y2, zero,
        ]  # fmt: skip
        by_y = [one, x, x2, x3, x4, 2 * y, 2 * x * y, 2 * x2 * y, 3 * y2, 3 * y2 * x, zero, 2 * x3 * y, 4 * y3]
        slopes = [self._sum(by_x, FIRST_TOUCH), 2 * root * self._sum(by_y, FIRST_TOUCH + 7)]
        along = [axes[k][0] * slopes[0] + axes[k][1] * slopes[1] for k in (0, 1)]
        along.append(self._first_touch(x, root))
        return np.array([axes[0][k] * along[0] + axes[1][k] * along[1] + axes[2][k] * along[2] for k in range(3)], np.float32)

    def _first_touch(self, x: Any, y: Any) -> Any:
        """Height of the plane at first touch over the origin, along its normal of which x and y are given, mm."""
        y = y * y
        x2, y2 = x * x, y * y
        x3, x4, x6 = x2 * x, x2 * x2, x2 * x2 * x2
        terms = [
            np.ones_like(x), x, x2, x3, x4, x4 * x, x6, y, y * x, y * x2, y * x3, y * x4, y2, y2 * x, y2 * x2, y2 * y, y2 * y * x,
            x6 * x, y2 * x3, y2 * y2,
        ]  # fmt: skip
        return self._sum(terms, FIRST_TOUCH)

    def _sum(self, terms: list[Any], at: int) -> Any:
        sum = np.zeros_like(terms[0])
        for term, coefficient in zip(terms, self.numbers[at : at + len(terms)], strict=True):
            sum = sum + term * coefficient
        return sum

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Pad) and self._data == other._data

    def __hash__(self) -> int:
        return hash(self._data)

    def __repr__(self) -> str:
        return f"<fingerpad_warp.Pad: {len(self.patches)} patches, {self.depth_max_mm:g} mm>"

    def _check(self) -> None:
        n, patches = self.numbers.astype(np.float64), self.patches.astype(np.float64)
        check_range("area of a patch, mm2", patches[:, PATCH_AREA], 1e-4, LARGEST)
        check_range("middle of a patch, mm", patches[:, :3], -LARGEST, LARGEST)
        check_range("spread of a patch, mm", patches[:, SPREAD:PATCH_MODES], -LARGEST, LARGEST)
        check_range("compliance of a patch, mm/N", patches[:, COMPLIANCE:], 1e-4, LARGEST)
        check_range("modes of a patch", patches[:, PATCH_MODES:COMPLIANCE], -LARGEST, LARGEST)
        check_range("rigid motion of the bulk", n[RIGID:SQUASH], -LARGEST, LARGEST)
        check_range("reach of the bulk", n[REACH], 1e-9, LARGEST)
        # Patches that are not looked at in a step rely on it.
        reach = np.sqrt((patches[:, PATCH_MODES:COMPLIANCE] ** 2).sum(axis=1))
        check_range("reach of a patch over that of the bulk", reach / n[REACH], 0, 1.001)
        check_range("squash", n[SQUASH:REACH], -LARGEST, LARGEST)
        check_range("diagonal of the squash", n[[SQUASH + k * (k + 3) // 2 for k in range(MODES)]], 0, LARGEST)
        check_range("first touch and middle, mm", n[CENTRE:NEUTRAL_PITCH], -LARGEST, LARGEST)
        check_range("softness", n[SOFTNESS : SOFTNESS + 2], 0.05, 20)
        check_range("stiffening", n[STIFFENING : STIFFENING + 2], 0, LARGEST)
        check_range("flattening_mpa", n[FLATTENING : FLATTENING + 2], 1e-9, LARGEST)
        check_range("area in contact", n[AREA : AREA + 3], 1e-3, 1e3)
        check_range("lambda", n[FRICTION], 1e-9, LARGEST)
        check_range("beta", n[FRICTION + 1], 1e-3, 1)
        check_range("onset", n[ONSET], 1e-3, 1e3)
        check_range("lift and turn", n[LIFT:], -LARGEST, LARGEST)
        check_range("bands", n[BAND_NORMAL:SOFTNESS], -LARGEST, LARGEST)
        check_range("pitch, degrees", n[NEUTRAL_PITCH:ROLL_MAX], -90, 90)
        check_range("largest roll, degrees", n[ROLL_MAX], 0, 60)
        check_range("depth_max_mm", n[DEPTH_MAX], 1e-9, LARGEST)
        if not n[PITCH_RANGE] <= n[PITCH_RANGE + 1]:
            raise ModelError(f"the least pitch, {n[PITCH_RANGE]:g}, is above the largest, {n[PITCH_RANGE + 1]:g}")


def _sin_cos(angle: Any) -> tuple[Any, Any]:
    """Sine and cosine of angles within a quarter of a turn, by the core's polynomials in single precision."""
    f = np.float32
    quarters = angle * f(2 / np.pi)
    quarter = np.trunc(np.where(quarters < 0, quarters - f(0.5), quarters + f(0.5)))
    x = (angle - quarter * f(1.5703125)) - quarter * f(4.838268e-4)
    z = x * x
    sin = ((f(-1.9515296e-4) * z + f(8.332161e-3)) * z - f(1.6666655e-1)) * (z * x) + x
    cos = ((f(2.4433157e-5) * z - f(1.3887316e-3)) * z + f(4.1666646e-2)) * (z * z) - f(0.5) * z + f(1)
    odd, half = quarter.astype(int) & 1, quarter.astype(int) & 2
    sin, cos = np.where(odd, cos, sin), np.where(odd, -sin, cos)
    return np.where(half, -sin, sin), np.where(half, -cos, cos)


#: Least and largest radius, mm.
RADIUS_MM = (0.1, 1e6)


def _set(body: object, name: str, least: float, most: float, may_be_negative: bool = False) -> None:
    """Makes a number of a body a float, once it is known to lie within a range."""
    value = getattr(body, name)
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(f"{name}: {value!r} where a number is needed") from None
    if not least <= (abs(number) if may_be_negative else number) <= most:
        hollow = ", or the negative of that for a hollow" if may_be_negative else ""
        raise InputError(f"{name}: {value} is not between {least:.7g} and {most:.7g}{hollow}")
    object.__setattr__(body, name, number)


@dataclass(frozen=True)
class Plane:
    """A plane."""


@dataclass(frozen=True)
class Sphere:
    """A sphere that touches the finger at its apex; with a negative radius the finger lies in a bowl.

    A body that is sharper than the patches of a pad can see is refused by `Fingers` (see `Pad.least_radii_mm`).
    """

    radius_mm: float

    def __post_init__(self) -> None:
        _set(self, "radius_mm", *RADIUS_MM, may_be_negative=True)


@dataclass(frozen=True)
class Cylinder:
    """A cylinder along the tangent plane at the apex; with a negative radius a trough.

    axis_deg: direction of its axis, from x towards y, -180 to 180; 0 is along the finger.
    """

    radius_mm: float
    axis_deg: float = 0.0

    def __post_init__(self) -> None:
        _set(self, "radius_mm", *RADIUS_MM, may_be_negative=True)
        _set(self, "axis_deg", -180, 180)


@dataclass(frozen=True)
class Edge:
    """Two planes that meet in a rounded edge, which points at the finger.

    radius_mm: of the rounding. axis_deg: direction of the edge, from x towards y, -180 to 180. angle_deg: between the planes inside the
    body, 1 to 179.
    """

    radius_mm: float
    axis_deg: float = 0.0
    angle_deg: float = 90.0

    def __post_init__(self) -> None:
        _set(self, "radius_mm", *RADIUS_MM)
        _set(self, "axis_deg", -180, 180)
        _set(self, "angle_deg", 1, 179)


#: What a finger may touch.
Body = Union[Plane, Sphere, Cylinder, Edge]


def body_numbers(body: Body) -> tuple[int, Floats]:
    """Kind of a body (0 to 3, in the order of `Body`), and its radius, cosine and sine of its axis, cosine and sine of its faces."""
    kinds = (Plane, Sphere, Cylinder, Edge)
    if type(body) not in kinds:
        raise InputError(f"body: {body!r} where a Plane, Sphere, Cylinder or Edge is needed")
    axis = math.radians(getattr(body, "axis_deg", 0.0))
    face = math.radians(0.5 * (180 - getattr(body, "angle_deg", 180.0)))
    radius_mm = getattr(body, "radius_mm", 1.0)
    numbers = [radius_mm, math.cos(axis), math.sin(axis), math.cos(face), math.sin(face)]
    return kinds.index(type(body)), np.array(numbers, np.float32)
