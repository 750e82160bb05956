"""The limit surface of a finger at a depth and in a pose."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from fingerpad._arrays import Numbers, broadcast_shape, check_range, number
from fingerpad._bodies import Body
from fingerpad._errors import InputError
from fingerpad._fingers import RESPONSE, Fingers, refuse_pose
from fingerpad._grip import STRENGTH_FACTOR
from fingerpad._native import Model, Pad

#: Longest step of a press, mm.
PRESS_MM = 0.05


class LimitSurface(NamedTuple):
    """Friction and moment in full slip, and the press at which they hold."""

    points: npt.NDArray[np.void]
    """Array of `LIMIT`: the shape of the arguments, and behind it a point for each motion."""
    pressed: npt.NDArray[np.void]
    """Array of `RESPONSE` of the finger that was pressed without a slide: normal force, area, centre of pressure, status."""


def limit_surface(
    model: Model | Pad,
    depth_mm: Numbers,
    *,
    pitch_deg: Numbers | None = None,
    roll_deg: Numbers | None = None,
    body: Body | None = None,
    strength_factor: Numbers = 1.0,
    motion: npt.ArrayLike | None = None,
) -> LimitSurface:
    """Friction and moment in full slip over the directions in which the body can move (Goyal, Ruina & Papadopoulos 1991).

    depth_mm: 0 to `model.depth_max_mm`. pitch_deg, roll_deg, body: of a pad, as in `Fingers`. strength_factor: 0.1 to 5. These
    broadcast. motion: as in `Fingers.limit_surface`, which see for the meaning of the points. The finger is pressed in steps of at
    most 0.05 mm. Raises InputError for a depth, a pose or a factor out of range.
    """
    if not isinstance(model, (Model, Pad)):
        raise InputError(f"model: {type(model).__name__} where a Model or a Pad is needed")
    given = {"depth_mm": number("depth_mm", depth_mm), "strength_factor": number("strength_factor", strength_factor)}
    check_range("depth_mm", given["depth_mm"], 0, model.depth_max_mm)
    check_range("strength_factor", given["strength_factor"], *STRENGTH_FACTOR)
    pose = {"pitch_deg": pitch_deg, "roll_deg": roll_deg}
    if isinstance(model, Model):
        refuse_pose(model, **pose)
    given |= {name: number(name, value) for name, value in pose.items() if value is not None}
    shape = broadcast_shape(given)
    flat = {name: np.broadcast_to(array, shape).reshape(-1) for name, array in given.items()}
    depth, factor = flat["depth_mm"], flat["strength_factor"]
    fingers = Fingers(model, depth.size, body=body, pitch_deg=flat.get("pitch_deg"), roll_deg=flat.get("roll_deg"))
    pressed = np.zeros(depth.size, RESPONSE)
    steps = max(1, math.ceil(depth.max(initial=0) / PRESS_MM))
    for k in range(1, steps + 1):
        fingers.step(depth * (k / steps), strength_factor=factor, outputs="all", out=pressed)
    points = fingers.limit_surface(motion)
    return LimitSurface(points.reshape(*shape, points.shape[1]), pressed.reshape(shape))
