"""What pickles of models and fingers are made from."""

from __future__ import annotations

from fingerpad._fingers import Fingers
from fingerpad._native import Model


def model(data: bytes, tuning: tuple[float, float, float, float] | None) -> Model:
    """The model of a file's bytes, retuned if it was."""
    made = Model.from_bytes(data)
    if tuning is None:
        return made
    size, stiffness, lambda_factor, tau0_mpa = tuning
    return made.tuned(size=size, stiffness=stiffness, lambda_factor=lambda_factor, tau0_mpa=tau0_mpa)


def fingers(model: Model, count: int, spin: bool, saved: bytes) -> Fingers:
    """Fingers in a saved state."""
    made = Fingers(model, count, spin=spin)
    made.restore(saved)
    return made
