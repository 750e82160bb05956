"""The exceptions of the package."""

from __future__ import annotations


class Error(Exception):
    """Base of the exceptions of this package."""


class InputError(Error, ValueError):
    """Input that is refused: an argument, an array's shape or type, a file. The program ends with exit code 2 for it."""


class ModelError(InputError):
    """A model file, a saved state or a tuning that is refused."""


class NumericsError(Error, ArithmeticError):
    """The numerics failed: no equilibrium, no fit. The program ends with exit code 3 for it."""


class NotGoodEnough(NumericsError):
    """A model was made and is not good enough. The program ends with exit code 4 for it."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, or a progress callback that raised it, during a computation. The text names the results that are kept and their place."""
