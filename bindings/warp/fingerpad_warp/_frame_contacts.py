"""Many contacts from the poses of bodies, in Warp arrays.

Main classes: `FrameContacts`, `Shape`. Uses `_frames` for the geometry.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, SupportsIndex, Union

import numpy as np
import warp as wp

from fingerpad_warp import _arrays, _frames
from fingerpad_warp._errors import InputError
from fingerpad_warp._fingers import checked_count
from fingerpad_warp._model import Model
from fingerpad_warp._pad_model import RADIUS_MM, Pad

#: Kinds of shapes in the order of their numbers, and the names of their sizes.
_KINDS = ("plane", "sphere", "ellipsoid", "capsule", "cylinder", "edge", "cuboid")
#: Shapes that a bed of springs can touch.
FLAT = ("plane", "cuboid")


@dataclass(frozen=True)
class Shape:
    """The shape of a rigid body in its own frame: the origin in the middle, the axis of a cylinder and a capsule along z.

    Made by the functions below, which are those of the package `fingerpad`. Sizes are from 0.1 to 1e6 mm.
    """

    kind: str
    size_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    edge_radius_mm: float = 1.0
    angle_deg: float = 90.0

    @staticmethod
    def _made(kind: str, sizes: Sequence[Any] = (), edge_radius_mm: Any = 1.0, angle_deg: Any = 90.0) -> Shape:
        size = [_arrays.number_within("size_mm", each, *RADIUS_MM) for each in sizes]
        edge = _arrays.number_within("edge_radius_mm", edge_radius_mm, *RADIUS_MM)
        x, y, z = [*size, 0.0, 0.0, 0.0][:3]
        return Shape(kind, (x, y, z), edge, _arrays.number_within("angle_deg", angle_deg, 1, 179))

    @staticmethod
    def plane() -> Shape:
        """The plane z = 0; the body is below it."""
        return Shape._made("plane")

    @staticmethod
    def sphere(radius_mm: float) -> Shape:
        """A sphere about the origin."""
        return Shape._made("sphere", [radius_mm] * 3)

    @staticmethod
    def ellipsoid(semi_axes_mm: Sequence[float]) -> Shape:
        """An ellipsoid about the origin, with semi-axes along x, y and z."""
        return Shape._made("ellipsoid", _three("semi_axes_mm", semi_axes_mm))

    @staticmethod
    def capsule(radius_mm: float, half_length_mm: float) -> Shape:
        """A cylinder about z with two round ends; half_length_mm: from the origin to the centre of an end."""
        return Shape._made("capsule", [radius_mm, half_length_mm])

    @staticmethod
    def cylinder(radius_mm: float, half_length_mm: float) -> Shape:
        """A cylinder about z with two flat ends; its rims have no model."""
        return Shape._made("cylinder", [radius_mm, half_length_mm])

    @staticmethod
    def edge(radius_mm: float, angle_deg: float = 90.0) -> Shape:
        """Two planes that meet in a rounded edge along x, on which the origin lies; z points out of the body between them."""
        return Shape._made("edge", [radius_mm], angle_deg=angle_deg)

    @staticmethod
    def cuboid(half_mm: Sequence[float], edge_radius_mm: float) -> Shape:
        """A box about the origin, half its extents along x, y and z, with rounded edges; its corners have no model, and of a bed its edges."""
        return Shape._made("cuboid", _three("half_mm", half_mm), edge_radius_mm)

    def solid(self) -> Any:
        """The numbers that the kernels read."""
        out, face = _frames.Solid(), math.radians(0.5 * (180 - self.angle_deg))
        out.kind, out.size, out.edge_radius = _KINDS.index(self.kind), wp.vec3(*self.size_mm), self.edge_radius_mm
        out.face_cos, out.face_sin = math.cos(face), math.sin(face)
        return out


def _three(name: str, values: Any) -> Sequence[Any]:
    if np.shape(values) != (3,):
        raise InputError(f"{name}: {values!r} where three numbers are needed")
    return [float(value) for value in values]


class FrameContacts:
    """Fingers of one model, each against a rigid body of its own, from the pose of the body in the frame of the finger.

    The finger's frame is fixed to the bone: x along the finger from proximal to distal, z out of the pad's surface into the finger; the
    origin is the point at which a plane first touches in the neutral pose. The numbers are those of the class of this name in the package
    `fingerpad`, with poses in single precision.
    """

    def __init__(self, model: Union[Model, Pad], shape: Shape, count: SupportsIndex = 1, *, device: Any = None) -> None:
        """Fingers in the air. model: a bed, which touches planes and cuboids alone, or a pad. shape: of each body. count: how many."""
        self._count = checked_count(model, count)
        if not isinstance(shape, Shape) or shape.kind not in _KINDS:
            raise InputError(f"shape: {shape!r} where a Shape is needed")
        if isinstance(model, Model) and shape.kind not in FLAT:
            raise InputError(f"shape: {shape!r}, but a bed of springs touches planes and cuboids alone; a pad touches others")
        self._device = _arrays.device_of(device)
        solids = wp.array([shape.solid()], dtype=_frames.Solid, device=self._device)
        radii = (_frames.BED_RADIUS_MM, _frames.BED_RADIUS_MM)
        self._frames = _frames.Frames(model, self._count, self._device, solids, radii)

    def __len__(self) -> int:
        """Number of fingers."""
        return self._count

    @property
    def on_finger(self) -> Any:
        """Force, N, and moment about the origin, N mm, on each finger in its frame, as spatial vectors; the next step overwrites them."""
        return self._frames.on_finger

    @property
    def on_body(self) -> Any:
        """The same on each body in its own frame."""
        return self._frames.on_body

    @property
    def face(self) -> Any:
        """The face that each finger stands over; 0 for none."""
        return self._frames.face

    @property
    def depth_mm(self) -> Any:
        """Depth of each body as the model has it."""
        return self._frames.motion["depth_mm"]

    def step(self, position_mm: Any, quaternion_wxyz: Any, dt_s: float = 1e-3, *, strength_factor: Any = None) -> Any:
        """Advances every finger to a pose of its body; returns the `Response` along the axes of the face's plane.

        position_mm, quaternion_wxyz: rows of three and four numbers or one row for all, or Warp arrays of vec3 and vec4. A pose that is not
        finite, or whose quaternion is not of unit length, is flagged BAD_INPUT, and the body stays where it was. strength_factor: as of
        `Fingers.step`.
        """
        frames = self._frames
        if strength_factor is not None:
            frames.motion["strength_factor"] = _arrays.one_each("strength_factor", strength_factor, self._count, self._device)
        time_s = _arrays.one_number("dt_s", dt_s)
        poses = [
            value if isinstance(value, wp.array) else wp.array(_arrays.numbers(name, value, (self._count, size)), dtype=kind, device=self._device)
            for name, value, size, kind in (("position_mm", position_mm, 3, wp.vec3), ("quaternion_wxyz", quaternion_wxyz, 4, wp.vec4))
        ]
        wp.launch(
            _frames.sites_of_poses,
            dim=self._count,
            inputs=[*poses, frames.level],
            outputs=[frames.at, frames.axes, frames.is_known],
            device=self._device,
        )
        frames.step(time_s)
        frames.advance()
        return frames.response

    def reset(self, which: Any = True) -> None:
        """Lifts fingers off and makes them forget, strength factors included: all, or those where `which` (booleans) is true."""
        self._frames.reset(np.broadcast_to(np.asarray(which, bool), (self._count,)))
