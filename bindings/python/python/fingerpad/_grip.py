"""The least grip of a bed or a pad over arrays of loads."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fingerpad._arrays import broadcast_shape, check_range, number
from fingerpad._fingers import RESPONSE, Fingers, Status

if TYPE_CHECKING:
    from fingerpad._bodies import Body
    from fingerpad._native import Model, Pad

#: Range of the margin and of the strength factor.
MARGIN = (0.0, 0.95)
STRENGTH_FACTOR = (0.1, 5.0)

#: Depths over the largest one that are tried from the least on, and halvings of the step to the first one that holds.
LEVELS = (np.arange(1, 17) / 16) ** 1.5
HALVINGS = 11
#: Longest step of a press and of a slide, mm.
PRESS_MM, SLIDE_MM = 0.05, 0.1
#: Steps at rest after a press, which end in the same bits however many there are.
RESTS = 2
#: Length of the slide from which the stiffness is taken, mm.
PROBE_MM = 0.01
#: Most slides on the way to a load, and the shares of the load and of the friction limit of which the larger one may be missing.
SLIDES, MISSING, MISSING_OF_LIMIT = 200, 2e-3, 5e-4

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
    """The same of a pad, by presses to many depths, each followed by slides to the load. See `Pad.least_grip`."""
    arrays = _loads(friction_x_n, friction_y_n, margin, strength_factor)
    arrays["pitch_deg"] = number("pitch_deg", pad.neutral_pitch_deg if pitch_deg is None else pitch_deg)
    arrays["roll_deg"] = number("roll_deg", 0.0 if roll_deg is None else roll_deg)
    shape, (x, y, margins, factors, pitch, roll) = _columns(arrays)
    load = np.stack([x, y]).astype(float)
    finite = np.isfinite(load).all(0)
    load = np.where(finite, load, 0.0)
    fingers = Fingers(pad, x.size, body=body, pitch_deg=pitch, roll_deg=roll)
    low, high, best, found = np.zeros(x.size), np.zeros(x.size), np.zeros(x.size, RESPONSE), np.zeros(x.size, bool)
    for level in LEVELS:
        if found.all():
            break
        low = np.where(found, low, high)
        high = np.where(found, high, level * pad.depth_max_mm)
        held, r = _loaded(fingers, high, load, margins, factors)
        best = np.where(found, best, r)
        found |= held
    for _ in range(HALVINGS):
        middle = np.where(found, 0.5 * (low + high), high)
        held, r = _loaded(fingers, middle, load, margins, factors)
        low, high = np.where(held, low, middle), np.where(held, middle, high)
        best = np.where(held, r, best)
    status = best["status"] | np.where(found, 0, Status.LOAD_NOT_REACHED).astype(np.uint32)
    status = np.where(finite, status, Status.BAD_INPUT).astype(np.uint32)
    depth = np.where(finite, high, pad.depth_max_mm)
    free = finite & ~load.any(0)
    columns = [np.where(free, 0, column) for column in (depth, best["normal_force_n"], status)]
    return _shaped(shape, columns[0].astype(np.float32), columns[1].astype(np.float32), columns[2].astype(np.uint32))


def _loaded(
    fingers: Fingers, depth_mm: npt.NDArray[Any], load: npt.NDArray[Any], margins: _Floats, factors: _Floats
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.void]]:
    """Presses fingers from the air and slides them until friction is the load; whether they hold it, and their last responses.

    A finger that has come to its depth, or to its load, rests until the others have as well: its numbers do not depend on theirs.
    """
    fingers.reset()
    r = np.zeros(len(fingers), RESPONSE)
    for k in range(1, math.ceil(depth_mm.max(initial=0) / PRESS_MM) + 1 + RESTS):
        fingers.step(np.minimum(k * PRESS_MM, depth_mm), strength_factor=factors, outputs="all", out=r)
    size = np.hypot(*load)
    way = load / np.where(size > 0, size, 1)
    before = _friction(r)
    fingers.step(depth_mm, *(PROBE_MM * way), outputs="all", out=r)
    stiffness = np.maximum(np.hypot(*(_friction(r) - before)) / PROBE_MM, 1e-3)
    reached, under_load = np.zeros(len(fingers), bool), r.copy()
    for _ in range(SLIDES):
        missing = load - _friction(r)
        # While a finger rests its stick ratio may change, and with it the band.
        under_load = np.where(reached, under_load, r)
        reached |= np.hypot(*missing) <= np.maximum(MISSING * size, MISSING_OF_LIMIT * r["friction_limit_n"])
        if reached.all():
            break
        slide = np.where(reached, 0, missing / stiffness)
        slide *= np.minimum(1, SLIDE_MM / np.maximum(np.hypot(*slide), 1e-12))
        fingers.step(depth_mm, *slide, outputs="all", out=r)
    # The finger may hold less than the pad by the band of its friction.
    r = under_load
    kept = 1 - r["band_friction_n"] / np.maximum(r["friction_limit_n"], 1e-9)
    held = reached & (r["slip_margin"] >= 1 - (1 - margins) * np.maximum(kept, 0))
    return held | (size == 0), r


def _friction(r: npt.NDArray[np.void]) -> npt.NDArray[np.float64]:
    return np.stack([r["friction_x_n"], r["friction_y_n"]]).astype(float)


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
