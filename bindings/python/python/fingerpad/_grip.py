"""The least grip of a bed or a pad over arrays of loads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fingerpad import _bodies
from fingerpad._arrays import broadcast_shape, check_range, number

if TYPE_CHECKING:
    from fingerpad._bodies import Body
    from fingerpad._native import Model, Pad

#: Range of the margin and of the strength factor.
MARGIN = (0.0, 0.95)
STRENGTH_FACTOR = (0.1, 5.0)

_Floats = npt.NDArray[np.float32]


def least_grip(model: Model, friction_x_n: Any, friction_y_n: Any, margin: Any, strength_factor: Any) -> Any:
    """Depths, normal forces and statuses; plain numbers if all arguments are numbers. See `Model.least_grip`."""
    arrays = _loads(friction_x_n, friction_y_n, margin, strength_factor)
    shape, (x, y, margins, factors) = _columns(arrays)
    depth_mm, normal_force_n, status = np.empty(x.size, np.float32), np.empty(x.size, np.float32), np.empty(x.size, np.uint32)
    model._least_grips((x, y, margins, factors), depth_mm, normal_force_n, status)
    return _shaped(shape, depth_mm, normal_force_n, status)


def pad_least_grip(
    pad: Pad,
    friction_x_n: Any,
    friction_y_n: Any,
    margin: Any,
    strength_factor: Any,
    pitch_deg: Any,
    roll_deg: Any,
    body: Body | None,
) -> Any:
    """The same of a pad on a body in poses. See `Pad.least_grip`."""
    arrays = _loads(friction_x_n, friction_y_n, margin, strength_factor)
    arrays["pitch_deg"] = number("pitch_deg", pad.neutral_pitch_deg if pitch_deg is None else pitch_deg)
    arrays["roll_deg"] = number("roll_deg", 0.0 if roll_deg is None else roll_deg)
    check_range("pitch_deg", arrays["pitch_deg"], *pad.pitch_range_deg)
    check_range("roll_deg", arrays["roll_deg"], *pad.roll_range_deg)
    body = _bodies.Plane() if body is None else body
    _bodies.check(body)
    shape, columns = _columns(arrays)
    results = np.empty(columns[0].size, np.float32), np.empty(columns[0].size, np.float32), np.empty(columns[0].size, np.uint32)
    pad._least_grips(type(body).__name__, _bodies.numbers(body), tuple(columns), *results)
    return _shaped(shape, *results)


def _loads(friction_x_n: Any, friction_y_n: Any, margin: Any, strength_factor: Any) -> dict[str, npt.NDArray[Any]]:
    """The arguments as arrays, within their ranges."""
    given = {
        "friction_x_n": friction_x_n,
        "friction_y_n": 0.0 if friction_y_n is None else friction_y_n,
        "margin": 0.0 if margin is None else margin,
        "strength_factor": 1.0 if strength_factor is None else strength_factor,
    }
    arrays = {name: number(name, value) for name, value in given.items()}
    check_range("margin", arrays["margin"], *MARGIN)
    check_range("strength_factor", arrays["strength_factor"], *STRENGTH_FACTOR)
    return arrays


def _columns(arrays: dict[str, npt.NDArray[Any]]) -> tuple[tuple[int, ...], list[_Floats]]:
    """The common shape of arrays, and each as a column of that many numbers."""
    shape = broadcast_shape(arrays)
    with np.errstate(over="ignore"):
        return shape, [np.ascontiguousarray(np.broadcast_to(a, shape), np.float32).reshape(-1) for a in arrays.values()]


def _shaped(shape: tuple[int, ...], depth_mm: _Floats, normal_force_n: _Floats, status: npt.NDArray[np.uint32]) -> Any:
    if shape == ():
        return float(depth_mm[0]), float(normal_force_n[0]), int(status[0])
    return depth_mm.reshape(shape), normal_force_n.reshape(shape), status.reshape(shape)
