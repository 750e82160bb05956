"""Fingertip friction: a reduced model over numpy arrays, and what the program `fingerpad` does.

Units everywhere: mm, N, s, MPa; names end in their unit.
"""

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
from fingerpad._fingers import DRIVEN, EVENT, FORCES, RESPONSE, Fingers, Pose, Regime, Status
from fingerpad._native import Model, status_words
from fingerpad._program import Progress

__all__ = [
    "DRIVEN",
    "EVENT",
    "FORCES",
    "RESPONSE",
    "Diagnosis",
    "Error",
    "Fingers",
    "Identification",
    "InputError",
    "Interrupted",
    "Model",
    "ModelError",
    "NumericsError",
    "Pose",
    "Progress",
    "Reduction",
    "Regime",
    "Simulation",
    "Status",
    "diagnose",
    "diagnose_forces",
    "diagnose_table",
    "identify",
    "reduce",
    "simulate",
    "status_words",
]
