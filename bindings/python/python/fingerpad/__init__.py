"""Fingertip friction: a reduced model over numpy arrays, and what the program `fingerpad` does.

Units everywhere: mm, N, s, MPa; names end in their unit.
"""

from fingerpad._errors import Error, InputError, Interrupted, ModelError, NumericsError
from fingerpad._fingers import DRIVEN, EVENT, FORCES, RESPONSE, Fingers, Pose, Regime, Status
from fingerpad._native import Model, status_words

__all__ = [
    "DRIVEN",
    "EVENT",
    "FORCES",
    "RESPONSE",
    "Error",
    "Fingers",
    "InputError",
    "Interrupted",
    "Model",
    "ModelError",
    "NumericsError",
    "Pose",
    "Regime",
    "Status",
    "status_words",
]
