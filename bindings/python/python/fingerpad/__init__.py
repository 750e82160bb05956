"""Fingertip friction: reduced models over numpy arrays, and the commands of the program `fingerpad` on pandas frames.

Units everywhere: mm, N, s, MPa; names end in their unit.
"""

from fingerpad._bodies import Cylinder, Edge, Plane, Sphere
from fingerpad._commands import (
    Diagnosis,
    Identification,
    Models,
    Simulation,
    diagnose,
    diagnose_forces,
    diagnose_table,
    finger,
    identify,
    simulate,
)
from fingerpad._errors import Error, InputError, Interrupted, ModelError, NotGoodEnough, NumericsError
from fingerpad._fingers import DRIVEN, EVENT, FORCES, LIMIT, PATCH, PRESSURE_MAP, RESPONSE, SLIP_MAP, Fingers, Regime, Status
from fingerpad._frames import FRAME_PATCH, FRAMES, FrameContacts, Shape, relative_pose
from fingerpad._limit_surface import LimitSurface, limit_surface
from fingerpad._native import Finger, Margin, MarginObserver, Model, Pad, Response, __version__, load, status_words
from fingerpad._program import Progress

__all__ = [
    "DRIVEN",
    "EVENT",
    "FORCES",
    "FRAMES",
    "FRAME_PATCH",
    "LIMIT",
    "PATCH",
    "PRESSURE_MAP",
    "RESPONSE",
    "SLIP_MAP",
    "Cylinder",
    "Diagnosis",
    "Edge",
    "Error",
    "Finger",
    "Fingers",
    "FrameContacts",
    "Identification",
    "InputError",
    "Interrupted",
    "LimitSurface",
    "Margin",
    "MarginObserver",
    "Model",
    "ModelError",
    "Models",
    "NotGoodEnough",
    "NumericsError",
    "Pad",
    "Plane",
    "Progress",
    "Regime",
    "Response",
    "Shape",
    "Simulation",
    "Sphere",
    "Status",
    "__version__",
    "diagnose",
    "diagnose_forces",
    "diagnose_table",
    "finger",
    "identify",
    "limit_surface",
    "load",
    "relative_pose",
    "simulate",
    "status_words",
]
