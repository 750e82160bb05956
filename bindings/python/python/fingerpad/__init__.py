"""Fingertip friction: reduced models over numpy arrays, and what the program `fingerpad` does.

Units everywhere: mm, N, s, MPa; names end in their unit.
"""

from fingerpad._bodies import Cylinder, Edge, Plane, Sphere
from fingerpad._commands import (
    Diagnosis,
    Identification,
    Reduction,
    Simulation,
    diagnose,
    diagnose_forces,
    diagnose_table,
    identify,
    reduce,
    simulate,
)
from fingerpad._errors import Error, InputError, Interrupted, ModelError, NumericsError
from fingerpad._fingers import DRIVEN, EVENT, FORCES, PATCH, RESPONSE, Fingers, Regime, Status
from fingerpad._native import Model, Pad, __version__, load, status_words
from fingerpad._program import Progress

__all__ = [
    "DRIVEN",
    "EVENT",
    "FORCES",
    "PATCH",
    "RESPONSE",
    "Cylinder",
    "Diagnosis",
    "Edge",
    "Error",
    "Fingers",
    "Identification",
    "InputError",
    "Interrupted",
    "Model",
    "ModelError",
    "NumericsError",
    "Pad",
    "Plane",
    "Progress",
    "Reduction",
    "Regime",
    "Simulation",
    "Sphere",
    "Status",
    "__version__",
    "diagnose",
    "diagnose_forces",
    "diagnose_table",
    "identify",
    "load",
    "reduce",
    "simulate",
    "status_words",
]
