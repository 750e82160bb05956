"""The numbers of a bed of springs, read from a model file and checked.

Main class: `Model`. A step multiplies by these numbers and divides by some of them, and the promise that no motion yields work rests on
them. `Model` therefore refuses what the core's `DataOf::check` refuses.
"""

from __future__ import annotations

import json
import os
import struct
from typing import Any

import numpy as np

from fingerpad_warp._errors import ModelError
from fingerpad_warp._file import Envelope, check_range, read_bytes

#: Springs and table nodes of the models that this package steps.
SPRINGS, NODES = 4, 37
#: Floats before the springs, of a spring, and of a row of the tables.
HEAD, SPRING, ROW = 19, 5, 31 + 4 * SPRINGS

# Places in the head.
DEPTH_MAX, CELLS_PER_MM, ODD, AREA_TILT, PRESSURE_CENTRE_PER_N, SPIN_CROSS = 0, 1, 2, 3, 4, 6
SLIP_LEAD, GYRATION, BAND_NORMAL_OF, BAND_FRICTION_OF, PRESSURE_EXPONENT, POSE = 7, 9, 10, 13, 16, 17
# Places in a spring.
STIFFNESS, SHARPNESS, CENTRE, ARM = 0, 1, 2, 3
# Places in a row: lines have two floats, parabolas three.
NORMAL, AREA, STIFFNESS_X, STIFFNESS_Y, PRESS_SLIDE, ANISOTROPY, YIELD_SHIFT, LIMIT = 0, 2, 4, 7, 10, 13, 15, 17
LIMIT_RATIO, LIMIT_SHIFT, SPIN_LIMIT, FRICTION_CENTRE, PRESSURE_CENTRE, BAND_NORMAL = 19, 21, 23, 25, 27, 29
RADIUS, AREA_SHARE = 31, 31 + 2 * SPRINGS

#: Largest |q u| of a spring on its limit: its force grows with the displacement throughout.
ODD_MAX = 0.4
#: Strength factor up to which the normal force must stay positive.
STRENGTH = 2.0

_LINES = {
    "normal_force_n": NORMAL, "contact_area_mm2": AREA, "strength_ratio": ANISOTROPY, "yield_tilt": YIELD_SHIFT,
    "friction_limit_n": LIMIT, "friction_limit_ratio": LIMIT_RATIO, "friction_tilt": LIMIT_SHIFT,
    "spin_limit_n_mm": SPIN_LIMIT, "friction_centre_mm": FRICTION_CENTRE, "pressure_centre_mm": PRESSURE_CENTRE,
    "band_normal_n": BAND_NORMAL,
}  # fmt: skip
_PARABOLAS = {"stiffness_x": STIFFNESS_X, "stiffness_y": STIFFNESS_Y, "press_slide": PRESS_SLIDE}


