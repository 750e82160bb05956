"""Functions that make models, pads and fingers from their pickles."""

from __future__ import annotations

from typing import Any

from fingerpad._fingers import Fingers
from fingerpad._native import Finger, Model, Pad


def model(data: bytes, tuning: tuple[float, float, float]) -> Model:
    """The model of a file's bytes for another finger: factors on size, stiffness and lambda."""
    size, stiffness, lambda_factor = tuning
    return Model.from_bytes(data).tuned(size=size, stiffness=stiffness, lambda_factor=lambda_factor)


def pad(data: bytes, tuning: tuple[float, float, float]) -> Pad:
    """The pad of a file's bytes for another finger: factors on size, stiffness and lambda."""
    size, stiffness, lambda_factor = tuning
    return Pad.from_bytes(data).tuned(size=size, stiffness=stiffness, lambda_factor=lambda_factor)


def fingers(model: Model | Pad, count: int, options: dict[str, Any], saved: bytes) -> Fingers:
    """Fingers in a saved state."""
    made = Fingers(model, count, **options)
    made.restore(saved)
    return made


def finger(fingers: Fingers, saved: bytes) -> Finger:
    """The single finger of `Fingers` of one, in a saved state."""
    made = Finger._of(fingers)
    made.restore(saved)
    return made
