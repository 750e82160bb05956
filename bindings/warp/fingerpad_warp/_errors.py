"""The exceptions of the package."""

from __future__ import annotations


class Error(Exception):
    """Whatever this package refuses."""


class InputError(Error, ValueError):
    """An argument that is refused: its type, its shape, its range. The text names argument, value and range."""


class ModelError(InputError):
    """A model file that is refused, with the reason."""