class Model:
    """A fitted bed of springs, of one pose on a plane: the numbers of a model file, checked."""

    def __init__(self, data: bytes) -> None:
        """From a file's bytes; `ModelError` names what is wrong."""
        envelope = Envelope(data)
        if b"RELX" in envelope:
            raise ModelError("section RELX is not understood: this package follows no tissue that relaxes")
        if b"DATA" not in envelope and b"PADN" in envelope:
            raise ModelError("the file holds a pad, not a bed of springs: read it with Pad, or with load")
        head = envelope.section(b"DATA")[:8]
        springs, nodes = struct.unpack("<2I", head) if len(head) == 8 else (0, 0)
        if (springs, nodes) != (SPRINGS, NODES):
            raise ModelError(f"made for {springs} springs and {nodes} table nodes; this package steps {SPRINGS} and {NODES}")
        numbers = envelope.floats(b"DATA", 8, HEAD + SPRING * SPRINGS + ROW * NODES)
        self.head = numbers[:HEAD]
        self.springs = numbers[HEAD : HEAD + SPRING * SPRINGS].reshape(SPRINGS, SPRING)
        self.rows = numbers[HEAD + SPRING * SPRINGS :].reshape(NODES, ROW)
        self.effects = len(envelope.section(b"EFFX")) // 32
        try:
            self.meta: dict[str, Any] = json.loads(envelope.section(b"META").decode())
        except ValueError as error:
            raise ModelError(f"section META: {error}") from None
        self._data = bytes(data)
        self._check()

    @classmethod
    def from_bytes(cls, data: bytes) -> Model:
        """A model from a file's bytes."""
        return cls(data)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Model:
        """A model from a file."""
        return cls(read_bytes(path))

    def to_bytes(self) -> bytes:
        """The bytes of the file."""
        return self._data

    @property
    def depth_max_mm(self) -> float:
        """Largest depth for which the model was fitted, mm."""
        return float(self.head[DEPTH_MAX])

    @property
    def pose_deg(self) -> tuple[float, float]:
        """Pitch and roll of the pose that the model is of, degrees."""
        return float(self.head[POSE]), float(self.head[POSE + 1])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Model) and self._data == other._data

    def __hash__(self) -> int:
        return hash(self._data)

    def __repr__(self) -> str:
        pitch_deg, roll_deg = self.pose_deg
        return f"<fingerpad_warp.Model: {SPRINGS} springs, pitch {pitch_deg:g} deg, roll {roll_deg:g} deg, {self.depth_max_mm:g} mm>"

    def _check(self) -> None:
        self._check_head()
        self._check_rows()
        self._check_joins()
        cell_mm = float(self.head[DEPTH_MAX]) / (NODES - 1)
        for i in range(NODES - 1):
            for t in (0.0, 1.0) if i > 0 else (1.0,):
                self._check_passive(i, t, cell_mm)

    def _check_head(self) -> None:
        head, springs = self.head.astype(np.float64), self.springs
        check_range("depth_max_mm", head[DEPTH_MAX], 0.1, 20)
        cells = head[CELLS_PER_MM] * head[DEPTH_MAX] / (NODES - 1)
        check_range("cells_per_mm * depth_max_mm / cells", cells, 1 - 1e-6, 1 + 1e-6)
        check_range("odd_per_mm", head[ODD], -2, 2)
        check_range("area_tilt", head[AREA_TILT], -0.5, 0.5)
        check_range("pressure_centre_per_n", head[PRESSURE_CENTRE_PER_N : PRESSURE_CENTRE_PER_N + 2], -100, 100)
        check_range("spin_cross", head[SPIN_CROSS], 0, 1)
        touch, change = head[SLIP_LEAD : SLIP_LEAD + 2]
        check_range("slip_lead", touch, -1, 1)
        check_range("slip_lead at the largest depth", touch + change * (NODES - 1), -1 - 1e-6, 1 + 1e-6)
        check_range("gyration_mm", head[GYRATION], 0, 100)
        for name, at in {"band_normal": BAND_NORMAL_OF, "band_friction": BAND_FRICTION_OF}.items():
            slip, rate, bend = head[at : at + 3]
            check_range(f"{name} in full slip and in full stick", [slip, slip + rate + bend], 0, 20)
            check_range(f"{name}, square of the stick ratio", bend, -200, 200)
            if bend != 0:
                lowest = min(max(-0.5 * rate / bend, 0.0), 1.0)
                check_range(f"{name} where it is extreme", slip + lowest * (rate + lowest * bend), 0, 100)
        check_range("pressure_exponent", head[PRESSURE_EXPONENT], -1, 2)
        check_range("pitch_deg", head[POSE], 10, 70)
        check_range("roll_deg", head[POSE + 1], -30, 30)
        check_range("stiffness share of a spring", springs[:, STIFFNESS], 0, 1)
        check_range("sharpness of a spring", springs[:, SHARPNESS], 0, 1)
        check_range("place and arms of a spring, mm", springs[:, CENTRE:], -100, 100)
        check_range("sum of the stiffness shares", springs[:, STIFFNESS].sum(), 1 - 1e-5, 1 + 1e-5)

    def _check_rows(self) -> None:
        rows = self.rows.astype(np.float64)
        check_range("normal_force_n", rows[:, NORMAL], 0, 1e3)
        check_range("contact_area_mm2", rows[:, AREA], 1e-12, 1e4)
        check_range("friction_limit_n", rows[:, LIMIT], 1e-12, 1e3)
        for t in (0.0, 1.0):
            kx, ky = _parabola(rows, STIFFNESS_X, t), _parabola(rows, STIFFNESS_Y, t)
            check_range("stiffness_x, N/mm", kx, 1e-6, 1e3)
            check_range("stiffness_y / stiffness_x", ky / kx, 0.25, 4)
            with np.errstate(all="ignore"):
                ratio = ky / (kx * _line(rows, ANISOTROPY, t))
            check_range("strength ratio of the springs", ratio, 0.5 - 1e-4, 2 + 1e-4)
        check_range("friction_limit_ratio", rows[:, LIMIT_RATIO], 0.25, 4)
        check_range("yield_tilt", rows[:, YIELD_SHIFT], -0.25, 0.25)
        check_range("friction_tilt", rows[:, LIMIT_SHIFT], -1, 1)
        check_range("press_slide and its slope, mm", rows[:, PRESS_SLIDE : PRESS_SLIDE + 2], -20, 20)
        check_range("spin_limit_n_mm", rows[:, SPIN_LIMIT], 0, 1e6)
        check_range("friction_centre_mm", rows[:, FRICTION_CENTRE], -100, 100)
        check_range("pressure_centre_mm", rows[:, PRESSURE_CENTRE], -100, 100)
        check_range("band_normal_n", rows[:, BAND_NORMAL], 0, 1e3)
        radius, share = rows[:, RADIUS:AREA_SHARE], rows[:, AREA_SHARE:]
        check_range("yield slide of a spring, mm", radius[:, ::2], 0, 10)
        check_range("|odd_per_mm| * yield slide", 1.29 * radius[:, ::2] * abs(float(self.head[ODD])), 0, ODD_MAX)
        check_range("area share of a spring", share[:, ::2], 0, 1)
        check_range("sum of the area shares", share[:, ::2].sum(axis=1), 1 - 1e-5, 1 + 1e-5)
        for name, change in {
            "normal_force_n": rows[:, NORMAL + 1], "contact_area_mm2": rows[:, AREA + 1], "yield slide of a spring": radius[:, 1::2],
        }.items():  # fmt: skip
            if not (change >= 0).all():
                raise ModelError(f"{name} falls at node {int(np.argwhere(~(change >= 0))[0][0])}")

    def _check_joins(self) -> None:
        """Every line and parabola meets that of the next row; the last row is flat."""
        rows = self.rows.astype(np.float64)
        lines = dict(_LINES)
        lines |= {f"yield slide of spring {j}": RADIUS + 2 * j for j in range(SPRINGS)}
        lines |= {f"area share of spring {j}": AREA_SHARE + 2 * j for j in range(SPRINGS)}
        ends = {name: (rows[:, at], _line(rows, at, 1.0), rows[-1, at + 1 : at + 2]) for name, at in lines.items()}
        ends |= {name: (rows[:, at], _parabola(rows, at, 1.0), rows[-1, at + 1 : at + 3]) for name, at in _PARABOLAS.items()}
        for name, (values, end, last) in ends.items():
            gap = np.abs(end[:-1] - values[1:])
            apart = np.flatnonzero(~(gap <= 4e-6 * np.maximum(np.abs(values[1:]), np.abs(values[:-1])) + 1e-9))
            if apart.size:
                i = int(apart[0])
                raise ModelError(f"{name} jumps at node {i + 1}: from {end[i]:g} to {values[i + 1]:g}")
            if not (last == 0).all():
                raise ModelError(f"{name} changes behind the last node: {last}")

    def _check_passive(self, i: int, t: float, cell_mm: float) -> None:
        """The inequalities for which no closed path yields work; the argument is at the core's `DataOf::check`."""
        row = self.rows[i].astype(np.float64)
        radius = row[RADIUS:AREA_SHARE:2] + row[RADIUS + 1 : AREA_SHARE : 2] * t
        square = float((self.springs[:, STIFFNESS].astype(np.float64) * radius**2).sum())
        square_x, square_y = 1.64 * square, 1.07 * square / float(_line(row, ANISOTROPY, t)) ** 2
        friction, per = 1.3 * float(_line(row, LIMIT, t)), 1 / cell_mm
        (kx, dkx, ddkx), (ky, dky, ddky), (_, coupling, bend) = (
            (float(_parabola(row, at, t)), float(row[at + 1] + 2 * t * row[at + 2]) * per, 2 * float(row[at + 2]) * per**2)
            for at in _PARABOLAS.values()
        )
        normal, rises = float(_line(row, NORMAL, t)), float(row[NORMAL + 1]) * per
        coupled, bent = abs(coupling) * friction, abs(bend) * friction
        taken = 0.5 * (max(-dkx, 0) * square_x + max(-dky, 0) * square_y)
        bent_whole = bent + 0.5 * (abs(ddkx) * square_x + abs(ddky) * square_y) + dkx**2 * square_x / kx + dky**2 * square_y / ky
        for name, value, limit in (
            ("press coupling", coupled, normal),
            ("change of the stiffness", STRENGTH * (coupled + STRENGTH * taken), normal),
            ("bend of the press coupling", bent, rises),
            ("bend of the stiffness", bent_whole, rises),
        ):
            # The core computes in single precision.
            if not value <= limit * (1 + 1e-5) + 1e-12:
                raise ModelError(f"{name} in cell {i} could create energy: {value:g} where {limit:g} is allowed")


def _line(rows: Any, at: int, t: float) -> Any:
    return rows[..., at] + rows[..., at + 1] * t


def _parabola(rows: Any, at: int, t: float) -> Any:
    return rows[..., at] + t * (rows[..., at + 1] + t * rows[..., at + 2])
