"""Contacts from the poses of bodies: a pose in, forces and moments on finger and body out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, SupportsIndex, Union, final

import numpy as np
import numpy.typing as npt

from fingerpad._arrays import Numbers, broadcast, broadcast_shape, fit, rows
from fingerpad._bodies import RADIUS_MM, checked
from fingerpad._errors import InputError
from fingerpad._fingers import RESPONSE, Batch, _target, _times, _words
from fingerpad._native import Contacts, Model, Pad

#: Response of a contact in frames: that of the model, along the axes of the face's plane, then force and moment on the finger, in its frame
#: and about its origin, and on the body in its own; depth; pitch and roll of the finger against the face; and the face: 0 for none; 1 for a
#: plane, a sphere, an ellipsoid and an edge; of a cuboid 1 to 6 for +x, +y, +z, -x, -y, -z and 7 to 18 for its edges; of a capsule and a
#: cylinder 1 for the side, 2 and 3 for the ends at +z and -z.
FRAMES = np.dtype(
    [(name, RESPONSE.fields[name][0]) for name in RESPONSE.names or ()]  # type: ignore[index]
    + [
        ("force_on_finger_n", np.float32, 3),
        ("moment_on_finger_n_mm", np.float32, 3),
        ("force_on_body_n", np.float32, 3),
        ("moment_on_body_n_mm", np.float32, 3),
        ("depth_mm", np.float32),
        ("pitch_deg", np.float32),
        ("roll_deg", np.float32),
        ("face", np.uint32),
    ]
)

#: One patch of the skin as a taxel of a tactile sensor, in the finger's frame: place of its middle; force of the body on it, which over all
#: patches adds up to `force_on_finger_n`; moment about its middle; pressure, and friction along and across the finger (x and y of the face's
#: plane), over its own area; that area and the part in contact; the share of it that sticks (1 stick, 0 slip), and the share of its strength in use.
FRAME_PATCH = np.dtype(
    [
        ("place_mm", np.float32, 3),
        ("force_n", np.float32, 3),
        ("moment_n_mm", np.float32, 3),
        ("pressure_mpa", np.float32),
        ("shear_mpa", np.float32, 2),
        ("area_mm2", np.float32),
        ("contact_area_mm2", np.float32),
        ("stick_ratio", np.float32),
        ("used_share", np.float32),
    ]
)

#: Shapes that a bed of springs can touch.
FLAT = ("plane", "cuboid")

def _made(kind: str, **sizes: Any) -> Shape:
    """The shape of a kind once its sizes are checked: a number, or three of them."""
    found: list[float | tuple[float, ...]] = []
    for name, size in sizes.items():
        if name in ("semi_axes_mm", "half_mm"):
            if np.shape(size) != (3,):
                raise InputError(f"{name}: {size!r} where three numbers are needed")
            found.append(tuple(checked(name, value, *RADIUS_MM) for value in size))
        else:
            found.append(checked(name, size, *((1, 179) if name == "angle_deg" else RADIUS_MM)))
    return Shape(kind, tuple(found))


@dataclass(frozen=True, repr=False)
class Shape:
    """The shape of a rigid body in its own frame: the origin in the middle, the axis of a cylinder and a capsule along z.

    Made by the functions below. Sizes are from 0.1 to 1e6 mm.
    """

    kind: str
    sizes: tuple[Union[float, tuple[float, ...]], ...] = ()

    @staticmethod
    def plane() -> Shape:
        """The plane z = 0; the body is below it."""
        return _made("plane")

    @staticmethod
    def sphere(radius_mm: float) -> Shape:
        """A sphere about the origin."""
        return _made("sphere", radius_mm=radius_mm)

    @staticmethod
    def ellipsoid(semi_axes_mm: Sequence[float]) -> Shape:
        """An ellipsoid about the origin, with semi-axes along x, y and z. It is met as a sphere of about the curvature there."""
        return _made("ellipsoid", semi_axes_mm=semi_axes_mm)

    @staticmethod
    def capsule(radius_mm: float, half_length_mm: float) -> Shape:
        """A cylinder about z with two round ends; half_length_mm: from the origin to the centre of an end."""
        return _made("capsule", radius_mm=radius_mm, half_length_mm=half_length_mm)

    @staticmethod
    def cylinder(radius_mm: float, half_length_mm: float) -> Shape:
        """A cylinder about z with two flat ends; its rims have no model."""
        return _made("cylinder", radius_mm=radius_mm, half_length_mm=half_length_mm)

    @staticmethod
    def edge(radius_mm: float, angle_deg: float = 90.0) -> Shape:
        """Two planes that meet in a rounded edge along x. The origin lies on the rounding; z points out of the body between the planes.

        angle_deg: between the planes inside the body, 1 to 179.
        """
        return _made("edge", radius_mm=radius_mm, angle_deg=angle_deg)

    @staticmethod
    def cuboid(half_mm: Sequence[float], edge_radius_mm: float) -> Shape:
        """A box about the origin, half its extents along x, y and z, with rounded edges; its corners have no model, and of a bed its edges."""
        return _made("cuboid", half_mm=half_mm, edge_radius_mm=edge_radius_mm)

    def __repr__(self) -> str:
        return f"Shape.{self.kind}({', '.join(map(repr, self.sizes))})"


@final
class FrameContacts(Batch):
    """Fingers of one model, each against a rigid body of its own, from the pose of the body in the frame of the finger.

    The finger's frame is fixed to the bone: x along the finger from proximal to distal, z out of the pad's surface into the finger, towards
    the nail, y to complete a right-handed frame. The origin is the point at which a plane first touches in the neutral pose (pitch 30 deg).
    The body's frame is that of its `Shape`. A step finds the face that the finger meets and how the finger moves on it. Steps are the same
    bits as those of the core. A contact of a bed follows spin.

    `copy` keeps a state and `restore` takes it up again; there are no bytes of it.
    """

    def __init__(self, model: Model | Pad, shape: Shape, count: SupportsIndex = 1) -> None:
        """Fingers in the air.

        model: a bed or a pad, kept by its numbers. shape: of each body; a bed touches planes and cuboids alone. count: how many.
        """
        self._take(model, count)
        if not isinstance(shape, Shape):
            raise InputError(f"shape: {shape!r} where a Shape is needed")
        if isinstance(model, Model) and shape.kind not in FLAT:
            raise InputError(
                f"shape: {shape!r}, but a bed of springs touches planes and cuboids alone; a pad touches others: fingerpad.Pad.shipped()"
            )
        self._shape = shape
        sizes = [x for size in shape.sizes for x in (size if isinstance(size, tuple) else (size,))]
        self._contacts = Contacts.in_frames(model, shape.kind, sizes, self._count)

    @property
    def shape(self) -> Shape:
        """The shape of each body."""
        return self._shape

    def __repr__(self) -> str:
        return f"<fingerpad.FrameContacts: {self._count} of {self._model!r} on {self._shape!r}>"

    def step(
        self,
        position_mm: npt.ArrayLike,
        quaternion_wxyz: npt.ArrayLike,
        dt_s: float = 1e-3,
        *,
        strength_factor: Numbers | None = None,
        out: npt.NDArray[np.void] | None = None,
    ) -> npt.NDArray[np.void]:
        """Advances every finger by one step; returns an array of `FRAMES`, one a finger.

        position_mm, quaternion_wxyz: pose of the body in the finger's frame at the end of the step, rows of three and four numbers, or one row
        for all. strength_factor, out: as of `Fingers.step`. Raises InputError for arrays that do not fit; no finger moves then. A pose that is
        not finite, or whose quaternion is not of unit length, is flagged BAD_INPUT, and the body stays where it was.

        A contact begins at most 1 mm deep, and no deeper than the finger came closer in this step; what is left out then counts as a lower
        surface and is flagged BEGAN_INSIDE, until slip has raised it. The first step of all takes the pose as it is, up to the depth of the
        model.
        """
        poses = np.empty((self._count, 7))
        poses[:, :3] = fit("position_mm", rows("position_mm", position_mm, 3), (self._count, 3))
        poses[:, 3:] = fit("quaternion_wxyz", rows("quaternion_wxyz", quaternion_wxyz, 4), (self._count, 4))
        strength = None if strength_factor is None else broadcast("strength_factor", strength_factor, (1, self._count))
        result = _target(out, FRAMES, (self._count,))
        self._contacts.step_frames(poses, strength, _times(dt_s, 1), _words(result, 1))
        return result

    def patches(self) -> npt.NDArray[np.void]:
        """The skin of each finger after the last step as a tactile sensor: an array of `FRAME_PATCH` of shape (fingers, patches).

        Without contact all is 0 but place and area. The forces, and place x force plus moment, add up to force and moment on the finger. On a
        curved face those of patches that slip are off by up to 2 % in that step, and by rounding after a few steps at rest. Costs about as
        much as a round of a step. Raises InputError for a bed of springs, which has no patches.
        """
        if not isinstance(self._model, Pad):
            raise InputError("patches: a bed of springs has none; a pad has them: fingerpad.Pad.shipped()")
        result = np.zeros((self._count, self._model.patches), FRAME_PATCH)
        self._contacts.patches(result.view(np.float32).reshape(-1))
        return result

    def copy(self) -> FrameContacts:
        """The same fingers again, in the same state."""
        made = FrameContacts.__new__(FrameContacts)
        made._model, made._count, made._shape = self._model, self._count, self._shape
        made._contacts = self._contacts.copy()
        return made

    def restore(self, saved: FrameContacts) -> None:
        """Takes up the state of a copy, which stays as it is. Raises InputError for fingers of another model, shape or count."""
        if not isinstance(saved, FrameContacts):
            raise InputError(f"saved: {type(saved).__name__} where FrameContacts are needed")
        if (saved._model, saved._shape, saved._count) != (self._model, self._shape, self._count):
            raise InputError(f"saved: {saved!r}, but here it is {self!r}")
        self._contacts.take_up(saved._contacts)


def relative_pose(
    finger_position_mm: npt.ArrayLike,
    finger_quaternion_wxyz: npt.ArrayLike,
    body_position_mm: npt.ArrayLike,
    body_quaternion_wxyz: npt.ArrayLike,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Position and quaternion of bodies in the frames of fingers, from the poses of both in the world; rows broadcast.

    Quaternions are (w, x, y, z), and of unit length: a step flags others.
    """
    given = {
        "finger_position_mm": finger_position_mm,
        "finger_quaternion_wxyz": finger_quaternion_wxyz,
        "body_position_mm": body_position_mm,
        "body_quaternion_wxyz": body_quaternion_wxyz,
    }
    arrays = {name: rows(name, value, 4 if "quaternion" in name else 3) for name, value in given.items()}
    broadcast_shape({name: array[..., 0] for name, array in arrays.items()})
    at, turn, place, other = arrays.values()
    back = turn * (1, -1, -1, -1)
    with np.errstate(invalid="ignore", over="ignore"):
        away = place - at
        cross = 2 * np.cross(back[..., 1:], away)
        position = away + back[..., :1] * cross + np.cross(back[..., 1:], cross)
        real = back[..., :1] * other[..., :1] - (back[..., 1:] * other[..., 1:]).sum(-1, keepdims=True)
        imaginary = back[..., :1] * other[..., 1:] + other[..., :1] * back[..., 1:] + np.cross(back[..., 1:], other[..., 1:])
    return position, np.concatenate((real, imaginary), axis=-1)
