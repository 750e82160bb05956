"""Fingertip friction on NVIDIA Warp: beds of springs and pads, many contacts at a time, on CPU and GPU from one source."""

from __future__ import annotations

import os
from typing import Union

from fingerpad_warp._errors import Error, InputError, ModelError
from fingerpad_warp._file import Envelope, read_bytes
from fingerpad_warp._fingers import RESPONSE, Fingers, Response
from fingerpad_warp._frame_contacts import FrameContacts, Shape
from fingerpad_warp._model import Model
from fingerpad_warp._pad_model import Body, Cylinder, Edge, Pad, Plane, Sphere
from fingerpad_warp._status import Regime, Status

__version__ = "0.1.0"
__all__ = [
    "RESPONSE", "Body", "Cylinder", "Edge", "Error", "Fingers", "FrameContacts", "InputError", "Model", "ModelError", "Pad", "Plane",
    "Regime", "Response", "Shape", "Sphere", "Status", "load",
]  # fmt: skip


def load(source: bytes | str | os.PathLike[str]) -> Union[Model, Pad]:
    """The bed or the pad that a model file holds, from its bytes or its path.

    Raises `InputError` for a file that cannot be read, `ModelError` for one that is refused.
    """
    data = read_bytes(source)
    return Pad(data) if b"PADN" in Envelope(data) else Model(data)
