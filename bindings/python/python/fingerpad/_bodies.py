"""Rigid bodies that the fingers of a pad touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Union

from fingerpad._errors import InputError

#: Least and largest radius, mm.
RADIUS_MM = (0.1, 1e6)


def checked(name: str, value: object, least: float, most: float, may_be_negative: bool = False) -> float:
    """A number as a float, once it is known to lie within a range."""
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise InputError(f"{name}: {value!r} where a number is needed") from None
    if not least <= (abs(number) if may_be_negative else number) <= most:
        hollow = ", or the negative of that for a hollow" if may_be_negative else ""
        raise InputError(f"{name}: {value} is not between {least:.7g} and {most:.7g}{hollow}")
    return number


def _set(body: object, name: str, least: float, most: float, may_be_negative: bool = False) -> None:
    """Makes a number of a body a float, so that bodies of equal numbers are spelled alike: a saved state compares their spelling."""
    object.__setattr__(body, name, checked(name, getattr(body, name), least, most, may_be_negative))


@dataclass(frozen=True)
class Plane:
    """A plane."""


@dataclass(frozen=True)
class Sphere:
    """A sphere that touches the finger at its apex; with a negative radius the finger lies in a bowl.

    A step takes a sharper body than the patches of the pad can see (3.9 mm with the shipped pad) as one of the least radius, and flags it:
    `Status.BODY_TOO_SHARP`.
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

    radius_mm: of the rounding. axis_deg: direction of the edge, from x towards y, -180 to 180. angle_deg: between the planes inside
    the body, 1 to 179.
    """

    radius_mm: float
    axis_deg: float = 0.0
    angle_deg: float = 90.0

    def __post_init__(self) -> None:
        _set(self, "radius_mm", *RADIUS_MM)
        _set(self, "axis_deg", -180, 180)
        _set(self, "angle_deg", 1, 179)


#: A body that a finger may touch.
Body = Union[Plane, Sphere, Cylinder, Edge]


def numbers(body: Body) -> tuple[float, float, float]:
    """Radius (mm), axis and angle (degrees) of a body, 0 where it has none."""
    return getattr(body, "radius_mm", 0.0), getattr(body, "axis_deg", 0.0), getattr(body, "angle_deg", 0.0)


def check(body: object) -> None:
    """Refuses what is no body."""
    if not isinstance(body, (Plane, Sphere, Cylinder, Edge)):
        raise InputError(f"body: {body!r} where a Plane, Sphere, Cylinder or Edge is needed")
